//! One clock of two recordings: what is found is as far from the truth as its standard errors say, and what
//! has nothing in common is refused.

use crate::synthetic;

use std::f64::consts::TAU;

use stillbeam_identify::{
    ClockError, ClockFit, Derivative, Signal, clock_by_edges, clock_by_motion, rising_edges_s,
};
use synthetic::Noise;

/// Two recordings of one motion, and the truth.
struct Case {
    slow: [Vec<f64>; 2],
    fast: [Vec<f64>; 2],
    offset_s: f64,
    drift: f64,
}

/// A motion without a pattern: a sweep, or 40 sines of random phase.
fn motion(noise: &mut Noise, duration_s: f64) -> impl Fn(f64) -> f64 + use<> {
    let sweeps = noise.even() < 0.5;
    let waves: Vec<[f64; 2]> =
        (0..40).map(|_| [TAU * (0.3 + 7.0 * noise.even()), TAU * noise.even()]).collect();
    move |t: f64| match sweeps {
        true => (TAU * (0.4 * t + 0.5 * 7.0 / duration_s * t * t)).sin(),
        false => waves.iter().map(|[w, phase]| (w * t + phase).sin()).sum::<f64>() / 20.0_f64.sqrt(),
    }
}

fn case(seed: u64) -> Case {
    let mut noise = Noise(seed);
    let between = |noise: &mut Noise, low: f64, high: f64| low + (high - low) * noise.even();
    let duration_s = between(&mut noise, 20.0, 90.0);
    let moved = motion(&mut noise, duration_s);
    let offset_s = between(&mut noise, -100.0, 100.0);
    let drift = between(&mut noise, -200e-6, 200e-6);
    let [slow_hz, fast_hz] = [between(&mut noise, 50.0, 120.0), between(&mut noise, 200.0, 1000.0)];
    let noise_share = 0.05 * noise.even();
    let jitter_s = 0.002 * noise.even() * noise.even();
    // The fast recording begins and ends up to a tenth before or after the slow one.
    let begin_s = between(&mut noise, -0.1, 0.1) * duration_s;
    let end_s = duration_s * between(&mut noise, 0.9, 1.1);
    let fast_time_s: Vec<f64> =
        (0..((end_s - begin_s) * fast_hz) as usize).map(|k| begin_s + k as f64 / fast_hz).collect();
    let fast: Vec<f64> = fast_time_s.iter().map(|t| moved(*t) + 0.2 * noise_share * noise.normal()).collect();
    // Stamps of the slow recording: even, with jitter, on a clock of its own.
    let true_s: Vec<f64> = (0..(duration_s * slow_hz) as usize).map(|k| k as f64 / slow_hz).collect();
    let slow: Vec<f64> =
        true_s.iter().map(|t| 1e3 * (moved(*t) + noise_share * noise.normal()) + 7.0).collect();
    let first_s = -offset_s;
    let most_s = 0.4 / slow_hz;
    let stamps = true_s
        .iter()
        .map(|t| first_s + t / (1.0 + drift) + (jitter_s * noise.normal()).clamp(-most_s, most_s))
        .collect();
    Case { slow: [stamps, slow], fast: [fast_time_s, fast], offset_s, drift }
}

fn found(case: &Case) -> Result<ClockFit, ClockError> {
    clock_by_motion(
        Signal { time_s: &case.slow[0], values: &case.slow[1] },
        Signal { time_s: &case.fast[0], values: &case.fast[1] },
        Derivative::Same,
    )
}

#[test]
fn offset_and_drift_are_within_three_standard_errors_in_99_of_100_records() {
    let (mut offsets, mut drifts, mut refused) = (0, 0, 0);
    let cases = 300;
    for seed in 0..cases {
        let case = case(seed);
        let Ok(fit) = found(&case) else {
            refused += 1;
            continue;
        };
        let drift = fit.drift.unwrap();
        // The true offset at the first stamp as it is written.
        let at_first = case.offset_s + (fit.first_s + case.offset_s) * case.drift;
        let away = (fit.offset_s.value - at_first) / fit.offset_s.stderr;
        let off = (drift.value - case.drift) / drift.stderr;
        if away.abs() >= 3.0 || off.abs() >= 3.0 {
            println!("seed {seed}: {away:.2} {off:.2} {fit:?} true {at_first} {}", case.drift);
        }
        offsets += usize::from(away.abs() < 3.0);
        drifts += usize::from(off.abs() < 3.0);
        assert!(fit.offset_s.stderr < 2e-3 && drift.stderr < 1e-4, "{fit:?}");
    }
    println!("{offsets} offsets, {drifts} drifts of {cases}, {refused} refused");
    assert!(refused == 0 && offsets >= 297 && drifts >= 297, "{offsets} {drifts} {refused} of {cases}");
}

#[test]
fn recordings_with_nothing_in_common_are_refused_with_a_remedy() {
    for seed in 0..40 {
        let (one, other) = (case(seed), case(seed + 1000));
        let mixed = Case { fast: other.fast, ..one };
        match found(&mixed) {
            Err(error) => assert!(error.to_string().contains("trigger"), "{error}"),
            Ok(fit) => panic!("seed {seed}: {fit:?}"),
        }
    }
}

#[test]
fn a_motion_that_repeats_itself_is_refused_as_such() {
    let sine = |rate_hz: f64, from: f64| -> [Vec<f64>; 2] {
        let time: Vec<f64> = (0..(30.0 * rate_hz) as usize).map(|k| k as f64 / rate_hz).collect();
        let values = time.iter().map(|t| (TAU * 2.0 * (t + from)).sin()).collect();
        [time, values]
    };
    let case = Case { slow: sine(100.0, 0.3), fast: sine(400.0, 0.0), offset_s: 0.0, drift: 0.0 };
    let error = found(&case).unwrap_err();
    assert!(matches!(error, ClockError::Ambiguous { .. }), "{error}");
}

#[test]
fn an_accelerometer_and_a_recorded_position_have_one_clock() {
    let time: Vec<f64> = (0..20_000).map(|k| k as f64 / 1000.0).collect();
    let phase = |t: f64| TAU * (0.5 * t + 0.2 * t * t);
    let position: Vec<f64> = time.iter().map(|t| phase(*t).sin()).collect();
    let slow: Vec<f64> = (0..2000).map(|k| k as f64 / 100.0).collect();
    let acceleration: Vec<f64> = slow
        .iter()
        .map(|t| {
            let (w, p) = (TAU * (0.5 + 0.4 * t), phase(*t));
            TAU * 0.4 * p.cos() - w * w * p.sin()
        })
        .collect();
    let stamps: Vec<f64> = slow.iter().map(|t| t - 3.25).collect();
    let fit = clock_by_motion(
        Signal { time_s: &stamps, values: &acceleration },
        Signal { time_s: &time, values: &position },
        Derivative::SecondRate,
    )
    .unwrap();
    assert!((fit.offset_s.value - 3.25).abs() < 1e-4, "{fit:?}");
}

#[test]
fn edges_give_the_clock_within_three_standard_errors() {
    let mut right = 0;
    for seed in 0..200 {
        let mut noise = Noise(seed);
        let (offset_s, drift) = (200.0 * noise.even() - 100.0, 4e-4 * noise.even() - 2e-4);
        let frames: Vec<f64> = (0..1000).map(|k| f64::from(k) * 0.01 + 1e-3 * noise.even()).collect();
        let edges: Vec<f64> = frames.iter().map(|t| t + offset_s + drift * t).collect();
        let first_s = offset_s - 1.0;
        let time: Vec<f64> = (0..14_000).map(|k| first_s + f64::from(k) * 1e-3).collect();
        let high = |t: f64| edges.iter().any(|edge| (0.0..0.004).contains(&(t - edge)));
        let level: Vec<f64> = time.iter().map(|t| f64::from(u8::from(high(*t)))).collect();
        let seen = rising_edges_s(&time, &level);
        let fit = clock_by_edges(&frames, &seen, 1e-3).unwrap();
        let away = (fit.offset_s.value - offset_s) / fit.offset_s.stderr;
        let off = (fit.drift.unwrap().value - drift) / fit.drift.unwrap().stderr;
        right += usize::from(away.abs() < 3.0 && off.abs() < 3.0);
    }
    assert!(right >= 198, "{right} of 200");
}

#[test]
fn one_edge_gives_the_offset_alone_and_a_wrong_number_is_refused() {
    let frames: Vec<f64> = (0..50).map(|k| f64::from(k) * 0.01).collect();
    let fit = clock_by_edges(&frames, &[12.5], 1e-3).unwrap();
    assert_eq!((fit.offset_s.value, fit.drift), (12.5, None));
    assert!(matches!(
        clock_by_edges(&frames, &[1.0, 2.0], 1e-3),
        Err(ClockError::EdgesDiffer { slow: 50, fast: 2 })
    ));
}
