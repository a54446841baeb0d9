//! The logarithmic decrement, with the count of periods right.
//!
//! A free oscillation w(t) = A exp(-zeta omega t) cos(omega_d t + phi) has its successive positive peaks one
//! damped period T = 2 pi / omega_d apart. From the first peak w_1 to the n-th peak w_n there are n - 1
//! periods, not n, hence
//!
//! ```text
//! w_1 / w_n = exp(zeta omega (n - 1) T)
//! delta     = ln(w_1 / w_n) / (n - 1) = zeta omega T = 2 pi zeta / sqrt(1 - zeta²)      (29, corrected)
//! zeta      = 1 / sqrt(1 + (2 pi / delta)²)                                            (28)
//! ```
//!
//! The paper's eq. (29) divides by n. With two peaks that halves the damping; with many it hardly matters.
//! The standard error follows from that of a peak's height, e: delta's is
//! e sqrt(1/w_1² + 1/w_n²) / (n - 1), and zeta's is delta's times about 1/(2 pi).

use std::f64::consts::TAU;

use crate::result::Estimate;

/// Damping ratio from positive peak heights of one mode, all in the same unit, `peak_stderr` the standard
/// error of one height.
///
/// `None` for fewer than two peaks, peaks that are not positive, or a last peak not below the first.
pub fn damping_from_peaks(peaks: &[f64], peak_stderr: f64) -> Option<Estimate> {
    let (first, last) = (*peaks.first()?, *peaks.last()?);
    let periods = peaks.len().checked_sub(1).filter(|n| *n > 0)? as f64;
    if !(last > 0.0 && first > last && first.is_finite()) {
        return None;
    }
    let delta = (first / last).ln() / periods;
    let delta_stderr = peak_stderr * (1.0 / first).hypot(1.0 / last) / periods;
    // d zeta / d delta of eq. (28).
    let slope = TAU * TAU / (delta * delta + TAU * TAU).powf(1.5);
    Some(Estimate { value: 1.0 / (1.0 + (TAU / delta).powi(2)).sqrt(), stderr: slope * delta_stderr })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn n_peaks_span_n_minus_one_periods() {
        for zeta in [0.001, 0.0074, 0.05, 0.3] {
            for n in [2, 3, 10] {
                let delta = TAU * zeta / (1.0_f64 - zeta * zeta).sqrt();
                let peaks: Vec<f64> = (0..n).map(|k| 2.0 * (-delta * f64::from(k)).exp()).collect();
                let found = damping_from_peaks(&peaks, 0.0).unwrap();
                assert!((found.value / zeta - 1.0).abs() < 1e-12, "{zeta} {n} {found:?}");
            }
        }
    }

    #[test]
    fn the_standard_error_is_the_change_by_one_standard_error_of_the_last_peak() {
        let base = damping_from_peaks(&[1.0, 0.5, 0.2], 1e-4).unwrap();
        let moved = damping_from_peaks(&[1.0, 0.5, 0.2 - 1e-4], 1e-4).unwrap();
        let ratio = (moved.value - base.value) / base.stderr;
        // The first peak's share is missing from the change.
        assert!((ratio - 5.0 / 26.0_f64.sqrt()).abs() < 1e-2, "{ratio}");
    }

    #[test]
    fn peaks_that_do_not_fall_give_nothing() {
        for peaks in [&[1.0][..], &[], &[1.0, 1.0], &[1.0, 2.0], &[1.0, -1.0], &[f64::NAN, 1.0]] {
            assert!(damping_from_peaks(peaks, 0.1).is_none(), "{peaks:?}");
        }
    }
}
