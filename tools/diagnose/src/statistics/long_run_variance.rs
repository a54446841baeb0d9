//! How far a sum over a residual series may stray by chance.

use super::autoregression::Autoregression;

/// Variance of the sum of `weights[t] * residuals[t]`, the larger of two estimates:
///
/// * Bartlett windows over the products themselves (W. Newey, K. West, Econometrica 55 (1987) 703), which
///   hold where the noise grows and shrinks along the record, but are unsure of themselves where the weights
///   sit in a few seconds of it (one resonance passage);
/// * the weights run through an autoregressive model of the residuals, which is sure of itself there, but
///   takes the noise as stationary.
///
/// Missing values (NaN) count as zero. `window` is the Bartlett window's width in samples, at least 1.
pub(crate) fn variance_of_weighted_sum(
    weights: &[f64],
    residuals: &[f64],
    colour: &Autoregression,
    window: usize,
) -> f64 {
    bartlett(weights, residuals, window).max(colour.variance_of_sum(weights))
}

/// A Bartlett kernel equals the mean square of sums over a sliding window that runs off both ends.
fn bartlett(weights: &[f64], residuals: &[f64], window: usize) -> f64 {
    let n = weights.len().min(residuals.len());
    let window = window.clamp(1, n.max(1));
    let product = |t: usize| {
        let value = weights[t] * residuals[t];
        if value.is_finite() { value } else { 0.0 }
    };
    let (mut running, mut sum) = (0.0, 0.0);
    for end in 0..n + window - 1 {
        if end < n {
            running += product(end);
        }
        if end >= window {
            running -= product(end - window);
        }
        sum += running * running;
    }
    sum / window as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_of_one_sums_the_squares() {
        let weights = [1.0, -2.0, 3.0];
        let residuals = [0.5, f64::NAN, 2.0];
        assert!((bartlett(&weights, &residuals, 1) - (0.25 + 36.0)).abs() < 1e-12);
    }

    #[test]
    fn noise_that_never_changes_sign_is_seen_as_one_draw() {
        let n = 100;
        let variance = bartlett(&vec![1.0; n], &vec![1.0; n], 20);
        assert!(variance > 15.0 * n as f64, "{variance}");
    }
}
