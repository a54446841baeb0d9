//! The paper's eqs. 28 to 34 and what the text says of its tables: decrement, shapers, sweeps, arithmetic.
//!
//! The product's own decrement is in tools/identify, its shapers and sweeps in the firmware's core, each with
//! its tests; here the formulas are tried as they are printed.

use std::f64::consts::{PI, TAU};

/// Eq. 28.
fn damping_of_decrement(delta: f64) -> f64 {
    1.0 / (1.0 + (TAU / delta).powi(2)).sqrt()
}

#[test]
fn equation_29_counts_one_period_too_many() {
    for zeta in [0.001_f64, 0.0074, 0.1] {
        let per_period = TAU * zeta / (1.0 - zeta * zeta).sqrt();
        assert!((damping_of_decrement(per_period) / zeta - 1.0).abs() < 1e-12, "eq. 28 is its inverse");
        for n in [2_u32, 3, 10] {
            let first_over_nth = (per_period * f64::from(n - 1)).exp();
            let corrected = damping_of_decrement(first_over_nth.ln() / f64::from(n - 1));
            let printed = damping_of_decrement(first_over_nth.ln() / f64::from(n));
            assert!((corrected / zeta - 1.0).abs() < 1e-12);
            // With the first two peaks, which the paper uses, half the damping.
            let factor = f64::from(n - 1) / f64::from(n);
            assert!((printed / zeta / factor - 1.0).abs() < 0.02, "{n}: {printed}");
        }
    }
}

/// Eqs. 30 to 32 as printed: amplitudes and times in half periods, for n = 2, 3, 4 impulses.
fn printed_shaper(n: usize, zeta: f64) -> Vec<(f64, f64)> {
    let k = (-zeta * PI / (1.0 - zeta * zeta).sqrt()).exp();
    let amplitudes = match n {
        2 => vec![1.0 / (1.0 + k), k / (1.0 + k)],
        3 => vec![1.0, 2.0 * k, k * k].into_iter().map(|a| a / (1.0 + k).powi(2)).collect(),
        _ => vec![1.0, 3.0 * k, 3.0 * k * k, k.powi(3)].into_iter().map(|a| a / (1.0 + k).powi(3)).collect(),
    };
    amplitudes.into_iter().zip(0..).map(|(amplitude, half)| (amplitude, f64::from(half))).collect()
}

/// What is left of a mode at `ratio` times the frequency, relative to an impulse at the end.
fn residual(impulses: &[(f64, f64)], zeta: f64, ratio: f64) -> f64 {
    let last = impulses.last().map_or(0.0, |(_, time)| *time);
    // Times in half damped periods of the design.
    let decay = PI * zeta / (1.0 - zeta * zeta).sqrt() * ratio;
    let sum = |turn: fn(f64) -> f64| -> f64 {
        impulses.iter().map(|(a, t)| a * (-decay * (last - t)).exp() * turn(PI * ratio * t)).sum()
    };
    sum(f64::cos).hypot(sum(f64::sin))
}

#[test]
fn equations_30_to_32_sum_to_one_and_have_single_double_and_triple_zeros() {
    for zeta in [0.0, 0.0074, 0.05] {
        for n in [2, 3, 4] {
            let impulses = printed_shaper(n, zeta);
            let sum: f64 = impulses.iter().map(|(amplitude, _)| amplitude).sum();
            assert!((sum - 1.0).abs() < 1e-14);
            assert!(residual(&impulses, zeta, 1.0) < 1e-14, "{n} {zeta}");
            // Halving a small error divides what is left by 2 to the order of the zero.
            let order = (residual(&impulses, zeta, 1.002) / residual(&impulses, zeta, 1.001)).log2();
            assert!((order - (n - 1) as f64).abs() < 0.02, "{n} {zeta}: {order}");
        }
    }
}

#[test]
fn n_to_the_m_impulses_hold_for_equal_types_only() {
    let product = |types: &[usize]| -> usize {
        let stages: Vec<Vec<(f64, f64)>> = types.iter().map(|n| printed_shaper(*n, 0.0074)).collect();
        let mut impulses = vec![0.0];
        for (stage, period) in stages.iter().zip([1.0, 6.2727]) {
            impulses = impulses.iter().flat_map(|t| stage.iter().map(move |(_, h)| t + h / period)).collect();
        }
        impulses.len()
    };
    assert_eq!(product(&[3, 3]), 3_usize.pow(2));
    // A ZV for one mode and a ZVDD for the other: neither 2² nor 4².
    assert_eq!(product(&[2, 4]), 8);
}

#[test]
fn equations_33_and_34_make_the_sweeps_last_what_this_project_takes_them_to_last() {
    let (low_hz, high_hz) = (0.1_f64, 8.0_f64);
    let linear = |t: f64| (high_hz - low_hz) / t;
    let exponential = |from_hz: f64, to_hz: f64, t: f64| (to_hz / from_hz).ln() / 2.0_f64.ln() * 60.0 / t;
    assert!((linear(7.9) - 1.0).abs() < 1e-12);
    assert!((exponential(low_hz, high_hz, 126.439) - 3.0).abs() < 1e-4);
    assert!((exponential(low_hz, high_hz, 54.188) - 7.0).abs() < 1e-4);
    // With f_a and f_b "the lower and upper frequency limits" no testing time gives −5; they are first and
    // last.
    assert!(exponential(low_hz, high_hz, 1e-3) > 0.0 && exponential(low_hz, high_hz, 1e6) > 0.0);
    assert!((exponential(high_hz, low_hz, 75.863) + 5.0).abs() < 1e-4);
}

#[test]
fn the_texts_arithmetic_on_table_1() {
    let spread = |values: [f64; 3]| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        values.iter().copied().fold(0.0, f64::max) / low - 1.0
    };
    // "Did not exceed 0.4 %": 0.34 and 0.405.
    assert!((spread([1.0951, 1.0988, 1.0976]) - 0.00338).abs() < 1e-5);
    assert!((spread([6.8917, 6.9146, 6.9196]) - 0.00405).abs() < 1e-5);
    // "More than 40 %" holds for the first mode; for the second it is a factor of five.
    assert!((spread([0.0071, 0.0059, 0.0083]) - 0.407).abs() < 1e-3);
    assert!((spread([0.0059, 0.0033, 0.0012]) - 3.917).abs() < 1e-3);
    // "The damping ratios under the linear sweep are too small": the second is the largest of its column.
    assert!([0.0059, 0.0033, 0.0012].iter().all(|other| *other < 0.0089));
    // One bin of a 7.9 s record is wider than what separates the linear sweep's first frequency from the
    // others'.
    let bin_hz = 1.0 / 7.9;
    for other_hz in [1.0951, 1.0988, 1.0976] {
        assert!((other_hz - 1.0063) < bin_hz);
    }
}

#[test]
fn the_texts_arithmetic_on_table_2() {
    let single = [(0.73, 22.04, 5.83), (1.12, 14.96, 3.62), (1.57, 8.48, 2.84)];
    let two = [(0.75, 13.18, 1.96), (1.27, 6.86, 1.26), (1.75, 2.26, 0.36)];
    // "As shown in Table 3, the settling time under ZVDD is three times that under ZV": Table 2, and 2.2
    // times.
    let ratio = |rows: [(f64, f64, f64); 3]| rows[2].0 / rows[0].0;
    assert!((ratio(single) - 2.15).abs() < 0.01 && (ratio(two) - 2.33).abs() < 0.01);
    // "At least 50 % of the improvement": 65 to 87 %.
    let gains: Vec<f64> = single.iter().zip(&two).map(|(one, both)| 1.0 - both.2 / one.2).collect();
    assert!(gains.iter().all(|gain| (0.65..0.88).contains(gain)), "{gains:?}");
    // Settling less the shaper's own length is the same 0.2 s in all six rows.
    let half_s = |hz: f64| 0.5 / hz / (1.0 - 0.0074_f64 * 0.0074).sqrt();
    let lengths = |extra_s: f64| [1.0, 2.0, 3.0].map(|halves| halves * (half_s(1.1) + extra_s));
    let left: Vec<f64> = lengths(0.0)
        .into_iter()
        .zip(single)
        .chain(lengths(half_s(6.9)).into_iter().zip(two))
        .map(|(length_s, row)| row.0 - length_s)
        .collect();
    let mean = left.iter().sum::<f64>() / 6.0;
    assert!((mean - 0.217).abs() < 0.001, "{left:?}");
    assert!(left.iter().all(|value| (value - mean).abs() < 0.06), "{left:?}");
}
