//! Instants at which something outside hits the structure.
//!
//! An autoregression foresees all that rings freely, beats of close modes included; a knock it does not. An
//! instant counts as a knock when it is far out of the usual error of the prediction and the structure rings
//! louder after it.

use nalgebra::{DMatrix, DVector};

use super::{median, rms};
use crate::narrow_band::WholeSpectrum;
use crate::poles::decimated;

/// Samples per period of the loudest frequency at which the record is looked at.
const PER_PERIOD: f64 = 8.0;
/// Order of the autoregression.
pub(super) const ORDER: usize = 12;
/// Samples over which errors of the prediction count together: beneath noise a knock is not foreseen for a
/// while.
const TOGETHER: usize = 6;
/// Usual errors beyond which their norm is no chance: of noise it is more once in ten million instants.
const UNFORESEEN: f64 = 6.7;
/// And what share of the loudness after it, at least.
const SHARE: f64 = 0.15;
/// Periods over which loudness before and after is compared, and periods between two knocks.
const PERIODS: f64 = 3.0;
const APART: f64 = 5.0;
/// How much louder it is after a knock.
const LOUDER: f64 = 1.3;
/// A knock is this share of the loudest, at least.
const COUNTS: f64 = 0.2;

/// Times of the knocks from the beginning of the signal, s.
pub(super) fn knocks(signal: &[f64], interval_s: f64) -> Vec<f64> {
    let Some(loudest_hz) = WholeSpectrum::new(signal, interval_s).strongest_hz() else { return Vec::new() };
    let (slow, step_s) = decimated(signal, interval_s, PER_PERIOD * loudest_hz);
    let window = ((PERIODS / (loudest_hz * step_s)) as usize).max(8);
    if slow.len() < 4 * window || slow.len() < 6 * ORDER {
        return Vec::new();
    }
    let Some(errors) = Autoregression::of(&slow).map(|one| one.errors(&slow)) else { return Vec::new() };
    let usual = (median(errors.iter().map(|e| e.abs()).collect()) / 0.6745).max(1e-9 * rms(&slow));
    let loudness = |from: usize, to: usize| rms(&slow[from.min(slow.len())..to.min(slow.len())]);
    let mut found: Vec<(usize, f64)> = Vec::new();
    let apart = ((APART / (loudest_hz * step_s)) as usize).max(ORDER);
    let mut k = 0;
    while k < errors.len() {
        let at = k + ORDER;
        let after = loudness(at, at + window);
        let together = &errors[k..(k + TOGETHER).min(errors.len())];
        let error = together.iter().map(|e| e * e).sum::<f64>().sqrt();
        if error > UNFORESEEN * usual && error > SHARE * after {
            let before = loudness(at.saturating_sub(window), at.saturating_sub(1));
            if after > LOUDER * before {
                found.push((at, after));
                k += apart;
                continue;
            }
        }
        k += 1;
    }
    // What rings when the record begins was knocked before.
    let opening = loudness(0, window);
    let loudest = found.iter().map(|one| one.1).fold(opening, f64::max);
    let quietest = slow.chunks(window).map(rms).fold(f64::INFINITY, f64::min);
    if found.first().is_none_or(|first| first.0 > 2 * window) && opening > 3.0 * quietest {
        found.insert(0, (0, opening));
    }
    found.iter().filter(|one| one.1 > COUNTS * loudest).map(|one| one.0 as f64 * step_s).collect()
}

/// What foresees each sample from those before it.
pub(super) struct Autoregression {
    weights: DVector<f64>,
}

impl Autoregression {
    /// The least-squares one of a signal.
    pub(super) fn of(signal: &[f64]) -> Option<Self> {
        let rows = signal.len().checked_sub(ORDER).filter(|rows| *rows > ORDER)?;
        let past = past_of(signal, rows);
        let next = DVector::from_fn(rows, |row, _| signal[row + ORDER]);
        let mut square = past.transpose() * &past;
        let ridge = 1e-10 * square.trace() / ORDER as f64;
        (0..ORDER).for_each(|k| square[(k, k)] += ridge.max(f64::MIN_POSITIVE));
        let weights = square.cholesky()?.solve(&(past.transpose() * &next));
        weights.iter().all(|w| w.is_finite()).then_some(Self { weights })
    }

    /// Errors of the prediction of a signal, from the order on.
    pub(super) fn errors(&self, signal: &[f64]) -> Vec<f64> {
        let rows = signal.len().saturating_sub(ORDER);
        let foreseen = past_of(signal, rows) * &self.weights;
        (0..rows).map(|row| signal[row + ORDER] - foreseen[row]).collect()
    }
}

fn past_of(signal: &[f64], rows: usize) -> DMatrix<f64> {
    DMatrix::from_fn(rows, ORDER, |row, lag| signal[row + ORDER - 1 - lag])
}
