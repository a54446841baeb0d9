//! Covariance-driven stochastic subspace identification (Peeters and De Roeck 1999).
//!
//! Under excitation without a pattern the covariance of the outputs by lag is a sum of free decays of the
//! structure. The Hankel matrix of these covariances has the observability matrix of the structure as its
//! range; its shift by one block of rows is the state transition, whose eigenvalues are the poles and whose
//! eigenvectors give the shapes.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rustfft::num_complex::Complex64;

use crate::poles::ContinuousPole;

/// Rows of the Hankel matrix at most: the cube of it is the cost.
const MAX_ROWS: usize = 120;
/// Steps of the subspace iteration for a shortened record.
const ITERATIONS: usize = 2;

/// Covariances of outputs by lag, from lag 0 on.
#[derive(Clone)]
pub(super) struct Covariances(pub(super) Vec<DMatrix<f64>>);

/// Outputs at even times: one vector per output.
pub(super) struct Outputs {
    samples: Vec<Vec<f64>>,
    pub(super) interval_s: f64,
    /// Rows between gaps.
    sound: Vec<Range<usize>>,
    /// What the usual block rows are divided by.
    shortened: usize,
}

/// Rows beside a gap that the low-pass of the decimation disturbs.
const BESIDE_GAP: usize = 4;

impl Outputs {
    /// Of outputs that were decimated from an interval (s) at which these rows lie between gaps.
    pub(super) fn new(
        slow: Vec<(Vec<f64>, f64)>,
        sound: &[Range<usize>],
        from_interval_s: f64,
        shortened: usize,
    ) -> Self {
        let interval_s = slow.first().map_or(from_interval_s, |one| one.1);
        let samples: Vec<Vec<f64>> = slow.into_iter().map(|(samples, _)| samples).collect();
        let count = samples.iter().map(Vec::len).min().unwrap_or(0);
        let at = |row: usize| row as f64 * from_interval_s / interval_s;
        let slow_rows = |rows: &Range<usize>| {
            let start = if rows.start == 0 { 0 } else { at(rows.start).ceil() as usize + BESIDE_GAP };
            let end = (at(rows.end) as usize).saturating_sub(BESIDE_GAP);
            start..end.min(count).max(start)
        };
        let sound = sound.iter().map(slow_rows).filter(|rows| !rows.is_empty()).collect();
        Self { samples, interval_s, sound, shortened }
    }

    /// How many rows lie between gaps.
    pub(super) fn sound_rows(&self) -> usize {
        self.sound.iter().map(ExactSizeIterator::len).sum()
    }

    /// How many block rows the Hankel matrix has.
    pub(super) fn block_rows(&self) -> usize {
        let rows = self.sound.iter().map(ExactSizeIterator::len).max().unwrap_or(0);
        (MAX_ROWS / self.shortened.max(1) / self.samples.len().max(1)).min(rows / 10).max(2)
    }

    /// Covariances of about that many stretches of the record, equal but for where gaps cut them, up to the
    /// last lag that the Hankel matrix needs.
    pub(super) fn covariances(&self, stretches: usize) -> Vec<Covariances> {
        let lags = 2 * self.block_rows();
        let usable = |rows: &Range<usize>| rows.len().saturating_sub(lags);
        let all: usize = self.sound.iter().map(usable).sum();
        let cut = |rows: &Range<usize>| {
            let (start, count) = (rows.start, (usable(rows) * stretches + all / 2) / all.max(1));
            let length = usable(rows) / count.max(1);
            (0..count).map(move |k| start + k * length..start + (k + 1) * length)
        };
        self.sound.iter().flat_map(cut).map(|rows| self.covariance(rows, lags)).collect()
    }

    fn covariance(&self, rows: Range<usize>, lags: usize) -> Covariances {
        let outputs = self.samples.len();
        let count = rows.len().max(1) as f64;
        let one = |lag: usize| {
            DMatrix::from_fn(outputs, outputs, |i, j| {
                let later = &self.samples[i][rows.start + lag..rows.end + lag];
                let now = &self.samples[j][rows.clone()];
                crate::tall::dot(later, now) / count
            })
        };
        Covariances((0..=lags).map(one).collect())
    }
}

impl Covariances {
    /// How many outputs they are of.
    pub(super) fn outputs(&self) -> usize {
        self.0.first().map_or(0, DMatrix::nrows)
    }

    /// The mean of several; those of index `without` left out.
    pub(super) fn mean(all: &[Self], without: Option<usize>) -> Self {
        let kept: Vec<&Self> =
            all.iter().enumerate().filter(|(index, _)| Some(*index) != without).map(|(_, one)| one).collect();
        let sum = |lag: usize| {
            let zero = DMatrix::zeros(kept[0].0[lag].nrows(), kept[0].0[lag].ncols());
            kept.iter().fold(zero, |sum, one| sum + &one.0[lag]) / kept.len() as f64
        };
        Self((0..kept[0].0.len()).map(sum).collect())
    }
}

/// A pole of one order.
#[derive(Debug, Clone, Copy)]
pub(super) struct OrderPole {
    pub(super) pole: ContinuousPole,
    /// Eigenvalue of the transition by one interval.
    pub(super) z: Complex64,
}

/// The range of the Hankel matrix, from which every order is read off.
pub(super) struct Subspace {
    observability: DMatrix<f64>,
    outputs: usize,
    interval_s: f64,
}

impl Subspace {
    /// `None` where the covariances cannot be computed with.
    pub(super) fn new(covariances: &Covariances, interval_s: f64) -> Option<Self> {
        let hankel = hankel(covariances)?;
        let observability = principal(&hankel * hankel.transpose())?;
        Some(Self { observability, outputs: covariances.outputs(), interval_s })
    }

    /// The first `kept` columns of the same of covariances that hardly differ: subspace iteration from this
    /// range.
    pub(super) fn near(&self, covariances: &Covariances, kept: usize) -> Option<Self> {
        let hankel = hankel(covariances)?;
        let mut range = self.observability.columns(0, kept.min(self.observability.ncols())).into_owned();
        for _ in 0..ITERATIONS {
            range = (&hankel * hankel.tr_mul(&range)).qr().q();
        }
        let seen = hankel.tr_mul(&range);
        let observability = range * principal(seen.tr_mul(&seen))?;
        Some(Self { observability, ..*self })
    }

    /// Rows of the Hankel matrix.
    pub(super) fn size(&self) -> usize {
        self.observability.nrows()
    }

    /// The transition by one interval of a model of this order.
    fn transition(&self, order: usize) -> Option<DMatrix<f64>> {
        let (rows, outputs) = (self.observability.nrows(), self.outputs);
        if order == 0 || order > self.observability.ncols() || order + outputs >= rows {
            return None;
        }
        let upper = self.observability.view((0, 0), (rows - outputs, order));
        let lower = self.observability.view((outputs, 0), (rows - outputs, order));
        upper.tr_mul(&upper).lu().solve(&upper.tr_mul(&lower))
    }

    /// Poles of one order (two per mode) that oscillate and decay, by frequency.
    pub(super) fn poles(&self, order: usize) -> Vec<OrderPole> {
        let Some(transition) = self.transition(order) else { return Vec::new() };
        let pole = |z: Complex64| {
            let pole = ContinuousPole::of_z(z, self.interval_s).filter(|pole| pole.damping_ratio > 0.0)?;
            Some(OrderPole { pole, z })
        };
        let mut found: Vec<OrderPole> =
            crate::poles::eigenvalues(transition).into_iter().filter_map(pole).collect();
        found.sort_by(|a, b| a.pole.frequency_hz.total_cmp(&b.pole.frequency_hz));
        found
    }

    /// What a pole of an order looks like: the share of each output.
    pub(super) fn shape(&self, order: usize, pole: &OrderPole) -> Option<Vec<Complex64>> {
        let vector = eigenvector(&self.transition(order)?, pole.z)?;
        let share = |output: usize| (0..order).map(|k| vector[k] * self.observability[(output, k)]).sum();
        Some((0..self.outputs).map(share).collect())
    }
}

/// Block rows of covariances at rising lags; `None` where they cannot be computed with.
fn hankel(covariances: &Covariances) -> Option<DMatrix<f64>> {
    let outputs = covariances.outputs();
    let size = (covariances.0.len() - 1) / 2 * outputs;
    let hankel = DMatrix::from_fn(size, size, |row, column| {
        covariances.0[row / outputs + column / outputs + 1][(row % outputs, column % outputs)]
    });
    hankel.iter().all(|value| value.is_finite()).then_some(hankel)
}

/// Eigenvectors of a symmetric matrix, those of the largest values first.
fn principal(square: DMatrix<f64>) -> Option<DMatrix<f64>> {
    if square.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::try_new(square, f64::EPSILON, 10_000)?;
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    Some(eigen.eigenvectors.select_columns(&order))
}

/// The eigenvector of a value, by one step of inverse iteration from a vector that favours no direction.
fn eigenvector(matrix: &DMatrix<f64>, value: Complex64) -> Option<DVector<Complex64>> {
    let size = matrix.nrows();
    let beside = value * (1.0 + 1e-9);
    let shifted = DMatrix::from_fn(size, size, |i, j| {
        Complex64::new(matrix[(i, j)], 0.0) - if i == j { beside } else { Complex64::new(0.0, 0.0) }
    });
    let lu = shifted.lu();
    let mut vector = DVector::from_fn(size, |k, _| Complex64::new(1.0, 0.1 * k as f64));
    for _ in 0..2 {
        vector = lu.solve(&vector)?;
        let size = vector.norm();
        vector /= Complex64::new(size, 0.0);
    }
    vector.iter().all(|x| x.re.is_finite() && x.im.is_finite()).then_some(vector)
}
