//! Models that have the right modes and show too much or too little of them: a mass on a spring in place of a
//! strip, or without the bodies that hang on it. The machine is linear, and no law of it is missing.

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_diagnose::{Diagnosis, Options, RecordRole, Verdict, diagnose};
use stillbeam_plant::{Model, Physics, simulate};
use stillbeam_recording::Recording;

const TRUE_STRIP: &str = r#"
    schema = 1
    kind = "beam_on_base"
    input = { column = "base_position_m" }
    output = [{ column = "tip_deflection_m" }]
    [beam]
    length_m = 0.6
    width_m = 0.03
    thickness_m = 0.0012
    density_kg_m3 = 7850.0
    young_Pa = 2.0e11
    modes = 3
    damping_ratio = [0.004, 0.005, 0.006]
    [base]
    mass_kg = 2.0
    viscous_N_s_m = 8.0
"#;

/// A mass on a spring that is moved, of which the share of the only mode is one.
const MASS_ON_A_SPRING: &str = r#"
    schema = 1
    kind = "lumped"
    body = [{ name = "carriage", mass = 1.0 }, { name = "tip", mass = 0.05 }]
    spring = [{ between = ["tip", "carriage"], stiffness = 13.0 }]
    damper = [{ between = ["tip", "carriage"], damping = 0.005 }]
    input = { column = "base_position_m", body = "carriage", quantity = "position" }
    output = [{ column = "tip_position_m", body = "tip", quantity = "position" }]
"#;

/// Three bodies in a row under a force, the last one left out by whoever made the model.
fn chain(bodies: usize, stiffer: f64) -> Model {
    let text = format!(
        r#"
        schema = 1
        kind = "lumped"
        body = [{{ name = "slider", mass = 2.0 }}, {{ name = "load", mass = {:e} }}{}]
        spring = [{{ between = ["slider", "ground"], stiffness = {:e} }}, {{ between = ["load", "slider"], stiffness = 1500.0 }}{}]
        damper = [{{ between = ["slider", "ground"], damping = 0.6 }}, {{ between = ["load", "slider"], damping = 0.5 }}{}]
        input = {{ column = "force_N", body = "slider" }}
        output = [
            {{ column = "slider_position_m", body = "slider", quantity = "position" }},
            {{ column = "load_position_m", body = "load", quantity = "position" }},
        ]
        "#,
        if bodies == 3 { 1.0 } else { 1.2 },
        if bodies == 3 { r#", { name = "cable", mass = 0.2 }"# } else { "" },
        900.0 * stiffer,
        if bodies == 3 { r#", { between = ["cable", "load"], stiffness = 4500.0 }"# } else { "" },
        if bodies == 3 { r#", { between = ["cable", "load"], damping = 0.4 }"# } else { "" },
    );
    Model::from_toml("chain.toml", &text).unwrap()
}

/// An exponential sweep at 200 Hz between two frequencies, of this size at all of them.
fn sweep(column: &str, [from_hz, to_hz]: [f64; 2], size: f64) -> Recording {
    let time_s: Vec<f64> = (0..6000).map(|k| 0.005 * f64::from(k)).collect();
    let growth = (to_hz / from_hz).ln() / 30.0;
    let at =
        |t: &f64| size * (t / 2.0).min(1.0) * (TAU * from_hz * ((growth * t).exp() - 1.0) / growth).sin();
    let samples = time_s.iter().map(at).collect();
    Recording::new("sweep", time_s).with_column(column, samples)
}

/// A sensor's reading with noise of this size.
fn read(samples: impl Iterator<Item = f64>, noise: f64, random: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let reading = samples.map(|x| {
        let draw: f64 = StandardNormal.sample(random);
        x + noise * draw
    });
    reading.collect()
}

/// The tip of a strip in space, as a camera beside the machine sees it.
fn strip(truth: &Model, band_hz: [f64; 2], size_m: f64, seed: u64) -> Recording {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let base = sweep("base_position_m", band_hz, size_m);
    let moved = simulate(truth, &base).unwrap();
    let deflection = moved.column("tip_deflection_m").unwrap();
    let position = deflection.iter().zip(&base.columns[0].samples).map(|(tip, base)| tip + base);
    let position = read(position, 2e-5, &mut random);
    base.with_column("tip_position_m", position)
}

fn pushed(truth: &Model, band_hz: [f64; 2], size_n: f64, seed: u64) -> Recording {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let force = sweep("force_N", band_hz, size_n);
    let moved = simulate(truth, &force).unwrap();
    ["slider_position_m", "load_position_m"].into_iter().fold(force, |recording, column| {
        let samples = read(moved.column(column).unwrap().iter().copied(), 3e-5, &mut random);
        recording.with_column(column, samples)
    })
}

fn diagnosed(given: &Model, runs: [Recording; 3]) -> Diagnosis {
    let [first, second, held_out] = runs;
    diagnose(given, &[first, second], &[held_out], &Options::default(), &mut |_| {}).unwrap()
}

fn held_out_rms(found: &Diagnosis) -> f64 {
    let held_out = found.fit.pooled.iter().filter(|fit| fit.role == RecordRole::HeldOut);
    held_out.map(|fit| fit.fits.refitted_linear.rms).fold(0.0, f64::max)
}

#[test]
fn a_mass_on_a_spring_in_place_of_a_strip_misses_no_law() {
    let truth = Model::from_toml("strip.toml", TRUE_STRIP).unwrap();
    let given = Model::from_toml("mass.toml", MASS_ON_A_SPRING).unwrap();
    let runs = [
        strip(&truth, [0.5, 6.0], 1e-3, 1),
        strip(&truth, [6.0, 0.5], 2e-3, 2),
        strip(&truth, [0.7, 5.0], 1.5e-3, 3),
    ];
    let found = diagnosed(&given, runs);
    assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
    assert!(found.effects.is_empty(), "{}", found.sentence);
    assert!(found.caps.iter().any(|cap| cap.contains("another share of its modes")), "{:?}", found.caps);
    assert!(held_out_rms(&found) < 2.2e-5, "{}", held_out_rms(&found));
    let damping = found.parameter_changes.iter().find(|change| change.path.ends_with("damping")).unwrap();
    // As the first mode of the strip: 2 z sqrt(k m).
    let stiffness = found.parameter_changes.iter().find(|change| change.path.ends_with("stiffness")).unwrap();
    let ratio = damping.to / (2.0 * (stiffness.to * 0.05).sqrt());
    assert!((ratio / 0.004 - 1.0).abs() < 0.05, "{ratio}");
}

#[test]
fn a_body_that_was_left_out_is_no_law() {
    let (truth, given) = (chain(3, 1.0), chain(2, 1.15));
    let runs = [
        pushed(&truth, [0.8, 12.0], 2.0, 4),
        pushed(&truth, [12.0, 0.8], 4.0, 5),
        pushed(&truth, [1.0, 10.0], 3.0, 6),
    ];
    let found = diagnosed(&given, runs);
    assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
    assert!(found.effects.is_empty(), "{}", found.sentence);
}

#[test]
fn the_shares_of_modes_do_not_make_up_for_dry_friction() {
    let given = chain(2, 1.1);
    let friction = Physics::new("coulomb_friction", "slider").with("force", 0.3);
    let mut truth = chain(3, 1.0);
    truth.setup_mut().physics = vec![friction];
    let runs = [
        pushed(&truth, [0.8, 12.0], 2.0, 7),
        pushed(&truth, [12.0, 0.8], 4.0, 8),
        pushed(&truth, [1.0, 10.0], 3.0, 9),
    ];
    let found = diagnosed(&given, runs);
    assert_ne!(found.verdict, Verdict::Adequate, "{}", found.sentence);
}
