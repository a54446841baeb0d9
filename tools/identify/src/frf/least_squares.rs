//! Small complex least-squares problems by Householder QR.

use nalgebra::{DMatrix, DVector};
use rustfft::num_complex::Complex64;

/// Solution, residual power per degree of freedom, and covariance for unit residual power.
pub(crate) struct Solution {
    pub(crate) x: DVector<Complex64>,
    /// Mean square of the equations' errors: residual sum of squares over degrees of freedom.
    pub(crate) power: f64,
    /// (A^H A)^-1.
    pub(crate) cofactor: DMatrix<Complex64>,
}

/// Least squares of `a x = b`; `None` when the columns are dependent or there are no more rows than columns.
pub(crate) fn solve(mut a: DMatrix<Complex64>, b: DVector<Complex64>) -> Option<Solution> {
    let (rows, columns) = a.shape();
    if rows <= columns {
        return None;
    }
    // Columns of equal length: powers of the line number and spectra differ by many orders of magnitude.
    let scale: Vec<f64> = a.column_iter().map(|column| column.norm()).collect();
    if scale.iter().any(|norm| !(*norm > 0.0 && norm.is_finite())) {
        return None;
    }
    for (mut column, norm) in a.column_iter_mut().zip(&scale) {
        column /= Complex64::from(*norm);
    }
    let qr = a.clone().qr();
    let r = qr.r();
    if (0..columns).any(|k| r[(k, k)].norm() < 1e-10) {
        return None;
    }
    let projected = qr.q().adjoint() * &b;
    let scaled = r.solve_upper_triangular(&projected)?;
    let power = (b - a * &scaled).norm_squared() / (rows - columns) as f64;
    let inverse = r.solve_upper_triangular(&DMatrix::identity(columns, columns))?;
    let mut cofactor = &inverse * inverse.adjoint();
    let mut x = scaled;
    for i in 0..columns {
        x[i] /= Complex64::from(scale[i]);
        for j in 0..columns {
            cofactor[(i, j)] /= Complex64::from(scale[i] * scale[j]);
        }
    }
    Some(Solution { x, power, cofactor })
}
