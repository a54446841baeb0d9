//! Models without an input: what rings by itself is simulated from its own initial state.

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_diagnose::{Options, Verdict, diagnose};
use stillbeam_plant::Model;
use stillbeam_recording::Recording;

const RING: &str = r#"
    schema = 1
    kind = "modal"
    [[mode]]
    frequency_hz = 6.5
    damping_ratio = 0.005
    participation = [1.0]
    [[output]]
    column = "tip_deflection_m"
    quantity = "position"
    [fixed]
    "mode.1.participation" = true
"#;

/// 20 s of 6.6 Hz with a damping ratio of 0.004 and 10 um of noise, at 100 Hz.
fn decay(amplitude_m: f64, seed: u64) -> Recording {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let omega = TAU * 6.6;
    let time_s: Vec<f64> = (0..2000).map(|k| 0.01 * f64::from(k)).collect();
    let tip = time_s.iter().map(|t| {
        let draw: f64 = StandardNormal.sample(&mut random);
        amplitude_m * (-0.004 * omega * t).exp() * (omega * (1.0 - 0.004_f64.powi(2)).sqrt() * t + 0.4).cos()
            + 1e-5 * draw
    });
    let tip = tip.collect();
    Recording::new(format!("decay {seed}"), time_s).with_column("tip_deflection_m", tip)
}

#[test]
fn a_free_decay_needs_no_input_and_a_wrong_frequency_is_only_refitted() {
    let model = Model::from_toml("ring.toml", RING).unwrap();
    let train = [decay(5e-3, 1), decay(3e-3, 2)];
    let found = diagnose(&model, &train, &[decay(4e-3, 3)], &Options::default(), &mut |_| {}).unwrap();
    assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
    let changed = found.parameter_changes.iter().find(|change| change.path == "mode.1.frequency_hz");
    let refitted = changed.map(|change| (change.to, change.stderr));
    assert!(refitted.is_some_and(|(hz, stderr)| (hz - 6.6).abs() < 4.0 * stderr), "{refitted:?}");
}
