//! Gaps in the stamps: rows that never came.
//!
//! A curve that is drawn across a gap is nothing that the structure did: it falls silent there and seems to
//! be struck where the rows come back, and an input that is drawn across drives what it never drove. So the
//! stretches between the gaps are read. A free decay is one stretch; covariances are taken within each; a fit
//! of a driven record begins anew in each.

use std::ops::Range;

use stillbeam_recording::{Column, Recording};

use crate::forced_record::{Present, input_gap, present};
use crate::interpolation::{InputInterpolation, PiecewiseCubic};
use crate::narrow_band::WholeSpectrum;
use crate::result::Rejected;
use crate::time_stamps::stamp_warnings;
use crate::warnings::{Warning, WarningKind};

/// Usual intervals beyond which nothing is drawn across the rows that are missing.
const GAP: f64 = 4.5;
/// Rows of the shortest stretch that says anything on its own.
const SHORTEST: usize = 64;
/// Share of the rows that such stretches hold where a record is read by stretches: one that loses rows all
/// the time has none.
const IN_STRETCHES: f64 = 0.5;
/// Share of the loudest line's period that a curve may be drawn across.
const OF_PERIOD: f64 = 0.25;
/// Blocks of which the quietest tenth is the noise.
const BLOCKS: usize = 50;
/// Rows on either side of a gap that an input must rest in, and the share of its range that it may move by.
const RESTS: (usize, f64) = (20, 0.02);

/// The rows between gaps longer than this, s; all rows where there are none, or where hardly any stretch is
/// long enough to be read.
fn stretches(time_s: &[f64], longest_bridged_s: f64) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let mut start = 0;
    for k in 1..=time_s.len() {
        if k == time_s.len() || time_s[k] - time_s[k - 1] > longest_bridged_s {
            found.push(start..k);
            start = k;
        }
    }
    found.retain(|rows| rows.len() >= SHORTEST);
    let rows: usize = found.iter().map(ExactSizeIterator::len).sum();
    if rows as f64 >= IN_STRETCHES * time_s.len() as f64 {
        found
    } else {
        std::iter::once(0..time_s.len()).collect()
    }
}

/// The interval that most rows have, s.
fn usual_interval_s(time_s: &[f64]) -> f64 {
    let mut intervals: Vec<f64> = time_s.windows(2).map(|t| t[1] - t[0]).collect();
    let middle = intervals.len() / 2;
    match intervals.is_empty() {
        true => f64::INFINITY,
        false => *intervals.select_nth_unstable_by(middle, f64::total_cmp).1,
    }
}

/// The stretches of a record, those that say most of what rings in them first; `None` where it has no gap
/// that matters.
///
/// What a stretch of ringing says of its frequencies and damping grows with its energy above the noise and
/// with the square of how far that reaches in time.
pub(crate) fn telling_stretches(time_s: &[f64], values: &[f64]) -> Option<Vec<Range<usize>>> {
    let usual_s = usual_interval_s(time_s);
    let all = stretches(time_s, GAP * usual_s);
    let longest = all.iter().max_by_key(|rows| rows.len()).filter(|rows| rows.len() < time_s.len())?;
    let loudest_hz = WholeSpectrum::new(&values[longest.clone()], usual_s).strongest_hz();
    let bridged_s = loudest_hz.map_or(0.0, |hz| OF_PERIOD / hz).max(GAP * usual_s);
    let noise = noise_power(values);
    let says = |rows: &Range<usize>| -> f64 {
        let part = &values[rows.clone()];
        let mean = part.iter().sum::<f64>() / part.len() as f64;
        let power = |k: usize| (values[k] - mean).powi(2) - noise;
        let energy: f64 = rows.clone().map(power).sum();
        let moment: f64 = rows.clone().map(|k| power(k) * time_s[k]).sum();
        let middle_s = moment / energy;
        let reach: f64 = rows.clone().map(|k| power(k) * (time_s[k] - middle_s).powi(2)).sum();
        if energy > 0.0 && reach.is_finite() { reach } else { 0.0 }
    };
    let mut told = stretches(time_s, bridged_s);
    told.sort_by(|a, b| says(b).total_cmp(&says(a)));
    told.first().is_some_and(|best| best.len() < time_s.len()).then_some(told)
}

/// Mean square of the quietest tenth of a signal's blocks, each about its own mean.
fn noise_power(values: &[f64]) -> f64 {
    let power = |block: &[f64]| {
        let mean = block.iter().sum::<f64>() / block.len() as f64;
        block.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / block.len() as f64
    };
    let mut blocks: Vec<f64> = values.chunks((values.len() / BLOCKS).max(8)).map(power).collect();
    blocks.sort_by(f64::total_cmp);
    blocks.get(blocks.len() / 10).copied().unwrap_or(0.0)
}

/// The stretches of a record of ringing between two times, each as a record of its own, the most telling one
/// first; `None` where there are no gaps that matter.
pub(crate) fn ringing_stretches(
    recording: &Recording,
    column: &str,
    window_s: [Option<f64>; 2],
) -> Option<Vec<Recording>> {
    let Present { time_s, values } = present(recording, column).ok()?;
    let from = window_s[0].map_or(0, |start_s| time_s.partition_point(|t| *t < start_s));
    let to = window_s[1].map_or(time_s.len(), |end_s| time_s.partition_point(|t| *t <= end_s));
    let (time_s, values) = (time_s.get(from..to)?, values.get(from..to)?);
    let row = |t: f64| recording.time_s.partition_point(|stamp| *stamp < t);
    let part =
        |rows: Range<usize>| part_of(recording, row(time_s[rows.start])..row(time_s[rows.end - 1]) + 1);
    Some(telling_stretches(time_s, values)?.into_iter().map(part).collect())
}

/// What is said of a record of which one stretch was read, and what of it was left out.
pub(crate) fn beyond_said(
    recording: &Recording,
    column: &str,
    read: &Recording,
) -> (Vec<Warning>, Vec<Rejected>) {
    let (Some(&first_s), Some(&last_s)) = (read.time_s.first(), read.time_s.last()) else {
        return (Vec::new(), Vec::new());
    };
    let present = present(recording, column);
    let mut said =
        present.map_or(Vec::new(), |rows| missing_rows(&recording.name, &rows.time_s, &rows.values));
    let window_s = [first_s, last_s];
    said.push(WarningKind::OneStretchRead { recording: recording.name.clone(), window_s }.into());
    let all = &recording.time_s;
    let beyond =
        [&all[..all.partition_point(|t| *t < first_s)], &all[all.partition_point(|t| *t <= last_s)..]];
    let left_out = beyond.into_iter().filter_map(|stamps| {
        Some(Rejected::Samples {
            recording: recording.name.clone(),
            count: stamps.len(),
            first_s: *stamps.first()?,
            last_s: *stamps.last()?,
            reason: "beyond a gap of the stamps".to_owned(),
        })
    });
    (said, left_out.collect())
}

/// An even grid over a record, and its rows that lie between the gaps.
pub(crate) struct Grid {
    origin_s: f64,
    pub(crate) interval_s: f64,
    count: usize,
}

/// Values on the grid, and the rows of it that were measured.
pub(crate) struct OnGrid {
    /// Between the stretches the mean of all.
    pub(crate) values: Vec<f64>,
    pub(crate) stretches: Vec<Range<usize>>,
}

impl Grid {
    /// Over a record with gaps; `None` where it has none.
    pub(crate) fn of(time_s: &[f64]) -> Option<Self> {
        let parts = stretches(time_s, GAP * usual_interval_s(time_s));
        let (origin_s, end_s) = (*time_s.first()?, *time_s.last()?);
        // The mean interval of all stretches: that of a few rows carries the rounding of their stamps.
        let (mut length_s, mut steps) = (0.0, 0);
        for rows in &parts {
            length_s += time_s[rows.end - 1] - time_s[rows.start];
            steps += rows.len() - 1;
        }
        let interval_s = length_s / steps.max(1) as f64;
        let has_gaps =
            parts.iter().map(ExactSizeIterator::len).sum::<usize>() < time_s.len() || parts.len() > 1;
        let count = ((end_s - origin_s) / interval_s) as usize + 1;
        has_gaps.then_some(Self { origin_s, interval_s, count })
    }

    /// A column of the record on the grid.
    pub(crate) fn take(&self, time_s: &[f64], values: &[f64]) -> OnGrid {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        let mut on_grid = OnGrid { values: vec![mean; self.count], stretches: Vec::new() };
        for rows in stretches(time_s, GAP * usual_interval_s(time_s)) {
            let (times, part) = (&time_s[rows.clone()], &values[rows.clone()]);
            let place = |t: f64| (t - self.origin_s) / self.interval_s;
            let first = (place(times[0]) - 1e-3).ceil().max(0.0) as usize;
            let end = ((place(times[times.len() - 1]) + 1e-3).floor() as usize + 1).min(self.count);
            let curve = PiecewiseCubic::new(times, part, InputInterpolation::Cubic);
            let stamps = (first..end).map(|k| self.origin_s + k as f64 * self.interval_s);
            let taken = curve.sample(stamps).into_iter().map(|at| at[0]);
            on_grid.values.splice(first..end.max(first), taken);
            on_grid.stretches.push(first..end.max(first));
        }
        on_grid
    }
}

/// The rows that are in a stretch of both.
pub(crate) fn in_both(some: &[Range<usize>], others: &[Range<usize>]) -> Vec<Range<usize>> {
    let shared = |a: &Range<usize>, b: &Range<usize>| a.start.max(b.start)..a.end.min(b.end);
    let all = some.iter().flat_map(|a| others.iter().map(move |b| shared(a, b)));
    all.filter(|rows| !rows.is_empty()).collect()
}

/// A driven record cut at the gaps in which its input may have driven it, each part as a record of its own;
/// `None` where there are none. An input that rests on both sides of a gap rested in it. Parts of fewer than
/// 64 rows, and such in which the input rests, are left out.
pub fn driven_stretches(recording: &Recording, input: &str) -> Option<Vec<Recording>> {
    let samples = recording.column(input).ok().filter(|samples| samples.len() == recording.time_s.len())?;
    let rows: Vec<usize> = (0..samples.len()).filter(|row| samples[*row].is_finite()).collect();
    let time_s: Vec<f64> = rows.iter().map(|row| recording.time_s[*row]).collect();
    let values: Vec<f64> = rows.iter().map(|row| samples[*row]).collect();
    let range = |some: &[f64]| {
        let (low, high) = some
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), u| (low.min(*u), high.max(*u)));
        high - low
    };
    let whole = range(&values);
    let rests = |k: usize| {
        let around = &values[k.saturating_sub(RESTS.0)..(k + RESTS.0).min(values.len())];
        range(around) < RESTS.1 * whole
    };
    let longest_s = GAP * usual_interval_s(&time_s);
    let cuts = (1..time_s.len()).filter(|k| time_s[*k] - time_s[*k - 1] > longest_s && !rests(*k));
    let mut edges: Vec<usize> = cuts.map(|k| rows[k]).collect();
    if edges.is_empty() {
        return None;
    }
    edges.insert(0, 0);
    edges.push(recording.time_s.len());
    let parts: Vec<Range<usize>> = edges
        .windows(2)
        .map(|pair| pair[0]..pair[1])
        .filter(|part| part.len() >= SHORTEST && range(&samples[part.clone()]) > RESTS.1 * whole)
        .collect();
    let kept: usize = parts.iter().map(ExactSizeIterator::len).sum();
    let enough = kept as f64 >= IN_STRETCHES * recording.time_s.len() as f64;
    enough.then(|| parts.into_iter().map(|part| part_of(recording, part)).collect())
}

/// What is said of a record that was read in stretches.
pub(crate) fn gaps_said(
    recording: &Recording,
    (input, output): (&str, &str),
    parts: &[Recording],
) -> Vec<Warning> {
    let length_s = |part: &Recording| match (part.time_s.first(), part.time_s.last()) {
        (Some(first), Some(last)) => last - first,
        _ => 0.0,
    };
    let together_s = parts.iter().map(length_s).sum();
    let read =
        WarningKind::StretchesRead { recording: recording.name.clone(), stretches: parts.len(), together_s };
    let seen = present(recording, output);
    let missing = seen.map_or(Vec::new(), |rows| missing_rows(&recording.name, &rows.time_s, &rows.values));
    let driven = present(recording, input).ok().and_then(|rows| input_gap(&rows.time_s, 0.0));
    missing.into_iter().chain(driven).chain([read.into()]).collect()
}

/// What the stamps say of rows that are missing.
pub(crate) fn missing_rows(recording: &str, time_s: &[f64], values: &[f64]) -> Vec<Warning> {
    let is_missing = |warning: &Warning| matches!(warning.kind, WarningKind::MissingSamples { .. });
    stamp_warnings(recording, time_s, values).into_iter().filter(is_missing).collect()
}

/// Some of the rows of a recording.
fn part_of(recording: &Recording, rows: Range<usize>) -> Recording {
    let column = |column: &Column| Column {
        name: column.name.clone(),
        samples: column.samples.get(rows.clone()).map(<[f64]>::to_vec).unwrap_or_default(),
    };
    Recording {
        name: recording.name.clone(),
        time_s: recording.time_s[rows.clone()].to_vec(),
        columns: recording.columns.iter().map(column).collect(),
        ..recording.clone()
    }
}
