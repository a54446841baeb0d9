//! Free decays of known modes.

use crate::synthetic;

use std::f64::consts::TAU;

use stillbeam_identify::{
    FreeDecayOptions, IdentifiedModes, Quantity, Rejected, Warning, WarningKind, identify_free_decay,
};
use stillbeam_recording::Recording;
use synthetic::{Mode, Noise, ring_down};

fn mode(frequency_hz: f64, damping_ratio: f64, participation: f64) -> Mode {
    Mode { frequency_hz, damping_ratio, participation }
}

fn options() -> FreeDecayOptions {
    FreeDecayOptions::new("tip_deflection_m")
}

fn noise(seed: u64, samples: usize, deviation: f64) -> Vec<f64> {
    let mut noise = Noise(seed);
    (0..samples).map(|_| deviation * noise.normal()).collect()
}

fn check(found: &IdentifiedModes, truth: &[Mode], f_tolerance: f64, zeta_tolerance: f64) {
    assert_eq!(found.modes.len(), truth.len(), "{:?}", found.modes);
    for (found, truth) in found.modes.iter().zip(truth) {
        let f = found.frequency_hz.value / truth.frequency_hz - 1.0;
        let zeta = found.damping_ratio.value / truth.damping_ratio - 1.0;
        assert!(f.abs() < f_tolerance && zeta.abs() < zeta_tolerance, "{truth:?}: {found:?}");
    }
}

#[test]
fn a_grid_of_decays_comes_back_with_no_warnings_of_change() {
    for frequency_hz in [0.7, 1.1, 6.9, 20.0] {
        for damping in [0.0033, 0.0074, 0.05, 0.2] {
            let truth = [mode(frequency_hz, damping, 5e-3)];
            // Until it has decayed by 60 dB, at most.
            let seconds = (6.9 / (damping * TAU * frequency_hz)).clamp(1.0, 60.0);
            let samples = ((seconds * 100.0) as usize).max(200);
            let e = noise(samples as u64, samples, 5e-6);
            let record = ring_down(&truth, 100.0, samples, 1e-3, |k| e[k]);
            let found = identify_free_decay(&record, &options()).unwrap();
            check(&found, &truth, 1e-3, 1e-2);

            assert!((found.offset.value - 1e-3).abs() < 5e-6);
            let changes = |w: &WarningKind| matches!(w, WarningKind::ChangesDuringDecay { .. });
            assert!(!found.warnings.iter().any(|w| changes(&w.kind)), "{:?}", found.warnings);
        }
    }
}

#[test]
fn several_modes_are_told_apart_and_counted() {
    let truth =
        [mode(1.1, 0.01, 5e-3), mode(6.9, 0.006, 1e-3), mode(8.1, 0.006, 5e-4), mode(31.0, 0.004, 2e-4)];
    let e = noise(1, 6000, 10e-6);
    let record = ring_down(&truth, 200.0, 6000, 0.0, |k| e[k]);
    check(&identify_free_decay(&record, &options()).unwrap(), &truth, 2e-3, 0.1);
    // With a number given, the most energetic ones.
    let two = identify_free_decay(&record, &options().with_modes(2)).unwrap();
    check(&two, &truth[..2], 1e-3, 2e-2);
}

#[test]
fn the_logarithmic_decrement_agrees_where_the_decay_is_linear() {
    for seed in 0..10 {
        let truth = [mode(1.1, 0.01, 5e-3), mode(6.9, 0.006, 2e-3)];
        let e = noise(seed, 4000, 20e-6);
        let record = ring_down(&truth, 100.0, 4000, 0.0, |k| e[k]);
        let found = identify_free_decay(&record, &options()).unwrap();
        for mode in &found.modes {
            let check =
                mode.cross_checks.iter().find(|check| check.method == "logarithmic_decrement").unwrap();
            let damping = check.damping_ratio.unwrap();
            assert!((damping.value / mode.damping_ratio.value - 1.0).abs() < 0.1, "{mode:?}");
        }
        let disagrees = |w: &WarningKind| matches!(w, WarningKind::CrossCheckDisagrees { .. });
        assert!(!found.warnings.iter().any(|w| disagrees(&w.kind)), "{:?}", found.warnings);
    }
}

/// A decay at 5 Hz with its own course of amplitude and phase.
fn odd_decay(amplitude: impl Fn(f64) -> f64, phase: impl Fn(f64) -> f64) -> Vec<(Quantity, f64, f64)> {
    let time_s: Vec<f64> = (0..8000).map(|k| f64::from(k) / 200.0).collect();
    let e = noise(3, time_s.len(), 1e-6);
    let tip = time_s.iter().zip(&e).map(|(t, e)| amplitude(*t) * phase(*t).cos() + e).collect();
    let record = Recording::new("odd", time_s).with_column("tip_deflection_m", tip);
    let found = identify_free_decay(&record, &options().with_modes(1)).unwrap();
    let change = |warning: Warning| match warning.kind {
        WarningKind::ChangesDuringDecay { quantity, early, late, .. } => Some((quantity, early, late)),
        _ => None,
    };
    found.warnings.into_iter().filter_map(change).collect()
}

#[test]
fn dry_friction_in_a_decay_is_reported_as_damping_that_rises() {
    let (decay, friction) = (0.05, 5e-5);
    let amplitude = |t: f64| ((5e-3 + friction / decay) * (-decay * t).exp() - friction / decay).max(0.0);
    let changes = odd_decay(amplitude, |t| TAU * 5.0 * t);
    let rises =
        |(quantity, early, late): &(Quantity, f64, f64)| *quantity == Quantity::DampingRatio && late > early;
    assert!(changes.iter().any(rises), "{changes:?}");
}

#[test]
fn a_drifting_frequency_in_a_decay_is_reported() {
    let changes = odd_decay(|t| 5e-3 * (-0.15 * t).exp(), |t| TAU * 5.0 * (t + 2e-4 * t * t));
    let rises = |(quantity, early, late): &(Quantity, f64, f64)| {
        // 5 Hz (1 + 4e-4 t): about 5 s into the record, and 33 s, in the last third of the fall.
        *quantity == Quantity::FrequencyHz && (5.0..5.03).contains(early) && (5.05..5.07).contains(late)
    };
    assert!(changes.iter().any(rises), "{changes:?}");
}

#[test]
fn a_tone_that_does_not_decay_is_called_one() {
    let truth = [mode(1.1, 0.02, 5e-3), mode(12.0, 0.0, 1e-3)];
    let e = noise(1, 4000, 10e-6);
    let record = ring_down(&truth, 100.0, 4000, 0.0, |k| e[k]);
    let found = identify_free_decay(&record, &options()).unwrap();
    let tone = |w: &WarningKind| matches!(w, WarningKind::ToneInRecord { frequency_hz, .. } if (frequency_hz - 12.0).abs() < 0.01);
    assert!(found.warnings.iter().any(|w| tone(&w.kind)), "{:?} {:?}", found.modes, found.warnings);
    check(&found, &truth[..1], 1e-4, 1e-2);
    let listed = |entry: &Rejected| matches!(entry, Rejected::Pole { frequency_hz, .. } if (frequency_hz - 12.0).abs() < 0.01);
    assert!(found.rejected.iter().any(listed), "{:?}", found.rejected);
}

#[test]
fn backbone_and_damping_curve_follow_amplitude_in_a_decay_and_are_flat_in_a_linear_one() {
    // Amplitude a obeys a' = -(c0 + c1 a) a, phase' = omega (1 + k a²): both in closed form, a(0) = 5 mm.
    let (c0, c1, k, start, omega) = (0.1, 60.0, 400.0, 5e-3, TAU * 8.0);
    let amplitude = |t: f64| {
        let fallen = start * (-c0 * t).exp();
        fallen / (1.0 + c1 / c0 * (start - fallen))
    };
    let time_s: Vec<f64> = (0..8000).map(|k| f64::from(k) / 200.0).collect();
    let e = noise(8, time_s.len(), 1e-6);
    let mut phase = 0.0;
    let bent: Vec<f64> = time_s
        .iter()
        .zip(&e)
        .map(|(t, e)| {
            let value = amplitude(*t) * f64::cos(phase) + e;
            phase += omega * (1.0 + k * amplitude(t + 0.0025).powi(2)) / 200.0;
            value
        })
        .collect();
    let record = Recording::new("bent", time_s.clone()).with_column("tip_deflection_m", bent);
    let found = identify_free_decay(&record, &options().with_modes(1)).unwrap();
    let mode = &found.modes[0];
    assert!(mode.by_amplitude.len() >= 5, "{:?}", mode.by_amplitude);
    for point in &mode.by_amplitude {
        let a = point.amplitude;
        let frequency_hz = 8.0 * (1.0 + k * a * a);
        let damping = (c0 + c1 * a) / (TAU * frequency_hz);
        assert!((point.frequency_hz.value / frequency_hz - 1.0).abs() < 1e-3, "{point:?}: {frequency_hz}");
        assert!((point.damping_ratio.value / damping - 1.0).abs() < 0.1, "{point:?}: {damping}");
    }
    assert_eq!(mode.amplitude_changes.len(), 2, "{:?}", mode.amplitude_changes);
    let [low, high] = mode.uncertainty_box.damping_ratio;
    assert!(low < 0.0022 && high > 0.0045, "{low} {high}");

    let e = noise(9, 8000, 1e-6);
    let straight = ring_down(&[mode_of_8_hz()], 200.0, 8000, 0.0, |k| e[k]);
    let found = identify_free_decay(&straight, &options()).unwrap();
    assert!(found.modes[0].amplitude_changes.is_empty() && found.modes[0].by_amplitude.len() >= 5);
}

fn mode_of_8_hz() -> Mode {
    mode(8.0, 0.003, 5e-3)
}

#[test]
fn the_rest_before_the_release_is_left_out() {
    let truth = [mode(2.0, 0.01, 5e-3)];
    let e = noise(6, 5000, 10e-6);
    let decay = ring_down(&truth, 100.0, 4000, 0.0, |_| 0.0);
    let mut tip = vec![0.0; 1000];
    tip.extend(&decay.columns[0].samples);
    tip.iter_mut().zip(&e).for_each(|(y, e)| *y += e);
    let time_s = (0..5000).map(|k| 0.01 * f64::from(k)).collect();
    let record = Recording::new("late", time_s).with_column("tip_deflection_m", tip);
    let found = identify_free_decay(&record, &options()).unwrap();
    assert!((found.window_s[0] - 10.0).abs() < 0.02, "{:?}", found.window_s);
    check(&found, &truth, 1e-4, 1e-2);
}

#[test]
fn missing_samples_and_uneven_stamps_are_fitted_where_they_are() {
    let truth = [mode(1.1, 0.01, 5e-3), mode(6.9, 0.006, 2e-3)];
    let e = noise(2, 4000, 20e-6);
    let mut record = ring_down(&truth, 100.0, 4000, 0.0, |k| e[k]);
    for k in (0..4000).filter(|k| k % 5 == 3 || (1000..1040).contains(k)) {
        record.columns[0].samples[k] = f64::NAN;
    }
    check(&identify_free_decay(&record, &options()).unwrap(), &truth, 1e-4, 1e-2);
}
