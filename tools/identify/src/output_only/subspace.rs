//! Covariance-driven stochastic subspace identification (Peeters and De Roeck 1999).
//!
//! Under excitation without a pattern the covariance of the outputs by lag is a sum of free decays of the
//! structure. The Hankel matrix of these covariances has the observability matrix of the structure as its
//! range; its shift by one block of rows is the state transition, whose eigenvalues are the poles and whose
//! eigenvectors give the shapes.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rustfft::num_complex::Complex64;

use crate::poles::ContinuousPole;

/// Rows of the Hankel matrix at most: the cube of it is the cost.
const MAX_ROWS: usize = 80;

/// Covariances of outputs by lag, from lag 0 on.
#[derive(Clone)]
pub(super) struct Covariances(pub(super) Vec<DMatrix<f64>>);

/// Outputs at even times: one vector per output.
pub(super) struct Outputs {
    pub(super) samples: Vec<Vec<f64>>,
    pub(super) interval_s: f64,
}

impl Outputs {
    /// How many block rows the Hankel matrix has.
    pub(super) fn block_rows(&self) -> usize {
        let rows = self.samples.first().map_or(0, Vec::len);
        (MAX_ROWS / self.samples.len().max(1)).min(rows / 10).max(2)
    }

    /// Covariances of equal stretches of the record, up to the last lag that the Hankel matrix needs.
    pub(super) fn covariances(&self, stretches: usize) -> Vec<Covariances> {
        let lags = 2 * self.block_rows();
        let rows = self.samples[0].len().saturating_sub(lags);
        let length = rows / stretches;
        (0..stretches)
            .map(|stretch| self.covariance(stretch * length..(stretch + 1) * length, lags))
            .collect()
    }

    fn covariance(&self, rows: std::ops::Range<usize>, lags: usize) -> Covariances {
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

/// A pole with what it looks like at the outputs.
#[derive(Debug, Clone)]
pub(super) struct ShapedPole {
    pub(super) pole: ContinuousPole,
    /// Eigenvalue of the transition by one interval.
    pub(super) z: Complex64,
    /// Share of each output.
    pub(super) shape: Vec<Complex64>,
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
        let outputs = covariances.0.first()?.nrows();
        let blocks = (covariances.0.len() - 1) / 2;
        let size = blocks * outputs;
        let hankel = DMatrix::from_fn(size, size, |row, column| {
            covariances.0[row / outputs + column / outputs + 1][(row % outputs, column % outputs)]
        });
        let square = &hankel * hankel.transpose();
        if square.iter().any(|value| !value.is_finite()) {
            return None;
        }
        let eigen = SymmetricEigen::try_new(square, f64::EPSILON, 10_000)?;
        let mut order: Vec<usize> = (0..size).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        Some(Self { observability: eigen.eigenvectors.select_columns(&order), outputs, interval_s })
    }

    /// Rows of the Hankel matrix.
    pub(super) fn size(&self) -> usize {
        self.observability.nrows()
    }

    /// Poles of one order (two per mode) that oscillate and decay, with their shapes.
    pub(super) fn poles(&self, order: usize) -> Vec<ShapedPole> {
        let (rows, outputs) = (self.observability.nrows(), self.outputs);
        if order == 0 || order + outputs >= rows {
            return Vec::new();
        }
        let upper = self.observability.view((0, 0), (rows - outputs, order)).into_owned();
        let lower = self.observability.view((outputs, 0), (rows - outputs, order)).into_owned();
        let Some(transition) = (upper.transpose() * &upper).lu().solve(&(upper.transpose() * lower)) else {
            return Vec::new();
        };
        let seen = self.observability.view((0, 0), (outputs, order)).into_owned();
        let values = crate::poles::eigenvalues(transition.clone());
        let mut found: Vec<ShapedPole> = values
            .into_iter()
            .filter_map(|z| {
                let pole =
                    ContinuousPole::of_z(z, self.interval_s).filter(|pole| pole.damping_ratio > 0.0)?;
                let vector = eigenvector(&transition, z)?;
                let shape = (0..outputs)
                    .map(|i| (0..order).map(|k| vector[k] * seen[(i, k)]).sum::<Complex64>())
                    .collect();
                Some(ShapedPole { pole, z, shape })
            })
            .collect();
        found.sort_by(|a, b| a.pole.frequency_hz.total_cmp(&b.pole.frequency_hz));
        found
    }
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
