//! The motion of one mode whose stiffness and damping go with its amplitude, by Runge-Kutta steps.

use super::{Course, Law};
use crate::forced_record::ForcedRecord;
use crate::modal_response::{InputKind, OutputQuantity, Pole};

/// The least relative stiffness and damping: below, the mode would run away.
pub(super) const LEAST: f64 = 0.05;
/// Steps per period of the mode.
const PER_PERIOD: f64 = 24.0;

/// What drives the mode, step by step.
pub(super) struct Drive {
    /// Length of a step, s, and the force at its beginning, middle and end.
    steps: Vec<(f64, [f64; 3])>,
    /// How many steps are done at each stamp.
    done: Vec<usize>,
    quantity: OutputQuantity,
}

/// Coordinate, speed and acceleration.
pub(super) type State = [f64; 3];

impl Drive {
    /// The drive of a record, fine enough for modes up to a frequency.
    pub(super) fn new(record: &ForcedRecord, delay_s: f64, frequency_hz: f64) -> Self {
        let times_s = record.input_times(delay_s);
        let (mut at_s, mut lengths, mut done) = (Vec::new(), Vec::new(), vec![0]);
        for pair in times_s.windows(2) {
            let count = ((pair[1] - pair[0]) * PER_PERIOD * frequency_hz).ceil().clamp(1.0, 1e4) as usize;
            let h = (pair[1] - pair[0]) / count as f64;
            for k in 0..count {
                let begin = pair[0] + k as f64 * h;
                at_s.extend([begin, begin + 0.5 * h]);
                lengths.push(h);
            }
            done.push(lengths.len());
        }
        at_s.extend(times_s.last());
        let force: Vec<f64> = record
            .input
            .sample(at_s)
            .into_iter()
            .map(|[value, _, second]| match record.input_kind {
                InputKind::Force => value,
                InputKind::BasePosition => -second,
                InputKind::BaseAcceleration => -value,
            })
            .collect();
        let steps = lengths
            .into_iter()
            .enumerate()
            .map(|(k, h)| (h, [force[2 * k], force[2 * k + 1], force[2 * k + 2]]))
            .collect();
        Self { steps, done, quantity: record.quantity }
    }

    /// The motion from rest at the stamps.
    pub(super) fn motion(&self, course: Course, reference: f64) -> Vec<State> {
        let Course { law, pole, stiffness, damping } = course;
        let w = pole.omega();
        let (square, friction) = (w * w, 2.0 * pole.damping_ratio * w);
        let acceleration = |q: f64, v: f64, force: f64| {
            let [spring, drag] = law_at(law, q / reference, v / (w * reference));
            let stiffer = (1.0 + stiffness * spring).max(LEAST);
            let damped = (1.0 + damping * drag).max(LEAST);
            force - friction * damped * v - square * stiffer * q
        };
        let (mut q, mut v) = (0.0_f64, 0.0_f64);
        let mut states = Vec::with_capacity(self.done.len());
        let mut from = 0;
        for &done in &self.done {
            for &(h, [begin, middle, end]) in &self.steps[from..done] {
                let a = acceleration(q, v, begin);
                let (v2, a2) = (v + 0.5 * h * a, acceleration(q + 0.5 * h * v, v + 0.5 * h * a, middle));
                let (v3, a3) = (v + 0.5 * h * a2, acceleration(q + 0.5 * h * v2, v + 0.5 * h * a2, middle));
                let (v4, a4) = (v + h * a3, acceleration(q + h * v3, v + h * a3, end));
                q += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
                v += h / 6.0 * (a + 2.0 * a2 + 2.0 * a3 + a4);
            }
            from = done;
            let force = match self.steps.get(done) {
                Some((_, force)) => force[0],
                None => self.steps.last().map_or(0.0, |(_, force)| force[2]),
            };
            states.push([q, v, acceleration(q, v, force)]);
        }
        states
    }

    /// The linear mode's motion from rest.
    pub(super) fn linear(&self, pole: Pole) -> Vec<State> {
        self.motion(Course { law: Law::Proportional, pole, stiffness: 0.0, damping: 0.0 }, 1.0)
    }

    /// What the output takes of a state.
    pub(super) fn output(&self, [q, v, a]: State) -> f64 {
        match self.quantity {
            OutputQuantity::Position => q,
            OutputQuantity::Velocity => v,
            OutputQuantity::Acceleration => a,
        }
    }
}

/// What the stiffness and the damping feel of a law at a moment, coordinate and speed as shares of the
/// largest amplitude.
fn law_at(law: Law, q: f64, v: f64) -> [f64; 2] {
    match law {
        Law::CubicAndDrag => [q * q, v.abs()],
        other => other.felt((q * q + v * v).sqrt()),
    }
}
