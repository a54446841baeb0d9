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
