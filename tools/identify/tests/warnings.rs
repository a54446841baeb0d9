//! Warnings that save people: every fault of a record is told, a sound record of the same machine is told
//! nothing, and what is not fitted is listed with its reason.

use crate::synthetic;

use stillbeam_identify::{
    ForcedOptions, FreeDecayOptions, IdentifiedModes, Quantity, Rejected, WarningKind, identify_forced,
    identify_free_decay,
};
use stillbeam_recording::Recording;
use synthetic::{Mode, Noise, Sweep, clean_sweep, noisy, ring_down};

fn mode(frequency_hz: f64, damping_ratio: f64, participation: f64) -> Mode {
    Mode { frequency_hz, damping_ratio, participation }
}

fn forced(record: &Recording) -> IdentifiedModes {
    let options =
        ForcedOptions { cross_checks: false, ..ForcedOptions::new("base_position_m", "tip_deflection_m") };
    identify_forced(record, &options).unwrap()
}

fn free(record: &Recording) -> IdentifiedModes {
    identify_free_decay(record, &FreeDecayOptions::new("tip_deflection_m")).unwrap()
}

/// A linear sweep of one mode with 20 µm of noise.
fn sweep(mode: Mode) -> Recording {
    let (time_s, clean) = clean_sweep(Sweep::Linear, &[mode], 1);
    noisy(Sweep::Linear, &time_s, &clean, 20e-6, 1)
}

/// 30 s of a decay of one mode from 5 mm, 100 Hz, with 20 µm of noise.
fn decay(mode: Mode) -> Recording {
    let mut noise = Noise(4);
    let e: Vec<f64> = (0..3000).map(|_| 20e-6 * noise.normal()).collect();
    ring_down(&[mode], 100.0, 3000, 0.0, |k| e[k])
}

fn told(found: &IdentifiedModes, kind: impl Fn(&WarningKind) -> bool) -> usize {
    found.warnings.iter().filter(|warning| kind(&warning.kind)).count()
}

#[test]
fn a_decay_shorter_than_its_decay_time_is_told() {
    let short = |w: &WarningKind| matches!(w, WarningKind::RecordShorterThanDecay { .. });
    let found = free(&decay(mode(2.0, 0.001, 5e-3)));
    let numbers = |w: &WarningKind| {
        matches!(w, WarningKind::RecordShorterThanDecay { duration_s, decay_time_s, .. }
            if (29.0..30.0).contains(duration_s) && (decay_time_s / 79.6 - 1.0).abs() < 0.05)
    };
    assert_eq!(told(&found, numbers), 1, "{:?}", found.warnings);
    assert_eq!(told(&free(&decay(mode(2.0, 0.01, 5e-3))), short), 0);
}

#[test]
fn a_line_that_the_input_does_not_drive_is_told_to_be_a_tone_and_listed() {
    let mut record = sweep(mode(1.1, 0.01, 1.0));
    let tone = |w: &WarningKind| matches!(w, WarningKind::ToneInRecord { frequency_hz, .. } if (frequency_hz - 17.0).abs() < 0.05);
    assert_eq!(told(&forced(&record), tone), 0);
    for (y, t) in record.columns[1].samples.iter_mut().zip(&record.time_s) {
        *y += 1e-3 * (std::f64::consts::TAU * 17.0 * t).sin();
    }
    let found = forced(&record);
    assert_eq!(told(&found, tone), 1, "{:?}", found.warnings);
    let listed = |entry: &Rejected| {
        matches!(entry, Rejected::Pole { frequency_hz, reason, .. }
            if (frequency_hz - 17.0).abs() < 0.05 && reason.contains("forced tone"))
    };
    assert!(found.rejected.iter().any(listed), "{:?}", found.rejected);
}

/// Too few periods to see a tone by its steadiness, and no decay that could be told from none.
#[test]
fn a_line_of_a_few_periods_that_hardly_decays_is_told_to_look_like_a_tone() {
    let tone = |w: &WarningKind| matches!(w, WarningKind::ForcedTone { .. });
    let mut noise = Noise(5);
    let e: Vec<f64> = (0..300).map(|_| 20e-6 * noise.normal()).collect();
    let of =
        |damping_ratio: f64| free(&ring_down(&[mode(5.3, damping_ratio, 5e-3)], 100.0, 300, 0.0, |k| e[k]));
    let found = of(5e-6);
    assert_eq!(told(&found, tone), 1, "{:?}", found.warnings);
    assert_eq!(told(&of(5e-3), tone), 0);
}

#[test]
fn a_clipped_decay_is_told_and_one_that_is_not_is_not() {
    let clipped = |w: &WarningKind| matches!(w, WarningKind::Clipping { .. });
    let mut record = decay(mode(2.0, 0.01, 5e-3));
    assert_eq!(told(&free(&record), clipped), 0);
    record.columns[0].samples.iter_mut().for_each(|y| *y = y.clamp(-3e-3, 3e-3));
    assert_eq!(told(&free(&record), clipped), 2);
}

#[test]
fn dropped_and_doubled_samples_are_told_and_what_was_empty_is_listed() {
    let whole = sweep(mode(1.1, 0.01, 1.0));
    let missing = |w: &WarningKind| matches!(w, WarningKind::MissingSamples { .. });
    let doubled = |w: &WarningKind| {
        matches!(w, WarningKind::CrowdedSamples { .. } | WarningKind::RepeatedSamples { .. })
    };
    let found = forced(&whole);
    assert_eq!((told(&found, missing), told(&found, doubled)), (0, 0), "{:?}", found.warnings);
    assert!(!found.rejected.iter().any(|entry| matches!(entry, Rejected::Samples { .. })));

    // Rows that never came.
    let mut dropped = whole.clone();
    dropped.time_s.drain(4000..4007);
    dropped.columns.iter_mut().for_each(|column| drop(column.samples.drain(4000..4007)));
    let is_seven = |w: &WarningKind| matches!(w, WarningKind::MissingSamples { count: 7, gaps: 1, at_s, .. } if (at_s - 39.99).abs() < 1e-9);
    assert_eq!(told(&forced(&dropped), is_seven), 1);

    // Cells that are empty: not fitted, and listed.
    let mut empty = whole.clone();
    empty.columns[1].samples[4000..4007].fill(f64::NAN);
    let found = forced(&empty);
    assert_eq!(told(&found, is_seven), 1);
    let listed = |entry: &Rejected| {
        matches!(entry, Rejected::Samples { count: 7, first_s, reason, .. }
            if (first_s - 40.0).abs() < 1e-9 && reason.contains("empty"))
    };
    assert!(found.rejected.iter().any(listed), "{:?}", found.rejected);
    assert_eq!(found.records[0].rows + 7, whole.time_s.len());

    // A row that came twice, a moment later.
    let mut twice = whole.clone();
    twice.time_s.insert(3001, twice.time_s[3000] + 1e-4);
    twice.columns.iter_mut().for_each(|column| column.samples.insert(3001, column.samples[3000]));
    let crowded = |w: &WarningKind| matches!(w, WarningKind::CrowdedSamples { count: 1, at_s, .. } if (at_s - 30.0).abs() < 1e-9);
    assert_eq!(told(&forced(&twice), crowded), 1);

    // A frame delivered again in place of the next one.
    let mut frozen = whole;
    for k in [1500, 3003, 4507] {
        frozen.columns[1].samples[k] = frozen.columns[1].samples[k - 1];
    }
    let found = forced(&frozen);
    let repeated = |w: &WarningKind| matches!(w, WarningKind::RepeatedSamples { .. });
    assert_eq!(told(&found, repeated), 1, "{:?}", found.warnings);
}

#[test]
fn a_mode_that_the_input_does_not_reach_is_told() {
    let outside = |w: &WarningKind| matches!(w, WarningKind::OutsideExcitedBand { mode_hz, upper_hz, .. } if mode_hz > upper_hz && *upper_hz < 9.0);
    let found = forced(&sweep(mode(9.6, 0.02, 1.0)));
    assert!((found.modes[0].frequency_hz.value / 9.6 - 1.0).abs() < 0.02, "{:?}", found.modes);
    assert_eq!(told(&found, outside), 1, "{:?}", found.warnings);
    let any = |w: &WarningKind| matches!(w, WarningKind::OutsideExcitedBand { .. });
    assert_eq!(told(&forced(&sweep(mode(6.9, 0.02, 1.0))), any), 0);
}

#[test]
fn a_damping_at_the_end_of_the_search_is_told() {
    let (time_s, clean) = clean_sweep(Sweep::Linear, &[mode(4.0, 0.0, 1.0)], 1);
    let at_bound =
        |w: &WarningKind| matches!(w, WarningKind::AtBound { quantity: Quantity::DampingRatio, .. });
    let options = ForcedOptions::new("base_position_m", "tip_deflection_m").with_modes(1);
    let undamped = identify_forced(&noisy(Sweep::Linear, &time_s, &clean, 0.0, 1), &options).unwrap();
    assert_eq!(told(&undamped, at_bound), 1, "{:?}", undamped.warnings);
    assert_eq!(told(&forced(&sweep(mode(4.0, 0.001, 1.0))), at_bound), 0);
}
