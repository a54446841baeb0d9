//! A sensor that spoils what it reads: no machine explains it, and any other machine a little more than the
//! right one.

use rand_distr::{Bernoulli, Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_plant::{Model, Physics, simulate};
use stillbeam_recording::{Recording, Role};

use crate::parameters::free_parameters;
use crate::refit::refit;
use crate::simulation::Hypothesis;
use crate::study::Study;
use crate::{Options, diagnose};

/// Two wheels joined by a belt; a voltage drives one, the speed of the other is read.
fn wheels(stiffness: f64, drag: f64) -> Model {
    let text = format!(
        r#"
        schema = 1
        kind = "lumped"
        body = [{{ name = "driven", mass = 0.05 }}, {{ name = "read", mass = 0.04 }}]
        spring = [{{ between = ["driven", "read"], stiffness = {stiffness:e} }}]
        damper = [
            {{ between = ["driven", "read"], damping = 0.1 }},
            {{ between = ["driven", "ground"], damping = {drag:e} }},
            {{ between = ["read", "ground"], damping = {drag:e} }},
        ]
        input = {{ column = "voltage_V", body = "driven" }}
        output = [{{ column = "speed_counts", body = "read", quantity = "velocity" }}]
        "#
    );
    Model::from_toml("wheels.toml", &text).unwrap()
}

/// Ten seconds at 50 Hz under a voltage that turns at random.
fn run(truth: &Model, size: f64, noise: f64, random: &mut Xoshiro256PlusPlus) -> Recording {
    let turns = Bernoulli::new(0.15).unwrap();
    let mut push = size;
    let mut next = |_| {
        push *= if turns.sample(random) { -1.0 } else { 1.0 };
        push
    };
    let voltage: Vec<f64> = (0..500).map(&mut next).collect();
    let time_s: Vec<f64> = (0..500).map(|k| 0.02 * f64::from(k)).collect();
    let commanded = Recording::new("run", time_s.clone()).with_column("voltage_V", voltage.clone());
    let moved = simulate(truth, &commanded).unwrap();
    let speed = moved.column("speed_counts").unwrap().iter();
    let read = speed.map(|speed| {
        let draw: f64 = StandardNormal.sample(random);
        speed + noise * draw
    });
    let read = read.collect();
    Recording::new("run", time_s).with_column("voltage_V", voltage).with_column("speed_counts", read)
}

/// Runs at three sizes of wheels a little stiffer than drawn, the sign of the speed lost.
fn runs(random: &mut Xoshiro256PlusPlus) -> [Recording; 3] {
    let mut truth = wheels(9.5, 0.3);
    truth.setup_mut().physics = vec![Physics::new("rectification", "sensor").with("share", 1.0)];
    [0.6, 1.0, 1.5].map(|size| run(&truth, size, 0.1, random))
}

#[test]
fn a_machine_far_from_the_drawing_is_not_taken_for_explaining_a_little_more() {
    for seed in [5, 10, 29] {
        let given = wheels(8.6, 0.27);
        let recorded = runs(&mut Xoshiro256PlusPlus::seed_from_u64(seed));
        let mut study = Study::new(&given, &recorded, &recorded).unwrap();
        let given = Hypothesis::given(&given);
        study.weigh_by(&study.on_all(&given, &[], &[]).unwrap());
        let (fitted, _) = refit(&study.stack(Role::Train), &given, &free_parameters(&given)).unwrap();
        let stiffness = fitted.hypothesis.model.parameter("spring.driven-read.stiffness").unwrap();
        assert!(stiffness > 4.3, "{seed}: half of what is drawn and less: {stiffness} N/m");
    }
}

#[test]
fn a_sensor_that_loses_the_sign_of_a_speed_is_named_though_no_machine_explains_half_of_what_it_reads() {
    for seed in 1..=4 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let (train, held_out) = (runs(&mut random), runs(&mut random));
        let given = wheels(8.6, 0.27);
        let found = diagnose(&given, &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
        let named: Vec<&str> = found.effects.iter().map(|effect| effect.id.as_str()).collect();
        assert_eq!(named, ["rectification"], "{seed}: {}", found.sentence);
    }
}
