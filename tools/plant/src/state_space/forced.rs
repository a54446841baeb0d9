//! The linear plant under forces given as series: what a latent force, once estimated, would do.

use std::collections::HashMap;
use std::rc::Rc;

use super::{Discrete, StateSpace};
use crate::error::PlantError;
use crate::simulate::Hold;
use crate::stamps::Stamps;

/// A force at an injection point, one sample per time stamp, joined by straight lines.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceSeries {
    /// Index into [`StateSpace::points`].
    pub point: usize,
    /// Samples in the point's force unit.
    pub samples: Vec<f64>,
}

/// What a plant did: one sample per time stamp.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trace {
    /// Per output, in the model's order.
    pub outputs: Vec<Vec<f64>>,
    /// Per injection point: its displacement.
    pub displacements: Vec<Vec<f64>>,
    /// Per injection point: its velocity; where it jumps (a base that moves in straight lines), that after
    /// the stamp.
    pub velocities: Vec<Vec<f64>>,
    /// States, one vector per stamp.
    pub states: Vec<Vec<f64>>,
}

impl StateSpace {
    /// Runs the linear plant from `initial` (as [`StateSpace::rest_at`] or [`StateSpace::state_from`] gives
    /// it) under an input and extra forces, all sampled at `time_s` (seconds, strictly increasing).
    ///
    /// Exact for straight lines between samples ([`Hold`] says whether the input is one).
    ///
    /// # Errors
    /// [`PlantError::Length`] when input, a force or the initial state has the wrong length;
    /// [`PlantError::TooFast`].
    pub fn run(
        &self,
        time_s: &[f64],
        input: &[f64],
        hold: Hold,
        forces: &[ForceSeries],
        initial: &[f64],
    ) -> Result<Trace, PlantError> {
        let length = |what, expected: usize, found: usize| {
            if expected == found { Ok(()) } else { Err(PlantError::Length { what, expected, found }) }
        };
        length("input", time_s.len(), input.len())?;
        length("initial state", self.order(), initial.len())?;
        for force in forces {
            length("force", time_s.len(), force.samples.len())?;
            length("injection point", 1, usize::from(force.point < self.points().len()))?;
        }
        let stamps = Stamps::new(time_s);
        let mut trace = Trace {
            outputs: vec![Vec::with_capacity(time_s.len()); self.outputs().len()],
            displacements: vec![Vec::with_capacity(time_s.len()); self.points().len()],
            velocities: vec![Vec::with_capacity(time_s.len()); self.points().len()],
            states: Vec::with_capacity(time_s.len()),
        };
        let mut state = initial.to_vec();
        let mut next = Vec::with_capacity(state.len());
        let mut steps = Discretes::default();
        let mut step = steps.of(self, stamps.interval_s(0).unwrap_or(0.0))?;
        let mut slope = 0.0;
        for (index, &u) in input.iter().enumerate() {
            let interval_s = stamps.interval_s(index);
            let ahead = |samples: &[f64], interval_s: f64| (samples[index + 1] - samples[index]) / interval_s;
            // The last sample starts no stretch; it keeps the slope that led there.
            if let Some(interval_s) = interval_s {
                slope = if hold == Hold::ZeroOrder { 0.0 } else { ahead(input, interval_s) };
            }
            self.look(&mut trace, &state, u, slope, |point| {
                forces.iter().filter(|force| force.point == point).map(|force| force.samples[index]).sum()
            });
            let Some(interval_s) = interval_s else { break };
            if step.step_s != interval_s {
                step = steps.of(self, interval_s)?;
            }
            step.advance(&state, u, slope, &mut next);
            for force in forces {
                let value = force.samples[index];
                step.add_force(force.point, value, ahead(&force.samples, interval_s), &mut next);
            }
            std::mem::swap(&mut state, &mut next);
        }
        Ok(trace)
    }

    fn look(&self, trace: &mut Trace, state: &[f64], u: f64, slope: f64, force: impl Fn(usize) -> f64) {
        for (output, samples) in self.outputs().iter().zip(&mut trace.outputs) {
            let through = output.feedthrough.iter().enumerate();
            let through: f64 =
                through.filter(|(_, gain)| **gain != 0.0).map(|(point, gain)| gain * force(point)).sum();
            samples.push(output.row.read(state, u, slope) + through);
        }
        for (index, point) in self.points().iter().enumerate() {
            trace.displacements[index].push(point.displacement.read(state, u, slope));
            trace.velocities[index].push(point.velocity.read(state, u, slope));
        }
        trace.states.push(state.to_vec());
    }
}

/// Steps by their length to the picosecond: stamps that were rounded when they were written differ by that,
/// plants do not.
#[derive(Default)]
struct Discretes {
    known: HashMap<i64, Rc<Discrete>>,
}

/// Steps kept for reuse; beyond that the stamps are irregular and reuse is rare.
const MOST_STEPS: usize = 4096;

impl Discretes {
    fn of(&mut self, space: &StateSpace, step_s: f64) -> Result<Rc<Discrete>, PlantError> {
        let key = (step_s * 1e12).round() as i64;
        if let Some(step) = self.known.get(&key) {
            return Ok(Rc::clone(step));
        }
        if self.known.len() >= MOST_STEPS {
            self.known.clear();
        }
        let step = Rc::new(space.discretise(step_s)?);
        self.known.insert(key, Rc::clone(&step));
        Ok(step)
    }
}
