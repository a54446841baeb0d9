//! Frequencies at which what a model leaves over rings.

use rustfft::num_complex::Complex;

use crate::noise::spectra;
use crate::study::{OnAll, Study};

impl Study {
    /// Frequencies at which the residual of a model rings, strongest first; at most four.
    pub(crate) fn peaks_hz(&self, on_all: &OnAll) -> Vec<f64> {
        let mut peaks: Vec<(f64, f64)> = Vec::new();
        for output in 0..self.weights.len() {
            for part in self.parts(on_all, output) {
                let rate_hz = part.record.rate_hz(part.output);
                let length = (part.residual.len() / 2).next_power_of_two() / 2;
                let windows = spectra(&part.residual, length.max(4));
                let bins = windows.first().map_or(0, Vec::len);
                let mean: Vec<f64> = (0..bins)
                    .map(|bin| {
                        windows.iter().map(|window| window[bin]).sum::<f64>() * self.weights[output].powi(2)
                    })
                    .collect();
                for bin in 2..bins.saturating_sub(2) {
                    let around = 0.25 * (mean[bin - 2] + mean[bin - 1] + mean[bin + 1] + mean[bin + 2]);
                    if mean[bin] > mean[bin - 1] && mean[bin] >= mean[bin + 1] && mean[bin] > 2.0 * around {
                        let offset = peak_offset(mean[bin - 1], mean[bin], mean[bin + 1]);
                        peaks.push((mean[bin], (bin as f64 + offset) * rate_hz / length as f64));
                    }
                }
            }
        }
        peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut chosen: Vec<f64> = Vec::new();
        for (_, hz) in peaks {
            if chosen.len() < 4 && chosen.iter().all(|other| (hz / other - 1.0).abs() > 0.02) {
                chosen.push(hz);
            }
        }
        chosen.into_iter().map(|hz| self.sharpened(on_all, hz)).collect()
    }

    /// The frequency near `hz` at which a steady tone takes most from the residual: windows of a few seconds
    /// tell it to a part of their width, which turns the phase by radians over a whole recording.
    fn sharpened(&self, on_all: &OnAll, hz: f64) -> f64 {
        const STEPS: i32 = 12;
        let parts: Vec<(Vec<f64>, f64)> = (0..self.weights.len())
            .flat_map(|output| {
                let weight = self.weights[output];
                self.parts(on_all, output).into_iter().map(move |part| {
                    let rate_hz = part.record.rate_hz(part.output);
                    (part.residual.iter().map(|value| value * weight).collect(), rate_hz)
                })
            })
            .collect();
        let longest_s =
            parts.iter().map(|(series, rate_hz)| series.len() as f64 / rate_hz).fold(0.0, f64::max);
        if longest_s <= 0.0 {
            return hz;
        }
        let power =
            |hz: f64| parts.iter().map(|(series, rate_hz)| tone_power(series, hz / rate_hz)).sum::<f64>();
        // Neighbouring steps turn the phase by a quarter of a period between the ends of the longest
        // recording, then by less and less.
        let mut best = hz;
        let mut step_hz = 0.25 / longest_s;
        for _ in 0..4 {
            let tried = (-STEPS..=STEPS).map(|step| best + f64::from(step) * step_hz).filter(|hz| *hz > 0.0);
            best = tried.max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap_or(best);
            step_hz *= 0.2;
        }
        best
    }
}

/// What a tone of so many periods per sample has in common with a series: the square of the Fourier sum over
/// half the count.
fn tone_power(series: &[f64], periods_per_sample: f64) -> f64 {
    let turn = Complex::from_polar(1.0, std::f64::consts::TAU * periods_per_sample);
    let mut phasor = Complex::new(1.0, 0.0);
    let mut sum = Complex::new(0.0, 0.0);
    for value in series {
        sum += phasor * value;
        phasor *= turn;
    }
    2.0 * sum.norm_sqr() / series.len().max(1) as f64
}

/// Offset of a peak from its highest bin, from the parabola through the logarithms.
fn peak_offset(left: f64, middle: f64, right: f64) -> f64 {
    let (l, m, r) = (left.max(1e-300).ln(), middle.max(1e-300).ln(), right.max(1e-300).ln());
    let curvature = l - 2.0 * m + r;
    if curvature < 0.0 { (0.5 * (l - r) / curvature).clamp(-0.5, 0.5) } else { 0.0 }
}
