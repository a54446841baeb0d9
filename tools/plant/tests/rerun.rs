//! The lean form that fits run thousands of times, against the plain simulation: every law of the catalogue
//! at every place of every kind of model, alone and two at once, over uniform and irregular stamps.

use crate::support;

use std::f64::consts::TAU;

use stillbeam_plant::catalogue::{Candidate, candidates, parameters_of};
use stillbeam_plant::{
    Hold, InitialState, Model, Physics, Rerun, SimulateOptions, StepLengths, force_along, simulate,
    simulate_with,
};
use stillbeam_recording::Recording;

use support::model_texts::{BEAM, LUMPED, MODAL, with};

/// A force on a free base, a setpoint through a servo, a moved base with many modes, modes, and bodies with
/// springs.
fn models() -> Vec<Model> {
    let setpoint = with(BEAM, "column = \"force_N\"", "column = \"setpoint_m\"");
    let moved = with(&with(BEAM, "force_N", "base_position_m"), "modes = 2", "modes = 4");
    let moved =
        with(&moved, "damping_ratio = [0.0074, 0.0059]", "damping_ratio = [0.007, 0.006, 0.006, 0.01]");
    let texts = [BEAM, &setpoint, &moved, MODAL, LUMPED];
    texts.iter().map(|text| Model::from_toml("model.toml", text).unwrap()).collect()
}

fn recording(model: &Model, uniform: bool) -> Recording {
    let time_s: Vec<f64> = (0..1600)
        .map(|k| {
            let k = f64::from(k);
            0.0025 * (k + if uniform { 0.0 } else { 0.2 * (1.7 * k).sin() })
        })
        .collect();
    let column = &model.input().unwrap().column;
    let size = if column.ends_with("_m") { 0.002 } else { 2.0 };
    let input = time_s.iter().map(|t| size * t.min(1.0) * (TAU * (0.6 + 0.7 * t) * t).sin()).collect();
    Recording::new("sweep", time_s).with_column(column.clone(), input)
}

/// The law with all its parameters away from zero.
fn at_work(model: &Model, candidate: &Candidate) -> Physics {
    let location = model.locations()[candidate.location].clone();
    let mut physics = Physics::new(candidate.law.id(), location.clone());
    for (spec, _) in parameters_of(model, candidate.law, &location) {
        let value = match spec.name {
            "delay" | "exposure" | "time_constant" => 0.003,
            "skew" => 1e-3,
            "static_force" => 0.09,
            "limit" => 0.003,
            "rate" => 0.01,
            "mass" | "compliance" | "step" | "gap" | "threshold" => 1e-3,
            _ if spec.default == 0.0 || !spec.default.is_finite() => 0.06,
            _ => spec.default,
        };
        physics = physics.with(spec.name, value.clamp(spec.lower, spec.upper));
    }
    physics
}

/// Sub-steps between which forces are taken anew, in both.
const STEP_S: f64 = 1e-3;

fn compare(model: &Model, recording: &Recording, every: usize) -> bool {
    let hold = model.input().and_then(|input| input.hold).unwrap_or_default();
    let rerun = Rerun::new(recording, model, 1).unwrap().with_hold(hold).thinned(every);
    let steps = StepLengths { short_s: STEP_S, smooth_s: None, halvings: 0 };
    let lean = rerun.outputs(model, Some(steps));
    let options = SimulateOptions { longest_step_s: Some(STEP_S), ..SimulateOptions::default() };
    let Ok(plain) = simulate_with(model, recording, &options) else {
        assert!(lean.is_err());
        return false;
    };
    let columns: Vec<&[f64]> = model
        .output_columns()
        .iter()
        .filter(|column| Some(*column) != model.input().map(|input| &input.column))
        .map(|column| plain.column(column).unwrap())
        .collect();
    if columns.iter().any(|samples| !samples.iter().all(|value| value.is_finite())) {
        return false;
    }
    let lean = lean.unwrap();
    for (plain, lean) in columns.iter().zip(&lean) {
        let largest = plain.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        let plain: Vec<f64> = plain.iter().step_by(every).copied().collect();
        assert_eq!(plain.len(), lean.len());
        for (k, (a, b)) in plain.iter().zip(lean).enumerate() {
            let laws: Vec<&str> = model.setup().physics.iter().map(|law| law.id.as_str()).collect();
            // A reading that is rounded may fall to either side.
            let allowed = if laws.contains(&"quantisation") { 1.1e-3 } else { 1e-7 * largest + 1e-15 };
            assert!((a - b).abs() <= allowed, "{laws:?}, sample {k}: {a} and {b} of {largest}");
        }
    }
    true
}

#[test]
fn a_held_force_is_held_with_and_without_laws() {
    let mut compared = 0;
    for model in models().iter().filter(|model| !model.input_is_motion()) {
        let held = model.with_hold(Hold::ZeroOrder);
        for (uniform, every) in [(true, 1), (true, 7), (false, 1), (false, 4)] {
            let recording = recording(&held, uniform);
            let straight = simulate(model, &recording).unwrap();
            let as_told = simulate(&held, &recording).unwrap();
            assert_ne!(straight.columns, as_told.columns, "half a sample is nothing?");
            assert!(compare(&held, &recording, every));
            let place = model.locations()[0].clone();
            let mut rubbing = held.clone();
            rubbing.setup_mut().physics = vec![Physics::new("coulomb_friction", place).with("force", 0.06)];
            compared += usize::from(rubbing.check().is_ok() && compare(&rubbing, &recording, every));
        }
    }
    assert!(compared > 0);
}

#[test]
fn every_law_at_every_place_as_in_the_plain_simulation() {
    let mut compared = 0;
    for model in models() {
        let recording = recording(&model, true);
        assert!(compare(&model, &recording, 4));
        for candidate in candidates(&model) {
            let mut with_law = model.clone();
            with_law.setup_mut().physics = vec![at_work(&model, &candidate)];
            compared += usize::from(compare(&with_law, &recording, 5));
        }
    }
    assert!(compared > 140, "only {compared} laws at places were simulated");
}

#[test]
fn laws_together_irregular_stamps_and_initial_states() {
    for model in models() {
        let recording = recording(&model, false);
        let candidates = candidates(&model);
        let initial = InitialState { displacement: 1e-3, velocity: -2e-3 };
        let start = match &model {
            Model::Lumped(_) => "load".to_owned(),
            _ => "mode 1".to_owned(),
        };
        for pair in candidates.windows(2).step_by(3) {
            let mut with_laws = model.clone();
            with_laws.setup_mut().physics = pair.iter().map(|law| at_work(&model, law)).collect();
            compare(&with_laws, &recording, 1);
            with_laws.setup_mut().initial.insert(start.clone(), initial);
            compare(&with_laws, &recording, 3);
        }
    }
}

/// A drag along the motion there is without it, by its formula.
#[test]
fn a_force_along_a_motion_is_that_of_its_law() {
    let model = Model::from_toml("model.toml", BEAM).unwrap();
    let recording = recording(&model, true);
    let motion = Rerun::new(&recording, &model, 2).unwrap().motion(&model, None).unwrap().unwrap();
    let law = Physics::new("cable_spring", "base").with("stiffness", 3.0);
    let series = force_along(&model, &law, &motion).unwrap();
    assert_eq!(series.len(), 1);
    let base = &motion.points[series[0].point][0];
    let largest = base.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    for k in 1..base.len() - 1 {
        let mean = 0.25 * (base[k - 1] + 2.0 * base[k] + base[k + 1]);
        assert!((series[0].samples[k] + 3.0 * mean).abs() < 1e-9 * largest);
    }
}

/// What drives may differ from what was recorded, to make up for straight lines between coarse samples; what
/// is read must not.
#[test]
fn an_output_that_shows_the_input_reads_the_true_one_and_others_the_driving_one() {
    let text = with(BEAM, "force_N", "setpoint_m");
    let servo = Model::from_toml("model.toml", &text).unwrap();
    let moved = Model::from_toml("model.toml", &with(BEAM, "force_N", "base_position_m")).unwrap();
    for (model, follows_at_once) in [(moved, true), (servo, false)] {
        let driving = recording(&model, true);
        let column = model.input().unwrap().column.clone();
        let true_input: Vec<f64> = driving.column(&column).unwrap().iter().map(|u| 1.01 * u).collect();
        let plain = Rerun::new(&driving, &model, 1).unwrap();
        let corrected = plain.clone().with_true_input(&true_input);
        let (before, after) =
            (plain.outputs(&model, None).unwrap(), corrected.outputs(&model, None).unwrap());
        let shown = model.output_columns().iter().position(|name| name == "base_position_m").unwrap();
        for (index, (before, after)) in before.iter().zip(&after).enumerate() {
            if index == shown && follows_at_once {
                let error = after.iter().zip(&true_input).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(error < 1e-15, "{error:e}");
            } else if !follows_at_once {
                assert_eq!(before, after, "behind a servo nothing shows the input at once");
            }
        }
    }
}

/// The peaks of a clipped command are flat, however far its true samples are from those that drive.
#[test]
fn an_output_that_shows_a_clipped_input_reads_the_limit() {
    let mut model = Model::from_toml("model.toml", &with(BEAM, "force_N", "base_position_m")).unwrap();
    let driving = recording(&model, true);
    let samples = driving.column("base_position_m").unwrap();
    let limit = 0.5 * samples.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    model.setup_mut().physics = vec![Physics::new("saturation", "drive").with("limit", limit)];
    let true_input: Vec<f64> = samples.iter().map(|u| 1.01 * u).collect();
    let rerun = Rerun::new(&driving, &model, 1).unwrap().with_true_input(&true_input);
    let shown = model.output_columns().iter().position(|name| name == "base_position_m").unwrap();
    let read = &rerun.outputs(&model, None).unwrap()[shown];
    let clipped = true_input.iter().map(|value| value.clamp(-limit, limit));
    let worst = read.iter().zip(clipped).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-15, "{worst:e}");
    assert!(true_input.iter().filter(|value| value.abs() > limit).count() > 10);
}

/// The identity that a diagnosis publishes as a tie, at sliding and at rest: the sine stops at every turn.
#[test]
fn even_friction_with_a_constant_force_is_friction_that_differs_by_direction() {
    let model = Model::from_toml("model.toml", BEAM).unwrap();
    let driven = recording(&model, true);
    let base = |id: &str| Physics::new(id, "base");
    let run = |laws: &[Physics]| {
        let mut model = model.clone();
        model.setup_mut().physics = laws.to_vec();
        Rerun::new(&driven, &model, 1).unwrap().outputs(&model, None).unwrap()
    };
    let (friction, force) = (0.5, 0.2);
    let even =
        run(&[base("coulomb_friction").with("force", friction), base("constant_force").with("force", force)]);
    let uneven = run(&[base("asymmetric_friction")
        .with("force_forward", friction - force)
        .with("force_backward", friction + force)]);
    let without = run(&[]);
    for ((even, uneven), without) in even.iter().zip(&uneven).zip(&without) {
        let apart = |other: &[f64]| even.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        assert!(apart(uneven) < 1e-6 * apart(without), "{:e} of {:e}", apart(uneven), apart(without));
    }
}
