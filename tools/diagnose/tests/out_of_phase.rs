//! Recordings with which no linear model stays in step.

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_diagnose::{Diagnosis, Options, Verdict, diagnose};
use stillbeam_plant::{Model, Physics, simulate};
use stillbeam_recording::Recording;

/// An arm on a bearing that nothing drives: 1.3 Hz at small angles.
fn arm(inertia: f64, damping: f64) -> Model {
    let text = format!(
        r#"
        schema = 1
        kind = "lumped"
        body = [{{ name = "arm", mass = {inertia:e} }}]
        spring = [{{ between = ["arm", "ground"], stiffness = 0.2 }}]
        damper = [{{ between = ["arm", "ground"], damping = {damping:e} }}]
        output = [{{ column = "angle_rad", body = "arm", quantity = "position" }}]
        "#
    );
    Model::from_toml("arm.toml", &text).unwrap()
}

/// Its swing from an angle, read with this noise at 100 Hz for 25 s.
fn swing(truth: &Model, angle_rad: f64, noise_rad: f64, random: &mut Xoshiro256PlusPlus) -> Recording {
    // Simulation asks for an input: none is there, so none is pushed.
    let driven = truth.to_toml().unwrap() + "\n[initial.arm]\ndisplacement = " + &format!("{angle_rad:e}\n");
    let driven =
        driven.replacen("schema = 1", "schema = 1\ninput = { column = \"none_N_m\", body = \"arm\" }", 1);
    let driven = Model::from_toml("arm.toml", &driven).unwrap();
    let time_s: Vec<f64> = (0..2500).map(|k| 0.01 * f64::from(k)).collect();
    let unpushed = Recording::new("swing", time_s.clone()).with_column("none_N_m", vec![0.0; time_s.len()]);
    let moved = simulate(&driven, &unpushed).unwrap();
    let read = moved.column("angle_rad").unwrap().iter().map(|angle| {
        let draw: f64 = StandardNormal.sample(random);
        angle + noise_rad * draw
    });
    Recording::new("swing", time_s).with_column("angle_rad", read.collect())
}

fn diagnosed(law: Option<Physics>, angle_rad: f64, seed: u64) -> Diagnosis {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut truth = arm(3.1e-3, 2.2e-4);
    truth.setup_mut().physics.extend(law);
    let mut recorded = |times: f64| swing(&truth, times * angle_rad, 1e-3, &mut random);
    let (train, held_out) = ([recorded(1.0), recorded(0.5)], [recorded(0.8)]);
    diagnose(&arm(2.9e-3, 3e-4), &train, &held_out, &Options::default(), &mut |_| {}).unwrap()
}

fn named(found: &Diagnosis) -> Vec<&str> {
    found.effects.iter().map(|effect| effect.id.as_str()).collect()
}

#[test]
fn what_makes_an_arm_swing_slower_the_wider_it_swings_is_named() {
    for (seed, angle_rad) in [(1, 1.2), (2, 1.9)] {
        let found = diagnosed(Some(Physics::new("pendulum", "arm").with("stiffness", 0.2)), angle_rad, seed);
        assert_eq!(named(&found), ["pendulum"], "{}", found.sentence);
        let stiffness = &found.effects[0].parameters["stiffness"];
        // A free arm does not show its inertia, which stays as given: 2.9 in place of 3.1 g m².
        let told = 0.2 * 2.9 / 3.1;
        assert!((stiffness.value / told - 1.0).abs() < 0.01, "{} N m/rad", stiffness.value);
    }
}

#[test]
fn a_linear_arm_of_another_inertia_lacks_nothing() {
    for seed in 4..7 {
        let found = diagnosed(None, 1.5, seed);
        assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
    }
}

/// What goes with the amplitude of an arm's swing, each large enough that a linear model loses step.
fn bending_laws() -> [Physics; 4] {
    [
        Physics::new("cubic_stiffness", "arm").with("stiffness", 0.25),
        Physics::new("cubic_stiffness", "arm").with("stiffness", -0.2),
        Physics::new("pendulum", "arm").with("stiffness", 0.2),
        Physics::new("quadratic_drag", "arm").with("drag", 2e-4),
    ]
}

#[test]
fn a_model_that_has_the_law_explains_every_decay_as_given() {
    for (seed, law) in (10..).zip(bending_laws()) {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut truth = arm(3.1e-3, 2.2e-4);
        truth.setup_mut().physics.push(law);
        let mut recorded = |angle_rad: f64| swing(&truth, angle_rad, 1e-4, &mut random);
        let (train, held_out) = ([recorded(0.6), recorded(0.3)], [recorded(0.45)]);
        let found = diagnose(&truth, &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
        assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
        for pooled in &found.fit.pooled {
            assert!(pooled.fits.given.rms < 1.1e-4, "{}: {}", pooled.output, pooled.fits.given.rms);
        }
    }
}

#[test]
fn a_spring_that_hardens_is_not_taken_for_gravity_where_noise_tells_them_apart() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(20);
    let mut truth = arm(3.1e-3, 2.2e-4);
    truth.setup_mut().physics.push(bending_laws()[0].clone());
    let mut recorded = |angle_rad: f64| swing(&truth, angle_rad, 5e-5, &mut random);
    let (train, held_out) = ([recorded(0.6), recorded(0.3)], [recorded(0.45)]);
    let found = diagnose(&arm(2.9e-3, 3e-4), &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
    assert_eq!(named(&found), ["cubic_stiffness"], "{}", found.sentence);
    assert_eq!(found.verdict, Verdict::Explained, "{}", found.sentence);
}

/// A mass on a spring, pushed through its resonance.
fn mass(mass_kg: f64, stiffness_n_m: f64, damping: f64) -> Model {
    let text = format!(
        r#"
        schema = 1
        kind = "lumped"
        body = [{{ name = "mass", mass = {mass_kg:e} }}]
        spring = [{{ between = ["mass", "ground"], stiffness = {stiffness_n_m:e} }}]
        damper = [{{ between = ["mass", "ground"], damping = {damping:e} }}]
        input = {{ column = "force_N", body = "mass" }}
        output = [{{ column = "position_m", body = "mass" }}]
        "#
    );
    Model::from_toml("mass.toml", &text).unwrap()
}

/// Its response to a sweep from 1 to 6 Hz in 25 s at 200 Hz.
fn pushed(truth: &Model, force_n: f64, noise_m: f64, random: &mut Xoshiro256PlusPlus) -> Recording {
    let time_s: Vec<f64> = (0..5000).map(|k| 0.005 * f64::from(k)).collect();
    let rate = 6.0_f64.ln() / 25.0;
    let force =
        time_s.iter().map(|t| force_n * (std::f64::consts::TAU * ((rate * t).exp() - 1.0) / rate).sin());
    let pushed = Recording::new("sweep", time_s.clone()).with_column("force_N", force.collect());
    let moved = simulate(truth, &pushed).unwrap();
    let read = moved.column("position_m").unwrap().iter().map(|position| {
        let draw: f64 = StandardNormal.sample(random);
        position + noise_m * draw
    });
    let read = read.collect();
    pushed.with_column("position_m", read)
}

#[test]
fn a_spring_that_bends_a_resonance_beyond_recognition_is_found_where_something_drives_it() {
    for (seed, share) in [(30, 0.5), (31, -0.18)] {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        // About 3 Hz; at 20 mm the cubic spring has this share of the linear one's force.
        let mut truth = mass(10.0, 3600.0, 9.0);
        let stiffness = share * 3600.0 / 0.02_f64.powi(2);
        truth.setup_mut().physics.push(Physics::new("cubic_stiffness", "mass").with("stiffness", stiffness));
        let mut recorded = |force_n: f64| pushed(&truth, force_n, 1e-4, &mut random);
        let (train, held_out) = ([recorded(4.0), recorded(2.0)], [recorded(3.0)]);
        let given = mass(11.0, 3300.0, 12.0);
        let found = diagnose(&given, &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
        assert_eq!(named(&found), ["cubic_stiffness"], "{}", found.sentence);
        let told = &found.effects[0].parameters["stiffness"];
        assert!((told.value / stiffness - 1.0).abs() < 0.02, "{} of {stiffness}", told.value);
    }
}
