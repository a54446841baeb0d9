//! What a law is tried with before anything is fitted: sizes that fit this machine's motion.
//!
//! A law's parameters are of two kinds. *Amplitudes* make it weaker or stronger and are zero where it is
//! absent; they are scaled until the law's effect on the outputs has the size of what is to be explained.
//! *Shapes* (a period, a speed, a contact) say what it looks like; several values are tried and the best
//! starts the fit.

use std::f64::consts::FRAC_PI_2;

use stillbeam_plant::catalogue::{Law, candidates};
use stillbeam_plant::{Model, Physics};

use super::scales::{Scale, Scales};
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

/// One set of values to try.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Trial {
    /// Parameters that scale the effect, with a first guess of their size.
    pub(crate) amplitudes: Vec<(&'static str, f64)>,
    /// The other parameters.
    pub(crate) shapes: Vec<(&'static str, f64)>,
}

impl Trial {
    /// Whether this is another trial's wave a quarter of a period ahead.
    pub(crate) fn is_quadrature_of(&self, other: &Self) -> bool {
        self.amplitudes == other.amplitudes
            && other.turned(FRAC_PI_2).is_some_and(|ahead| ahead.shapes == self.shapes)
    }

    /// Whether two trials of one law add up to one of the same law: a wave and the one a quarter ahead, a
    /// cable that pulls towards where the machine starts and one that pulls evenly.
    pub(crate) fn adds_to(&self, other: &Self) -> bool {
        self.is_quadrature_of(other) || (self.rest_position().is_some() && other.rest_position().is_some())
    }

    /// The trial, and what its amplitudes are to be multiplied by, that has so many times the force of this
    /// one and so many times that of one that adds to it; `None` where there is none.
    pub(crate) fn combined(&self, parts: [f64; 2], other: &Self) -> Option<(Self, f64)> {
        let (Some(rest), Some(other_rest)) = (self.rest_position(), other.rest_position()) else {
            return Some((self.turned(parts[1].atan2(parts[0]))?, parts[0].hypot(parts[1])));
        };
        let own = self.amplitudes.first()?.1;
        let [k, other_k] = [parts[0] * own, parts[1] * other.amplitudes.first()?.1];
        let mut trial = self.clone();
        let (_, value) = trial.shapes.iter_mut().find(|(name, _)| *name == "rest_position")?;
        *value = (k * rest + other_k * other_rest) / (k + other_k);
        value.is_finite().then_some((trial, (k + other_k) / own))
    }

    /// The period of a wave along the travel; `None` for what is none.
    pub(crate) fn period(&self) -> Option<f64> {
        self.shapes.iter().find(|(name, _)| *name == "period").map(|(_, value)| *value)
    }

    /// The same wave with another period; `None` for what is none.
    pub(crate) fn with_period(&self, period: f64) -> Option<Self> {
        let mut other = self.clone();
        let (_, value) = other.shapes.iter_mut().find(|(name, _)| *name == "period")?;
        *value = period;
        Some(other)
    }

    fn rest_position(&self) -> Option<f64> {
        self.shapes.iter().find(|(name, _)| *name == "rest_position").map(|(_, value)| *value)
    }

    /// The same wave with another phase; `None` for what is no wave.
    pub(crate) fn turned(&self, by_rad: f64) -> Option<Self> {
        let mut turned = self.clone();
        let (_, phase) = turned.shapes.iter_mut().find(|(name, _)| *name == "phase")?;
        *phase += by_rad;
        Some(turned)
    }
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
    for candidate in candidates(&hypothesis.model) {
        let Some(location) = locations.get(candidate.location) else { continue };
        let is_left_out = without.iter().any(|id| id == candidate.law.id());
        if is_left_out || !may_show(&hypothesis.model, &free, candidate.law, location, is_driven) {
            continue;
        }
        let Some(scale) = scales.at(hypothesis, location) else { continue };
        let mut push = |column: Option<String>, output: usize| {
            let trials =
                trials((candidate.law.id(), location == "sensor"), scale, scales, output, records, peaks_hz);
            if !trials.is_empty() {
                let ranges =
                    ranges((candidate.law.id(), location == "sensor"), scale, scales, output, records);
                let is_read_off = candidate.law.id() == "quantisation";
                let step = is_read_off.then(|| reading_step(records, output)).flatten();
                found.push(Candidate {
                    step_stderr: step.map(|step| step.stderr),
                    law: candidate.law,
                    location: location.clone(),
                    column,
                    trials,
                    ranges,
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
    let is_of_the_whole = ["extra_mode", "tip_mass", "clamp_compliance"].contains(&law.id());
    let is_at_the_beam_too = location == "tip" && model.locations().iter().any(|other| other == "beam");
    let own = law.own_parameter(model, location);
    let is_a_parameter = own.is_some_and(|own| free.iter().any(|free| free.path == own));
    !(is_cut_off || is_free_to_be_late || (is_of_the_whole && is_at_the_beam_too) || is_a_parameter)
}

/// The trials of a law; none where it could not show.
fn trials(
    (id, at_sensor): (&str, bool),
    at: Scale,
    scales: &Scales,
    output: usize,
    records: &[Record],
    peaks_hz: &[f64],
) -> Vec<Trial> {
    let (z, v, f) = (at.displacement, at.velocity, at.force);
    let [u, u_most] = scales.input;
    let [y, y_most] = scales.outputs.get(output).copied().unwrap_or([0.0; 2]);
    let amplitude =
        |name: &'static str, value: f64| vec![Trial { amplitudes: vec![(name, value)], shapes: Vec::new() }];
    let shaped = |name: &'static str, value: f64, shapes: &[(&'static str, f64)]| Trial {
        amplitudes: vec![(name, value)],
        shapes: shapes.to_vec(),
    };
    let limits = |most: f64| -> Vec<Trial> {
        [0.95, 0.8, 0.6]
            .iter()
            .map(|share| Trial { amplitudes: Vec::new(), shapes: vec![("limit", share * most)] })
            .collect()
    };
    // So close together that between two of them the force's pattern moves by less than a quarter of a wave
    // over the travel.
    let waves = |name: &'static str, size: f64| -> Vec<Trial> {
        let periods = (1..=MOST_WAVES * 4).map(|quarters| 4.0 * at.reach / f64::from(quarters));
        let periods = periods.filter(|period| *period <= at.travel);
        let both = periods.flat_map(|period| [0.0, FRAC_PI_2].map(|phase| (period, phase)));
        both.map(|(period, phase)| shaped(name, size, &[("period", period), ("phase", phase)])).collect()
    };
    match id {
        "coulomb_friction" => amplitude("force", f),
        "stribeck_friction" => [0.1, 0.3]
            .iter()
            .map(|share| Trial {
                amplitudes: vec![("force", f), ("static_force", 1.5 * f)],
                shapes: vec![("velocity", share * v)],
            })
            .collect(),
        "viscous_friction" => amplitude("damping", f / v),
        "asymmetric_friction" => vec![
            shaped(
                "force_forward",
                f,
                &[("force_backward", 0.0), ("viscous_forward", 0.0), ("viscous_backward", 0.0)],
            ),
            shaped(
                "force_backward",
                f,
                &[("force_forward", 0.0), ("viscous_forward", 0.0), ("viscous_backward", 0.0)],
            ),
            Trial {
                amplitudes: vec![("force_forward", f), ("force_backward", 0.7 * f)],
                shapes: vec![("viscous_forward", 0.0), ("viscous_backward", 0.0)],
            },
        ],
        "bilinear_damping" => amplitude("damping", f / v),
        "quadratic_drag" => amplitude("drag", f / (v * v)),
        "cogging" => waves("force", f),
        "force_ripple" => waves("ripple", 0.01),
        // A base that nothing holds starts anywhere beside a cable's rest: far away it pulls evenly.
        "cable_spring" => [(f / z, 0.0), (f / (FAR * z), FAR * z)]
            .iter()
            .map(|(stiffness, rest)| shaped("stiffness", *stiffness, &[("rest_position", *rest)]))
            .collect(),
        "cubic_stiffness" => amplitude("stiffness", f / (z * z * z)),
        "quadratic_stiffness" => amplitude("stiffness", f / (z * z)),
        // What of the spring's force the sine takes away at the largest angle.
        "pendulum" => amplitude("stiffness", f / (z - z.sin()).abs().max(f64::MIN_POSITIVE)),
        "hysteresis" => [0.3, 1.0, 3.0]
            .iter()
            .flat_map(|share| {
                let dahl = shaped("stiffness", f / z, &[("beta", share / z)]);
                // Yields as Dahl's, and comes back along a straight line.
                let half = 0.5 * share / z;
                [dahl, shaped("stiffness", f / z, &[("beta", half), ("gamma", half)])]
            })
            .collect(),
        "backlash" => amplitude("gap", 0.02 * z),
        "end_stop" => [0.95, 0.9, 0.8, 0.7, 0.6, 0.5]
            .iter()
            .map(|share| shaped("stiffness", f / z, &[("distance", share * at.reach)]))
            .collect(),
        "constant_force" => amplitude("force", f),
        // Close enough that a contact between two of them is seen from one: at 0 and 0.4 of the reach alone,
        // one at 0.2 looked like a cubic.
        "bilinear_stiffness" => [0.0, 0.2, -0.2, 0.4, -0.4, 0.7, -0.7]
            .iter()
            .map(|share| shaped("stiffness", f / z, &[("contact", share * at.reach)]))
            .collect(),
        "amplitude_damping" => amplitude("damping", f / (v * z * z)),
        "extra_mode" => peaks_hz
            .iter()
            .map(|hz| shaped("participation", 0.01, &[("frequency", *hz), ("damping_ratio", 0.01)]))
            .collect(),
        "tip_mass" => amplitude("mass", 1e-3),
        "clamp_compliance" => amplitude("compliance", 1e-4),
        "servo_lag" => amplitude("time_constant", 1e-3),
        "dead_time" | "delay" => amplitude("delay", 1e-3),
        "saturation" if at_sensor => limits(y_most),
        "saturation" => limits(u_most),
        "dead_zone" => amplitude("threshold", 0.02 * u),
        "gain_nonlinearity" => {
            [amplitude("quadratic", 0.01 / u), amplitude("cubic", 0.01 / (u * u))].concat()
        }
        "quantisation" => {
            reading_step(records, output).map_or_else(Vec::new, |ReadingStep { value: step, .. }| {
                // What the noise before the rounding leaves of it.
                [0.05, 0.15, 0.25, 0.4]
                    .map(|share| Trial {
                        amplitudes: Vec::new(),
                        shapes: vec![("step", step), ("dither", share * step)],
                    })
                    .to_vec()
            })
        }
        "nonlinearity" => [amplitude("quadratic", 0.01 / y), amplitude("cubic", 0.01 / (y * y))].concat(),
        "crosstalk" => amplitude("share", 0.01 * y / u),
        "exposure_blur" => amplitude("exposure", 2e-3),
        "clock_skew" => amplitude("skew", 1e-5),
        "rectification" => amplitude("share", 0.02),
        "periodic_disturbance" => peaks_hz
            .iter()
            .flat_map(|hz| {
                [0.0, FRAC_PI_2].map(|phase| shaped("force", f, &[("frequency", *hz), ("phase", phase)]))
            })
            .collect(),
        "parameter_drift" => amplitude("rate", 1e-5),
        _ => Vec::new(),
    }
}

/// So many times the motion away a cable's rest is another force than a spring's.
const FAR: f64 = 1e3;

/// A stop is looked for up to this many times as far as the model goes without it.
pub(super) const BEYOND_REACH: f64 = 2.0;

/// A sensor's limit is looked for up to this many times its largest reading.
const ABOVE_READINGS: f64 = 1.5;

/// What swings less often during the longest recording is a drift and no mode.
const FEWEST_PERIODS: f64 = 2.0;

/// Waves of a force over half the travel that are looked for.
const MOST_WAVES: i32 = 10;

/// Outside these a law is another one: a wave of which no whole period was seen is a spring and an offset, a
/// hysteresis that never yields too.
fn ranges(
    (id, at_sensor): (&str, bool),
    at: Scale,
    scales: &Scales,
    output: usize,
    records: &[Record],
) -> Vec<(&'static str, f64, f64)> {
    let [_, u_most] = scales.input;
    let [_, y_most] = scales.outputs.get(output).copied().unwrap_or([0.0; 2]);
    match id {
        "cogging" | "force_ripple" => vec![("period", 0.05 * at.reach, at.travel)],
        // How far a model without the stop goes is a guess of how far it is.
        "end_stop" => vec![("distance", 0.1 * at.reach, BEYOND_REACH * at.reach)],
        "bilinear_stiffness" => vec![("contact", -0.95 * at.reach, 0.95 * at.reach)],
        "hysteresis" => vec![("beta", 0.02 / at.reach, 200.0 / at.displacement)],
        "stribeck_friction" => vec![("velocity", 1e-3 * at.velocity, 3.0 * at.velocity)],
        "saturation" => {
            // The largest reading of a sensor that saturates is its limit, noise and an unknown zero put
            // aside: the limit lies about there and not below. A command is known exactly, and one above all
            // that was asked for limits nothing.
            let most = if at_sensor { ABOVE_READINGS * y_most } else { u_most };
            vec![("limit", 0.05 * most, most)]
        }
        "dead_zone" => vec![("threshold", 0.0, u_most)],
        "dead_time" | "delay" => vec![("delay", -0.1, 0.1)],
        "extra_mode" => {
            let longest_s = records.iter().map(Record::duration_s).fold(0.0, f64::max);
            vec![("frequency", FEWEST_PERIODS / longest_s, f64::INFINITY), ("damping_ratio", 1e-5, 0.5)]
        }
        _ => Vec::new(),
    }
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

    use crate::naming::on_a_spring::{let_go, machine, noisy_runs, searched, searched_around, unpushed};
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

    #[test]
    fn what_swings_less_than_twice_in_the_longest_recording_is_no_mode() {
        let train = noisy_runs(&machine(), &[1.0], 1e-5);
        searched(&train, &noisy_runs(&machine(), &[2.0], 1e-5), |search, _| {
            let at = Scale { displacement: 0.02, reach: 0.04, travel: 0.08, velocity: 0.1, force: 1.0 };
            let of = |records: &[Record]| ranges(("extra_mode", false), at, &Scales::default(), 0, records);
            let (name, least_hz, _) = of(&search.study.train)[0];
            assert_eq!(name, "frequency");
            assert!((least_hz * 20.0 - 2.0).abs() < 0.01, "{least_hz} Hz in 20 s");
        });
    }

    #[test]
    fn the_limit_of_a_saturating_sensor_may_be_its_largest_reading() {
        let at = Scale { displacement: 0.02, reach: 0.04, travel: 0.08, velocity: 0.1, force: 1.0 };
        let scales = Scales { input: [0.5, 1.0], outputs: vec![[0.02, 0.03]], ..Scales::default() };
        let most = |at_sensor: bool| ranges(("saturation", at_sensor), at, &scales, 0, &[])[0].2;
        assert!(most(true) > 1.1 * 0.03, "{}", most(true));
        assert!(most(false) < 1.0 + 1e-9, "a command is known exactly");
    }
}
