//! An input whose band reaches far up: what it does between its samples is not a straight line.

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stillbeam_diagnose::{Options, Verdict, diagnose};
use stillbeam_plant::Model;
use stillbeam_recording::Recording;

/// As an electronic circuit that is sampled nine times a period.
const CIRCUIT: &str = r#"
    schema = 1
    kind = "modal"
    [input]
    column = "input_V"
    gain = 190000.0
    [[mode]]
    frequency_hz = 69.0
    damping_ratio = 0.045
    participation = [1.0]
    [[output]]
    column = "output_V"
    quantity = "position"
"#;
const RATE_HZ: f64 = 610.0;
const FREQUENCY_HZ: f64 = 68.0;
const DAMPING_RATIO: f64 = 0.05;
const GAIN: f64 = 185_000.0;
const NOISE_V: f64 = 2e-4;

/// Four seconds of a multisine up to 200 Hz, and the steady response to it, in closed form at every line.
fn multisine(amplitude_v: f64, seed: u64) -> Recording {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let lines: Vec<(f64, f64)> = (4..800)
        .map(|line| (TAU * 0.25 * f64::from(line), TAU * (random.next_u64() as f64 / u64::MAX as f64)))
        .collect();
    let size_v = amplitude_v / (lines.len() as f64).sqrt();
    let own = TAU * FREQUENCY_HZ;
    let time_s: Vec<f64> = (0..2440).map(|k| f64::from(k) / RATE_HZ).collect();
    let input =
        time_s.iter().map(|t| lines.iter().map(|(omega, phase)| size_v * (omega * t + phase).cos()).sum());
    let output = time_s.iter().map(|t| {
        let draw: f64 = StandardNormal.sample(&mut random);
        let response = |(omega, phase): &(f64, f64)| {
            let (real, imaginary) = (own * own - omega * omega, 2.0 * DAMPING_RATIO * own * omega);
            let size = GAIN * size_v / real.hypot(imaginary);
            size * (omega * t + phase - imaginary.atan2(real)).cos()
        };
        lines.iter().map(response).sum::<f64>() + NOISE_V * draw
    });
    let (input, output) = (input.collect(), output.collect());
    Recording::new(format!("multisine {seed}"), time_s)
        .with_column("input_V", input)
        .with_column("output_V", output)
}

/// With straight lines between the samples the input at the resonance is 4 % too small and at 200 Hz 30 %,
/// which was named as crosstalk and a delay.
#[test]
fn a_linear_circuit_driven_up_to_a_third_of_the_sampling_rate_is_adequate() {
    let model = Model::from_toml("circuit.toml", CIRCUIT).unwrap();
    let train = [multisine(0.03, 1), multisine(0.06, 2)];
    let found = diagnose(&model, &train, &[multisine(0.05, 3)], &Options::default(), &mut |_| {}).unwrap();
    assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
    let refitted = |path: &str| {
        let change = found.parameter_changes.iter().find(|change| change.path == path);
        change.map(|change| (change.to, change.stderr))
    };
    for (path, truth) in [("mode.1.frequency_hz", FREQUENCY_HZ), ("mode.1.damping_ratio", DAMPING_RATIO)] {
        let found = refitted(path);
        assert!(
            found.is_some_and(|(value, stderr)| (value - truth).abs() < 4.0 * stderr + 1e-3 * truth),
            "{path}: {found:?}"
        );
    }
}
