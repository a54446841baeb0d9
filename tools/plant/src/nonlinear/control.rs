//! A known feedback law, run in closed loop with the plant.

use std::collections::VecDeque;

use crate::error::PlantError;
use crate::linear::dot;
use crate::model::Controller;
use crate::state_space::StateSpace;

/// The controller as it runs: its output is renewed every `sample_s` and held in between.
pub(super) struct Loop<'a> {
    controller: &'a Controller,
    /// Times and samples of the reference.
    time_s: &'a [f64],
    reference: &'a [f64],
    /// First output and its derivative as functions of the state.
    position: Vec<f64>,
    velocity: Vec<f64>,
    /// Index into the reference, and of the next renewal.
    place: usize,
    renewals: u64,
    /// Positions at the last renewals, the oldest first: as many as the velocity is taken over.
    before: VecDeque<f64>,
    output: f64,
}

impl<'a> Loop<'a> {
    pub(super) fn new(
        controller: &'a Controller,
        space: &StateSpace,
        time_s: &'a [f64],
        reference: &'a [f64],
    ) -> Result<Self, PlantError> {
        let position = space.outputs().first().map(|output| output.row.state.clone()).unwrap_or_default();
        let by_columns = space.a().column_iter();
        let velocity: Vec<f64> = by_columns.map(|column| dot(&position, column.as_slice())).collect();
        // A velocity would feel the force at once, and the loop would be algebraic.
        let feels = dot(&position, space.input_value()).abs() + dot(&position, space.input_slope()).abs();
        if feels > 0.0 {
            let what = "the controller's feedback, the model's first output, is not a position of a plant driven by a force";
            return Err(PlantError::Measure {
                what,
                remedy: "list a position first, and use a force as input",
            });
        }
        Ok(Self {
            controller,
            time_s,
            reference,
            position,
            velocity,
            place: 0,
            renewals: 0,
            before: VecDeque::new(),
            output: 0.0,
        })
    }

    /// When the output is renewed next.
    pub(super) fn next_s(&self) -> f64 {
        self.time_s[0] + self.renewals as f64 * self.controller.sample_s
    }

    /// Renews the output from the state now.
    pub(super) fn renew(&mut self, state: &[f64]) {
        let now_s = self.next_s();
        while self.place + 2 < self.time_s.len() && self.time_s[self.place + 1] <= now_s {
            self.place += 1;
        }
        let next = (self.place + 1).min(self.time_s.len() - 1);
        let (from_s, to_s) = (self.time_s[self.place], self.time_s[next]);
        let along = if to_s > from_s { ((now_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0) } else { 0.0 };
        let reference =
            self.reference[self.place] + along * (self.reference[next] - self.reference[self.place]);
        let Controller { kp, kv, limit, .. } = *self.controller;
        let position = dot(&self.position, state);
        let output = kv * (kp * (reference - position) - self.measured_velocity(position, state));
        self.output = limit.map_or(output, |limit| output.clamp(-limit, limit));
        self.renewals += 1;
    }

    /// The velocity as the controller has it, `position` being read now. Before the recording it is taken to
    /// have moved on steadily.
    fn measured_velocity(&mut self, position: f64, state: &[f64]) -> f64 {
        let velocity = dot(&self.velocity, state);
        let Some(samples) = self.controller.velocity_samples else { return velocity };
        let step_s = self.controller.sample_s;
        let samples = samples.get();
        if self.before.is_empty() {
            self.before.extend((1..=samples).rev().map(|ago| position - f64::from(ago) * step_s * velocity));
        }
        let oldest = self.before.pop_front().unwrap_or(position);
        self.before.push_back(position);
        (position - oldest) / (f64::from(samples) * step_s)
    }

    pub(super) fn output(&self) -> f64 {
        self.output
    }
}
