//! A screw turned at one steady speed after the other, its torque read: friction with a dip, and more of it
//! in one direction.

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_diagnose::{Diagnosis, Options, Verdict, diagnose};
use stillbeam_plant::{Model, Physics, simulate};
use stillbeam_recording::Recording;

/// Rad/s, there and back, none of them in both lists.
const TRAINED: [f64; 10] = [-20.0, -14.0, -8.0, -4.0, -2.0, 2.0, 4.0, 8.0, 14.0, 20.0];
const HELD_OUT: [f64; 6] = [-17.0, -6.0, -3.0, 3.0, 6.0, 17.0];
/// At each of them, and how much of that passes before a torque is read.
const SECONDS: f64 = 3.0;
const SETTLING_S: f64 = 0.8;

fn screw() -> Model {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/screw.toml");
    Model::read(std::path::Path::new(file)).unwrap()
}

fn recorded(truth: &Model, speeds: &[f64], seed: u64) -> Recording {
    let step_s = 0.01;
    let time_s: Vec<f64> =
        (0..(SECONDS * speeds.len() as f64 / step_s) as usize).map(|k| step_s * k as f64).collect();
    let place = |t: f64| ((t / SECONDS) as usize).min(speeds.len() - 1);
    let mut angle = 0.0;
    let mut speed = 0.0;
    let angles = time_s.iter().map(|t| {
        // The motor takes a quarter of a second to a new speed.
        speed += ((speeds[place(*t)] - speed) / 0.25 * step_s * 4.0).clamp(-1.0, 1.0);
        angle += speed * step_s;
        angle
    });
    let driven = Recording::new(format!("run {seed}"), time_s.clone())
        .with_column("motor_angle_rad", angles.collect());
    let mut recording = simulate(truth, &driven).unwrap();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    for column in recording.columns.iter_mut().filter(|column| column.name == "torque_as_twist_rad") {
        for (value, t) in column.samples.iter_mut().zip(&time_s) {
            let draw: f64 = StandardNormal.sample(&mut random);
            let settled = t - SECONDS * place(*t) as f64 > SETTLING_S;
            *value = if settled { *value + 3e-4 * draw } else { f64::NAN };
        }
    }
    recording
}

fn diagnosed(given: &Model, laws: Vec<Physics>) -> Diagnosis {
    let mut truth = given.clone();
    truth.set_parameter("damper.screw-ground.damping", 4e-5).unwrap();
    truth.setup_mut().physics = laws;
    let down: Vec<f64> = TRAINED.iter().rev().copied().collect();
    let train = [recorded(&truth, &TRAINED, 1), recorded(&truth, &down, 2)];
    let held_out = [recorded(&truth, &HELD_OUT, 3)];
    diagnose(given, &train, &held_out, &Options::default(), &mut |_| {}).unwrap()
}

fn names(found: &Diagnosis) -> Vec<&str> {
    let mut names: Vec<&str> = found.effects.iter().map(|effect| effect.id.as_str()).collect();
    names.sort_unstable();
    names
}

fn friction(id: &str) -> Physics {
    Physics::new(id, "screw")
}

/// The first law that explains nearly all, friction that differs by direction, leaves the dip no strength of
/// its own.
#[test]
fn a_dip_beside_a_steady_force_is_not_taken_for_friction_that_differs_by_direction() {
    let dip = friction("stribeck_friction")
        .with("force", 0.0026)
        .with("static_force", 0.0031)
        .with("velocity", 4.0);
    let found = diagnosed(&screw(), vec![dip, friction("constant_force").with("force", -3.5e-4)]);
    assert_eq!(names(&found), ["constant_force", "stribeck_friction"], "{}", found.sentence);
    let dip = found.effects.iter().find(|effect| effect.id == "stribeck_friction").unwrap();
    for (name, truth) in [("force", 0.0026), ("static_force", 0.0031), ("velocity", 4.0)] {
        let value = &dip.parameters[name];
        assert!(
            (value.value - truth).abs() < 4.0 * value.stderr,
            "{name} {} ± {}",
            value.value,
            value.stderr
        );
    }
}

#[test]
fn a_steady_force_shows_in_a_reading_whose_zero_is_known_and_in_no_other() {
    let laws = || {
        vec![
            friction("coulomb_friction").with("force", 0.0028),
            friction("constant_force").with("force", 3e-4),
        ]
    };
    let known = diagnosed(&screw(), laws());
    let is_seen =
        names(&known) == ["asymmetric_friction"] || names(&known) == ["constant_force", "coulomb_friction"];
    assert!(is_seen, "{}", known.sentence);
    let mut unknown = screw();
    unknown.setup_mut().sensors[0].zero_known = false;
    let found = diagnosed(&unknown, laws());
    assert_eq!(names(&found), ["coulomb_friction"], "{}", found.sentence);
    // An offset of the reading may hide any difference of the two forces, and that is said.
    assert_eq!(found.verdict, Verdict::Ambiguous, "{}", found.sentence);
    assert_eq!(found.ties[0].candidates[1], ["asymmetric_friction at screw"], "{}", found.sentence);
}
