//! One state space with force laws at its ports, advanced sub-step by sub-step.

use std::rc::Rc;

use super::steps::{Gains, Port, PortStep, Steps};
use crate::catalogue::{ForceLaw, Step};
use crate::error::PlantError;
use crate::linear::dot;
use crate::rerun::Motion;
use crate::state_space::{InjectionPoint, Row, StateSpace};

/// Sweeps over the laws of one sub-step at most; two laws settle in a handful.
const MOST_SWEEPS: usize = 60;

/// A law at work.
pub(crate) struct Element {
    pub(super) law: Box<dyn ForceLaw>,
    pub(super) effort: Effort,
    /// Index of the point, for feedthrough, and its direction.
    pub(crate) point: usize,
    pub(super) sign: f64,
}

/// Force that the drive exerts, for the laws that depend on it.
pub(crate) enum Effort {
    /// No law asks.
    None,
    /// The input times this.
    Input(f64),
    /// A servo that moves this mass.
    Servo(f64),
}

pub(super) struct Engine {
    pub(super) space: StateSpace,
    pub(super) state: Vec<f64>,
    pub(super) elements: Vec<Element>,
    steps: Steps,
    /// Mean forces of the sub-step before.
    pub(super) forces: Vec<f64>,
    /// Whether there was one.
    pub(super) has_moved: bool,
    next: Vec<f64>,
}

impl Element {
    /// A law of no parameters at a point.
    pub(crate) fn forced(law: Box<dyn ForceLaw>, point: usize, sign: f64) -> Self {
        Self { law, effort: Effort::None, point, sign }
    }

    /// The force on its point along a motion that it does not change, sample by sample.
    pub(crate) fn along(mut self, motion: &Motion, displacement: &[f64], velocity: &[f64]) -> Vec<f64> {
        let last = motion.time_s.len().saturating_sub(1);
        (0..motion.time_s.len())
            .map(|k| {
                let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
                let between_s = motion.time_s[after] - motion.time_s[before];
                let effort = match self.effort {
                    Effort::None => 0.0,
                    Effort::Input(gain) => gain * motion.input[k],
                    Effort::Servo(mass) => mass * (velocity[after] - velocity[before]) / between_s,
                };
                // From half-way to the neighbour before to half-way to the one after: the mean force belongs
                // to the sample.
                let half = |samples: &[f64], neighbour: usize| 0.5 * (samples[k] + samples[neighbour]);
                let seen = Step {
                    time_s: half(&motion.time_s, before),
                    step_s: 0.5 * between_s,
                    z: self.sign * half(displacement, before),
                    v: self.sign * half(velocity, before),
                    z_free: self.sign * half(displacement, after),
                    v_free: self.sign * half(velocity, after),
                    // A gain of nearly nothing: the motion stays as it is, and dry friction slides.
                    z_gain: 0.0,
                    v_gain: 1e-300,
                    effort,
                    effort_gain: 0.0,
                    near: 0.0,
                };
                let force = self.law.force(&seen);
                self.law.made(&seen, force);
                self.sign * force
            })
            .collect()
    }
}

impl Engine {
    pub(super) fn new(space: StateSpace, state: Vec<f64>, elements: Vec<Element>) -> Self {
        let ports = elements.iter().map(|element| port(&space.points()[element.point], element.sign));
        let steps = Steps::new(&space, ports.collect());
        let next = Vec::with_capacity(state.len());
        let forces = vec![0.0; elements.len()];
        Self { forces, has_moved: false, space, state, elements, steps, next }
    }

    /// Advances by `step_s` seconds from `time_s`, the input going in a straight line from `from` to `to`.
    pub(super) fn advance(&mut self, time_s: f64, step_s: f64, from: f64, to: f64) -> Result<(), PlantError> {
        let step = self.steps.of(step_s)?;
        let slope = (to - from) / step_s;
        step.advance(&self.state, from, slope, &mut self.next);
        match self.elements.len() {
            0 => {}
            1 => {
                let seen = self.see(0, &step, time_s, step_s, from, to);
                let element = &mut self.elements[0];
                let force = element.law.force(&seen);
                element.law.made(&seen, force);
                self.forces[0] = force;
            }
            _ => self.settle(&step, time_s, step_s, from, to),
        }
        for (column, force) in step.force.iter().zip(&self.forces) {
            for (entry, share) in self.next.iter_mut().zip(column) {
                *entry += share * force;
            }
        }
        std::mem::swap(&mut self.state, &mut self.next);
        self.has_moved = true;
        Ok(())
    }

    /// Forces of several laws.
    fn settle(&mut self, step: &PortStep, time_s: f64, step_s: f64, from: f64, to: f64) {
        let alone: Vec<Step> =
            (0..self.elements.len()).map(|index| self.see(index, step, time_s, step_s, from, to)).collect();
        settled(&mut self.elements, &mut self.forces, &alone, &step.gains);
    }

    /// The step of `step_s` seconds.
    pub(super) fn step(&mut self, step_s: f64) -> Result<Rc<PortStep>, PlantError> {
        self.steps.of(step_s)
    }

    /// Steps with the same key are the same.
    pub(super) fn key_of(step_s: f64) -> i64 {
        Steps::key_of(step_s)
    }

    pub(super) fn ports(&self) -> &[Port] {
        self.steps.ports()
    }

    fn see(&self, index: usize, step: &PortStep, time_s: f64, step_s: f64, from: f64, to: f64) -> Step {
        let port = &self.steps.ports()[index];
        let slope = (to - from) / step_s;
        let read = |row: &(Vec<f64>, f64, f64), state: &[f64], u: f64| {
            dot(&row.0, state) + row.1 * u + row.2 * slope
        };
        let (effort, effort_gain) = match &self.elements[index].effort {
            Effort::None => (0.0, 0.0),
            Effort::Input(gain) => (gain * 0.5 * (from + to), 0.0),
            // All that accelerates the base is the servo and the force here, so the change of its velocity
            // tells.
            Effort::Servo(mass) => {
                let per_velocity = mass / step_s;
                let change = read(&port.v, &self.next, to) - read(&port.v, &self.state, from);
                (per_velocity * change, per_velocity * step.gains.v[index][index] - 1.0)
            }
        };
        Step {
            time_s,
            step_s,
            z: read(&port.z, &self.state, from),
            v: read(&port.v, &self.state, from),
            z_free: read(&port.z, &self.next, to),
            v_free: read(&port.v, &self.next, to),
            z_gain: step.gains.z[index][index],
            v_gain: step.gains.v[index][index],
            effort,
            effort_gain,
            near: self.forces[index],
        }
    }

    /// Appends the outputs at the state now, for an input and its slope. What feels forces at once (an
    /// acceleration) reads the mean forces of the sub-step before, until [`Engine::felt`] knows those of the
    /// one after.
    pub(super) fn read(&self, u: f64, slope: f64, into: &mut [Vec<f64>]) {
        for (output, samples) in self.space.outputs().iter().zip(into) {
            let through = self.elements.iter().zip(&self.forces);
            let through: f64 = through
                .map(|(element, force)| output.feedthrough[element.point] * element.sign * force)
                .sum();
            samples.push(output.row.read(&self.state, u, slope) + through);
        }
    }

    /// What an advance after a look tells of the forces then, to second order: half the mean forces of the
    /// sub-step that ended there and half those of the one that began, or all of these where none had been.
    pub(super) fn felt(&self, before: &Before, into: &mut [Vec<f64>]) {
        for (output, samples) in self.space.outputs().iter().zip(into) {
            let through =
                self.elements.iter().map(|element| output.feedthrough[element.point] * element.sign);
            if let Some(last) = samples.last_mut() {
                *last += before.change(through, &self.forces);
            }
        }
    }
}

/// Mean forces of the sub-step that ended at a look.
pub(super) struct Before {
    forces: Vec<f64>,
    /// How much of the change to the next sub-step is felt at the look.
    share: f64,
}

impl Before {
    pub(super) fn of(engine: &Engine) -> Self {
        Self { forces: engine.forces.clone(), share: if engine.has_moved { 0.5 } else { 1.0 } }
    }

    /// What an output with these shares of every force shows more.
    pub(super) fn change(&self, through: impl Iterator<Item = f64>, after: &[f64]) -> f64 {
        let changes = self.forces.iter().zip(after).map(|(before, after)| after - before);
        self.share * through.zip(changes).map(|(share, change)| share * change).sum::<f64>()
    }
}

/// Finds the forces of several laws, each in turn, given the others, until none moves; `alone` is what each
/// sees without any. The forces of the sub-step before are where it begins.
pub(super) fn settled(elements: &mut [Element], forces: &mut [f64], alone: &[Step], gains: &Gains) {
    let given = |index: usize, forces: &[f64]| {
        let mut seen = Step { near: forces[index], ..alone[index] };
        for (other, force) in forces.iter().enumerate() {
            if other != index {
                seen.z_free += gains.z[index][other] * force;
                seen.v_free += gains.v[index][other] * force;
            }
        }
        seen
    };
    for _ in 0..MOST_SWEEPS {
        let mut moved = 0.0_f64;
        let mut size = 0.0_f64;
        for (index, element) in elements.iter().enumerate() {
            let force = element.law.force(&given(index, forces));
            moved = moved.max((force - forces[index]).abs());
            size = size.max(force.abs());
            forces[index] = force;
        }
        if moved <= 1e-13 * size {
            break;
        }
    }
    for (index, element) in elements.iter_mut().enumerate() {
        element.law.made(&given(index, forces), forces[index]);
    }
}

fn port(point: &InjectionPoint, sign: f64) -> Port {
    let row = |row: &Row| {
        (row.state.iter().map(|entry| sign * entry).collect(), sign * row.value, sign * row.slope)
    };
    Port {
        z: row(&point.displacement),
        v: row(&point.velocity),
        force: point.force.iter().map(|entry| sign * entry).collect(),
    }
}
