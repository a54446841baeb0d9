//! Several records at once, the noise model, and the details of the model that are only kept when called for.

use crate::synthetic;

use stillbeam_identify::{
    ForcedOptions, IdentifiedModes, NoiseModel, identify_forced, identify_forced_together,
};
use synthetic::{Mode, Noise, Sweep, clean_sweep, noisy};

const MODES: [Mode; 2] = [
    Mode { frequency_hz: 1.1, damping_ratio: 0.0074, participation: 1.566 },
    Mode { frequency_hz: 6.9, damping_ratio: 0.0059, participation: -0.868 },
];

fn options() -> ForcedOptions {
    ForcedOptions::new("base_position_m", "tip_deflection_m")
}

fn worst_error(
    found: &IdentifiedModes,
    pick: fn(&Mode) -> f64,
    value: fn(&IdentifiedModes, usize) -> f64,
) -> f64 {
    assert_eq!(found.modes.len(), MODES.len(), "{:?}", found.model_choice);
    let errors = MODES.iter().enumerate().map(|(k, truth)| (value(found, k) / pick(truth) - 1.0).abs());
    errors.fold(0.0, f64::max)
}

fn damping_error(found: &IdentifiedModes) -> f64 {
    worst_error(found, |mode| mode.damping_ratio, |found, k| found.modes[k].damping_ratio.value)
}

fn frequency_error(found: &IdentifiedModes) -> f64 {
    worst_error(found, |mode| mode.frequency_hz, |found, k| found.modes[k].frequency_hz.value)
}

#[test]
fn records_fitted_together_share_their_modes_and_keep_their_own_offsets() {
    let mut records = Vec::new();
    for (sweep, offset, seed) in [(Sweep::Linear, 2e-3, 1), (Sweep::Exponential, -5e-3, 2)] {
        let (time_s, clean) = clean_sweep(sweep, &MODES, 1);
        let shifted: Vec<f64> = clean.iter().map(|y| y + offset).collect();
        records.push(noisy(sweep, &time_s, &shifted, 200e-6, seed));
    }
    let alone: Vec<IdentifiedModes> =
        records.iter().map(|record| identify_forced(record, &options()).unwrap()).collect();
    let both = identify_forced_together(&[&records[0], &records[1]], &options()).unwrap();
    assert!(frequency_error(&both) < 1e-4 && damping_error(&both) < 1e-2);
    assert!((both.records[0].offset.value - 2e-3).abs() < 2e-5);
    assert!((both.records[1].offset.value + 5e-3).abs() < 2e-5);
    // Both records' information: the inverse variances add up.
    for k in 0..2 {
        let information = |found: &IdentifiedModes| found.modes[k].damping_ratio.stderr.powi(-2);
        let sum: f64 = alone.iter().map(information).sum();
        let ratio = information(&both) / sum;
        assert!((0.8..1.25).contains(&ratio), "mode {k}: {ratio}");
    }
    assert!(identify_forced_together(&[], &options()).is_err());
}

#[test]
fn a_noise_model_sharpens_the_fit_in_coloured_noise_and_is_left_out_in_white() {
    let (time_s, clean) = clean_sweep(Sweep::Linear, &MODES, 1);
    let mut errors = [0.0; 2];
    for seed in 0..6 {
        // A camera mount that wobbles at 1.1 Hz: the noise is largest where the first mode is.
        let mut noise = Noise(40 + seed);
        let (mut one, mut two) = (0.0, 0.0);
        let wobble = |value: &f64| {
            let angle = std::f64::consts::TAU * 1.6 / 100.0;
            let next = 2.0 * 0.97 * angle.cos() * one - 0.97 * 0.97 * two + 40e-6 * noise.normal();
            (two, one) = (one, next);
            value + next
        };
        let tip: Vec<f64> = clean.iter().map(wobble).collect();
        let record = noisy(Sweep::Linear, &time_s, &tip, 0.0, 1);
        let found = identify_forced(&record, &options().with_modes(2)).unwrap();
        assert!(
            matches!(found.noise, NoiseModel::Autoregressive { order } if order >= 2),
            "{:?}",
            found.noise
        );
        let z = |k: usize| {
            let damping = found.modes[k].damping_ratio;
            (damping.value - MODES[k].damping_ratio) / damping.stderr
        };
        errors = [errors[0] + z(0).powi(2) / 6.0, errors[1] + z(1).powi(2) / 6.0];
    }
    assert!(errors.iter().all(|square| *square < 4.0), "{errors:?}");
    let white = identify_forced(&noisy(Sweep::Linear, &time_s, &clean, 50e-6, 3), &options()).unwrap();
    assert_eq!(white.noise, NoiseModel::White);
}

#[test]
fn a_mode_beyond_the_band_leaves_a_direct_share_and_not_a_spurious_mode() {
    let far = Mode { frequency_hz: 19.3, damping_ratio: 0.01, participation: 0.5 };
    let (time_s, near) = clean_sweep(Sweep::Exponential, &MODES, 1);
    let (_, rest) = clean_sweep(Sweep::Exponential, &[far], 1);
    let tip: Vec<f64> = near.iter().zip(&rest).map(|(a, b)| a + b).collect();
    let record = noisy(Sweep::Exponential, &time_s, &tip, 20e-6, 1);
    let found = identify_forced(&record, &options().with_modes(2)).unwrap();
    assert!(damping_error(&found) < 1e-2 && frequency_error(&found) < 1e-4, "{:?}", found.modes);
    let direct = found.direct.unwrap().value;
    // The mode's response grows from its static one to 1.2 times it at the end of the sweep, 8 Hz.
    let fixed = far.participation / (std::f64::consts::TAU * far.frequency_hz).powi(2);
    assert!((1.0..1.21).contains(&(direct / fixed)), "{direct} for {fixed}");
    // Without such a mode there is none, and the record says how the model was chosen.
    let plain = identify_forced(&noisy(Sweep::Exponential, &time_s, &near, 20e-6, 1), &options()).unwrap();
    assert!(plain.direct.is_none());
    assert!(plain.model_choice.iter().filter(|step| step.kept && step.what.starts_with("mode")).count() == 2);
    assert!(plain.model_choice.iter().any(|step| !step.kept) && !plain.rejected.is_empty());
}

#[test]
fn a_delay_is_kept_only_where_the_record_calls_for_one() {
    let (time_s, clean) = clean_sweep(Sweep::Linear, &MODES, 10);
    let late: Vec<f64> = (0..clean.len()).map(|k| if k < 20 { f64::NAN } else { clean[k - 20] }).collect();
    let allowed = ForcedOptions { max_delay_s: 0.05, ..options() };
    let found = identify_forced(&noisy(Sweep::Linear, &time_s, &late, 50e-6, 1), &allowed).unwrap();
    let delay = found.delay_s.unwrap();
    assert!((delay.value - 0.02).abs() < 4.0 * delay.stderr && delay.stderr < 1e-4, "{delay:?}");
    assert!(frequency_error(&found) < 1e-4 && damping_error(&found) < 1e-2);
    let found = identify_forced(&noisy(Sweep::Linear, &time_s, &clean, 50e-6, 1), &allowed).unwrap();
    assert!(found.delay_s.is_none());
}
