//! What the classical methods say beside the fit: they start it, they are listed with errors that can be
//! relied on, and they disagree only where the record holds more than the fitted modes and noise.

use crate::synthetic;

use stillbeam_identify::{
    ForcedOptions, FreeDecayOptions, IdentifiedModes, LinearityVerdict, Rejected, WarningKind,
    identify_forced, identify_free_decay,
};
use stillbeam_recording::Recording;
use synthetic::{Mode, Noise, Sweep, clean_sweep, noisy, ring_down};

fn beam() -> [Mode; 2] {
    [
        Mode { frequency_hz: 1.1, damping_ratio: 0.0071, participation: 1.566 },
        Mode { frequency_hz: 6.9, damping_ratio: 0.0059, participation: -0.868 },
    ]
}

fn options() -> ForcedOptions {
    ForcedOptions::new("base_position_m", "tip_deflection_m")
}

fn disagreements(found: &IdentifiedModes) -> Vec<&str> {
    let told = found.warnings.iter().filter(|w| matches!(w.kind, WarningKind::CrossCheckDisagrees { .. }));
    told.map(|warning| warning.message.as_str()).collect()
}

#[test]
fn leakage_of_a_short_sweep_is_no_disagreement_and_the_methods_start_the_fit() {
    for sweep in [Sweep::Linear, Sweep::Exponential] {
        let (time_s, clean) = clean_sweep(sweep, &beam(), 1);
        for seed in 0..4 {
            let found = identify_forced(&noisy(sweep, &time_s, &clean, 50e-6, seed), &options()).unwrap();
            assert!(disagreements(&found).is_empty(), "{sweep:?} {seed}: {:?}", disagreements(&found));
            for mode in &found.modes {
                let method = |name: &str| {
                    let check = mode.cross_checks.iter().find(|check| check.method == name);
                    check.and_then(|check| check.damping_ratio)
                };
                // Leakage doubles or halves what a windowed transform of the whole record says of the
                // damping.
                let leaking = method("complex_frequency").or(method("complex_exponential")).unwrap();
                assert!((leaking.value / mode.damping_ratio.value - 1.0).abs() > 0.2, "{leaking:?}");
                assert!(leaking.stderr > 0.2 * mode.damping_ratio.value, "{leaking:?}");
                let local = method("local_rational").unwrap();
                assert!((local.value / mode.damping_ratio.value - 1.0).abs() < 0.05, "{local:?}");
            }
            let started =
                found.model_choice.iter().filter(|step| step.kept && step.what.starts_with("mode "));
            assert!(started.clone().all(|step| step.what.contains("started from")));
            assert!(started.clone().any(|step| !step.what.contains("a scan")), "{:?}", found.model_choice);
            let frf = found.frf.as_ref().unwrap();
            for curve in [&frf.h2.real, &frf.hv.imag, &frf.coherence, &frf.input_density, &frf.output_density]
            {
                assert_eq!(curve.len(), frf.frequency_hz.len());
            }
            let reasons = found.rejected.iter().filter_map(|entry| match entry {
                Rejected::Pole { reason, .. } => Some(reason.as_str()),
                Rejected::Samples { .. } => None,
            });
            assert!(reasons.clone().any(|reason| reason.contains("orders")), "{:?}", found.rejected);
        }
    }
}

/// Without noise standard errors are those of rounding, and methods that agree to nine digits are many of
/// them apart.
#[test]
fn without_noise_digits_that_no_record_shows_are_no_disagreement() {
    for sweep in [Sweep::Linear, Sweep::Exponential] {
        for input_per_frame in [1, 5] {
            let (time_s, clean) = clean_sweep(sweep, &beam(), input_per_frame);
            let found = identify_forced(&noisy(sweep, &time_s, &clean, 0.0, 1), &options()).unwrap();
            assert_eq!(found.modes.len(), 2);
            assert!(disagreements(&found).is_empty(), "{sweep:?}: {:?}", disagreements(&found));
        }
    }
    let modes = beam().map(|mode| Mode { participation: 2e-3, ..mode });
    let record = ring_down(&modes, 100.0, 4000, 0.0, |_| 0.0);
    let found = identify_free_decay(&record, &FreeDecayOptions::new("tip_deflection_m")).unwrap();
    assert!(disagreements(&found).is_empty(), "{:?}", disagreements(&found));
}

/// The local rational method sees a mode that moves in the record's second half as two; the fit sees one.
#[test]
fn a_mode_that_moves_makes_the_methods_disagree() {
    let [_, second] = beam();
    let moved = Mode { frequency_hz: 1.105, ..beam()[0] };
    let (time_s, before) = clean_sweep(Sweep::Exponential, &beam(), 1);
    let (_, after) = clean_sweep(Sweep::Exponential, &[moved, second], 1);
    let middle = time_s.partition_point(|t| *t < 55.0);
    let mixed: Vec<f64> = before[..middle].iter().chain(&after[middle..]).copied().collect();
    let found =
        identify_forced(&noisy(Sweep::Exponential, &time_s, &mixed, 50e-6, 1), &options().with_modes(2))
            .unwrap();
    assert!(!disagreements(&found).is_empty(), "{:?}", found.modes);
    assert_eq!(found.linearity.verdict, LinearityVerdict::NotConstant, "{:?}", found.linearity);
    assert!(found.modes.iter().all(|mode| mode.amplitude_changes.is_empty()), "{:?}", found.modes);
}

#[test]
fn a_decay_is_seen_by_its_methods_too_and_they_agree_with_the_fit() {
    let modes = [
        Mode { frequency_hz: 1.1, damping_ratio: 0.01, participation: 5e-3 },
        Mode { frequency_hz: 6.9, damping_ratio: 0.006, participation: 2e-3 },
    ];
    for seed in 0..6 {
        let mut noise = Noise(40 + seed);
        let e: Vec<f64> = (0..4000).map(|_| 50e-6 * noise.normal()).collect();
        let record = ring_down(&modes, 100.0, 4000, 0.0, |k| e[k]);
        let found = identify_free_decay(&record, &FreeDecayOptions::new("tip_deflection_m")).unwrap();
        assert!(disagreements(&found).is_empty(), "{seed}: {:?}", disagreements(&found));
        for mode in &found.modes {
            for name in ["complex_exponential", "eigensystem_realisation", "logarithmic_decrement"] {
                assert!(mode.cross_checks.iter().any(|check| check.method == name), "{name}: {mode:?}");
            }
        }
    }
}

/// A knock whose first tenth of a second is not a free decay, and a short, weak mode that only the
/// realisation finds.
#[test]
fn a_knock_that_drowns_the_mode_at_first_is_read_from_where_modes_explain_it() {
    let rate_hz = 3200.0;
    for seed in 0..4 {
        let mut noise = Noise(70 + seed);
        let time_s: Vec<f64> = (0..6000).map(|k| f64::from(k) / rate_hz).collect();
        let tau = std::f64::consts::TAU;
        let belt = |t: f64| 3000.0 * (-0.01 * tau * 110.0 * t).exp() * (tau * 110.0 * t).sin();
        let values: Vec<f64> = time_s
            .iter()
            .map(|t| {
                // The finger: a burst of noise that fades within 20 ms and is no mode.
                let t = t - 0.3;
                let burst = if t > 0.0 { 60e3 * (-t / 0.008).exp() * noise.normal() } else { 0.0 };
                burst + if t > 0.0 { belt(t) } else { 0.0 } + 200.0 * noise.normal()
            })
            .collect();
        let record = Recording::new("knock", time_s).with_column("acceleration_mm_s2", values);
        let found = identify_free_decay(&record, &FreeDecayOptions::new("acceleration_mm_s2")).unwrap();
        let strongest = found.modes.iter().max_by(|a, b| a.energy().total_cmp(&b.energy())).unwrap();
        let (hz, zeta) = (strongest.frequency_hz.value, strongest.damping_ratio.value);
        assert!(
            (hz / 110.0 - 1.0).abs() < 0.01 && (zeta / 0.01 - 1.0).abs() < 0.3,
            "{seed}: {:?}",
            found.modes
        );
        assert!(found.window_s[0] > 0.31, "{:?}", found.window_s);
    }
}

#[test]
fn candidates_that_are_not_taken_are_listed_with_the_reason() {
    let modes =
        [1.1, 6.9, 19.0].map(|frequency_hz| Mode { frequency_hz, damping_ratio: 0.006, participation: 2e-3 });
    let mut noise = Noise(3);
    let e: Vec<f64> = (0..4000).map(|_| 20e-6 * noise.normal()).collect();
    let record = ring_down(&modes, 100.0, 4000, 0.0, |k| e[k]);
    let one = FreeDecayOptions::new("tip_deflection_m").with_modes(1);
    let found = identify_free_decay(&record, &one).unwrap();
    for wanted in [6.9, 19.0] {
        let listed = found.rejected.iter().any(|entry| {
            matches!(entry, Rejected::Pole { frequency_hz, reason, .. }
                if (frequency_hz / wanted - 1.0).abs() < 0.01 && reason.contains("lowest 1"))
        });
        assert!(listed, "{wanted}: {:?}", found.rejected);
    }
}
