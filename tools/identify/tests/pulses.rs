//! A base that goes there and back and then rests while the structure rings: the quickest excitation there
//! is.

use crate::synthetic;

use stillbeam_identify::{ForcedOptions, IdentifiedModes, WarningKind, identify_forced};
use stillbeam_recording::Recording;
use synthetic::{Mode, Noise, modal_response};

const MODES: [Mode; 2] = [
    Mode { frequency_hz: 1.1, damping_ratio: 0.0071, participation: 1.566 },
    Mode { frequency_hz: 6.9, damping_ratio: 0.0059, participation: -0.868 },
];
/// Duration of either way, s, and its length, m.
const WAY_S: f64 = 0.2;
const WAY_M: f64 = 0.02;

/// Position and acceleration of a quintic there, or back.
fn way(t: f64) -> [f64; 2] {
    let x = (t / WAY_S).clamp(0.0, 1.0);
    let place = x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x);
    let bend = 60.0 * x - 180.0 * x * x + 120.0 * x.powi(3);
    [WAY_M * place, WAY_M * bend / (WAY_S * WAY_S)]
}

/// Half a second of rest, the pulse, and rest until the end.
fn record(duration_s: f64, noise_m: f64, seed: u64) -> Recording {
    let base = |t: f64| {
        let (there, back) = (way(t - 0.5), way(t - 0.5 - WAY_S));
        [there[0] - back[0], there[1] - back[1]]
    };
    let time_s: Vec<f64> = (0..(500.0 * duration_s) as u32).map(|k| f64::from(k) / 500.0).collect();
    let mut noise = Noise(seed);
    let mut tip: Vec<f64> = time_s.iter().map(|_| noise_m * noise.normal()).collect();
    for mode in MODES {
        let q = modal_response(mode, |t| -base(t)[1], &time_s);
        tip.iter_mut().zip(q).for_each(|(tip, q)| *tip += mode.participation * q);
    }
    Recording::new("pulse", time_s.clone())
        .with_column("base_position_m", time_s.iter().map(|t| base(*t)[0]).collect())
        .with_column("tip_deflection_m", tip)
}

fn identify(record: &Recording) -> IdentifiedModes {
    let options = ForcedOptions {
        cross_checks: false,
        max_delay_s: 0.05,
        ..ForcedOptions::new("base_position_m", "tip_deflection_m")
    };
    identify_forced(record, &options).unwrap()
}

/// From three periods of the first mode to more than its decay time.
#[test]
fn both_modes_are_found_after_a_pulse_however_long_the_rest() {
    for duration_s in [3.0, 5.0, 10.0, 20.0, 40.0] {
        for (seed, noise_m) in [(1, 0.0), (2, 20e-6)] {
            let found = identify(&record(duration_s, noise_m, seed));
            assert_eq!(found.modes.len(), 2, "{duration_s} s, {noise_m} m: {:?}", found.model_choice);
            for (mode, truth) in found.modes.iter().zip(&MODES) {
                let f = mode.frequency_hz.value / truth.frequency_hz - 1.0;
                let zeta = mode.damping_ratio.value / truth.damping_ratio - 1.0;
                assert!(f.abs() < 1e-3 && zeta.abs() < 0.1, "{duration_s} s: {f} {zeta}");
            }
            let clipping = |kind: &WarningKind| matches!(kind, WarningKind::Clipping { .. });
            assert!(!found.warnings.iter().any(|w| clipping(&w.kind)), "{:?}", found.warnings);
        }
    }
}
