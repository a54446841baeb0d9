//! Models whose natural frequencies are wrong by tens of per cent: parameters, not missing physics.

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_diagnose::{Options, Progress, Verdict, diagnose};
use stillbeam_plant::{Model, simulate};
use stillbeam_recording::Recording;

/// A slider on a spring, and a load on a spring beside it, in kg, N/m and N s/m.
fn machine(mass: [f64; 2], stiffness: [f64; 2], damping: [f64; 2]) -> Model {
    let text = format!(
        r#"
        schema = 1
        kind = "lumped"
        body = [{{ name = "slider", mass = {:e} }}, {{ name = "load", mass = {:e} }}]
        spring = [{{ between = ["slider", "ground"], stiffness = {:e} }}, {{ between = ["load", "slider"], stiffness = {:e} }}]
        damper = [{{ between = ["slider", "ground"], damping = {:e} }}, {{ between = ["load", "slider"], damping = {:e} }}]
        input = {{ column = "force_N", body = "slider" }}
        output = [
            {{ column = "slider_position_m", body = "slider", quantity = "position" }},
            {{ column = "load_position_m", body = "load", quantity = "position" }},
        ]
        "#,
        mass[0], mass[1], stiffness[0], stiffness[1], damping[0], damping[1]
    );
    Model::from_toml("machine.toml", &text).unwrap()
}

/// A sweep at 200 Hz through both modes, with noise of half a per cent of each output's root mean square.
fn sweep(truth: &Model, band_hz: [f64; 2], random: &mut Xoshiro256PlusPlus) -> Recording {
    recorded(truth, band_hz, |rms| 0.005 * rms, random)
}

/// The same with noise by the root mean square of an output.
fn recorded(
    truth: &Model,
    [from_hz, to_hz]: [f64; 2],
    noise: impl Fn(f64) -> f64,
    random: &mut Xoshiro256PlusPlus,
) -> Recording {
    let time_s: Vec<f64> = (0..5000).map(|k| 0.005 * f64::from(k)).collect();
    let growth = (to_hz / from_hz).ln() / 25.0;
    let force = time_s.iter().map(|t| 3.0 * (TAU * from_hz * ((growth * t).exp() - 1.0) / growth).sin());
    let force: Vec<f64> = force.collect();
    let commanded = Recording::new("sweep", time_s.clone()).with_column("force_N", force.clone());
    let moved = simulate(truth, &commanded).unwrap();
    let mut read = Recording::new("sweep", time_s).with_column("force_N", force);
    for column in ["slider_position_m", "load_position_m"] {
        let samples = moved.column(column).unwrap();
        let rms = (samples.iter().map(|x| x * x).sum::<f64>() / samples.len() as f64).sqrt();
        let mut noisy = |x: &f64| {
            let draw: f64 = StandardNormal.sample(random);
            x + noise(rms) * draw
        };
        read = read.with_column(column, samples.iter().map(&mut noisy).collect());
    }
    read
}

#[test]
fn frequencies_that_are_wrong_by_tens_of_per_cent_are_refitted() {
    let mass = [1.1, 0.5];
    let stiffness = [900.0, 2600.0];
    let damping = [0.25, 0.3];
    let truth = machine(mass, stiffness, damping);
    for (seed, heavier, stiffer) in
        [(1, [0.75, 0.8], [1.3, 1.25]), (2, [1.3, 1.2], [0.72, 0.8]), (3, [1.25, 0.8], [0.7, 1.3])]
    {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let times = |values: [f64; 2], factors: [f64; 2]| [0, 1].map(|k| values[k] * factors[k]);
        let given = machine(times(mass, heavier), times(stiffness, stiffer), damping);
        let (train, held_out) = (
            [sweep(&truth, [1.0, 22.0], &mut random), sweep(&truth, [22.0, 1.0], &mut random)],
            [sweep(&truth, [1.5, 18.0], &mut random)],
        );
        let found = diagnose(&given, &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
        assert_eq!(found.verdict, Verdict::Adequate, "{seed}: {}", found.sentence);
        for change in &found.parameter_changes {
            let right = truth.parameter(&change.path).unwrap();
            assert!((change.to / right - 1.0).abs() < 0.02, "{seed}: {change:?} instead of {right}");
        }
    }
}

#[test]
fn a_mode_that_only_the_held_out_recording_shows_is_refitted_before_any_law_is_looked_for() {
    let (mass, stiffness, damping) = ([1.1, 0.5], [900.0, 2600.0], [0.25, 0.3]);
    let truth = machine(mass, stiffness, damping);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(4);
    let given = machine([1.15, 0.5], [950.0, 2350.0], [0.3, 0.35]);
    let mut run = |band_hz: [f64; 2]| recorded(&truth, band_hz, |_| 1e-4, &mut random);
    let train = [run([0.8, 4.0]), run([4.5, 1.0])];
    let held_out = [run([1.0, 22.0])];
    let mut steps: Vec<String> = Vec::new();
    let mut say = |progress: &Progress| steps.push(progress.step.clone());
    let found = diagnose(&given, &train, &held_out, &Options::default(), &mut say).unwrap();
    assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
    assert!(found.caps.iter().any(|cap| cap.contains("held-out ones too")), "{:?}", found.caps);
    let first = |words: &str| steps.iter().position(|step| step.contains(words)).unwrap();
    assert!(first("held-out recordings too") < first("catalogue of physics"), "{steps:?}");
    assert!(!steps.iter().any(|step| step.contains("explains the rest beside")), "{steps:?}");
}
