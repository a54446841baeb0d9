//! Samples that no physics makes: a camera that lost the tip for a frame, a bit that flipped.

use crate::record::Record;
use crate::stacking::{RecordFit, Stack};

/// A sample this many robust standard deviations off the median of its neighbours, in the residual, is set
/// aside.
const OFF: f64 = 7.0;
/// A neighbour that is off by more than this share of it makes a sample part of a motion.
const ALONG: f64 = 0.2;
/// Neighbours on either side.
const REACH: usize = 3;
/// Samples on either side from which it is reckoned how far a sample stands off there as a rule: what is left
/// of a motion does so more where it is fast.
const AROUND: usize = 40;
/// Median absolute deviation of a normal variable over its standard deviation.
const MAD: f64 = 0.674_489_750_196_081_7;
/// At most this share of an output is set aside: more would be physics.
const MOST: f64 = 0.02;

/// Lone outliers of every output of a recording, as places in its samples.
pub(crate) fn lone_outliers(stack: &Stack<'_>, index: usize, fit: &RecordFit) -> Vec<Vec<usize>> {
    let mut start = 0;
    stack.records[index]
        .outputs
        .iter()
        .map(|output| {
            let end = start + output.at.len();
            let found = in_series(&fit.residuals[start..end]);
            start = end;
            if found.len() as f64 > MOST * output.at.len() as f64 { Vec::new() } else { found }
        })
        .collect()
}

fn in_series(series: &[f64]) -> Vec<usize> {
    let departures: Vec<f64> = (0..series.len())
        .map(|k| {
            let from = k.saturating_sub(REACH);
            let to = (k + REACH + 1).min(series.len());
            let mut around: Vec<f64> = (from..to).filter(|&j| j != k).map(|j| series[j]).collect();
            series[k] - median(&mut around)
        })
        .collect();
    let sizes: Vec<f64> = departures.iter().map(|departure| departure.abs()).collect();
    let scale = median(&mut sizes.clone()) / MAD;
    let scale_around = |k: usize| {
        let (from, to) = (k.saturating_sub(AROUND), (k + AROUND + 1).min(sizes.len()));
        median(&mut sizes[from..to].to_vec()) / MAD
    };
    let is_off =
        |k: usize| sizes.get(k).is_some_and(|size| *size > OFF * scale && *size > OFF * scale_around(k));
    // Lone ones: a run of samples that are off is a motion. In strongly coloured noise neighbours depart so
    // little that some of them are off by themselves; beside a motion they would be off by as much as it.
    let goes_along = |neighbour: usize, k: usize| {
        is_off(neighbour) && departures[neighbour].abs() > ALONG * departures[k].abs()
    };
    let is_lone = |k: usize| !(goes_along(k.wrapping_sub(1), k) || goes_along(k + 1, k));
    (0..series.len()).filter(|&k| scale > 0.0 && is_off(k) && is_lone(k)).collect()
}

fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The recording without its outliers, and a line that says so.
pub(crate) fn set_aside(record: &Record, outliers: &[Vec<usize>]) -> (Record, Vec<String>) {
    let mut cleaned = record.clone();
    let mut lines = Vec::new();
    for (output, places) in cleaned.outputs.iter_mut().zip(outliers).filter(|(_, places)| !places.is_empty())
    {
        let first_s = record.time_s[output.at[places[0]]];
        lines.push(format!(
            "{}: {} sample(s) of `{}` stand off their neighbours by more than {OFF} standard deviations, the first at {first_s:.3} s",
            record.name,
            places.len(),
            output.column,
        ));
        *output = output.without(places);
    }
    (cleaned, lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_is_found_and_a_wave_is_not() {
        let mut series: Vec<f64> =
            (0..500).map(|k| (0.3 * f64::from(k)).sin() + 0.1 * (7.7 * f64::from(k)).sin()).collect();
        assert!(in_series(&series).is_empty());
        series[200] += 20.0;
        assert_eq!(in_series(&series), vec![200]);
    }

    #[test]
    fn the_fast_end_of_a_motion_that_is_not_explained_is_no_outlier() {
        let chirp = |k: i32| (0.3 + 2.0 * f64::from(k) / 500.0) * f64::from(k) * 0.5;
        let swept =
            |k: i32| (f64::from(k) / 100.0).exp() * chirp(k).sin() + 0.01 * (7.7 * f64::from(k)).sin();
        let mut series: Vec<f64> = (0..500).map(swept).collect();
        assert!(in_series(&series).is_empty(), "{:?}", in_series(&series));
        series[250] += 200.0;
        assert_eq!(in_series(&series), vec![250]);
    }

    #[test]
    fn a_spike_beside_a_sample_that_is_a_little_off_is_found_and_a_jolt_of_two_samples_is_not() {
        let quiet: Vec<f64> = (0..500).map(|k| 0.1 * (7.7 * f64::from(k)).sin()).collect();
        let mut series = quiet.clone();
        (series[200], series[201]) = (20.0, 1.5);
        assert!(in_series(&series).contains(&200));
        let mut series = quiet;
        (series[200], series[201]) = (20.0, 15.0);
        assert!(in_series(&series).is_empty());
    }
}
