//! Impact tests: blows of a hammer whose load cell is noisy between them, and taps that are over within
//! milliseconds.

use crate::synthetic;

use std::f64::consts::{PI, TAU};

use stillbeam_identify::{
    ForcedOptions, IdentifiedModes, LinearityVerdict, WarningKind, identify_forced, usual_max_delay_s,
};
use stillbeam_recording::Recording;
use synthetic::Noise;

/// Frequency and damping ratio.
type Pair = [f64; 2];

/// Blows of half a sine at samples, and what modes of equal size answer as accelerations; the force's and the
/// output's noise.
fn blown(modes: &[Pair], rate_hz: f64, samples: usize, blows: &[usize], noise: Pair, seed: u64) -> Recording {
    blown_for(10.0, modes, rate_hz, samples, blows, noise, seed)
}

/// The same with blows that last so many samples, and begin between two where that is no whole number.
fn blown_for(
    lasts: f64,
    modes: &[Pair],
    rate_hz: f64,
    samples: usize,
    blows: &[usize],
    noise: Pair,
    seed: u64,
) -> Recording {
    const FINE: usize = 8;
    let (width, h) = ((lasts * FINE as f64) as usize, 1.0 / (rate_hz * FINE as f64));
    let force = |k: usize| {
        let late = |at: usize| at * FINE + if width % FINE == 0 { 0 } else { at % FINE };
        let into = blows.iter().filter_map(|at| k.checked_sub(late(*at))).find(|into| *into < width);
        into.map_or(0.0, |into| 100.0 * (PI * into as f64 / width as f64).sin().powi(2))
    };
    let mut output = vec![0.0; samples];
    for [hz, zeta] in modes {
        let (w, a) = (TAU * hz, zeta * TAU * hz);
        let damped = w * (1.0 - zeta * zeta).sqrt();
        let [e, c, s] = [(-a * h).exp(), (damped * h).cos(), (damped * h).sin()];
        let (mut q, mut v) = (0.0_f64, 0.0_f64);
        for k in 0..samples * FINE {
            // The force is held in the middle of each fine step: exact for the mode, second order for the
            // pulse.
            let level = 0.5 * (force(k) + force(k + 1)) / (w * w);
            if k % FINE == 0 {
                output[k / FINE] += force(k) - 2.0 * a * v - w * w * q;
            }
            let (x, b) = (q - level, (v + a * (q - level)) / damped);
            q = e * (x * c + b * s) + level;
            v = e * ((b * damped - a * x) * c - (x * damped + a * b) * s);
        }
    }
    let mut chance = Noise(seed);
    let largest = output.iter().fold(0.0_f64, |top, y| top.max(y.abs()));
    let mut measured = |clean: f64, size: f64| clean + size * chance.normal();
    let output = output.iter().map(|y| measured(*y, noise[1] * largest)).collect();
    let force = (0..samples).map(|k| measured(force(k * FINE), noise[0] * 100.0)).collect();
    let time_s = (0..samples).map(|k| k as f64 / rate_hz).collect();
    Recording::new("blows", time_s).with_column("force_N", force).with_column("tip_m_s2", output)
}

fn found(recording: &Recording) -> IdentifiedModes {
    let max_delay_s = usual_max_delay_s(recording);
    let options =
        ForcedOptions { max_delay_s, cross_checks: false, ..ForcedOptions::new("force_N", "tip_m_s2") };
    identify_forced(recording, &options).unwrap()
}

fn are(found: &IdentifiedModes, truth: &[Pair], within: Pair) {
    let modes: Vec<Pair> =
        found.modes.iter().map(|mode| [mode.frequency_hz.value, mode.damping_ratio.value]).collect();
    assert_eq!(modes.len(), truth.len(), "{modes:?} for {truth:?}");
    for (mode, truth) in modes.iter().zip(truth) {
        for ((value, truth), within) in mode.iter().zip(truth).zip(within) {
            assert!((value / truth - 1.0).abs() < within, "{modes:?}");
        }
    }
}

#[test]
fn a_noisy_force_channel_makes_no_modes() {
    let truth = [[14.3, 0.008], [61.0, 0.005]];
    for seed in 0..3 {
        let record = blown(&truth, 512.0, 1536, &[40, 52, 700], [0.01, 0.001], seed);
        are(&found(&record), &truth, [1e-3, 0.03]);
    }
}

#[test]
fn a_tap_at_the_very_beginning_is_fitted_whole_and_its_hammer_is_not_clipped() {
    let truth = [[420.0, 0.03], [950.0, 0.04]];
    let record = blown(&truth, 12_800.0, 4096, &[12], [0.0, 0.01], 5);
    let found = found(&record);
    are(&found, &truth, [3e-3, 0.08]);
    assert!(found.window_s[0] == 0.0, "{:?}", found.window_s);
    let clipped = |kind: &WarningKind| matches!(kind, WarningKind::Clipping { .. });
    assert!(!found.warnings.iter().any(|warning| clipped(&warning.kind)), "{:?}", found.warnings);
}

/// What a force does between its few samples is a guess; nothing of the structure's is said by it.
#[test]
fn a_linear_structure_is_not_called_otherwise_after_blows_of_few_samples() {
    let mut told = 0;
    for (seed, lasts) in (0..).zip([1.4, 1.9, 2.3, 2.8, 3.3, 4.1]) {
        let modes = [[23.0 + 4.0 * seed as f64, 0.006], [131.0, 0.011]];
        let blows = [100, 2203, 4307, 6401];
        let recording = blown_for(lasts, &modes, 1000.0, 8400, &blows, [1e-3, 1e-3], seed);
        let found = found(&recording);
        assert_ne!(found.linearity.verdict, LinearityVerdict::NotLinear, "{lasts}: {:?}", found.linearity);
        let about = |kind: &WarningKind| match kind {
            WarningKind::BlowsOfFewSamples { samples, .. } => (1..6).contains(samples),
            _ => false,
        };
        told += usize::from(found.warnings.iter().any(|warning| about(&warning.kind)));
    }
    assert!(told > 0);
}
