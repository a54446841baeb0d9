//! Initial states that the beginning of a recording does not show.
//!
//! The state that a recording began in is the one that explains it best. Where a motion depends on its start
//! as steeply as the rebounds from a stop do, that is one that makes up for what the model lacks much later:
//! a tip that stood still for a second is said to have rung, since the base then comes nearer to where it was
//! seen after its rebound. A fit may go that way, since it ends where the model is right; what is held out is
//! judged from a start that its beginning allows.

use std::sync::Arc;

use rayon::prelude::*;
use stillbeam_identify::tall::{Orthonormal, dot};

use crate::simulation::{Hypothesis, free_responses, simulate};
use crate::stacking::{RecordFit, Stack};

/// A start other than rest may leave so many mean squares more of the time before the machine is driven, ...
const CLEAR: f64 = 10.0;
/// ... which is while the input is within this share of its greatest change.
const STILL: f64 = 1e-3;

impl Stack<'_> {
    /// All recordings under a hypothesis that was not fitted to them, in order.
    pub(crate) fn evaluate_held_out(
        &self,
        hypothesis: &Hypothesis,
        starts: &[Vec<f64>],
    ) -> Option<Vec<RecordFit>> {
        let found = self.evaluate(hypothesis, starts)?;
        found
            .into_par_iter()
            .enumerate()
            .map(|(index, found)| {
                if !hypothesis.is_linear() && self.never_rests(index, hypothesis) {
                    return Some(self.begun_anew(index, hypothesis).into_iter().fold(found, better));
                }
                let stands = self.adds_free_responses(index, hypothesis)
                    || found.initial.iter().all(|state| *state == 0.0);
                if stands {
                    return Some(found);
                }
                let rest = self.run_from(index, hypothesis, vec![0.0; found.initial.len()]);
                let begun = self.run_from(index, hypothesis, found.initial.clone());
                match (rest, begun) {
                    (Some(rest), Some(begun)) if self.contradicts_the_beginning(index, &begun, &rest) => {
                        Some(rest)
                    }
                    _ => Some(found),
                }
            })
            .collect()
    }

    /// Whether, before the machine is driven, a start leaves more than rest does.
    fn contradicts_the_beginning(&self, index: usize, begun: &RecordFit, rest: &RecordFit) -> bool {
        let record = self.records[index];
        let Some(input) = &record.input else { return false };
        let driven = before_it_is_driven(input);
        let early = |fit: &RecordFit| {
            let mut start = 0;
            let parts = record.outputs.iter().map(|output| {
                let quiet = output.at.partition_point(|stamp| *stamp < driven);
                let part = &fit.residuals[start..start + quiet];
                start += output.at.len();
                let mean = part.iter().sum::<f64>() / part.len().max(1) as f64;
                part.iter().map(|value| (value - mean).powi(2)).sum::<f64>()
            });
            parts.sum::<f64>()
        };
        early(begun) > early(rest) + CLEAR
    }

    /// One recording as the model runs from a state, with nothing but offsets taken out.
    pub(crate) fn run_from(
        &self,
        index: usize,
        hypothesis: &Hypothesis,
        initial: Vec<f64>,
    ) -> Option<RecordFit> {
        let mut linear = Orthonormal::default();
        for response in free_responses(hypothesis, self.records[index])? {
            linear.push(self.weighted(index, &response));
        }
        let mut offsets = Orthonormal::default();
        self.offsets(index, hypothesis, &linear).into_iter().for_each(|offset| offsets.push(offset));
        let simulated = simulate(hypothesis, self.records[index], &initial)?;
        let mut residuals = self.departure(index, &simulated);
        offsets.remove_from(&mut residuals);
        let is_finite = residuals.iter().all(|value| value.is_finite());
        is_finite.then(|| RecordFit { simulated, nuisances: Arc::new(offsets), residuals, initial })
    }
}

/// Of two fits to the same recording the one that leaves less.
fn better(a: RecordFit, b: RecordFit) -> RecordFit {
    let left = |fit: &RecordFit| dot(&fit.residuals, &fit.residuals);
    if left(&b) < left(&a) { b } else { a }
}

/// Samples before an input leaves its first value.
fn before_it_is_driven(input: &[f64]) -> usize {
    let away = |value: &f64| (value - input[0]).abs();
    let most = input.iter().map(away).fold(0.0, f64::max);
    input.iter().take_while(|value| away(value) <= STILL * most).count()
}

#[cfg(test)]
mod tests {
    use std::slice::from_ref;

    use rand_distr::{Distribution, Normal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;
    use stillbeam_plant::{Model, Physics};
    use stillbeam_recording::{Recording, Role};

    use super::*;
    use crate::comparison::compare;
    use crate::study::Study;

    const NOISE_M: f64 = 3e-5;

    /// A base that nothing holds, with a mass that rings on it, between stops.
    fn between_stops(distance_m: f64) -> Model {
        let text = r#"
            schema = 1
            kind = "lumped"
            body = [{ name = "base", mass = 3.0 }, { name = "mass", mass = 1.0 }]
            input = { column = "force_N", body = "base" }
            output = [{ column = "mass_m", body = "mass" }, { column = "base_m", body = "base" }]
            spring = [{ between = ["base", "mass"], stiffness = 60.0 }]
            damper = [
                { between = ["base", "mass"], damping = 0.05 },
                { between = ["base", "ground"], damping = 4.0 },
            ]
        "#;
        let mut model = Model::from_toml("stops.toml", text).unwrap();
        let stop = Physics::new("end_stop", "base").with("distance", distance_m).with("stiffness", 2e4);
        model.setup_mut().physics = vec![stop];
        model
    }

    /// A second of rest, one of force and one of force back, to the stops on either side: no shift of the
    /// base makes up for their distance. Then where the base rolls to.
    fn pushed(machine: &Model, size_n: f64) -> Recording {
        let time_s: Vec<f64> = (0..2000).map(|k| 0.01 * f64::from(k)).collect();
        let push = |t: &f64| match *t {
            t if (1.0..2.0).contains(&t) => size_n,
            t if (2.0..3.0).contains(&t) => -size_n,
            _ => 0.0,
        };
        let force = time_s.iter().map(push).collect();
        let commanded = Recording::new("pushed", time_s).with_column("force_N", force);
        let moved = stillbeam_plant::simulate(machine, &commanded).unwrap();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let noise = Normal::new(0.0, NOISE_M).unwrap();
        ["mass_m", "base_m"].iter().fold(commanded, |recording, column| {
            let read = moved.column(column).unwrap().iter().map(|x| x + noise.sample(&mut random));
            recording.with_column(*column, read.collect())
        })
    }

    /// Something about a recording of a machine that is held out, its noise known.
    fn held_out<T>(
        model: &Model,
        recording: &Recording,
        look: impl FnOnce(&Stack<'_>, &Hypothesis) -> T,
    ) -> T {
        let mut study = Study::new(model, from_ref(recording), from_ref(recording)).unwrap();
        compare(&mut study, &Hypothesis::given(model)).unwrap();
        look(&study.stack(Role::HeldOut), &Hypothesis::given(model))
    }

    #[test]
    fn a_start_that_makes_up_for_later_rebounds_is_none() {
        let recording = pushed(&between_stops(0.1), 6.0);
        held_out(&between_stops(0.1008), &recording, |stack, hypothesis| {
            let power = |fits: &[RecordFit]| dot(&fits[0].residuals, &fits[0].residuals);
            let found = stack.evaluate(hypothesis, &[]).unwrap();
            assert!(found[0].initial.iter().any(|state| state.abs() > 1e-4), "{:?}", found[0].initial);
            let judged = stack.evaluate_held_out(hypothesis, &[]).unwrap();
            assert!(judged[0].initial.iter().all(|state| *state == 0.0), "{:?}", judged[0].initial);
            assert!(power(&judged) > 2.0 * power(&found), "{} {}", power(&judged), power(&found));
        });
    }

    #[test]
    fn a_start_that_the_beginning_shows_stands() {
        let mut ringing = between_stops(0.1);
        let recording = pushed(&ringing, 0.3);
        let aside = |recording: &Recording, by: f64| {
            let time = recording.time_s.clone();
            let ring = |t: &f64| by * (-0.03 * t).exp() * (8.9 * t).cos();
            let moved = recording.column("mass_m").unwrap().iter().zip(&time).map(|(x, t)| x + ring(t));
            Recording::new("aside", time.clone())
                .with_column("force_N", recording.column("force_N").unwrap().to_vec())
                .with_column("mass_m", moved.collect())
                .with_column("base_m", recording.column("base_m").unwrap().to_vec())
        };
        ringing.setup_mut().physics[0].parameters.insert("distance".to_owned(), 0.5);
        held_out(&ringing, &aside(&recording, 0.01), |stack, hypothesis| {
            let judged = stack.evaluate_held_out(hypothesis, &[]).unwrap();
            assert!(judged[0].initial.iter().any(|state| state.abs() > 1e-3), "{:?}", judged[0].initial);
        });
    }

    #[test]
    fn the_time_before_a_machine_is_driven_ends_with_the_first_force() {
        assert_eq!(before_it_is_driven(&[0.0, 0.0, 1e-6, 0.5, 1.0, 0.0]), 3);
        assert_eq!(before_it_is_driven(&[2.0, 2.0, 2.0]), 3);
    }
}
