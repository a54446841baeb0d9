//! A machine for tests: two bodies on springs, the first one pushed, both read.

use rand_distr::{Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_plant::{Model, Physics, simulate};
use stillbeam_recording::{Recording, Role};

use crate::effort::Effort;
use crate::fit::{Fitted, fit};
use crate::parameters::free_parameters;
use crate::simulation::Hypothesis;
use crate::study::Study;

/// Noise of both sensors.
pub(crate) const NOISE_M: f64 = 3e-5;

/// The machine with this stiffness between its bodies, and laws.
pub(crate) fn slide(coupling_n_m: f64, laws: &[Physics]) -> Model {
    let text = format!(
        r#"
        schema = 1
        kind = "lumped"
        body = [{{ name = "motor", mass = 35.0 }}, {{ name = "load", mass = 25.0 }}]
        input = {{ column = "force_N", body = "motor" }}
        output = [{{ column = "motor_m", body = "motor" }}, {{ column = "load_m", body = "load" }}]
        spring = [
            {{ between = ["motor", "ground"], stiffness = 10000.0 }},
            {{ between = ["motor", "load"], stiffness = {coupling_n_m:.1} }},
        ]
        damper = [
            {{ between = ["motor", "ground"], damping = 40.0 }},
            {{ between = ["motor", "load"], damping = 15.0 }},
        ]
        "#
    );
    let mut model = Model::from_toml("slide.toml", &text).unwrap();
    model.setup_mut().physics = laws.to_vec();
    model
}

/// A force of 20 s at 100 Hz, from 0.6 to 8.6 Hz.
pub(crate) fn swept(amplitude_n: f64) -> Vec<f64> {
    let sweep = |t: f64| amplitude_n * (std::f64::consts::TAU * (0.6 * t + 0.2 * t * t)).sin();
    (0..2000).map(|k| sweep(0.01 * f64::from(k))).collect()
}

/// What is recorded of it under this force, and one that nobody records; runs of different seeds have
/// different noise.
pub(crate) fn driven(machine: &Model, force_n: &[f64], unrecorded_n: Option<&[f64]>, seed: u64) -> Recording {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let noise = Normal::new(0.0, NOISE_M).unwrap();
    let time_s: Vec<f64> = (0..force_n.len()).map(|k| 0.01 * k as f64).collect();
    let acting = match unrecorded_n {
        Some(unrecorded) => force_n.iter().zip(unrecorded).map(|(one, other)| one + other).collect(),
        None => force_n.to_vec(),
    };
    let name = format!("run {seed}");
    let moved =
        simulate(machine, &Recording::new(&name, time_s.clone()).with_column("force_N", acting)).unwrap();
    let mut recording = Recording::new(name, time_s).with_column("force_N", force_n.to_vec());
    for column in ["motor_m", "load_m"] {
        let read = moved.column(column).unwrap().iter().map(|x| x + noise.sample(&mut random));
        recording = recording.with_column(column, read.collect());
    }
    recording
}

/// Play that a model of the slide is given.
const GIVEN_GAP_M: f64 = 4.8e-4;

/// The slide with play between its bodies.
fn with_play(coupling_n_m: f64, gap_m: f64) -> Model {
    slide(coupling_n_m, &[Physics::new("backlash", "motor-load").with("gap", gap_m)])
}

/// What is recorded of a slide whose play is another one than its model says.
pub(crate) fn played(gap_m: f64) -> Study {
    let truth = with_play(31_000.0, gap_m);
    let train = [(8.0, 5), (16.0, 6)].map(|(amplitude, seed)| driven(&truth, &swept(amplitude), None, seed));
    Study::new(&with_play(30_200.0, GIVEN_GAP_M), &train, &[]).unwrap()
}

/// A fit to it by small differences, which ends in a jag.
pub(crate) fn stuck_in_a_jag(study: &Study) -> Fitted {
    let hypothesis = Hypothesis::given(&with_play(30_200.0, GIVEN_GAP_M));
    let free = free_parameters(&hypothesis);
    let start: Vec<f64> = free.iter().map(|parameter| parameter.given).collect();
    fit(&study.stack(Role::Train), &hypothesis, &free, &start, &[], Effort::FULL).unwrap()
}
