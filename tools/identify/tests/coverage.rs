//! Standard errors mean what they say: over many noise realisations the errors, divided by the claimed
//! standard errors, scatter like a standard normal variable.

use crate::synthetic;

use stillbeam_identify::{Estimate, ForcedOptions, FreeDecayOptions, identify_forced, identify_free_decay};
use stillbeam_recording::Recording;
use synthetic::{Mode, Noise, Sweep, clean_sweep, ring_down};

/// Noise with the autocorrelation rho^lag and the given standard deviation.
fn coloured(seed: u64, n: usize, rho: f64, deviation: f64) -> Vec<f64> {
    let mut noise = Noise(seed);
    let mut value = noise.normal();
    (0..n)
        .map(|_| {
            value = rho * value + (1.0 - rho * rho).sqrt() * noise.normal();
            deviation * value
        })
        .collect()
}

/// Checks root mean square and 95 % coverage of normalised errors.
///
/// With 64 seeds a right claim gives 1.00 +- 0.09 and 95 +- 2.7 %; errors claimed twice too small give 2.0
/// and 67 %, twice too large 0.5: the bounds lie four standard deviations from the former and shut out the
/// latter.
fn check(name: &str, errors: &[f64]) {
    let n = errors.len() as f64;
    let rms = (errors.iter().map(|z| z * z).sum::<f64>() / n).sqrt();
    let covered = errors.iter().filter(|z| z.abs() < 1.96).count() as f64 / n;
    println!("{name}: {n} seeds, rms of error/stderr {rms:.3}, within 1.96 stderr {:.1} %", 100.0 * covered);
    assert!((0.75..1.35).contains(&rms), "{name}: rms {rms:.3}");
    assert!((0.84..=1.0).contains(&covered), "{name}: coverage {covered:.3}");
}

fn error(estimate: Estimate, truth: f64) -> f64 {
    (estimate.value - truth) / estimate.stderr
}

fn sweep_errors(sweep: Sweep, rho: f64, seeds: u64) {
    let modes = [
        Mode { frequency_hz: 1.1, damping_ratio: 0.0074, participation: 1.566 },
        Mode { frequency_hz: 6.9, damping_ratio: 0.0059, participation: -0.868 },
    ];
    let (time_s, clean) = clean_sweep(sweep, &modes, 1);
    let base: Vec<f64> = time_s.iter().map(|t| sweep.position(*t)).collect();
    let mut errors = vec![Vec::new(); 6];
    for seed in 0..seeds {
        let noise = coloured(1000 + seed, clean.len(), rho, 100e-6);
        let tip = clean.iter().zip(noise).map(|(y, e)| y + e).collect();
        let record = Recording::new("sweep", time_s.clone())
            .with_column("base_position_m", base.clone())
            .with_column("tip_deflection_m", tip);
        let options = ForcedOptions {
            cross_checks: false,
            ..ForcedOptions::new("base_position_m", "tip_deflection_m").with_modes(2)
        };
        let found = identify_forced(&record, &options).unwrap();
        for (index, (mode, truth)) in found.modes.iter().zip(&modes).enumerate() {
            errors[3 * index].push(error(mode.frequency_hz, truth.frequency_hz));
            errors[3 * index + 1].push(error(mode.damping_ratio, truth.damping_ratio));
            errors[3 * index + 2].push(error(mode.participation.unwrap(), truth.participation));
        }
    }
    let names = ["f1", "zeta1", "participation1", "f2", "zeta2", "participation2"];
    for (name, errors) in names.iter().zip(&errors) {
        check(&format!("{sweep:?} rho {rho} {name}"), errors);
    }
}

#[test]
fn intervals_of_a_sweep_hold_in_white_noise() {
    sweep_errors(Sweep::Exponential, 0.0, 64);
}

#[test]
fn intervals_of_a_sweep_hold_in_coloured_noise() {
    // Eleven times the power of white noise at 1.1 Hz: standard errors for white noise would be 3.6 times too
    // small.
    sweep_errors(Sweep::Linear, 0.9, 64);
}

#[test]
fn intervals_of_a_free_decay_hold_in_white_and_coloured_noise() {
    let modes = [
        Mode { frequency_hz: 1.1, damping_ratio: 0.01, participation: 5e-3 },
        Mode { frequency_hz: 6.9, damping_ratio: 0.006, participation: 2e-3 },
    ];
    for rho in [0.0, 0.8] {
        let mut errors = vec![Vec::new(); 6];
        for seed in 0..64 {
            let noise = coloured(5000 + seed, 4000, rho, 100e-6);
            let record = ring_down(&modes, 100.0, 4000, 0.0, |k| noise[k]);
            let options = FreeDecayOptions {
                start_s: Some(0.0),
                cross_checks: false,
                ..FreeDecayOptions::new("tip_deflection_m").with_modes(2)
            };
            let found = identify_free_decay(&record, &options).unwrap();
            for (index, (mode, truth)) in found.modes.iter().zip(&modes).enumerate() {
                errors[3 * index].push(error(mode.frequency_hz, truth.frequency_hz));
                errors[3 * index + 1].push(error(mode.damping_ratio, truth.damping_ratio));
                errors[3 * index + 2].push(error(mode.amplitude, truth.participation));
            }
        }
        let names = ["f1", "zeta1", "amplitude1", "f2", "zeta2", "amplitude2"];
        for (name, errors) in names.iter().zip(&errors) {
            check(&format!("decay rho {rho} {name}"), errors);
        }
    }
}
