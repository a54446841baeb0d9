//! Decays beside what does not ring: sensors that creep, the mains' hum, the ends of a sensor's range.

use crate::synthetic;

use std::f64::consts::{PI, TAU};

use stillbeam_identify::{
    ForcedOptions, FreeDecayOptions, IdentifiedModes, RecordKind, Rejected, WarningKind, identify_forced,
    identify_free_decay, recognise,
};
use stillbeam_recording::Recording;
use synthetic::kinds::{between, ratio_between, whole};
use synthetic::{Mode, Noise, Sweep, clean_sweep, noisy, ring_down};

const TIP: &str = "tip_deflection_m";

/// Modes that ring with like amplitudes, their frequencies in these ratios at least.
fn modes(noise: &mut Noise, count: usize, damping: [f64; 2]) -> Vec<Mode> {
    let mut frequency_hz = between(noise, 4.0, 9.0);
    (0..count)
        .map(|index| {
            if index > 0 {
                frequency_hz *= between(noise, 1.5, 2.3);
            }
            Mode {
                frequency_hz,
                damping_ratio: ratio_between(noise, damping[0], damping[1]),
                participation: if index == 0 { 1.0 } else { between(noise, 0.25, 0.7) },
            }
        })
        .collect()
}

/// A decay with noise and something beside it, over time (s) and the share of the record that has passed.
fn record(
    modes: &[Mode],
    (rate_hz, periods): (f64, f64),
    noise: &mut Noise,
    beside: impl Fn(f64, f64) -> f64,
) -> Recording {
    let rows = (periods * rate_hz / modes[0].frequency_hz) as usize;
    let errors: Vec<f64> = (0..rows).map(|_| 3e-3 * noise.normal()).collect();
    ring_down(modes, rate_hz, rows, 0.2, |k| errors[k] + beside(k as f64 / rate_hz, k as f64 / rows as f64))
}

fn identified(record: &Recording) -> IdentifiedModes {
    let options = FreeDecayOptions { cross_checks: false, ..FreeDecayOptions::new(TIP) };
    identify_free_decay(record, &options).unwrap()
}

fn assert_right(found: &IdentifiedModes, truth: &[Mode], damping: f64, what: &str) {
    assert_eq!(found.modes.len(), truth.len(), "{what}: {:?} {truth:?}", found.modes);
    for (own, truth) in found.modes.iter().zip(truth) {
        assert!(
            (own.frequency_hz.value / truth.frequency_hz - 1.0).abs() < 1e-3,
            "{what}: {own:?} {truth:?}"
        );
        let ratio = own.damping_ratio.value / truth.damping_ratio;
        assert!((ratio - 1.0).abs() < damping, "{what}: {own:?} {truth:?}");
    }
}

/// A creep by the logarithm of time, a course that bends at its end, and two that turn back.
const COURSES: [fn(f64) -> f64; 4] =
    [|x| (100.0 * x).ln_1p() / 4.6, |x| x.powi(3) - 0.2 * x, |x| (0.8 * PI * x).sin(), |x| x - x.powi(3)];

#[test]
fn a_decay_beside_a_drift_that_bends_or_turns_back_is_recognised_with_all_its_modes() {
    for seed in 0..12_u64 {
        let mut noise = Noise(41 * seed + 5);
        let count = 1 + seed as usize % 4;
        let truth = modes(&mut noise, count, [0.006, 0.02]);
        let (size, course) = (ratio_between(&mut noise, 1.0, 6.0), COURSES[seed as usize % COURSES.len()]);
        let record = record(&truth, (400.0, 40.0), &mut noise, |_, x| size * course(x));
        assert_eq!(recognise(&record, TIP).unwrap().kind, RecordKind::FreeDecay, "{seed}");
        assert_right(&identified(&record), &truth, 0.1, &format!("{seed}"));
    }
}

#[test]
fn ringing_that_hardly_falls_beside_a_drift_is_a_decay_and_lines_that_do_not_fall_are_none() {
    for seed in 0..12_u64 {
        let mut noise = Noise(57 * seed + 11);
        let truth = modes(&mut noise, 2 + seed as usize % 3, [0.0008, 0.0015]);
        let (size, course) = (ratio_between(&mut noise, 0.5, 4.0), COURSES[seed as usize % COURSES.len()]);
        let ringing = record(&truth, (500.0, 25.0), &mut noise, |_, x| size * course(x));
        assert_eq!(recognise(&ringing, TIP).unwrap().kind, RecordKind::FreeDecay, "{seed}");
        assert_right(&identified(&ringing), &truth, 0.3, &format!("{seed}"));
        let steady: Vec<Mode> = truth.iter().map(|mode| Mode { damping_ratio: 0.0, ..*mode }).collect();
        let steady = record(&steady, (500.0, 25.0), &mut noise, |_, x| size * course(x));
        assert_ne!(recognise(&steady, TIP).unwrap().kind, RecordKind::FreeDecay, "{seed}");
    }
}

/// The mains with harmonics, a per mille off.
fn hum(noise: &mut Noise) -> (f64, impl Fn(f64) -> f64 + use<>) {
    let mains_hz = if noise.even() < 0.5 { 50.0 } else { 60.0 } * between(noise, 0.9995, 1.0005);
    let harmonics = whole(noise, 1, 3);
    let size = ratio_between(noise, 0.03, 0.6);
    let sum = move |t: f64| {
        let one = |k: usize| (TAU * mains_hz * k as f64 * t + k as f64).sin() / k as f64;
        size * (1..=harmonics).map(one).sum::<f64>()
    };
    (mains_hz, sum)
}

#[test]
fn hum_is_told_and_neither_hides_a_mode_nor_is_one_in_long_and_in_short_records() {
    for seed in 0..24_u64 {
        let mut noise = Noise(73 * seed + 3);
        let truth = modes(&mut noise, 1 + seed as usize % 3, [0.005, 0.03]);
        let (mains_hz, hum) = hum(&mut noise);
        if truth
            .iter()
            .any(|mode| (1..4).any(|k| (mode.frequency_hz / (f64::from(k) * mains_hz)).ln().abs() < 0.05))
        {
            continue;
        }
        let periods = if seed % 2 == 0 { 60.0 } else { 9.0 };
        let drift = if seed % 3 == 0 { between(&mut noise, 0.5, 3.0) } else { 0.0 };
        let course = COURSES[seed as usize % COURSES.len()];
        let record = record(&truth, (700.0, periods), &mut noise, |t, x| hum(t) + drift * course(x));
        assert_eq!(recognise(&record, TIP).unwrap().kind, RecordKind::FreeDecay, "{seed}");
        let found = identified(&record);
        assert_right(&found, &truth, 0.15, &format!("{seed}"));
        let told = |kind: &WarningKind| {
            matches!(kind, WarningKind::ToneInRecord { frequency_hz, reason }
                if (frequency_hz / mains_hz - 1.0).abs() < 3e-3 && reason.contains("mains"))
        };
        assert!(found.warnings.iter().any(|warning| told(&warning.kind)), "{seed}: {:?}", found.warnings);
    }
}

/// The hum is louder than what is left of the ringing, and the drift than both.
#[test]
fn hum_beside_a_drift_hides_no_ringing() {
    for seed in 0..12_u64 {
        let mut noise = Noise(29 * seed + 13);
        let mut truth = modes(&mut noise, 1 + seed as usize % 3, [0.002, 0.005]);
        truth.iter_mut().for_each(|mode| mode.frequency_hz *= 4.3);
        let mains_hz = if seed % 2 == 0 { 50.0 } else { 60.0 };
        let near =
            |mode: &Mode| (1..4).any(|k| (mode.frequency_hz / (f64::from(k) * mains_hz)).ln().abs() < 0.06);
        if truth.iter().any(near) {
            continue;
        }
        let size = between(&mut noise, 0.2, 0.4);
        let drift = between(&mut noise, 0.7, 2.0);
        let course = COURSES[seed as usize % COURSES.len()];
        let record = record(&truth, (950.0, 200.0), &mut noise, |t, x| {
            size * (TAU * mains_hz * t).sin()
                + 0.5 * size * (2.0 * TAU * mains_hz * t).cos()
                + drift * course(x)
        });
        assert_right(&identified(&record), &truth, 0.1, &format!("{seed}"));
    }
}

/// Neither has a peak of its own in the spectrum.
#[test]
fn a_mode_that_a_louder_one_beside_it_hides_is_found_in_what_that_leaves() {
    for seed in 0..24_u64 {
        let mut noise = Noise(3 * seed + 101);
        let hidden_hz = between(&mut noise, 1.7, 1.9);
        let mode = |ratio: f64, damping_ratio: f64, participation: f64| Mode {
            frequency_hz: ratio * hidden_hz,
            damping_ratio,
            participation,
        };
        let near = between(&mut noise, 1.28, 1.36);
        let truth = [
            mode(1.0, 0.0185, 0.065),
            mode(near, 0.0355, 0.25),
            mode(1.96, 0.0025, 0.05),
            mode(3.95, 0.0084, 0.14),
        ];
        let found = identified(&record(&truth, (67.0, 18.0), &mut noise, |_, _| 0.0));
        assert_eq!(found.modes.len(), truth.len(), "{seed}: {:?}", found.modes);
        for (own, truth) in found.modes.iter().zip(truth) {
            assert!((own.frequency_hz.value / truth.frequency_hz - 1.0).abs() < 1e-2, "{seed}: {own:?}");
        }
    }
}

/// How many samples were left out because they were cut off.
fn cut_off(found: &IdentifiedModes) -> usize {
    let counts = found.rejected.iter().map(|entry| match entry {
        Rejected::Samples { count, reason, .. } if reason.contains("cut off") => *count,
        _ => 0,
    });
    counts.sum()
}

/// The quick mode is gone before the sensor is back in its range.
#[test]
fn modes_that_ring_while_the_sensor_is_overdriven_are_read_from_between_what_is_cut_off() {
    for seed in 0..12_u64 {
        let mut noise = Noise(91 * seed + 29);
        let slow = Mode {
            frequency_hz: between(&mut noise, 4.0, 7.0),
            damping_ratio: ratio_between(&mut noise, 0.002, 0.004),
            participation: 1.0,
        };
        let quick = Mode {
            frequency_hz: slow.frequency_hz * between(&mut noise, 3.3, 5.7),
            damping_ratio: ratio_between(&mut noise, 0.012, 0.02),
            participation: 0.4,
        };
        let limit = between(&mut noise, 0.6, 0.8);
        let mut record = record(&[slow, quick], (400.0, 80.0), &mut noise, |_, _| -0.2);
        let samples = &mut record.columns[0].samples;
        let cut = samples.iter().filter(|y| y.abs() >= limit).count();
        samples.iter_mut().for_each(|y| *y = y.clamp(-limit, limit));
        let found = identified(&record);
        assert_right(&found, &[slow, quick], 0.1, &format!("{seed}"));
        assert_eq!(cut_off(&found), cut, "{seed}: {:?}", found.rejected);
    }
}

/// A few samples per period: what lies between is no mode at a multiple of the frequency.
#[test]
fn the_gaps_of_a_fast_mode_that_was_cut_off_are_no_modes() {
    for seed in 0..16_u64 {
        let mut noise = Noise(17 * seed + 1);
        let mode = Mode {
            frequency_hz: between(&mut noise, 45.0, 70.0),
            damping_ratio: ratio_between(&mut noise, 0.002, 0.006),
            participation: 1.0,
        };
        let limit = between(&mut noise, 0.4, 0.75);
        let mut record = record(&[mode], (480.0, 130.0), &mut noise, |_, _| -0.2);
        record.columns[0].samples.iter_mut().for_each(|y| *y = y.clamp(-limit, limit));
        assert_right(&identified(&record), &[mode], 0.1, &format!("{seed}"));
    }
}

#[test]
fn the_damping_of_a_driven_mode_is_right_where_its_resonance_is_cut_off() {
    for (seed, limit) in [(1, 0.4), (2, 0.6), (3, 0.8)] {
        let truth = Mode { frequency_hz: 1.1, damping_ratio: 0.01, participation: 1.566 };
        let (time_s, clean) = clean_sweep(Sweep::Linear, &[truth], 1);
        let top = clean.iter().fold(0.0_f64, |top, y| top.max(y.abs()));
        let mut record = noisy(Sweep::Linear, &time_s, &clean, 1e-3 * top, seed);
        record.columns[1].samples.iter_mut().for_each(|y| *y = y.clamp(-limit * top, limit * top));
        let found = identify_forced(&record, &ForcedOptions::new("base_position_m", TIP)).unwrap();
        assert_right(&found, &[truth], 0.02, &format!("{limit}"));
        assert!(cut_off(&found) > 5, "{limit}: {:?}", found.rejected);
    }
}
