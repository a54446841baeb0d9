//! Spectra by averaged, windowed segments (Welch), and the peaks in them.
//!
//! They start the fits, draw the plots and cross-check; no reported frequency or damping rests on them.

use std::f64::consts::TAU;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;

use crate::frf::{AveragedSpectra, FrfEstimate};
use crate::responses::{Frf, Response, Spectrum};

/// Shape of the segments' window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Window {
    /// Narrow main lobe, side lobes 43 dB down: for frequency responses.
    Hamming,
    /// Side lobes that fall off fast: for peaks beside much larger ones.
    Hann,
    /// None: for what rings at one end of the record and is over long before the other.
    Rectangular,
}

impl Window {
    fn weights(self, length: usize) -> Vec<f64> {
        let a = match self {
            Self::Hamming => 0.54,
            Self::Hann => 0.5,
            Self::Rectangular => 1.0,
        };
        (0..length).map(|k| a - (1.0 - a) * (TAU * (k as f64 + 0.5) / length as f64).cos()).collect()
    }
}

/// Averaged auto- and cross-spectra of two uniformly sampled signals.
#[derive(Clone)]
pub(crate) struct CrossSpectra {
    pub(crate) frequency_hz: Vec<f64>,
    /// Density of the input.
    pub(crate) input: Vec<f64>,
    /// Density of the output.
    pub(crate) output: Vec<f64>,
    /// Cross density, input conjugated.
    pub(crate) cross: Vec<Complex64>,
}

impl CrossSpectra {
    /// Averages over segments of `length` samples that overlap by half or a little more, so that the last one
    /// ends with the record: a sweep's last octave is in its last seconds.
    pub(crate) fn welch(
        input: &[f64],
        output: &[f64],
        interval_s: f64,
        length: usize,
        window: Window,
    ) -> Self {
        let total = input.len().min(output.len());
        let length = length.clamp(1, total.max(1));
        let bins = length / 2 + 1;
        let weights = window.weights(length);
        let fft = FftPlanner::new().plan_fft_forward(length);
        let transform = |segment: &[f64]| {
            let mean = segment.iter().sum::<f64>() / length as f64;
            let mut buffer: Vec<Complex64> = segment
                .iter()
                .zip(&weights)
                .map(|(value, weight)| Complex64::new((value - mean) * weight, 0.0))
                .collect();
            fft.process(&mut buffer);
            buffer
        };
        let mut spectra = Self {
            frequency_hz: (0..bins).map(|k| k as f64 / (length as f64 * interval_s)).collect(),
            input: vec![0.0; bins],
            output: vec![0.0; bins],
            cross: vec![Complex64::new(0.0, 0.0); bins],
        };
        let starts = segment_starts(total, length);
        let power: f64 = weights.iter().map(|w| w * w).sum();
        let scale = 2.0 * interval_s / (power * starts.len() as f64);
        for start in starts {
            let x = transform(&input[start..start + length]);
            let y = transform(&output[start..start + length]);
            for (k, (x, y)) in x.iter().zip(&y).take(bins).enumerate() {
                spectra.input[k] += scale * x.norm_sqr();
                spectra.output[k] += scale * y.norm_sqr();
                spectra.cross[k] += x.conj() * y * scale;
            }
        }
        spectra
    }

    /// The responses H1, H2 and Hv with their coherence and densities.
    pub(crate) fn frf(self) -> Frf {
        let averaged = AveragedSpectra::from(self);
        let parts = |estimate: FrfEstimate| Response {
            real: estimate.response.iter().map(|value| value.re).collect(),
            imag: estimate.response.iter().map(|value| value.im).collect(),
        };
        let Response { real, imag } = parts(averaged.h1());
        Frf {
            real,
            imag,
            h2: parts(averaged.h2()),
            hv: parts(averaged.hv()),
            coherence: averaged.coherence(),
            frequency_hz: averaged.frequency_hz,
            input_density: averaged.input,
            output_density: averaged.output,
        }
    }
}

/// Power spectral density of one signal.
pub(crate) fn density(signal: &[f64], interval_s: f64, length: usize, window: Window) -> Spectrum {
    let spectra = CrossSpectra::welch(signal, signal, interval_s, length, window);
    Spectrum { frequency_hz: spectra.frequency_hz, density: spectra.output }
}

/// Indices of local maxima that top everything within `reach` bins, largest first. The first two bins hold
/// the mean and its leakage and never count.
pub(crate) fn peaks(values: &[f64], reach: usize) -> Vec<usize> {
    let mut found: Vec<usize> = (2..values.len().saturating_sub(1))
        .filter(|&k| {
            let around = &values[k.saturating_sub(reach)..(k + reach + 1).min(values.len())];
            let value = values[k];
            value > 0.0 && value > values[k - 1] && around.iter().all(|other| *other <= value)
        })
        .collect();
    found.sort_by(|a, b| values[*b].total_cmp(&values[*a]));
    found
}

/// How far a local maximum rises above the higher of the two valleys that part it from larger values, as a
/// ratio; infinite for the largest.
pub(crate) fn prominence(values: &[f64], k: usize) -> f64 {
    let top = values[k];
    let valley = |side: &mut dyn Iterator<Item = &f64>| {
        let mut lowest = top;
        for value in side {
            if *value > top {
                return lowest;
            }
            lowest = lowest.min(*value);
        }
        0.0
    };
    let left = valley(&mut values[..k].iter().rev());
    let right = valley(&mut values[k + 1..].iter());
    top / left.max(right)
}

/// Median of the values within `reach` bins of `k`.
pub(crate) fn local_median(values: &[f64], k: usize, reach: usize) -> f64 {
    let mut around = values[k.saturating_sub(reach)..(k + reach + 1).min(values.len())].to_vec();
    let middle = around.len() / 2;
    *around.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Where segments start that cover `total` samples, the first at the beginning and the last at the end, each
/// at most half a segment after the one before.
fn segment_starts(total: usize, length: usize) -> Vec<usize> {
    let last = total.saturating_sub(length);
    let gaps = last.div_ceil((length / 2).max(1));
    (0..=gaps).map(|gap| (gap * last).checked_div(gaps).unwrap_or(0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_cover_the_whole_record_and_overlap_by_half_or_more() {
        for total in [1, 2, 7, 8, 9, 100, 1000, 8501] {
            for length in [1, 2, 3, 8, 97, 2125].into_iter().filter(|length| *length <= total) {
                let starts = segment_starts(total, length);
                assert_eq!((starts[0], starts[starts.len() - 1] + length), (0, total));
                assert!(starts.windows(2).all(|pair| pair[1] - pair[0] <= (length / 2).max(1)));
            }
        }
    }

    #[test]
    fn prominence_is_measured_from_the_higher_valley() {
        let values = [9.0, 1.0, 4.0, 2.0, 8.0, 0.5, 3.0];
        assert_eq!(prominence(&values, 2), 2.0);
        assert_eq!(prominence(&values, 4), 8.0);
        assert_eq!(prominence(&values, 0), f64::INFINITY);
    }

    #[test]
    fn the_density_integrates_to_the_mean_square() {
        for window in [Window::Hamming, Window::Hann] {
            let signal: Vec<f64> = (0..4096).map(|k| 3.0 * (0.7 * f64::from(k)).sin()).collect();
            let spectrum = density(&signal, 0.01, 512, window);
            let bin = spectrum.frequency_hz[1];
            let power: f64 = spectrum.density.iter().sum::<f64>() * bin;
            assert!((power - 4.5).abs() < 0.05, "{window:?} {power}");
        }
    }

    #[test]
    fn the_response_of_a_delay_by_one_sample_has_unit_size_and_linear_phase() {
        let noise: Vec<f64> =
            (0..6000_u64).map(|k| ((k * k * 2_654_435_761) % 1_000_003) as f64 / 1e6 - 0.5).collect();
        let spectra = CrossSpectra::welch(&noise[1..], &noise[..5999], 0.01, 256, Window::Hamming);
        let frf = spectra.frf();
        for k in (10..100).step_by(10) {
            let h = Complex64::new(frf.real[k], frf.imag[k]);
            let wanted = Complex64::from_polar(1.0, -TAU * frf.frequency_hz[k] * 0.01);
            assert!((h - wanted).norm() < 0.15, "bin {k}: {h}");
            assert!(frf.coherence[k] > 0.9);
        }
    }
}
