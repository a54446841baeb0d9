//! Roots of real polynomials, as eigenvalues of the companion matrix.

use nalgebra::{DMatrix, Schur};
use rustfft::num_complex::Complex64;

/// Iterations of the QR algorithm after which a matrix counts as hopeless.
const MAX_ITERATIONS: usize = 10_000;

/// Roots of x^n + c_{n-1} x^{n-1} + ... + c_0, coefficients from c_0 upwards. Empty when they cannot be
/// found.
pub(super) fn roots(coefficients: &[f64]) -> Vec<Complex64> {
    let n = coefficients.len();
    let companion = DMatrix::from_fn(n, n, |row, column| match (row, column) {
        (row, column) if column + 1 == n => -coefficients[row],
        (row, column) if row == column + 1 => 1.0,
        _ => 0.0,
    });
    eigenvalues(companion)
}

/// Eigenvalues of a real matrix. Empty when they cannot be found.
pub(crate) fn eigenvalues(matrix: DMatrix<f64>) -> Vec<Complex64> {
    if matrix.is_empty() || matrix.iter().any(|value| !value.is_finite()) {
        return Vec::new();
    }
    Schur::try_new(matrix, f64::EPSILON, MAX_ITERATIONS)
        .map(|schur| schur.complex_eigenvalues().iter().copied().collect())
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_of_a_product_are_its_factors() {
        // (x - 2)(x² + x + 1) = x³ - x² - x - 2
        let mut found = roots(&[-2.0, -1.0, -1.0]);
        found.sort_by(|a, b| a.re.total_cmp(&b.re).then(a.im.total_cmp(&b.im)));
        let wanted = [(-0.5, -(0.75_f64.sqrt())), (-0.5, 0.75_f64.sqrt()), (2.0, 0.0)];
        for (root, (re, im)) in found.iter().zip(wanted) {
            assert!((root - Complex64::new(re, im)).norm() < 1e-12, "{root}");
        }
        assert!(roots(&[]).is_empty() && roots(&[f64::NAN]).is_empty());
    }
}
