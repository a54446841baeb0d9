//! What a command does between its samples, and what a speed sensor reads where nothing moves.

use rand_distr::{Bernoulli, Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_diagnose::{Diagnosis, Options, Verdict, diagnose};
use stillbeam_plant::{Hold, Model, Physics, simulate};
use stillbeam_recording::Recording;

/// A motor under a torque, its speed read.
fn motor(inertia: f64, damping: f64) -> Model {
    let text = format!(
        r#"
        schema = 1
        kind = "lumped"
        body = [{{ name = "rotor", mass = {inertia:e} }}]
        damper = [{{ between = ["rotor", "ground"], damping = {damping:e} }}]
        input = {{ column = "torque_Nm", body = "rotor" }}
        output = [{{ column = "speed_rad_s", body = "rotor", quantity = "velocity" }}]
        "#
    );
    Model::from_toml("motor.toml", &text).unwrap()
}

/// Torques of either sign that turn at random, once in so many samples; the first quarter second nothing.
fn turning(size: f64, samples_each: f64, random: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let turns = Bernoulli::new(1.0 / samples_each).unwrap();
    let mut push = size;
    let mut next = |k: i32| {
        push *= if turns.sample(random) { -1.0 } else { 1.0 };
        if k < 25 { 0.0 } else { push }
    };
    (0..1200).map(&mut next).collect()
}

/// A run at 100 Hz with noise of this size.
fn run(truth: &Model, torque: Vec<f64>, noise: f64, random: &mut Xoshiro256PlusPlus) -> Recording {
    let time_s: Vec<f64> = (0..torque.len()).map(|k| 0.01 * k as f64).collect();
    let commanded = Recording::new("run", time_s.clone()).with_column("torque_Nm", torque.clone());
    let moved = simulate(truth, &commanded).unwrap();
    let speed = moved.column("speed_rad_s").unwrap().iter();
    let read = speed.map(|speed| {
        let draw: f64 = StandardNormal.sample(random);
        speed + noise * draw
    });
    let read = read.collect();
    Recording::new("run", time_s).with_column("torque_Nm", torque).with_column("speed_rad_s", read)
}

fn diagnosed(given: &Model, truth: &Model, size: f64, seed: u64) -> Diagnosis {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut recorded = |times: f64| {
        let torque = turning(times * size, 12.0, &mut random);
        run(truth, torque, 0.1, &mut random)
    };
    let (train, held_out) = ([recorded(1.0), recorded(1.6)], [recorded(1.3)]);
    diagnose(given, &train, &held_out, &Options::default(), &mut |_| {}).unwrap()
}

#[test]
fn a_held_command_is_no_late_law() {
    for (seed, size) in [(1, 0.02), (2, 0.05)] {
        let truth = motor(1.3e-4, 1.2e-3).with_hold(Hold::ZeroOrder);
        let found = diagnosed(&motor(1.2e-4, 1e-3), &truth, size, seed);
        assert!(found.effects.is_empty(), "{}", found.sentence);
        assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
        assert!(
            found.caps.iter().any(|cap| cap.contains("held from one sample to the next")),
            "{:?}",
            found.caps
        );
    }
}

#[test]
fn a_command_that_the_model_says_is_held_is_not_guessed_at() {
    let truth = motor(1.3e-4, 1.2e-3).with_hold(Hold::ZeroOrder);
    let given = motor(1.2e-4, 1e-3).with_hold(Hold::ZeroOrder);
    let found = diagnosed(&given, &truth, 0.03, 3);
    assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
    assert!(!found.caps.iter().any(|cap| cap.contains("held")), "{:?}", found.caps);
}

/// A rotor that never turns back: a constant reading offset and a first speed that is forgotten make up for
/// dry friction.
#[test]
fn dry_friction_of_a_rotor_that_turns_one_way_is_no_offset_of_its_speed() {
    for (seed, friction) in [(4, 0.004), (5, 0.008)] {
        let mut truth = motor(1.3e-4, 1.2e-3);
        truth.setup_mut().physics = vec![Physics::new("coulomb_friction", "rotor").with("force", friction)];
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut recorded = |size: f64| {
            let torque = turning(0.3 * size, 12.0, &mut random);
            let forwards =
                torque.iter().map(|torque| if *torque == 0.0 { 0.0 } else { torque + size }).collect();
            run(&truth, forwards, 0.1, &mut random)
        };
        let (train, held_out) = ([recorded(0.03), recorded(0.06)], [recorded(0.045)]);
        let given = motor(1.2e-4, 1e-3);
        let found = diagnose(&given, &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
        // A dead zone of the drive and a constant force do the same to it.
        let named = found.effects.iter().map(|effect| effect.id.clone());
        let tied = found.ties.iter().flat_map(|tie| tie.candidates.iter().flatten().cloned());
        let all: Vec<String> = named.chain(tied).collect();
        assert!(all.iter().any(|name| name.starts_with("coulomb_friction")), "{all:?}: {}", found.sentence);
    }
}
