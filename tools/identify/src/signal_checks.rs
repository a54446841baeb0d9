//! Checks of a recorded signal before and after a fit: clipping, sweep rate, excited band.

use std::ops::Range;

use crate::warnings::{Warning, WarningKind};

/// Largest step beside a rest, as a share of the signal's largest: what is cut off gets there at speed.
const SLOW: f64 = 0.1;
/// Shortest rest within a record, as a share of the record.
const REST: f64 = 0.02;

/// Samples at an extreme, where the next value comes once, that show a fast signal to be cut off.
const OFTEN: usize = 10;

/// Warns when a signal sits at one of its extremes.
///
/// A smooth signal touches its extreme once; a clipped one stays there for runs of samples, and far more
/// often than at the value next to it, which tells clipping from mere quantisation. Before and after a pulse
/// a base rests at its extreme, and between its blows a hammer rests at zero: that is no clipping.
///
/// The warning says whether these samples were left out.
pub(crate) fn clipping(column: &str, samples: &[f64], left_out: bool) -> Vec<Warning> {
    let sides = clipped_sides(samples).into_iter();
    sides
        .map(|(level, runs)| {
            let samples = runs.iter().map(Range::len).sum();
            WarningKind::Clipping { column: column.to_owned(), level, samples, left_out }.into()
        })
        .collect()
}

/// Rows at which a signal is cut off, from the first to the last.
pub(crate) fn clipped_rows(samples: &[f64]) -> Vec<usize> {
    let mut rows: Vec<usize> =
        clipped_sides(samples).into_iter().flat_map(|(_, runs)| runs.into_iter().flatten()).collect();
    rows.sort_unstable();
    rows
}

/// The levels at which a signal is cut off, and where.
fn clipped_sides(samples: &[f64]) -> Vec<(f64, Vec<Range<usize>>)> {
    let step = |k: usize| match (k.checked_sub(1).and_then(|before| samples.get(before)), samples.get(k)) {
        (Some(before), Some(after)) => Some((after - before).abs()),
        _ => None,
    };
    let fastest = (1..samples.len()).filter_map(step).fold(0.0, f64::max);
    let is_rest = |run: &Range<usize>| {
        let beside = [run.start.checked_sub(1).and_then(step), step(run.end + 1)];
        let slow = beside.into_iter().flatten().all(|step| step < SLOW * fastest);
        let at_an_end = run.start == 0 || run.end == samples.len();
        slow && (at_an_end || run.len() as f64 >= REST * samples.len() as f64)
    };
    let mut sides = Vec::new();
    for sign in [1.0, -1.0] {
        let level = samples.iter().fold(f64::NEG_INFINITY, |top, value| top.max(sign * value));
        // What a signal is for most of the time is where it rests.
        if 2 * samples.iter().filter(|value| sign * **value == level).count() > samples.len() {
            continue;
        }
        let others = samples.iter().map(|value| sign * value).filter(|value| *value != level);
        let next = others.fold(f64::NEG_INFINITY, f64::max);
        let beside = samples.iter().filter(|value| sign * **value == next).count();
        let stays: Vec<Range<usize>> =
            runs_at(samples, sign * level).into_iter().filter(|run| !is_rest(run)).collect();
        let count: usize = stays.iter().map(Range::len).sum();
        let longest = stays.iter().map(Range::len).max().unwrap_or(0);
        // Fast signals stay for a sample or two; where readings are as good as never the same, that is
        // enough.
        let stays_long = longest >= 3 && count >= 5 && count > 4 * beside;
        let comes_back = count >= OFTEN && beside <= 1 && longest >= 2;
        if (stays_long || comes_back) && count < samples.len() {
            sides.push((sign * level, stays));
        }
    }
    sides
}

/// Where a signal stays at a value.
fn runs_at(samples: &[f64], level: f64) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (k, _) in samples.iter().enumerate().filter(|(_, value)| **value == level) {
        match runs.last_mut() {
            Some(run) if run.end == k => run.end = k + 1,
            _ => runs.push(k..k + 1),
        }
    }
    runs
}

/// A signal has changed sides where it is beyond this share of its root mean square on the other one: noise
/// crosses zero many times in a row.
const OTHER_SIDE: f64 = 0.3;

/// Where a signal passes its mean from one side to the other.
fn crossings(time_s: &[f64], signal: &[f64]) -> Vec<f64> {
    let count = signal.len().max(1) as f64;
    let mean = signal.iter().sum::<f64>() / count;
    let rms = (signal.iter().map(|u| (u - mean) * (u - mean)).sum::<f64>() / count).sqrt();
    let mut crossings = Vec::new();
    let mut side = 0.0;
    let mut passed_s = None;
    for (t, u) in time_s.windows(2).zip(signal.windows(2)) {
        let (a, b) = (u[0] - mean, u[1] - mean);
        if (a < 0.0) != (b < 0.0) {
            passed_s = Some(t[0] + (t[1] - t[0]) * a / (a - b));
        }
        if b.abs() > OTHER_SIDE * rms && b.signum() != side {
            crossings.extend(passed_s.filter(|_| side != 0.0));
            side = b.signum();
        }
    }
    crossings
}

/// The rate (Hz/s) at which a swept sine passes a frequency, from the times of its zero crossings.
///
/// `None` when the signal is not a sweep that passes it.
pub(crate) fn sweep_rate_at(time_s: &[f64], input: &[f64], frequency_hz: f64) -> Option<f64> {
    let crossings = crossings(time_s, input);
    // Whole periods: half ones alternate when the mean is a little off.
    let points: Vec<(f64, f64)> =
        crossings.windows(3).map(|c| (0.5 * (c[0] + c[2]), 1.0 / (c[2] - c[0]))).collect();
    // A sweep: over an eighth of it the frequency always moves the same way.
    let lag = (points.len() / 8).max(1);
    let later = points.iter().skip(lag);
    let rising = points.iter().zip(later).filter(|(a, b)| b.1 > a.1).count();
    let share = rising as f64 / points.len().saturating_sub(lag).max(1) as f64;
    if points.len() < 8 || (0.1..0.9).contains(&share) {
        return None;
    }
    let at = points
        .windows(2)
        .position(|p| (p[0].1 - frequency_hz) * (p[1].1 - frequency_hz) <= 0.0 && p[0].1 != p[1].1)?;
    // A line through the crossings on either side: single periods scatter.
    let beside = (points.len() / 16).max(6);
    let rate = slope(&points[at.saturating_sub(beside)..(at + beside + 2).min(points.len())]).abs();
    rate.is_finite().then_some(rate)
}

/// Slope of the straight line that fits points best.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / count, y + point.1 / count));
    let moments = points.iter().fold((0.0, 0.0), |(xy, xx), point| {
        (xy + (point.0 - x) * (point.1 - y), xx + (point.0 - x) * (point.0 - x))
    });
    moments.0 / moments.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clipped_signals_are_told_from_quantised_ones() {
        let sine: Vec<f64> = (0..2000).map(|k| (0.013 * f64::from(k)).sin()).collect();
        let clipped: Vec<f64> = sine.iter().map(|v| v.min(0.8)).collect();
        let quantised: Vec<f64> = sine.iter().map(|v| (v * 50.0).round() / 50.0).collect();
        assert!(clipping("a_m", &sine, false).is_empty());
        assert!(clipping("a_m", &quantised, false).is_empty());
        let found = clipping("a_m", &clipped, false);
        assert!(matches!(found[0].kind, WarningKind::Clipping { level: 0.8, .. }) && found.len() == 1);
    }

    /// There and back within a tenth of the record, as the firmware moves: at rest before and after, and once
    /// between.
    #[test]
    fn a_base_that_rests_at_its_extreme_is_not_clipped_and_one_that_is_cut_off_on_the_way_is() {
        let smooth = |x: f64| x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x);
        let ramp = |k: i32, from: i32| smooth(f64::from((k - from).clamp(0, 100)) / 100.0);
        for held in [100, 600] {
            let pulse: Vec<f64> = (0..2000).map(|k| ramp(k, 200) - ramp(k, 200 + held)).collect();
            assert!(
                clipping("a_m", &pulse, false).is_empty(),
                "{held}: {:?}",
                clipping("a_m", &pulse, false)
            );
            let cut: Vec<f64> = pulse.iter().map(|v| v.min(0.6)).collect();
            let found = clipping("a_m", &cut, false);
            let is_top = |w: &Warning| matches!(w.kind, WarningKind::Clipping { level: 0.6, .. });
            assert!(found.len() == 1 && is_top(&found[0]), "{held}: {found:?}");
        }
    }

    #[test]
    fn a_hammer_that_rests_at_zero_is_not_clipped_and_one_that_is_cut_off_at_its_top_is() {
        let blow = |k: i32, at: i32| match k - at {
            into @ 0..20 => (f64::from(into) * 0.157).sin(),
            _ => 0.0,
        };
        let force: Vec<f64> =
            (0..3000).map(|k| 90.0 * (blow(k, 100) + blow(k, 900) + blow(k, 1800))).collect();
        assert!(clipping("force_N", &force, false).is_empty(), "{:?}", clipping("force_N", &force, false));
        let cut: Vec<f64> = force.iter().map(|value| value.min(50.0)).collect();
        let found = clipping("force_N", &cut, false);
        assert!(matches!(found[0].kind, WarningKind::Clipping { level: 50.0, .. }) && found.len() == 1);
    }

    #[test]
    fn the_rate_of_a_linear_and_of_an_exponential_sweep_is_found() {
        let time_s: Vec<f64> = (0..8000).map(|k| 0.01 * f64::from(k)).collect();
        let tau = std::f64::consts::TAU;
        let linear: Vec<f64> =
            time_s.iter().map(|t| (tau * (0.1 * t + 0.5 * 0.09875 * t * t)).sin()).collect();
        let rate = sweep_rate_at(&time_s, &linear, 5.0).unwrap();
        assert!((rate / 0.09875 - 1.0).abs() < 0.05, "{rate}");
        let k = 80.0_f64.ln() / 80.0;
        let exponential: Vec<f64> =
            time_s.iter().map(|t| (tau * 0.1 * ((k * t).exp() - 1.0) / k).sin()).collect();
        let rate = sweep_rate_at(&time_s, &exponential, 5.0).unwrap();
        assert!((rate / (k * 5.0) - 1.0).abs() < 0.1, "{rate}");
        assert!(sweep_rate_at(&time_s, &exponential, 9.5).is_none());
    }

    /// 2 % of noise crosses zero several times where a slow sine does once.
    #[test]
    fn noise_on_a_sweep_does_not_change_its_rate() {
        let time_s: Vec<f64> = (0..40_000).map(|k| 0.002 * f64::from(k)).collect();
        let tau = std::f64::consts::TAU;
        let mut state = 5_u64;
        let noisy: Vec<f64> = time_s
            .iter()
            .map(|t| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                let noise = (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
                (tau * (0.1 * t + 0.5 * 0.09875 * t * t)).sin() + 0.07 * noise
            })
            .collect();
        for frequency_hz in [1.0, 3.0, 6.0] {
            let rate = sweep_rate_at(&time_s, &noisy, frequency_hz).unwrap();
            assert!((rate / 0.09875 - 1.0).abs() < 0.1, "{rate} at {frequency_hz} Hz");
        }
    }
}
