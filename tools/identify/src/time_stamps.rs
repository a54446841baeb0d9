//! What the stamps and the samples of a recording say about the recorder: gaps, doublets, jitter, frozen
//! samples.

use stillbeam_recording::Recording;

use crate::error::IdentifyError;
use crate::warnings::{Warning, WarningKind};

/// Intervals beyond this many usual ones are gaps, below the other they are doublets.
const GAP: f64 = 1.5;
const DOUBLET: f64 = 0.5;
/// Scatter of the remaining intervals, as a share, that is worth a word: rounded stamps stay below.
const JITTER: f64 = 0.05;
/// A repeated sample is suspicious where the signal moves by this many of its steps around it.
const MOVES: f64 = 8.0;

/// Rms distance of the stamps from an even grid, as a share of its interval, below which they count as even.
const EVEN: f64 = 0.01;
/// Distances up to this many units of the stamps' last decimal place are rounding.
const ROUNDED: f64 = 0.6;

/// Whether the stamps lie beside an even grid by more than their rounding: only then do they tell a mode from
/// its image.
///
/// An even recorder whose stamps are written with few digits was not uneven: the digits say nothing of when
/// it sampled. Rows that are missing leave the others on the grid.
pub(crate) fn are_uneven(time_s: &[f64]) -> bool {
    let mut intervals: Vec<f64> = time_s.windows(2).map(|t| t[1] - t[0]).collect();
    if intervals.is_empty() {
        return false;
    }
    let middle = intervals.len() / 2;
    let usual_s = *intervals.clone().select_nth_unstable_by(middle, f64::total_cmp).1;
    // Places on the grid, counted from stamp to stamp so that an error of the interval does not add up.
    intervals.iter_mut().for_each(|interval| *interval = (*interval / usual_s).round());
    let places: Vec<f64> = std::iter::once(0.0)
        .chain(intervals.iter().scan(0.0, |place, step| {
            *place += step;
            Some(*place)
        }))
        .collect();
    let count = time_s.len() as f64;
    let (mean_place, mean_s) = (places.iter().sum::<f64>() / count, time_s.iter().sum::<f64>() / count);
    let (mut covariance, mut variance) = (0.0, 0.0);
    for (place, t) in places.iter().zip(time_s) {
        covariance += (place - mean_place) * (t - mean_s);
        variance += (place - mean_place).powi(2);
    }
    if variance == 0.0 {
        return false;
    }
    let interval_s = covariance / variance;
    let distances = || places.iter().zip(time_s).map(|(k, t)| t - mean_s - interval_s * (k - mean_place));
    let rms = (distances().map(|d| d * d).sum::<f64>() / count).sqrt();
    let furthest = distances().fold(0.0_f64, |most, d| most.max(d.abs()));
    rms > EVEN * interval_s && furthest > ROUNDED * last_decimal_place(time_s)
}

/// Usual interval from which stamps may not be seconds, s: a machine whose modes are below a tenth of this
/// rate is rare.
const DOUBTFUL_S: f64 = 0.5;
/// Usual interval from which they are not, s: at 100 Hz to 500 Hz, milliseconds give 10 to 2.
const ABSURD_S: f64 = 2.0;

/// The interval that most samples have, s; none of less than two.
fn usual_interval_s(time_s: &[f64]) -> Option<f64> {
    let mut intervals: Vec<f64> = time_s.windows(2).map(|t| t[1] - t[0]).collect();
    let middle = intervals.len() / 2;
    (!intervals.is_empty()).then(|| *intervals.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// An error when samples are so far apart that the stamps are not seconds.
pub(crate) fn refuse_absurd_stamps(recording: &Recording, time_s: &[f64]) -> Result<(), IdentifyError> {
    match usual_interval_s(time_s) {
        Some(interval_s) if interval_s >= ABSURD_S => {
            Err(IdentifyError::StampsNotSeconds { recording: recording.name.clone(), interval_s })
        }
        _ => Ok(()),
    }
}

/// Unit of the last decimal place that the stamps use, s; 0 where they use more than nine.
fn last_decimal_place(time_s: &[f64]) -> f64 {
    let whole = |unit: f64| time_s.iter().all(|t| (t / unit - (t / unit).round()).abs() < 1e-3);
    (0..=9).map(|digits| 10_f64.powi(-digits)).find(|unit| whole(*unit)).unwrap_or(0.0)
}

/// Warnings about the stamps and the values of one column's present samples.
pub(crate) fn stamp_warnings(recording: &str, time_s: &[f64], values: &[f64]) -> Vec<Warning> {
    let intervals: Vec<f64> = time_s.windows(2).map(|t| t[1] - t[0]).collect();
    if intervals.len() < 3 {
        return Vec::new();
    }
    let mut sorted = intervals.clone();
    let middle = sorted.len() / 2;
    let usual = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
    let recording = recording.to_owned();
    let mut kinds = Vec::new();
    if usual >= DOUBTFUL_S {
        kinds.push(WarningKind::StampsMayNotBeSeconds { recording: recording.clone(), interval_s: usual });
    }

    let gaps: Vec<usize> = (0..intervals.len()).filter(|k| intervals[*k] > GAP * usual).collect();
    if let Some(&longest) = gaps.iter().max_by(|a, b| intervals[**a].total_cmp(&intervals[**b])) {
        kinds.push(WarningKind::MissingSamples {
            recording: recording.clone(),
            count: gaps.iter().map(|k| (intervals[*k] / usual).round() as usize - 1).sum(),
            gaps: gaps.len(),
            longest_s: intervals[longest],
            at_s: time_s[longest],
        });
    }
    let doublets: Vec<usize> = (0..intervals.len()).filter(|k| intervals[*k] < DOUBLET * usual).collect();
    if let Some(&first) = doublets.first() {
        kinds.push(WarningKind::CrowdedSamples {
            recording: recording.clone(),
            count: doublets.len(),
            at_s: time_s[first],
        });
    }
    let ordinary: Vec<f64> =
        intervals.iter().map(|h| h / usual).filter(|h| (DOUBLET..GAP).contains(h)).collect();
    let mean = ordinary.iter().sum::<f64>() / ordinary.len().max(1) as f64;
    let scatter =
        (ordinary.iter().map(|h| (h - mean).powi(2)).sum::<f64>() / ordinary.len().max(1) as f64).sqrt();
    if scatter > JITTER {
        kinds.push(WarningKind::UnevenStamps { recording: recording.clone(), scatter });
    }
    let frozen = repeated(values);
    if let Some(&first) = frozen.first() {
        kinds.push(WarningKind::RepeatedSamples { recording, count: frozen.len(), at_s: time_s[first] });
    }
    kinds.into_iter().map(Warning::from).collect()
}

/// The step of a quantised signal: the smallest, where all steps are multiples of it; else 0.
pub(crate) fn sensor_step(values: &[f64]) -> f64 {
    let steps = || values.windows(2).map(|v| (v[1] - v[0]).abs()).filter(|step| *step > 0.0);
    let smallest = steps().fold(f64::INFINITY, f64::min);
    let whole = |step: f64| (step / smallest - (step / smallest).round()).abs() < 0.05;
    let multiples = steps().filter(|step| whole(*step)).count();
    if 20 * multiples >= 19 * steps().count() { smallest } else { 0.0 }
}

/// Samples that repeat the one before although the signal is on its way up or down: frames delivered twice.
///
/// Coarse samples repeat by chance, about once in as many samples as the signal moves steps from one to the
/// next; only clearly more than that counts.
fn repeated(values: &[f64]) -> Vec<usize> {
    let resolution = sensor_step(values);
    let most = values.iter().fold(f64::NEG_INFINITY, |top, v| top.max(*v));
    let least = values.iter().fold(f64::INFINITY, |low, v| low.min(*v));
    let mut found = Vec::new();
    let mut by_chance = 0.0;
    for k in 2..values.len().saturating_sub(1) {
        let (into, out) = (values[k - 1] - values[k - 2], values[k + 1] - values[k]);
        let pace = into.abs().min(out.abs());
        if into * out > 0.0 && pace > MOVES * resolution && pace > 0.01 * (most - least) {
            by_chance += resolution / pace;
            if values[k] == values[k - 1] {
                found.push(k);
            }
        }
    }
    if found.len() as f64 > 3.0 * by_chance + 3.0 * by_chance.sqrt() { found } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(n: usize) -> (Vec<f64>, Vec<f64>) {
        let time_s: Vec<f64> = (0..n).map(|k| 0.01 * k as f64).collect();
        let values = time_s.iter().map(|t| (7.0 * t).sin()).collect();
        (time_s, values)
    }

    #[test]
    fn a_clean_record_has_no_warnings_even_when_its_stamps_are_rounded_or_its_values_quantised() {
        let (time_s, values) = sine(2000);
        assert!(stamp_warnings("r", &time_s, &values).is_empty());
        let rounded: Vec<f64> = (0..2000).map(|k| (f64::from(k) / 1651.613 * 1e6).round() / 1e6).collect();
        assert!(stamp_warnings("r", &rounded, &values).is_empty());
        for steps in [10.0, 100.0, 1000.0] {
            let coarse: Vec<f64> = values.iter().map(|v| (v * steps).round() / steps).collect();
            assert!(stamp_warnings("r", &time_s, &coarse).is_empty(), "{steps}");
        }
    }

    #[test]
    fn dropped_doubled_and_jittered_samples_are_each_named() {
        let (mut time_s, mut values) = sine(2000);
        time_s.drain(500..503);
        values.drain(500..503);
        let found = stamp_warnings("r", &time_s, &values);
        assert!(
            matches!(found[0].kind, WarningKind::MissingSamples { count: 3, gaps: 1, at_s, .. } if (at_s - 4.99).abs() < 1e-9),
            "{found:?}"
        );
        time_s.insert(101, time_s[100] + 0.001);
        values.insert(101, values[100]);
        let found = stamp_warnings("r", &time_s, &values);
        assert!(found.iter().any(|w| matches!(w.kind, WarningKind::CrowdedSamples { count: 1, .. })));

        let (time_s, mut values) = sine(2000);
        for k in [300, 901] {
            values[k] = values[k - 1];
        }
        let found = stamp_warnings("r", &time_s, &values);
        assert!(
            matches!(found.as_slice(), [Warning { kind: WarningKind::RepeatedSamples { count: 2, .. }, .. }]),
            "{found:?}"
        );
        let (time_s, values) = sine(2000);
        let uneven: Vec<f64> =
            time_s.iter().enumerate().map(|(k, t)| t + 0.002 * ((k * k) as f64).sin()).collect();
        let found = stamp_warnings("r", &uneven, &values);
        assert!(found.iter().any(|w| matches!(w.kind, WarningKind::UnevenStamps { .. })), "{found:?}");
    }

    #[test]
    fn rounding_and_missing_rows_do_not_make_stamps_uneven_and_scatter_does() {
        let even = |rate_hz: f64| (0..4000).map(move |k| f64::from(k) / rate_hz);
        let rounded = |digits: i32| move |t: f64| (t * 10_f64.powi(digits)).round() / 10_f64.powi(digits);
        assert!(!are_uneven(&even(1651.613).collect::<Vec<_>>()));
        assert!(!are_uneven(&even(1651.613).map(rounded(6)).collect::<Vec<_>>()));
        assert!(!are_uneven(&even(130.0).map(rounded(3)).collect::<Vec<_>>()));
        let missing: Vec<f64> = even(100.0).enumerate().filter(|(k, _)| k % 7 != 3).map(|(_, t)| t).collect();
        assert!(!are_uneven(&missing));
        let scattered: Vec<f64> =
            even(100.0).enumerate().map(|(k, t)| t + 0.001 * ((k * k) as f64).sin()).collect();
        assert!(are_uneven(&scattered));
        assert!(are_uneven(&scattered.into_iter().map(rounded(4)).collect::<Vec<_>>()));
        assert!(!are_uneven(&[]) && !are_uneven(&[1.0]) && !are_uneven(&[1.0, 2.0]));
    }
}
