//! Structures that are held aside and let go.

use crate::synthetic;

use std::f64::consts::TAU;

use stillbeam_identify::{FreeDecayOptions, identify_free_decay};
use stillbeam_recording::Recording;
use synthetic::kinds::between;
use synthetic::{Mode, Noise};

const ROWS: usize = 6000;
const RATE_HZ: f64 = 400.0;

/// Held for longer than it rings, and then let go: the mode that dies first is heard at the beginning alone.
#[test]
fn all_modes_of_a_structure_that_is_held_and_let_go_are_found() {
    for seed in 0..12_u64 {
        let mut noise = Noise(13 * seed + 5);
        let first_hz = between(&mut noise, 4.0, 12.0);
        let mode = |frequency_hz, damping_ratio| Mode { frequency_hz, damping_ratio, participation: 1.0 };
        let modes = [mode(first_hz, 0.002), mode(first_hz * between(&mut noise, 2.2, 3.4), 0.02)];
        let held_s = between(&mut noise, 0.5, 2.5);
        let value = |t: f64| -> f64 {
            let since = (t - held_s).max(0.0);
            modes
                .iter()
                .map(|mode| {
                    let w = TAU * mode.frequency_hz;
                    (-mode.damping_ratio * w * since).exp() * (w * since).cos()
                })
                .sum()
        };
        let time_s: Vec<f64> = (0..ROWS).map(|k| k as f64 / RATE_HZ).collect();
        let tip = time_s.iter().map(|t| value(*t) + 2.8e-2 * noise.normal()).collect();
        let record = Recording::new("let go", time_s).with_column("tip_deflection_m", tip);
        let options = FreeDecayOptions { cross_checks: false, ..FreeDecayOptions::new("tip_deflection_m") };
        let found = identify_free_decay(&record, &options).unwrap();
        assert_eq!(found.modes.len(), 2, "{seed}: {:?}", found.modes);
        for (own, truth) in found.modes.iter().zip(modes) {
            assert!((own.frequency_hz.value / truth.frequency_hz - 1.0).abs() < 2e-3, "{seed}: {own:?}");
            assert!((own.damping_ratio.value / truth.damping_ratio - 1.0).abs() < 0.05, "{seed}: {own:?}");
        }
    }
}
