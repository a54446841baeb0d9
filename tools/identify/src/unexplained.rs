//! Whether a fit leaves visibly more than the noise of its record, and where.
//!
//! Noise fills the spectrum of what is left; lines, drifts and what is not linear stand out of it. The median
//! of the density tells the noise, whatever stands out.

use crate::decay_modes::Uniform;
use crate::result::fit_percent;
use crate::warnings::{Warning, WarningKind};

/// How many times the power of the noise is left where it is visibly more.
const ABOVE_NOISE: f64 = 4.0;
/// By how many per cent of the output a fit explains visibly less than noise allows.
const VISIBLY_LESS: f64 = 5.0;
/// Lines of the spectrum that a median can be taken of.
const LINES: usize = 32;

/// What to say of a fit that explains visibly less of a column than the noise in it allows, unless what is
/// left is loudest at a line that is told already.
pub(crate) fn unexplained(
    column: &str,
    (time_s, output, left): (&[f64], &[f64], &[f64]),
    is_told: impl Fn(f64, f64) -> bool,
) -> Option<Warning> {
    let uniform = Uniform::new(time_s, left);
    let spectrum = &uniform.spectrum;
    // The first two lines hold the mean and its leakage.
    let density = spectrum.density.get(2..).filter(|lines| lines.len() >= LINES)?;
    let mut sorted = density.to_vec();
    let middle = sorted.len() / 2;
    let noise = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
    let mean = density.iter().sum::<f64>() / density.len() as f64;
    let power = left.iter().map(|e| e * e).sum::<f64>() / left.len().max(1) as f64;
    let noise_rms = (power * (noise / mean.max(f64::MIN_POSITIVE)).min(1.0)).sqrt();
    let explained_percent = fit_percent(output, power.sqrt());
    let possible_percent = fit_percent(output, noise_rms);
    let loudest = (0..density.len()).max_by(|a, b| density[*a].total_cmp(&density[*b]))? + 2;
    let loudest_hz = spectrum.frequency_hz[loudest];
    let visibly = mean > ABOVE_NOISE * noise && explained_percent < possible_percent - VISIBLY_LESS;
    (visibly && !is_told(loudest_hz, uniform.bin_hz())).then(|| {
        WarningKind::LeavesMoreThanNoise {
            column: column.to_owned(),
            explained_percent,
            possible_percent,
            loudest_hz,
        }
        .into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Ringing with noise, and what a fit of the ringing leaves of it beside something else.
    fn told(noise: f64, beside: impl Fn(f64) -> f64) -> Option<Warning> {
        let mut state = 3_u64;
        let time_s: Vec<f64> = (0..4000).map(|k| f64::from(k) / 200.0).collect();
        let left: Vec<f64> = time_s
            .iter()
            .map(|t| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                noise * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) + beside(*t)
            })
            .collect();
        let rings = |t: f64| (-0.2 * t).exp() * (TAU * 7.0 * t).cos();
        let output: Vec<f64> = time_s.iter().zip(&left).map(|(t, e)| rings(*t) + e).collect();
        unexplained("tip_m", (&time_s, &output, &left), |_, _| false)
    }

    #[test]
    fn a_line_that_is_left_is_told_with_its_frequency_and_noise_of_any_size_is_not() {
        for noise in [1e-3, 0.1, 1.0, 10.0] {
            assert_eq!(told(noise, |_| 0.0), None, "{noise}");
        }
        for (noise, size) in [(1e-3, 0.1), (0.1, 0.2), (0.3, 0.4)] {
            let warning = told(noise, |t| size * (TAU * 31.0 * t).sin());
            let at = |kind: &WarningKind| match kind {
                WarningKind::LeavesMoreThanNoise { loudest_hz, .. } => (loudest_hz - 31.0).abs() < 0.5,
                _ => false,
            };
            assert!(warning.as_ref().is_some_and(|one| at(&one.kind)), "{noise} {size}: {warning:?}");
        }
    }
}
