//! Frames that were lost although the stamps are even: from there on the record is early by whole intervals.
//!
//! A recorder that numbers frames as they arrive stamps them evenly even when some never came. What is
//! recorded after the loss then is y(t + k h) and not y(t), and the residual has a part k h y'(t) from there
//! on. The fit takes up as much of that as its parameters can, so the step is looked for outside their span:
//! at every sample, by least squares of the residual on the fitted output's rate from there on, less its part
//! along the fit's columns and tangents.

use crate::column::Column;
use crate::forced_model::{ForcedModel, pole};
use crate::forced_record::ForcedRecord;
use crate::levenberg_marquardt::{Minimum, Parameter};
use crate::modal_response::Pole;
use crate::separable::{Projected, fit_roughly, span, sum_of_squares_at};
use crate::tall::{Orthonormal, dot};
use crate::warnings::{Warning, WarningKind};

/// Share of the residual's energy that the step must explain, and how sure it must be, as a ratio of sums of
/// squares times rows: far more than the best of all places would give by chance. Lost frames explain nearly
/// all of what they leave; a structure that is not linear leaves what a step explains up to 0.6 of, at some
/// place, to no meaning.
const EXPLAINED: f64 = 0.8;
const SURE: f64 = 100.0;
/// How near, in intervals, the step must be to a whole number of them.
const WHOLE: f64 = 0.25;
/// Steps at most that are looked for.
const MOST: usize = 8;
/// Samples on either side of a step at least.
const BESIDE: usize = 16;

/// One record of a fit: where its rows are among all, and what was fitted there.
pub(crate) struct FittedRecord<'r> {
    pub(crate) name: &'r str,
    pub(crate) first_row: usize,
    /// Stamps, s.
    pub(crate) time_s: Vec<f64>,
    pub(crate) fitted: Vec<f64>,
}

/// Warnings about jumps of a record's clock under even stamps. `residuals` are those of all rows of the fit,
/// `span` its columns and tangents.
pub(crate) fn time_shift_warnings(
    record: &FittedRecord<'_>,
    residuals: &[f64],
    span: &Orthonormal,
) -> Vec<Warning> {
    let time_s = &record.time_s;
    let rows = time_s.len();
    let Some(interval_s) = even_interval_s(time_s) else { return Vec::new() };
    let rate = Column { start: record.first_row, values: rate_of(time_s, &record.fitted) };
    let mut left = residuals.to_vec();
    let mut span = span.clone();
    let mut found = Vec::new();
    for _ in 0..MOST {
        let energy = dot(&left[rate.rows()], &left[rate.rows()]);
        let Some(step) = Step::best(&left, &rate, &span) else { break };
        let intervals = step.shift_s / interval_s;
        let whole = intervals.round();
        let sure = step.gain / (energy - step.gain).max(f64::MIN_POSITIVE) * rows as f64;
        let is_whole = (intervals - whole).abs() < WHOLE && whole != 0.0;
        if step.gain < EXPLAINED * energy || sure < SURE || !is_whole {
            break;
        }
        span.push(Column { start: rate.start + step.row, values: rate.values[step.row..].to_vec() });
        span.remove_from(&mut left);
        found.push(Warning::from(WarningKind::LostFrames {
            recording: record.name.to_owned(),
            count: whole as i64,
            at_s: time_s[step.row],
        }));
    }
    found
}

/// What jumps of the clock explain of a record, as rivals of what a structure may do.
#[derive(Debug, Default)]
pub(crate) struct ClockJumps {
    /// What is left with stamps that jump; `None` where no jump explains anything.
    pub(crate) sum_of_squares: Option<f64>,
    /// Whether all are whole intervals.
    pub(crate) are_whole: bool,
}

/// Share of what is left that a jump must explain to be tried, and how many are.
const TRIED: f64 = 0.1;
const JUMPS: usize = 3;
/// How far, in rows, a jump may be from where it seems to be to first order.
const ROWS: usize = 8;
/// Share of what a jump of any length explains that one of whole intervals must.
const AS_GOOD: f64 = 0.99;

impl ClockJumps {
    /// The jumps that explain most of what a fit leaves, one after the other: the stamps from a row on are
    /// moved and the records fitted anew.
    pub(crate) fn of(model: &ForcedModel<'_>, found: &Minimum<Projected>) -> Self {
        let intervals_s: Vec<Option<f64>> =
            model.records.iter().map(|record| even_interval_s(&record.time_s)).collect();
        let mut records = model.records.to_vec();
        let mut found = found.clone();
        let mut jumps = Self { sum_of_squares: None, are_whole: true };
        for _ in 0..JUMPS {
            let here = ForcedModel { records: &records, ..*model };
            let Some(jump) = Jump::best(&here, &found, &intervals_s) else { break };
            let (moved, again, is_whole) = match jump.tried(&here, &found) {
                Some(tried) if tried.1.sum_of_squares < (1.0 - TRIED) * found.sum_of_squares => tried,
                _ => break,
            };
            // Several jumps that are no whole intervals describe anything.
            if !is_whole && jumps.sum_of_squares.is_some() {
                break;
            }
            jumps =
                Self { sum_of_squares: Some(again.sum_of_squares), are_whole: jumps.are_whole && is_whole };
            (records, found) = (moved, again);
        }
        jumps
    }
}

/// Where a record's clock may jump, and by how much.
#[derive(Debug, Clone, Copy)]
struct Jump {
    record: usize,
    row: usize,
    intervals: f64,
    interval_s: f64,
    gain: f64,
}

impl Jump {
    /// The jump of an even clock that explains most to first order.
    fn best(
        model: &ForcedModel<'_>,
        found: &Minimum<Projected>,
        intervals_s: &[Option<f64>],
    ) -> Option<Self> {
        let span = span(model, found);
        let left = &found.point.residuals;
        let rows = model.rows().enumerate().zip(intervals_s.iter().copied());
        let jumps = rows.filter_map(|((record, (rows, own)), interval_s)| {
            let interval_s = interval_s?;
            let here = &left[rows.clone()];
            let fitted: Vec<f64> = own.output.iter().zip(here).map(|(y, e)| y - e).collect();
            let rate = Column { start: rows.start, values: rate_of(&own.time_s, &fitted) };
            let Step { row, shift_s, gain } = Step::best(left, &rate, &span)?;
            (gain > TRIED * dot(here, here)).then_some(Self {
                record,
                row,
                intervals: shift_s / interval_s,
                interval_s,
                gain,
            })
        });
        jumps.max_by(|a, b| a.gain.total_cmp(&b.gain))
    }

    fn moved(&self, model: &ForcedModel<'_>) -> Vec<ForcedRecord> {
        let mut records = model.records.to_vec();
        let late_s = self.intervals * self.interval_s;
        records[self.record].time_s.iter_mut().skip(self.row).for_each(|t| *t += late_s);
        records
    }

    /// The records with the jump, their fit, and whether it is one of whole intervals.
    fn tried(
        &self,
        model: &ForcedModel<'_>,
        found: &Minimum<Projected>,
    ) -> Option<(Vec<ForcedRecord>, Minimum<Projected>, bool)> {
        let with = |jump: &Self| {
            let records = jump.moved(model);
            let found = refitted(&ForcedModel { records: &records, ..*model }, found)?;
            Some((records, found))
        };
        let nearest = self.intervals.round();
        let intervals = if nearest == 0.0 { self.intervals.signum() } else { nearest };
        let whole = with(&Self { intervals, ..*self }).and_then(|(_, about)| {
            // To first order the place is only about right.
            let at_once = |jump: &Self| {
                let records = jump.moved(model);
                sum_of_squares_at(&ForcedModel { records: &records, ..*model }, &about.parameters)
            };
            let places = (0..=2 * ROWS).map(|k| (self.row + k).saturating_sub(ROWS).max(1));
            let jumps = places.map(|row| Self { row, intervals, ..*self });
            let sums = jumps.filter_map(|jump| Some((at_once(&jump)?, jump)));
            sums.min_by(|a, b| a.0.total_cmp(&b.0)).and_then(|(_, jump)| with(&jump))
        });
        let free = with(self);
        match (whole, free) {
            (Some((_, whole)), Some((records, free)))
                if found.sum_of_squares - whole.sum_of_squares
                    < AS_GOOD * (found.sum_of_squares - free.sum_of_squares) =>
            {
                Some((records, free, false))
            }
            (Some((records, whole)), _) => Some((records, whole, true)),
            (None, Some((records, free))) => Some((records, free, false)),
            (None, None) => None,
        }
    }
}

/// A fit from where another one ended.
pub(crate) fn refitted(model: &ForcedModel<'_>, found: &Minimum<Projected>) -> Option<Minimum<Projected>> {
    let poles: Vec<Pole> = (0..model.modes).map(|mode| pole(&found.parameters, mode)).collect();
    let rate_per_s = model.rate_per_s(&found.parameters);
    let range: Vec<Parameter> = model.parameters(&poles, model.delay_s(&found.parameters), rate_per_s);
    fit_roughly(model, &range)
}

/// The interval of stamps that are even, s.
fn even_interval_s(time_s: &[f64]) -> Option<f64> {
    let rows = time_s.len();
    if rows < 4 * BESIDE {
        return None;
    }
    let interval_s = (time_s[rows - 1] - time_s[0]) / (rows - 1) as f64;
    let even = |pair: &[f64]| (pair[1] - pair[0] - interval_s).abs() < 0.2 * interval_s;
    time_s.windows(2).all(even).then_some(interval_s)
}

/// The rate of what was fitted.
fn rate_of(time_s: &[f64], fitted: &[f64]) -> Vec<f64> {
    let rows = time_s.len();
    let rate = (0..rows).map(|k| {
        let (before, after) = (k.saturating_sub(1), (k + 1).min(rows - 1));
        (fitted[after] - fitted[before]) / (time_s[after] - time_s[before])
    });
    rate.collect()
}

/// From a row on, the record is early by a shift.
struct Step {
    row: usize,
    shift_s: f64,
    /// What it takes off the sum of squares.
    gain: f64,
}

/// Share of a step's column that must lie outside the span for it to be computed at all; whether it matters
/// there is what the gain tells.
const OUTSIDE: f64 = 1e-5;

impl Step {
    /// The step that explains most. Its column is the rate's end, so all inner products are sums from the end
    /// on.
    fn best(left: &[f64], rate: &Column, span: &Orthonormal) -> Option<Self> {
        let directions = span.dense_part(rate.rows());
        let left = &left[rate.rows()];
        let mut along = vec![0.0; directions.len()];
        let (mut product, mut power) = (0.0, 0.0);
        let mut best: Option<Self> = None;
        for row in (BESIDE..rate.values.len()).rev() {
            let v = rate.values[row];
            product += left[row] * v;
            power += v * v;
            for (along, direction) in along.iter_mut().zip(&directions) {
                *along += direction[row] * v;
            }
            let outside = power - dot(&along, &along);
            if rate.values.len() - row < BESIDE || outside <= OUTSIDE * power {
                continue;
            }
            let gain = product * product / outside;
            if best.as_ref().is_none_or(|known| gain > known.gain) {
                best = Some(Self { row, shift_s: product / outside, gain });
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(shift_s: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let time_s: Vec<f64> = (0..4000).map(|k| 0.01 * f64::from(k)).collect();
        let wave = |t: f64| (6.9 * t).sin() + 0.3 * (20.0 * t).cos();
        let fitted: Vec<f64> = time_s.iter().map(|t| wave(*t)).collect();
        let mut state = 5_u64;
        let residuals = time_s
            .iter()
            .zip(&fitted)
            .map(|(t, y)| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                let noise = 0.02 * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5);
                wave(if *t >= 25.0 { t + shift_s } else { *t }) - y + noise
            })
            .collect();
        (time_s, fitted, residuals)
    }

    fn told((time_s, fitted, residuals): (Vec<f64>, Vec<f64>, Vec<f64>)) -> Vec<Warning> {
        let mut span = Orthonormal::default();
        // A fit that may move in size and in time.
        span.push(fitted.clone());
        span.push(time_s.iter().map(|t| (6.9 * t).cos()).collect::<Vec<f64>>());
        span.push(time_s.iter().map(|t| (20.0 * t).sin()).collect::<Vec<f64>>());
        let mut left = residuals;
        span.remove_from(&mut left);
        time_shift_warnings(&FittedRecord { name: "r", first_row: 0, time_s, fitted }, &left, &span)
    }

    #[test]
    fn lost_and_doubled_frames_under_even_stamps_are_found_where_they_are() {
        for (shift_s, wanted) in [(0.01, 1), (0.02, 2), (-0.02, -2)] {
            let found = told(record(shift_s));
            assert!(
                matches!(found.as_slice(), [Warning { kind: WarningKind::LostFrames { count, at_s, .. }, .. }]
                    if *count == wanted && (at_s - 25.0).abs() < 0.1),
                "{shift_s}: {found:?}"
            );
        }
    }

    #[test]
    fn noise_a_delay_and_a_part_of_an_interval_are_no_lost_frames() {
        for shift_s in [0.0, 0.005] {
            assert!(told(record(shift_s)).is_empty(), "{shift_s}");
        }
        let (time_s, fitted, residuals) = record(0.0);
        let delayed = residuals.iter().zip(&time_s).map(|(e, t)| e + 0.069 * (6.9 * t).cos()).collect();
        assert!(told((time_s, fitted, delayed)).is_empty());
    }
}
