//! The eigensystem realisation algorithm (Juang and Pappa 1985), for free decays.
//!
//! The rows of a Hankel matrix of the decay span the observability matrix of the system that made it; its
//! shift by one row is the state transition, whose eigenvalues are the poles. The left singular vectors are
//! taken from the matrix times its transpose, so that the whole record counts, however long; white noise adds
//! the same to every one of its eigenvalues and does not turn them.

use nalgebra::{DMatrix, SymmetricEigen};

use super::ContinuousPole;
use super::polynomial::eigenvalues;

/// Rows of the Hankel matrix at most: the cube of it is the cost.
const MAX_ROWS: usize = 160;

/// The left singular vectors of a decay's Hankel matrix, from which every order is read off.
pub(super) struct Realisation {
    /// By falling singular value.
    vectors: DMatrix<f64>,
    interval_s: f64,
}

impl Realisation {
    /// `None` for sequences too short for two rows.
    pub(super) fn new(sequence: &[f64], interval_s: f64) -> Option<Self> {
        let rows = (sequence.len() / 3).min(MAX_ROWS);
        let columns = (sequence.len() + 1).checked_sub(rows).filter(|_| rows >= 2)?;
        let mut square = DMatrix::<f64>::zeros(rows, rows);
        for j in 0..rows {
            square[(0, j)] = (0..columns).map(|k| sequence[k] * sequence[k + j]).sum();
        }
        for i in 1..rows {
            for j in i..rows {
                // One step further along the record: the first product leaves, one more comes in.
                square[(i, j)] = square[(i - 1, j - 1)] - sequence[i - 1] * sequence[j - 1]
                    + sequence[columns + i - 1] * sequence[columns + j - 1];
            }
        }
        square.fill_lower_triangle_with_upper_triangle();
        if square.iter().any(|value| !value.is_finite()) {
            return None;
        }
        let eigen = SymmetricEigen::try_new(square, f64::EPSILON, 10_000)?;
        let mut order: Vec<usize> = (0..rows).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        Some(Self { vectors: eigen.eigenvectors.select_columns(&order), interval_s })
    }

    /// Poles of one order (two per mode), by frequency.
    pub(super) fn poles(&self, order: usize) -> Vec<ContinuousPole> {
        let rows = self.vectors.nrows();
        if order == 0 || order >= rows {
            return Vec::new();
        }
        let upper = self.vectors.view((0, 0), (rows - 1, order)).into_owned();
        let lower = self.vectors.view((1, 0), (rows - 1, order)).into_owned();
        // The vectors are orthonormal but for the missing row, so the normal equations are well conditioned.
        let square = upper.transpose() * &upper;
        let Some(transition) = square.lu().solve(&(upper.transpose() * lower)) else {
            return Vec::new();
        };
        let found = eigenvalues(transition).into_iter();
        let mut poles: Vec<ContinuousPole> =
            found.filter_map(|z| ContinuousPole::of_z(z, self.interval_s)).collect();
        poles.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
        poles
    }
}

/// Poles of a free decay, without its constant part, by eigensystem realisation of the given order, two per
/// mode.
///
/// The decay should be sampled no faster than ten times its highest frequency or so: the matrix has at most
/// 160 rows, and modes that barely turn within them cannot be told from a trend.
pub fn eigensystem_realisation(decay: &[f64], interval_s: f64, order: usize) -> Vec<ContinuousPole> {
    Realisation::new(decay, interval_s).map(|realised| realised.poles(order)).unwrap_or_default()
}
