//! Peak picking: maximum and half-power points of a frequency response.

use super::{MethodMode, PoleMethod};
use crate::frf::FrfEstimate;
use crate::spectra::{peaks, prominence};

/// Peaks must rise this far, as a ratio of amplitudes, above the valleys beside them.
const PROMINENCE: f64 = 2.0;

/// Modes at the largest peaks of a response, at most `limit`, by frequency.
///
/// Damping is the half-power bandwidth over twice the frequency; its standard error is that of two points
/// read off a grid. A band of fewer than four lines is wider by the window than by the mode, and then the
/// mode has no damping to report: such peaks are left out.
pub fn peak_picking(frf: &FrfEstimate, limit: usize) -> Vec<MethodMode> {
    let size: Vec<f64> = frf.response.iter().map(|value| value.norm()).collect();
    let line_hz = frf.resolution_hz();
    let standing = peaks(&size, 2).into_iter().filter(|k| prominence(&size, *k) > PROMINENCE);
    let mut found: Vec<MethodMode> =
        standing.filter_map(|k| half_power(&size, k, &frf.frequency_hz, line_hz)).take(limit).collect();
    found.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    found
}

fn half_power(size: &[f64], peak: usize, frequency_hz: &[f64], line_hz: f64) -> Option<MethodMode> {
    let half = size.get(peak)? / std::f64::consts::SQRT_2;
    let crossing = |inner: usize, outer: usize| {
        let share = (size[inner] - half) / (size[inner] - size[outer]);
        inner as f64 + share * (outer as f64 - inner as f64)
    };
    let below = (1..=peak).rev().find(|&k| size[k - 1] < half)?;
    let above = (peak..size.len().checked_sub(1)?).find(|&k| size[k + 1] < half)?;
    let lines = crossing(above, above + 1) - crossing(below, below - 1);
    let centre_hz = *frequency_hz.get(peak)?;
    let damping_ratio = lines * line_hz / (2.0 * centre_hz);
    (lines >= 4.0).then(|| MethodMode {
        method: PoleMethod::PeakPicking,
        frequency_hz: centre_hz,
        frequency_stderr_hz: Some(line_hz.hypot(0.5 * damping_ratio * centre_hz)),
        damping_ratio,
        damping_stderr: Some(line_hz / centre_hz),
    })
}
