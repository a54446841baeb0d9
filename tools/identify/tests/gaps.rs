//! Rows that never came: a gap in the stamps is said, and spoils neither the kind nor the modes.

use crate::synthetic;

use stillbeam_identify::{
    ForcedOptions, FreeDecayOptions, IdentifiedModes, OutputOnlyOptions, RecordKind, WarningKind,
    identify_forced, identify_free_decay, identify_output_only, recognise,
};
use stillbeam_recording::Recording;
use synthetic::ambient::ambient;
use synthetic::kinds::between;
use synthetic::{Mode, Noise, modal_response, ring_down};

/// The record without the rows of some stretches of time.
fn without(record: &Recording, gaps: &[[f64; 2]]) -> Recording {
    let is_there = |t: f64| gaps.iter().all(|gap| !(gap[0]..gap[1]).contains(&t));
    let kept: Vec<usize> = (0..record.time_s.len()).filter(|k| is_there(record.time_s[*k])).collect();
    let mut left = record.clone();
    left.time_s = kept.iter().map(|k| record.time_s[*k]).collect();
    for (column, whole) in left.columns.iter_mut().zip(&record.columns) {
        column.samples = kept.iter().map(|k| whole.samples[*k]).collect();
    }
    left
}

fn says_gaps(found: &IdentifiedModes, read: fn(&WarningKind) -> bool) -> bool {
    let told = |kind: fn(&WarningKind) -> bool| found.warnings.iter().any(|warning| kind(&warning.kind));
    told(|kind| matches!(kind, WarningKind::MissingSamples { .. })) && told(read)
}

fn holds(found: &IdentifiedModes, truth: &[Mode]) -> bool {
    let near = |f: f64, of: f64, share: f64| (f / of - 1.0).abs() < share;
    found.modes.len() == truth.len()
        && found.modes.iter().zip(truth).all(|(mode, truth)| {
            let known = (5.0 * mode.damping_ratio.stderr / truth.damping_ratio).max(0.02);
            near(mode.frequency_hz.value, truth.frequency_hz, 2e-3)
                && near(mode.damping_ratio.value, truth.damping_ratio, known.min(0.5))
        })
}

#[test]
fn a_decay_with_a_gap_anywhere_is_a_decay_with_all_its_modes() {
    for seed in 0..6_u64 {
        let mut noise = Noise(seed + 900);
        let lowest_hz = between(&mut noise, 4.0, 12.0);
        let truth = [1.0, between(&mut noise, 2.0, 4.0)].map(|ratio| Mode {
            frequency_hz: ratio * lowest_hz,
            damping_ratio: between(&mut noise, 0.003, 0.012),
            participation: 1.0 / ratio,
        });
        let rows: Vec<f64> = (0..3000).map(|_| 0.004 * noise.normal()).collect();
        let whole = ring_down(&truth, 250.0, 3000, 0.0, |k| rows[k]);
        for start_s in [0.9, 1.7, 3.1, 5.3] {
            for length_s in [0.06, 0.2, 0.8, 2.0] {
                let record = without(&whole, &[[start_s, start_s + length_s]]);
                let kind = recognise(&record, "tip_deflection_m").unwrap().kind;
                assert_eq!(kind, RecordKind::FreeDecay, "{seed} {start_s} {length_s}");
                let found = identify_free_decay(&record, &FreeDecayOptions::new("tip_deflection_m")).unwrap();
                assert!(holds(&found, &truth), "{seed} {start_s} {length_s}: {:?}", found.modes);
                // What is short beside the period is fitted where it is.
                let read = |kind: &WarningKind| {
                    matches!(kind, WarningKind::OneStretchRead { .. } | WarningKind::MissingSamples { .. })
                };
                assert!(says_gaps(&found, read), "{seed} {start_s} {length_s}: {:?}", found.warnings);
            }
        }
    }
}

#[test]
fn a_later_stretch_is_read_where_it_is_asked_for() {
    let truth = [Mode { frequency_hz: 6.0, damping_ratio: 0.004, participation: 1.0 }];
    let mut noise = Noise(3);
    let rows: Vec<f64> = (0..3000).map(|_| 0.004 * noise.normal()).collect();
    let record = without(&ring_down(&truth, 250.0, 3000, 0.0, |k| rows[k]), &[[5.0, 6.0]]);
    let options = FreeDecayOptions { start_s: Some(6.5), ..FreeDecayOptions::new("tip_deflection_m") };
    let found = identify_free_decay(&record, &options).unwrap();
    assert!(found.window_s[0] >= 6.5 && holds(&found, &truth), "{:?} {:?}", found.window_s, found.modes);
}

#[test]
fn a_random_record_with_gaps_is_random_and_keeps_its_modes() {
    let (mut kept, mut heard) = (0, 0);
    for seed in 0..8_u64 {
        let (whole, _) = ambient(seed, 900.0);
        let last_s = whole.time_s[whole.time_s.len() - 1];
        let options = OutputOnlyOptions { outputs: vec!["acc0_m_s2".to_owned()], modes: None };
        let clean = identify_output_only(&whole, &options).unwrap();
        for count in [1, 3] {
            let mut noise = Noise(seed + 70 + count);
            let gaps: Vec<[f64; 2]> = (0..count)
                .map(|index| {
                    let start_s = last_s * (index as f64 + between(&mut noise, 0.2, 0.8)) / count as f64;
                    [start_s, start_s + last_s * between(&mut noise, 0.001, 0.02)]
                })
                .collect();
            let record = without(&whole, &gaps);
            let kind = recognise(&record, "acc0_m_s2").unwrap().kind;
            assert_eq!(kind, RecordKind::Random, "{seed} {gaps:?}");
            let found = identify_output_only(&record, &options).unwrap();
            let read = |kind: &WarningKind| matches!(kind, WarningKind::StretchesRead { .. });
            assert!(says_gaps(&found, read), "{seed} {gaps:?}: {:?}", found.warnings);
            for mode in &clean.modes {
                let is_near = |other: f64| (other / mode.frequency_hz.value - 1.0).abs() < 0.02;
                heard += 1;
                kept += usize::from(found.modes.iter().any(|one| is_near(one.frequency_hz.value)));
            }
        }
    }
    println!("{kept} of {heard}");
    assert!(10 * kept >= 9 * heard, "{kept} of {heard}");
}

/// Two modes under a random force, without and with gaps in the rows of both columns.
#[test]
fn a_driven_record_with_gaps_is_fitted_anew_after_each() {
    let options = ForcedOptions { cross_checks: false, ..ForcedOptions::new("force_N", "tip_m") };
    for seed in 0..3_u64 {
        let mut noise = Noise(seed + 40);
        let truth = [1.0, between(&mut noise, 2.0, 3.0)].map(|ratio| Mode {
            frequency_hz: 5.0 * ratio,
            damping_ratio: between(&mut noise, 0.005, 0.015),
            participation: ratio,
        });
        let time_s: Vec<f64> = (0..8000).map(|k| f64::from(k) / 200.0).collect();
        let force: Vec<f64> = (0..8000).map(|_| noise.normal()).collect();
        let at = |t: f64| {
            let (row, share) = ((200.0 * t).floor(), (200.0 * t).fract());
            let value = |row: usize| force[row.min(force.len() - 1)];
            (1.0 - share) * value(row as usize) + share * value(row as usize + 1)
        };
        let mut tip = vec![0.0; time_s.len()];
        for mode in truth {
            let q = modal_response(mode, at, &time_s);
            tip.iter_mut().zip(q).for_each(|(y, q)| *y += mode.participation * q);
        }
        let size = tip.iter().fold(0.0_f64, |top, y| top.max(y.abs()));
        tip.iter_mut().for_each(|y| *y += 2e-3 * size * noise.normal());
        let record = Recording::new("driven", time_s).with_column("force_N", force.clone());
        let record = record.with_column("tip_m", tip);
        let gaps = [[9.0, 9.0 + between(&mut noise, 0.2, 1.5)], [26.0, 26.0 + between(&mut noise, 0.2, 1.5)]];
        let found = identify_forced(&without(&record, &gaps), &options).unwrap();
        assert!(holds(&found, &truth), "{seed}: {:?}", found.modes);
        let read = |kind: &WarningKind| matches!(kind, WarningKind::StretchesRead { stretches: 3, .. });
        assert!(says_gaps(&found, read), "{seed}: {:?}", found.warnings);
        assert_eq!((found.recording.as_str(), found.records.len()), ("driven", 3));
    }
}
