//! Sweeps that keep the amplitude of the acceleration of the base: its position falls with the square of the
//! frequency, and what it excites does not.

use crate::synthetic;

use std::f64::consts::TAU;

use stillbeam_identify::{ForcedOptions, identify_forced};
use stillbeam_recording::Recording;
use synthetic::{Mode, Noise, modal_response};

#[test]
fn a_sweep_of_constant_acceleration_shows_the_high_mode_without_noise() {
    for (modes, seed) in [([1.7611, 11.0366], 1), ([0.9, 7.3], 2), ([2.2, 14.1], 3)] {
        let record = constant_acceleration(modes, seed);
        for asked in [None, Some(2)] {
            let options =
                ForcedOptions { modes: asked, ..ForcedOptions::new("setpoint_m", "tip_deflection_m") };
            let found = identify_forced(&record, &options).unwrap();
            let hz: Vec<f64> = found.modes.iter().map(|mode| mode.frequency_hz.value).collect();
            assert_eq!(hz.len(), 2, "{hz:?}");
            assert!(
                hz.iter().zip(modes).all(|(f, truth)| (f / truth - 1.0).abs() < 1e-4),
                "{hz:?} {modes:?}"
            );
        }
    }
}

/// An exponential sweep of a base's position whose acceleration keeps its amplitude, 0.5 Hz to 16 Hz in 60 s.
fn constant_acceleration(modes_hz: [f64; 2], seed: u64) -> Recording {
    let growth = 32.0_f64.ln() / 60.0;
    let rise = |t: f64| if t < 1.0 { 0.5 - 0.5 * (std::f64::consts::PI * t).cos() } else { 1.0 };
    let position = |t: f64| {
        let w = TAU * 0.5 * (growth * t).exp();
        -0.1 / (w * w) * ((w - TAU * 0.5) / growth).sin() * rise(t)
    };
    let h = 1e-4;
    let drive = |t: f64| -(position(t + h) - 2.0 * position(t) + position(t - h)) / (h * h);
    let time_s: Vec<f64> = (0..12_000).map(|k| h + f64::from(k) * 0.005).collect();
    let mut noise = Noise(seed);
    let parts = modes_hz.map(|frequency_hz| {
        let damping_ratio = 0.003 + 0.004 * noise.even();
        modal_response(Mode { frequency_hz, damping_ratio, participation: 1.0 }, drive, &time_s)
    });
    let tip = parts[0].iter().zip(&parts[1]).map(|(a, b)| 1.5 * a - 0.9 * b).collect();
    let base = time_s.iter().map(|t| position(*t)).collect();
    Recording::new("sweep", time_s).with_column("setpoint_m", base).with_column("tip_deflection_m", tip)
}
