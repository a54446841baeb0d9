//! The least-squares complex exponential method (Brown, Allemang, Zimmerman and Mergeay 1979).
//!
//! A sum of n decaying oscillations, sampled evenly, obeys a linear recursion of order 2 n whose coefficients
//! are the polynomial with the poles z as roots. The coefficients are found by least squares over the
//! sequence.

use nalgebra::{DMatrix, DVector};

use super::ContinuousPole;
use super::polynomial::roots;

/// Equations used at most: beyond, the sequence is taken to hold nothing but noise.
const MAX_EQUATIONS: usize = 4000;

/// Poles of a sequence that is a sum of decaying oscillations: an impulse response or a free decay without
/// its constant part. `order` is the recursion's, two per mode.
///
/// Noise enters both sides of the equations and so damps the poles; orders far above twice the number of
/// modes take the noise up, at the price of poles that mean nothing: see [`super::StabilisationChart`].
pub fn complex_exponential(sequence: &[f64], interval_s: f64, order: usize) -> Vec<ContinuousPole> {
    let equations = sequence.len().saturating_sub(order).min(MAX_EQUATIONS);
    if order == 0 || equations < order {
        return Vec::new();
    }
    // The normal equations, built up without the tall matrix: neighbouring entries differ by two products.
    let product =
        |i: usize, j: usize| -> f64 { (0..equations).map(|row| sequence[row + i] * sequence[row + j]).sum() };
    let mut moments = DMatrix::zeros(order + 1, order + 1);
    for j in 0..=order {
        moments[(0, j)] = product(0, j);
    }
    for i in 1..=order {
        for j in i..=order {
            moments[(i, j)] = moments[(i - 1, j - 1)] - sequence[i - 1] * sequence[j - 1]
                + sequence[equations + i - 1] * sequence[equations + j - 1];
        }
    }
    for i in 0..=order {
        for j in 0..i {
            moments[(i, j)] = moments[(j, i)];
        }
    }
    let square = moments.view((0, 0), (order, order)).into_owned();
    let right = DVector::from_fn(order, |row, _| -moments[(row, order)]);
    let Some(coefficients) = super::frequency_domain::solve_symmetric(square, right) else {
        return Vec::new();
    };
    let found = roots(coefficients.as_slice()).into_iter();
    let mut poles: Vec<ContinuousPole> = found.filter_map(|z| ContinuousPole::of_z(z, interval_s)).collect();
    poles.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    poles
}
