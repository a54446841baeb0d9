//! What the best that can be known of the training recordings leaves of the held-out ones.
//!
//! Noise moves what recordings say of a law, and where a motion depends on it as steeply as a rebound from a
//! stop depends on when the stop is met, the right law with the likeliest values leaves many times the noise
//! of what was held out. So the floor is what least squares leave that begin at the truth: the lab's model
//! with as many modes as it has and the laws that were left out of it, fitted to the training recordings. The
//! tool has to find all that this fit is told.
//!
//! The fit has the input that was recorded, as the tool has, not what was between the samples. That changes
//! nothing where motions that begin alike stay alike. Where a body rattles in a play they do not: what lies
//! between two samples decides which flank is met next, and then nobody who has the recordings can say where
//! the body is, the right law with all values right included.

use nalgebra::{DMatrix, DVector};

use super::maker::{Bench, MadeRun, RATE_HZ};
use super::{Channel, Role};
use crate::refit::visit;
use crate::truth::law::Physics;
use crate::truth::recorded_input::RecordedInput;
use crate::truth::run::{Kind, Rig};

/// A parameter of the machine is known beforehand to this share, one standard error; one of a law to a factor
/// of e.
const DRAWN: f64 = 0.15;
const UNKNOWN: f64 = 1.0;
/// Logarithm of a parameter for a first look at its effect, which is its derivative where it is within these
/// shares of the noise, ...
const FIRST_STEP: f64 = 1e-4;
const GOOD_LOOK: std::ops::Range<f64> = 1e-3..1.0;
/// ... and otherwise made to be this share, within these bounds.
const EFFECT: f64 = 0.3;
const STEPS: [f64; 2] = [1e-7, 1e-2];
/// Corrections, all with the derivatives at the truth, ...
const ROUNDS: usize = 3;
/// ... each halved so often before it is given up; they end when one gains less than this in squares of the
/// noise.
const HALVINGS: usize = 5;
const SETTLED: f64 = 0.1;

/// Per channel the root mean square that such a fit leaves of the held-out recordings, in the channel's unit;
/// `None` without a law and where it cannot be made.
pub(super) fn achievable(bench: &Bench, physics: &[Physics], runs: &[MadeRun]) -> Option<Vec<f64>> {
    if physics.is_empty() {
        return None;
    }
    // Readings in steps have no derivative: the steps are known, and left out of what is fitted.
    let (rounding, fitted): (Vec<Physics>, Vec<Physics>) =
        physics.iter().cloned().partition(|law| law.id == "quantisation");
    let extended = Extended {
        kind: bench.start(),
        physics: &fitted,
        rounding: &rounding,
        channels: &bench.channels,
        runs: runs.iter().map(|run| (run, recorded_input(run))).collect(),
    };
    let theta = extended.fitted()?;
    let left = extended.left(&theta, Role::HeldOut)?;
    let pooled = |channel: usize| {
        let parts = left.iter().skip(channel).step_by(bench.channels.len());
        let (sum, count) = parts
            .fold((0.0, 0.0), |(sum, count), part| (sum + part.norm_squared(), count + part.len() as f64));
        bench.channels[channel].device.noise_rms * (sum / f64::max(count, 1.0)).sqrt()
    };
    Some((0..bench.channels.len()).map(pooled).collect())
}

/// The lab's model with the right laws, as a function of the logarithms of its parameters relative to the
/// true ones.
struct Extended<'c> {
    kind: Kind,
    physics: &'c [Physics],
    rounding: &'c [Physics],
    channels: &'c [Channel],
    runs: Vec<(&'c MadeRun, Option<RecordedInput>)>,
}

/// What a recording says of what drove the machine; `None` where nothing did.
fn recorded_input(run: &MadeRun) -> Option<RecordedInput> {
    let (_, samples) = run.inputs.first()?;
    RecordedInput::through(samples, RATE_HZ)
}

impl Extended<'_> {
    /// Standard errors with which the parameters are known beforehand: the machine's, then the laws'.
    fn known(&self) -> Vec<f64> {
        let mut known = Vec::new();
        visit(&mut self.kind.clone(), &mut |_| known.push(DRAWN));
        known.extend(self.physics.iter().flat_map(|law| law.parameters.values()).map(|_| UNKNOWN));
        known
    }

    fn rig(&self, theta: &[f64], role: Role) -> Option<Rig> {
        let mut factors = theta.iter().map(|value| value.exp());
        let mut kind = self.kind.clone();
        visit(&mut kind, &mut |value| *value *= factors.next().unwrap_or(1.0));
        let mut physics = self.physics.to_vec();
        for value in physics.iter_mut().flat_map(|law| law.parameters.values_mut()) {
            *value *= factors.next().unwrap_or(1.0);
        }
        if role == Role::HeldOut {
            physics.extend_from_slice(self.rounding);
        }
        Rig::new(&kind, &physics)
    }

    /// What is left of every channel of every recording of a role, in units of the noise. Zeros of sensors
    /// are unknown where a fit is made; what is held out is missed by where a base ends up, too.
    fn left(&self, theta: &[f64], role: Role) -> Option<Vec<DVector<f64>>> {
        let rig = self.rig(theta, role)?;
        let mut left = Vec::new();
        for (run, input) in self.runs.iter().filter(|(run, _)| run.plan.role == role) {
            let excitation = &run.plan.excitation;
            let outcome = match input {
                Some(input) => rig.run_recorded(excitation, input, RATE_HZ),
                None => rig.run(excitation, RATE_HZ, 1),
            }?;
            for (channel, recorded) in self.channels.iter().zip(&run.recorded) {
                let simulated = outcome.shown(channel.output);
                let mut part = DVector::from_iterator(
                    recorded.len(),
                    recorded.iter().zip(&simulated).map(|(r, s)| (r - s) / channel.device.noise_rms),
                );
                if role == Role::Train {
                    let mean = part.mean();
                    part.add_scalar_mut(-mean);
                }
                left.push(part);
            }
        }
        left.iter().flatten().all(|value| value.is_finite()).then_some(left)
    }

    fn training(&self, theta: &[f64]) -> Option<DVector<f64>> {
        let parts = self.left(theta, Role::Train)?;
        Some(DVector::from_iterator(
            parts.iter().map(DVector::len).sum(),
            parts.iter().flat_map(|part| part.iter().copied()),
        ))
    }

    /// How the residuals of the training recordings change with a parameter.
    fn derivative(&self, parameter: usize, left: &DVector<f64>) -> Option<DVector<f64>> {
        let change = |step: f64| {
            let mut moved = vec![0.0; self.known().len()];
            moved[parameter] = step;
            Some(self.training(&moved)? - left)
        };
        let first = change(FIRST_STEP)?;
        let rms = first.norm() / (first.len().max(1) as f64).sqrt();
        if rms == 0.0 || GOOD_LOOK.contains(&rms) {
            return Some(first / FIRST_STEP);
        }
        let step = (FIRST_STEP * EFFECT / rms).clamp(STEPS[0], STEPS[1]);
        Some(change(step)? / step)
    }

    /// The likeliest logarithms.
    fn fitted(&self) -> Option<Vec<f64>> {
        let known = self.known();
        let mut theta = vec![0.0; known.len()];
        let mut left = self.training(&theta)?;
        let columns: Vec<DVector<f64>> =
            (0..known.len()).map(|parameter| self.derivative(parameter, &left)).collect::<Option<_>>()?;
        let jacobian = DMatrix::from_columns(&columns);
        let mut normal = jacobian.transpose() * &jacobian;
        for (k, known) in known.iter().enumerate() {
            normal[(k, k)] += known.powi(-2);
        }
        let solver = normal.cholesky()?;
        let cost = |theta: &[f64], left: &DVector<f64>| {
            let drawn = theta.iter().zip(&known).map(|(value, known)| (value / known).powi(2));
            left.norm_squared() + drawn.sum::<f64>()
        };
        for _ in 0..ROUNDS {
            let mut gradient = jacobian.transpose() * &left;
            for (k, known) in known.iter().enumerate() {
                gradient[k] += theta[k] / known.powi(2);
            }
            let step = solver.solve(&gradient);
            let before = cost(&theta, &left);
            let moved = |halvings: usize| -> Option<(Vec<f64>, DVector<f64>)> {
                let share = 0.5_f64.powi(i32::try_from(halvings).ok()?);
                let moved: Vec<f64> = theta.iter().zip(step.iter()).map(|(t, s)| t - share * s).collect();
                let left = self.training(&moved)?;
                (cost(&moved, &left) < before).then_some((moved, left))
            };
            let Some(better) = (0..HALVINGS).find_map(moved) else { break };
            (theta, left) = better;
            if before - cost(&theta, &left) < SETTLED {
                break;
            }
        }
        Some(theta)
    }
}

#[cfg(test)]
mod tests {
    use super::super::maker::make;

    /// Held-out floors over the noise of the channels.
    fn floors(seed: u64, number: usize) -> Vec<f64> {
        let truth = make(seed, number).unwrap().truth;
        let channels = truth.channels.iter().zip(&truth.held_out_floor);
        channels.map(|(channel, floor)| floor / channel.device.noise_rms).collect()
    }

    /// A hardening beam that its recordings show well.
    #[test]
    fn what_the_recordings_say_well_leaves_the_noise() {
        for floor in floors(15, 145) {
            assert!((0.97..1.03).contains(&floor), "{floor}");
        }
    }

    /// A load that rattles in a play of 0.76 mm: from the recorded input nobody can say which flank it meets
    /// next.
    #[test]
    fn a_rattle_beyond_what_the_input_says_is_not_asked_for() {
        let [motor, load] = floors(16, 85)[..] else { panic!("two channels") };
        assert!(motor > 1.05 && load > 2.0, "{motor} {load}");
    }

    /// A stop that a base without a spring meets once in the held-out move: where it rolls to from there
    /// depends on a tenth of a millimetre.
    #[test]
    fn a_rebound_that_the_recordings_leave_open_is_not_asked_for() {
        let [tip, base] = floors(15, 210)[..] else { panic!("two channels") };
        assert!(tip > 5.0 && base > 50.0, "{tip} {base}");
    }
}
