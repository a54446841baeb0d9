//! The laws of the catalogue at the places of a machine, with what each is tried with there.

use stillbeam_plant::catalogue::{Law, Sizes, Trial, candidates};
use stillbeam_plant::{Model, Physics};

use super::scales::Scales;
use crate::parameters::{FreeParameter, free_parameters};
use crate::reading_step::ReadingStep;
use crate::record::Record;
use crate::simulation::Hypothesis;

/// A law at a place, with what it is tried with.
#[derive(Clone)]
pub(crate) struct Candidate {
    pub(crate) law: &'static dyn Law,
    pub(crate) location: String,
    /// For laws of the sensor: the output.
    pub(crate) column: Option<String>,
    pub(crate) trials: Vec<Trial>,
    /// Name, least and greatest value of shapes that mean something only within the machine's motion.
    pub(crate) ranges: Vec<(&'static str, f64, f64)>,
    /// Standard error of a step that is read off the recordings and not fitted.
    pub(crate) step_stderr: Option<f64>,
}

impl Candidate {
    /// The law with a trial's values, its amplitudes multiplied.
    pub(crate) fn physics(&self, trial: &Trial, factor: f64) -> Physics {
        let mut physics = Physics::new(self.law.id(), self.location.clone());
        physics.column.clone_from(&self.column);
        for (name, value) in &trial.amplitudes {
            physics = physics.with(*name, factor * value);
        }
        for (name, value) in &trial.shapes {
            physics = physics.with(*name, *value);
        }
        physics
    }

    /// The same, no amplitude beyond what the law allows.
    pub(super) fn physics_within_bounds(&self, trial: &Trial, factor: f64) -> Physics {
        let mut physics = self.physics(trial, factor);
        for spec in self.law.parameters() {
            if let Some(value) = physics.parameters.get_mut(spec.name) {
                *value = value.clamp(spec.lower, spec.upper);
            }
        }
        physics
    }

    /// Whether its strength is read off the readings themselves.
    pub(crate) fn is_read_off(&self) -> bool {
        self.step_stderr.is_some()
    }

    /// `id at location`, with the column where there are several sensors.
    pub(crate) fn name(&self) -> String {
        match &self.column {
            Some(column) => format!("{} at {} ({column})", self.law.id(), self.location),
            None => format!("{} at {}", self.law.id(), self.location),
        }
    }

    /// Names of all parameters that set the strength in any trial.
    pub(crate) fn amplitude_names(&self) -> Vec<String> {
        let mut names: Vec<String> = self.trials.iter().flat_map(Trial::amplitude_names).collect();
        names.sort();
        names.dedup();
        names
    }

    /// Whether an amplitude may have either sign.
    pub(crate) fn is_signed(&self, trial: &Trial) -> bool {
        trial
            .amplitudes
            .iter()
            .all(|(name, _)| self.law.parameters().iter().any(|spec| spec.name == *name && spec.lower < 0.0))
    }
}

/// Every law of the catalogue at every place at which this model lets it sit and where something moves.
///
/// `peaks_hz` are frequencies at which the residual rings.
pub(crate) fn all_candidates(
    hypothesis: &Hypothesis,
    scales: &Scales,
    records: &[Record],
    peaks_hz: &[f64],
    without: &[String],
) -> Vec<Candidate> {
    let locations = hypothesis.model.locations();
    let free = free_parameters(hypothesis);
    let columns = hypothesis.model.output_columns();
    let recorded: Vec<usize> = (0..columns.len())
        .filter(|index| records.iter().any(|record| record.outputs.iter().any(|o| o.index == *index)))
        .collect();
    let mut found = Vec::new();
    let is_driven = records.iter().any(|record| record.input.is_some());
    let longest_s = records.iter().map(Record::duration_s).fold(0.0, f64::max);
    for candidate in candidates(&hypothesis.model) {
        let Some(location) = locations.get(candidate.location) else { continue };
        let is_left_out = without.iter().any(|id| id == candidate.law.id());
        if is_left_out || !may_show(&hypothesis.model, &free, candidate.law, location, is_driven) {
            continue;
        }
        let Some(scale) = scales.at(hypothesis, location) else { continue };
        let sizes = Sizes {
            displacement: scale.displacement,
            reach: scale.reach,
            travel: scale.travel,
            velocity: scale.velocity,
            force: scale.force,
            input: scales.input,
            peaks_hz,
            longest_s,
            ..Sizes::default()
        };
        let mut push = |column: Option<String>, output: usize| {
            let step = reading_step(records, output);
            let sizes = Sizes {
                output: scales.outputs.get(output).copied().unwrap_or_default(),
                reading_step: step.as_ref().map(|step| step.value),
                ..sizes
            };
            let trials = candidate.law.trials(&sizes);
            if !trials.is_empty() {
                found.push(Candidate {
                    step_stderr: step.filter(|_| candidate.law.is_read_off()).map(|step| step.stderr),
                    law: candidate.law,
                    location: location.clone(),
                    column,
                    trials,
                    ranges: candidate.law.ranges(&sizes),
                });
            }
        };
        if location == "sensor" && recorded.len() > 1 {
            recorded.iter().for_each(|&output| push(Some(columns[output].clone()), output));
        } else {
            push(None, recorded.first().copied().unwrap_or(0));
        }
    }
    found
}

/// Whether a law at a place could show what neither the model's own parameters do nor the same law elsewhere.
fn may_show(model: &Model, free: &[FreeParameter], law: &dyn Law, location: &str, is_driven: bool) -> bool {
    // The chain is cut at every recorded signal: what came before the motion that was recorded is no part of
    // any mismatch behind it.
    let is_cut_off = location == "drive" && model.input_is_behind_the_drive();
    // A clock of its own, a delay: nothing to tell them by but an input, without which a later beginning or
    // other frequencies are the same.
    let is_free_to_be_late = law.is_late() && !is_driven;
    // Linear laws of the structure as a whole are the same wherever on the beam they are said to sit.
    let is_of_the_whole = law.is_of_the_whole();
    let is_at_the_beam_too = location == "tip" && model.locations().iter().any(|other| other == "beam");
    let own = law.own_parameter(model, location);
    let is_a_parameter = own.is_some_and(|own| free.iter().any(|free| free.path == own));
    !(is_cut_off || is_free_to_be_late || (is_of_the_whole && is_at_the_beam_too) || is_a_parameter)
}

/// The step of an output's readings, from the recording that says it best; `None` where it has none.
fn reading_step(records: &[Record], output: usize) -> Option<ReadingStep> {
    let signals =
        records.iter().filter_map(|record| record.outputs.iter().find(|signal| signal.index == output));
    let steps = signals.filter_map(|signal| signal.step);
    steps.min_by(|a, b| a.stderr.total_cmp(&b.stderr))
}

#[cfg(test)]
mod tests {
    use super::*;
    use stillbeam_plant::Hold;
    use stillbeam_recording::Recording;

    use crate::naming::on_a_spring::{let_go, machine, noisy_runs, searched_around, unpushed};
    use crate::{Diagnosis, Options, diagnose};

    #[test]
    fn what_comes_late_is_looked_for_only_where_an_input_is_known() {
        let late = |given: &Model, recorded: &[Recording]| {
            searched_around(given, &recorded[..1], &recorded[1..], |search, _| {
                search.candidates.iter().filter(|candidate| candidate.law.is_late()).count()
            })
        };
        assert!(late(&machine(), &noisy_runs(&machine(), &[3.0, 5.0], 1e-5)) > 0);
        assert_eq!(late(&unpushed(), &let_go(&machine(), &[0.02, 0.01], 1e-5)), 0);
    }

    /// Runs whose readings are rounded in the presence of noise, and again when they are written down.
    fn rounded_twice(amplitudes: &[f64], noise_m: f64, step_m: f64, written_m: f64) -> Vec<Recording> {
        let to = |value: f64, step: f64| (value / step).round() * step;
        let rounded = |recording: Recording| {
            let column = |name: &str| recording.column(name).unwrap().to_vec();
            let read = column("position_m").iter().map(|x| to(to(*x, step_m), written_m)).collect();
            Recording::new(recording.name.clone(), recording.time_s.clone())
                .with_column("force_N", column("force_N"))
                .with_column("position_m", read)
        };
        noisy_runs(&machine(), amplitudes, noise_m).into_iter().map(rounded).collect()
    }

    /// What is found where a law is missing.
    fn found_without(law: Physics) -> Diagnosis {
        let mut truth = machine();
        truth.setup_mut().physics = vec![law];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-4);
        let (train, held_out) = (noisy(&[3.0, 9.0]), noisy(&[5.0]));
        // What straight lines between the samples do is known to be no law.
        let drawn = machine().with_hold(Hold::FirstOrder);
        diagnose(&drawn, &train, &held_out, &Options::default(), &mut |_| {}).unwrap()
    }

    fn assert_named(found: &Diagnosis, id: &str) {
        let named: Vec<&str> = found.effects.iter().map(|effect| effect.id.as_str()).collect();
        assert_eq!(named, [id], "{}", found.sentence);
    }

    /// The force of Bouc and Wen falls along another line than Dahl's.
    #[test]
    fn hysteresis_is_found_with_the_shape_of_its_loop() {
        let shape = [("stiffness", 200.0), ("beta", 40.0), ("gamma", 40.0)];
        let law = shape
            .iter()
            .fold(Physics::new("hysteresis", "mass"), |law, (name, value)| law.with(*name, *value));
        let found = found_without(law);
        assert_named(&found, "hysteresis");
        for (name, value) in shape {
            let fitted = &found.effects[0].parameters[name];
            assert!((fitted.value / value - 1.0).abs() < 0.05, "{name}: {fitted:?}");
        }
    }

    #[test]
    fn a_shock_absorber_is_known_by_damping_that_differs_with_the_direction() {
        for damping in [3.0, -2.0] {
            let law = Physics::new("bilinear_damping", "mass").with("damping", damping);
            assert_named(&found_without(law), "bilinear_damping");
        }
    }

    #[test]
    fn a_spring_that_is_harder_to_one_side_is_known() {
        for stiffness in [500.0, -500.0] {
            let law = Physics::new("quadratic_stiffness", "mass").with("stiffness", stiffness);
            assert_named(&found_without(law), "quadratic_stiffness");
        }
    }

    #[test]
    fn no_law_is_tried_for_what_a_free_parameter_of_the_model_does() {
        let recorded = (noisy_runs(&machine(), &[1.0], 1e-5), noisy_runs(&machine(), &[2.0], 1e-5));
        let viscous_is_tried = |given: &Model| {
            searched_around(given, &recorded.0, &recorded.1, |search, _| {
                search.candidates.iter().any(|candidate| candidate.law.id() == "viscous_friction")
            })
        };
        assert!(!viscous_is_tried(&machine()), "its damper is free");
        let mut known = machine();
        if let Model::Lumped(lumped) = &mut known {
            lumped.fixed.insert("damper.mass-ground.damping".to_owned(), true);
        }
        assert!(viscous_is_tried(&known));
    }

    #[test]
    fn readings_that_are_rounded_amid_noise_and_written_down_in_finer_steps_are_known_as_rounded() {
        let (noise_m, step_m, written_m) = (0.22e-3, 1.0013e-3, 2.2e-5);
        let train = rounded_twice(&[3.0, 9.0, 5.0], noise_m, step_m, written_m);
        let held_out = rounded_twice(&[7.0], noise_m, step_m, written_m);
        let found = diagnose(&machine(), &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
        let named: Vec<&str> = found.effects.iter().map(|effect| effect.id.as_str()).collect();
        assert_eq!(named, ["quantisation"], "{}", found.sentence);
        let step = &found.effects[0].parameters["step"];
        assert!((step.value - step_m).abs() < 3.0 * step.stderr && step.stderr < 1e-3 * step_m, "{step:?}");
    }
}
