//! Free decays as people have them: close modes, wild samples, dead and overdriven sensors, several knocks;
//! and what is claimed of amplitude.

use crate::synthetic;

use std::f64::consts::TAU;

use stillbeam_identify::{
    FreeDecayOptions, IdentifiedModes, IdentifyError, LinearityVerdict, RecordKind, WarningKind,
    identify_free_decay,
};
use stillbeam_recording::Recording;
use synthetic::decays::{Course, LINEAR, close_pair, decay_of};
use synthetic::kinds::record;
use synthetic::{Mode, Noise, ring_down};

fn options(column: &str) -> FreeDecayOptions {
    FreeDecayOptions { cross_checks: false, ..FreeDecayOptions::new(column) }
}

fn is_right(found: &IdentifiedModes, truth: &[Mode]) -> bool {
    found.modes.len() == truth.len()
        && found.modes.iter().zip(truth).all(|(found, truth)| {
            (found.frequency_hz.value / truth.frequency_hz - 1.0).abs() < 2e-3
                && (found.damping_ratio.value / truth.damping_ratio - 1.0).abs() < 0.15
        })
}

#[test]
fn two_close_modes_are_two() {
    let apart = [0.0075, 0.01, 0.015, 0.02, 0.03, 0.06];
    let (mut right, mut tones) = (0, 0);
    for share in apart {
        for seed in 0..12 {
            let (record, truth) = close_pair(seed, share);
            match identify_free_decay(&record, &options("tip_deflection_m")) {
                Ok(found) => {
                    let good = is_right(&found, &truth);
                    right += usize::from(good);
                    if !good {
                        let modes: Vec<(f64, f64)> = found
                            .modes
                            .iter()
                            .map(|m| (m.frequency_hz.value, m.damping_ratio.value))
                            .collect();
                        println!("{share} {seed}: {modes:?} for {truth:?}");
                    }
                    let is_tone = |kind: &WarningKind| matches!(kind, WarningKind::ToneInRecord { .. });
                    tones += found.warnings.iter().filter(|warning| is_tone(&warning.kind)).count();
                }
                Err(refusal) => println!("{share} {seed}: {refusal}"),
            }
        }
    }
    println!("{right} of 72 right, {tones} beats called tones");
    assert!(right >= 69 && tones == 0, "{right} of 72 right, {tones} beats called tones");
}

#[test]
fn a_number_of_modes_that_was_asked_for_is_fitted() {
    for seed in 0..6 {
        let (record, truth) = close_pair(seed, 0.01);
        let found = identify_free_decay(&record, &options("tip_deflection_m").with_modes(2)).unwrap();
        assert!(is_right(&found, &truth), "{seed}: {:?} {truth:?}", found.modes);
    }
}

#[test]
fn several_outputs_of_a_decay_give_the_shapes_of_its_modes() {
    for seed in 0..10 {
        let mut noise = Noise(seed + 40);
        let first_hz = 3.0 + 9.0 * noise.even();
        let mode = |frequency_hz: f64| Mode { frequency_hz, damping_ratio: 0.01, participation: 1.0 };
        let truth = [mode(first_hz), mode(1.03 * first_hz)];
        // The shares of three outputs in either mode; the first output hears both.
        let shares: [[f64; 2]; 3] = [[1.0, 0.8], [0.6, -0.9], [-1.4, 0.2]];
        let mut outputs = shares.iter().map(|shares| {
            let modes: Vec<Mode> = truth
                .iter()
                .zip(shares)
                .map(|(mode, share)| Mode { participation: *share, ..*mode })
                .collect();
            let errors: Vec<f64> = (0..4000).map(|_| 0.005 * noise.normal()).collect();
            ring_down(&modes, 200.0, 4000, 0.1, |k| errors[k])
        });
        let mut record = outputs.next().unwrap();
        for (name, other) in ["second_m", "third_m"].into_iter().zip(outputs) {
            record = record.with_column(name, other.columns[0].samples.clone());
        }
        let also = vec!["second_m".to_owned(), "third_m".to_owned()];
        let found =
            identify_free_decay(&record, &FreeDecayOptions { also, ..options("tip_deflection_m") }).unwrap();
        assert!(is_right(&found, &truth), "{seed}: {:?} {truth:?}", found.modes);
        for (mode, shape) in found.shapes.iter().enumerate() {
            assert_eq!(shape.frequency_hz, found.modes[mode].frequency_hz.value);
            for (part, share) in shape.parts.iter().zip(shares) {
                let ratio = shape.parts[0].real / shares[0][mode];
                let apart = (part.real / ratio - share[mode]).hypot(part.imag / ratio);
                assert!(apart < 0.02, "{seed} {}: {apart}", part.output);
            }
        }
        assert_eq!(found.shapes.len(), 2);
    }
}

fn is_bent(record: &Recording) -> Option<bool> {
    let found = identify_free_decay(record, &options("tip_m")).ok()?;
    Some(found.linearity.verdict == LinearityVerdict::NotLinear)
}

#[test]
fn a_linear_decay_is_not_called_bent() {
    let linear: Vec<Option<bool>> = (0..300).map(|seed| is_bent(&decay_of(&LINEAR, seed).0)).collect();
    let false_claims = linear.iter().filter(|one| **one == Some(true)).count();
    let refused = linear.iter().filter(|one| one.is_none()).count();
    println!("linear: {false_claims} of 300 called bent, {refused} refused");
    assert!(false_claims <= 1 && refused == 0, "{false_claims} false, {refused} refused");
}

#[test]
fn a_bent_decay_is_called_bent() {
    let real = [
        ("dry friction", Course { dry: 0.1, ..LINEAR }, 45),
        ("drag", Course { drag: 2.0, ..LINEAR }, 45),
        ("softening", Course { softening: 0.03, ..LINEAR }, 45),
    ];
    let mut missed = Vec::new();
    for (name, course, least) in real {
        let found = (0..50).filter(|seed| is_bent(&decay_of(&course, *seed).0) == Some(true)).count();
        println!("{name}: {found} of 50 found");
        if found < least {
            missed.push((name, found));
        }
    }
    assert!(missed.is_empty(), "{missed:?}");
}

/// A decay of one mode with noise, 2000 rows at 200 Hz, and its truth.
fn one_mode(seed: u64) -> (Recording, [Mode; 1]) {
    let mut noise = Noise(seed + 900);
    let truth = [Mode {
        frequency_hz: 5.0 + 7.0 * noise.even(),
        damping_ratio: 0.006 + 0.01 * noise.even(),
        participation: 1.0,
    }];
    let e: Vec<f64> = (0..2000).map(|_| 0.005 * noise.normal()).collect();
    (ring_down(&truth, 200.0, 2000, 0.3, |k| e[k]), truth)
}

#[test]
fn wild_samples_are_named_and_do_not_move_the_start() {
    for seed in 0..20 {
        let (mut record, truth) = one_mode(seed);
        let mut noise = Noise(seed);
        let rows: Vec<usize> = (0..1 + seed as usize % 3).map(|_| (1990.0 * noise.even()) as usize).collect();
        for row in &rows {
            record.columns[0].samples[*row] += 12.0;
        }
        let found = identify_free_decay(&record, &options("tip_deflection_m")).unwrap();
        assert!(is_right(&found, &truth), "{seed}: {:?} {truth:?}", found.modes);
        let named = found.warnings.iter().find_map(|warning| match &warning.kind {
            WarningKind::WildSamples { samples, .. } => Some(samples.len()),
            _ => None,
        });
        let mut distinct = rows.clone();
        distinct.sort_unstable();
        distinct.dedup();
        assert_eq!(named, Some(distinct.len()), "{seed}: {:?}", found.warnings);
        assert!(found.window_s[0] < 0.3, "{:?}", found.window_s);
    }
}

/// Spikes no higher than the swing that they fall on, within the decay and after it.
#[test]
fn spikes_within_the_swing_neither_move_the_start_nor_hide_modes() {
    for seed in 0..12 {
        let mut noise = Noise(seed + 4000);
        let lowest_hz = 5.0 + 7.0 * noise.even();
        let ratios = [1.0, 2.0 + noise.even(), 3.6 + noise.even()];
        let truth: Vec<Mode> = ratios
            .iter()
            .map(|ratio| Mode {
                frequency_hz: ratio * lowest_hz,
                damping_ratio: 0.003 + 0.005 * noise.even(),
                participation: [1.0, 0.6, 0.4][(*ratio / 1.8) as usize],
            })
            .collect();
        let e: Vec<f64> = (0..4000).map(|_| 0.01 * noise.normal()).collect();
        let mut record = ring_down(&truth, 500.0, 4000, 0.0, |k| e[k]);
        for index in 0..4 + 2 * seed as usize {
            let row = (3900.0 * noise.even()) as usize;
            let sign = if noise.even() < 0.5 { -1.0 } else { 1.0 };
            record.columns[0].samples[row + 60] += sign * (0.6 + 2.0 * noise.even() + 0.01 * index as f64);
        }
        let found = identify_free_decay(&record, &options("tip_deflection_m")).unwrap();
        assert!(is_right(&found, &truth), "{seed}: {:?} {truth:?} {:?}", found.modes, found.window_s);
        assert!(found.window_s[0] < 0.3 && found.window_s[1] > 4.0, "{seed}: {:?}", found.window_s);
    }
}

#[test]
fn a_sensor_that_dies_is_told_and_what_came_before_is_fitted() {
    for seed in 0..20 {
        let (mut record, truth) = one_mode(seed);
        let at = 300 + 60 * seed as usize;
        let level = record.columns[0].samples[at];
        record.columns[0].samples[at..].fill(level);
        let found = identify_free_decay(&record, &options("tip_deflection_m")).unwrap();
        assert!(is_right(&found, &truth), "{seed}: {:?} {truth:?}", found.modes);
        let told = |kind: &WarningKind| matches!(kind, WarningKind::NothingChanges { at_s, .. } if (at_s - at as f64 / 200.0).abs() < 0.02);
        assert!(found.warnings.iter().any(|warning| told(&warning.kind)), "{:?}", found.warnings);
    }
}

#[test]
fn an_overdriven_sensor_is_told_and_what_comes_after_is_fitted() {
    for seed in 0..20 {
        let (mut record, truth) = one_mode(seed);
        record.columns[0].samples.iter_mut().for_each(|y| *y = y.clamp(-0.4, 0.9));
        let found = identify_free_decay(&record, &options("tip_deflection_m")).unwrap();
        assert!(is_right(&found, &truth), "{seed}: {:?} {truth:?}", found.modes);
        let told = |kind: &WarningKind| matches!(kind, WarningKind::Clipping { .. });
        assert!(found.warnings.iter().any(|warning| told(&warning.kind)), "{:?}", found.warnings);
    }
}

#[test]
fn a_sensor_recorded_twice_is_told() {
    let (mut record, _) = one_mode(1);
    let twin = record.columns[0].samples.clone();
    record = record.with_column("second_m", twin);
    let found = identify_free_decay(&record, &options("tip_deflection_m")).unwrap();
    let told =
        |kind: &WarningKind| matches!(kind, WarningKind::DoubledColumn { other, .. } if other == "second_m");
    assert!(found.warnings.iter().any(|warning| told(&warning.kind)), "{:?}", found.warnings);
}

#[test]
fn of_several_knocks_one_decay_is_read_and_the_others_are_told() {
    for seed in 0..12 {
        let mut noise = Noise(seed + 77);
        let (f, zeta) = (4.0 + 20.0 * noise.even(), 0.01 + 0.02 * noise.even());
        let times: Vec<f64> = (0..3).map(|k| 0.5 + 9.0 * f64::from(k) + noise.even()).collect();
        let omega = TAU * f;
        let value = |t: f64| -> f64 {
            let rings = times.iter().filter(|at| t >= **at);
            rings
                .map(|at| {
                    (-zeta * omega * (t - at)).exp() * (omega * (1.0 - zeta * zeta).sqrt() * (t - at)).sin()
                })
                .sum()
        };
        let time_s: Vec<f64> = (0..6000).map(|k| 0.005 * f64::from(k)).collect();
        let tip = time_s.iter().map(|t| value(*t) + 0.01 * noise.normal()).collect();
        let record = Recording::new("knocks", time_s).with_column("tip_m", tip);
        let found = identify_free_decay(&record, &options("tip_m")).unwrap();
        assert!(
            is_right(&found, &[Mode { frequency_hz: f, damping_ratio: zeta, participation: 1.0 }]),
            "{seed} {f} {zeta} {:?}",
            found.modes
        );
        assert_eq!(found.kind, Some(RecordKind::Pulse));
        let told = |kind: &WarningKind| matches!(kind, WarningKind::SeveralKnocks { knocks_s, .. } if knocks_s.len() == 3);
        assert!(found.warnings.iter().any(|warning| told(&warning.kind)), "{:?}", found.warnings);
    }
}

#[test]
fn what_is_no_decay_is_refused_with_what_it_is() {
    for (kind, word) in [
        (RecordKind::Sweep, "sweep"),
        (RecordKind::Multisine, "multisine"),
        (RecordKind::Random, "random"),
        (RecordKind::Tone, "tone"),
    ] {
        let mut fitted = 0;
        for seed in 1000..1020 {
            match identify_free_decay(&record(kind, seed), &options("tip_m")) {
                Ok(_) => fitted += 1,
                Err(refusal) => {
                    let right = refusal.to_string().contains(word);
                    if !right {
                        println!("{kind:?} {seed}: {refusal}");
                    }
                }
            }
        }
        assert!(fitted == 0, "{kind:?}: {fitted} of 20 fitted as a decay");
    }
    let swept = record(RecordKind::Sweep, 3);
    let input = swept.columns[0].samples.clone();
    let refusal =
        identify_free_decay(&swept.with_column("setpoint_m", input), &options("tip_m")).unwrap_err();
    assert!(matches!(refusal, IdentifyError::NoDecay { .. }), "{refusal}");
    assert!(refusal.to_string().contains("--input setpoint_m"), "{refusal}");
}
