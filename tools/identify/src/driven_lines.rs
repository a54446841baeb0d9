//! Whether a line of what a fit leaves is driven by the input: it keeps step with the input's own line there.

use rustfft::num_complex::Complex64;

use crate::narrow_band::WholeSpectrum;

/// Coherence, over the course of the record, from which two lines keep step.
const IN_STEP: f64 = 0.7;
/// Half the width of the band around a line, in lines of the record's spectrum.
const HALF_WIDTH_LINES: f64 = 6.0;

/// An input and what a fit leaves of its output.
pub(crate) struct DrivenLines {
    input: WholeSpectrum,
    left: WholeSpectrum,
    line_hz: f64,
}

impl DrivenLines {
    pub(crate) fn new(input: &[f64], left: &[f64], interval_s: f64) -> Self {
        Self {
            input: WholeSpectrum::new(input, interval_s),
            left: WholeSpectrum::new(left, interval_s),
            line_hz: 1.0 / (left.len().max(1) as f64 * interval_s),
        }
    }

    /// Whether the line at this frequency, Hz, keeps step with the input.
    pub(crate) fn at(&self, frequency_hz: f64) -> bool {
        let band = |spectrum: &WholeSpectrum| {
            spectrum.narrow_band(frequency_hz, HALF_WIDTH_LINES * self.line_hz, 2).amplitude
        };
        let (input, left) = (band(&self.input), band(&self.left));
        let power = |some: &[Complex64]| some.iter().map(Complex64::norm_sqr).sum::<f64>();
        let cross: Complex64 = left.iter().zip(&input).map(|(y, u)| y * u.conj()).sum();
        cross.norm_sqr() > IN_STEP * power(&input) * power(&left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn a_line_of_a_multisine_is_driven_and_hum_beside_it_is_not() {
        let time = |k: usize| k as f64 * 0.01;
        let wave = |hz: f64, phase: f64| move |t: f64| (TAU * hz * t + phase).sin();
        let (count, multisine) =
            (4000, |t: f64| (10..60).map(|n| wave(0.25 * f64::from(n), f64::from(n * n))(t)).sum());
        let input: Vec<f64> = (0..count).map(|k| multisine(time(k))).collect();
        let left: Vec<f64> =
            (0..count).map(|k| 0.1 * wave(5.0, 1.0)(time(k)) + 0.1 * wave(16.67, 0.3)(time(k))).collect();
        let lines = DrivenLines::new(&input, &left, 0.01);
        assert!(lines.at(5.0));
        assert!(!lines.at(16.67));
    }
}
