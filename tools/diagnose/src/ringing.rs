//! Frequencies at which what a model leaves over rings.

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
        chosen
    }
}

/// Offset of a peak from its highest bin, from the parabola through the logarithms.
fn peak_offset(left: f64, middle: f64, right: f64) -> f64 {
    let (l, m, r) = (left.max(1e-300).ln(), middle.max(1e-300).ln(), right.max(1e-300).ln());
    let curvature = l - 2.0 * m + r;
    if curvature < 0.0 { (0.5 * (l - r) / curvature).clamp(-0.5, 0.5) } else { 0.0 }
}
