//! Standard errors that stay honest when the residuals are correlated in time.
//!
//! The textbook covariance s² (J'J)⁻¹ assumes white residuals of constant size. Here the middle of the
//! sandwich (J'J)⁻¹ S (J'J)⁻¹ is estimated from the scores J_t e_t themselves with Bartlett weights
//! (W. Newey, K. West, Econometrica 55 (1987) 703). The bandwidth follows the first autocorrelation of
//! the residuals (D. Andrews, Econometrica 59 (1991) 817, AR(1) rule).

use nalgebra::DMatrix;

use crate::column::Column;
use crate::tall::{dot, gram};

/// Covariance of the parameters whose Jacobian columns are given; `None` when J'J cannot be inverted or
/// there are not more residuals than parameters.
pub(crate) fn covariance(jacobian: &[Column], residuals: &[f64]) -> Option<DMatrix<f64>> {
    let n = residuals.len();
    let p = jacobian.len();
    if n <= p {
        return None;
    }
    // Unit columns: participation and frequency differ by many orders of magnitude.
    let products = gram(jacobian);
    let lengths: Vec<f64> = products.diagonal().iter().map(|square| square.sqrt()).collect();

    if lengths.iter().any(|length| !(length.is_normal() && length.is_finite())) {
        return None;
    }
    let bread = DMatrix::from_fn(p, p, |i, j| products[(i, j)] / (lengths[i] * lengths[j]));
    let bread = bread.cholesky()?.inverse();
    let middle = score_covariance(jacobian, &lengths, residuals, bandwidth(residuals));
    let correction = n as f64 / (n - p) as f64;
    let scaled = &bread * middle * &bread * correction;
    let unscaled = DMatrix::from_fn(p, p, |i, j| scaled[(i, j)] / (lengths[i] * lengths[j]));
    unscaled.iter().all(|value| value.is_finite()).then_some(unscaled)
}

/// Bartlett-weighted sum of the scores' autocovariances.
///
/// A Bartlett kernel of width L equals the mean square of sums over a sliding window of L scores, running
/// off both ends of the record, which costs the same for every L.
fn score_covariance(jacobian: &[Column], lengths: &[f64], residuals: &[f64], width: usize) -> DMatrix<f64> {
    let sums: Vec<Column> = jacobian
        .iter()
        .zip(lengths)
        .map(|(column, length)| {
            let here = &residuals[column.rows()];
            let scores = column.values.iter().zip(here).map(|(slope, e)| slope * e / length);
            sliding_sums(Column { start: column.start, values: scores.collect() }, width)
        })
        .collect();
    gram(&sums) / width as f64
}

/// Sums over the `width` rows that end at each row, from the first that is not zero to the last.
fn sliding_sums(scores: Column, width: usize) -> Column {
    if width == 1 {
        return scores;
    }
    let n = scores.values.len();
    let mut sum = 0.0;
    let sums = (0..n + width - 1).map(|end| {
        sum += scores.values.get(end).copied().unwrap_or(0.0);
        if end >= width {
            sum -= scores.values[end - width];
        }
        sum
    });
    Column { start: scores.start, values: sums.collect() }
}

/// Width of the Bartlett window in samples: 1 takes the residuals as uncorrelated.
fn bandwidth(residuals: &[f64]) -> usize {
    let n = residuals.len();
    let power = dot(residuals, residuals);
    let later = residuals.get(1..).unwrap_or_default();
    let lag_one = dot(&residuals[..later.len()], later);
    let rho = if power > 0.0 { (lag_one / power).clamp(-0.97, 0.97) } else { 0.0 };
    let alpha = 4.0 * rho * rho / ((1.0 - rho * rho).powi(2));
    let width = 1.1447 * (alpha * n as f64).cbrt();
    (width.ceil() as usize).clamp(1, (n / 8).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(seed: u64, n: usize) -> Vec<f64> {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut uniform = move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..n).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
    }

    /// Fits a line through AR(1) noise many times and compares the scatter of the slope with what is claimed.
    fn claimed_over_actual(rho: f64) -> f64 {
        let n = 2000;
        let columns = [vec![1.0; n], (0..n).map(|t| t as f64 / n as f64 - 0.5).collect::<Vec<_>>()];
        let mut actual = 0.0;
        let mut claimed = 0.0;
        for seed in 1..=300 {
            let mut last = 0.0;
            let mut e: Vec<f64> = noise(seed, n)
                .into_iter()
                .map(|innovation| {
                    last = rho * last + innovation;
                    last
                })
                .collect();
            let slope = dot(&columns[1], &e) / dot(&columns[1], &columns[1]);
            let level = e.iter().sum::<f64>() / n as f64;
            for (t, value) in e.iter_mut().enumerate() {
                *value -= level + slope * columns[1][t];
            }
            actual += slope * slope;
            claimed += covariance(&columns.iter().cloned().map(Column::from).collect::<Vec<_>>(), &e)
                .unwrap()[(1, 1)];
        }
        (claimed / actual).sqrt()
    }

    #[test]
    fn claimed_errors_match_the_scatter_for_white_and_coloured_residuals() {
        for rho in [0.0, 0.5, 0.9, -0.5] {
            let ratio = claimed_over_actual(rho);
            assert!((0.8..1.2).contains(&ratio), "rho {rho}: claimed/actual = {ratio:.3}");
        }
    }

    #[test]
    fn parameters_that_cannot_be_told_apart_have_no_covariance() {
        let column = Column::from(noise(1, 100));
        assert!(covariance(&[column.clone(), column], &noise(2, 100)).is_none());
    }
}
