//! Peaks of a spectrum that no mode explains.

use super::Found;
use crate::decay_modes::Uniform;
use crate::spectra::{local_median, peaks, prominence};
use crate::warnings::WarningKind;

/// A peak stands above the median around it and above its valleys by these ratios.
const STANDS: (f64, f64) = (10.0, 5.0);
/// Share of the signal's power that a peak holds at least.
const SHARE: f64 = 0.01;
/// Share of its frequency, lines of the spectrum and half-power bandwidths within which a mode explains a
/// peak.
const SAME: (f64, f64, f64) = (0.03, 3.0, 3.0);
/// Peaks at most.
const MOST: usize = 6;

/// A peak of a spectrum.
#[derive(Debug, Clone, Copy)]
pub(super) struct Peak {
    pub(super) frequency_hz: f64,
    /// How far it stands above its neighbourhood, as a ratio of power.
    pub(super) above: f64,
    /// Share of the signal's power between its valleys.
    pub(super) share: f64,
}

/// The peaks that none of the modes explains, the strongest first.
pub(super) fn unexplained(uniform: &Uniform, found: &[Found]) -> Vec<Peak> {
    let (density, bin_hz) = (&uniform.spectrum.density, uniform.bin_hz());
    let power: f64 = density.iter().skip(2).sum();
    let mut left: Vec<Peak> = Vec::new();
    for k in peaks(density, 3) {
        let above = density[k] / local_median(density, k, (k / 3).max(24)).max(f64::MIN_POSITIVE);
        let hz = k as f64 * bin_hz;
        let share = share_at(density, k) / power;
        let is_at = |other: f64, width_hz: f64| {
            (other - hz).abs() < (SAME.0 * hz).max(SAME.1 * bin_hz).max(SAME.2 * width_hz)
        };
        let explained = found.iter().any(|mode| {
            let mode_hz = mode.frequency_hz.value;
            is_at(mode_hz, 2.0 * mode.damping_ratio.value * mode_hz)
        });
        let is_new = !explained && left.iter().all(|peak| !is_at(peak.frequency_hz, 0.0));
        if is_new && share > SHARE && above > STANDS.0 && prominence(density, k) > STANDS.1 {
            left.push(Peak { frequency_hz: hz, above, share });
        }
        if left.len() == MOST {
            break;
        }
    }
    left
}

/// Power of a peak down to a tenth of its height on either side.
fn share_at(density: &[f64], k: usize) -> f64 {
    let stands = |value: &&f64| **value > 0.1 * density[k];
    let after: f64 = density[k..].iter().take_while(stands).sum();
    after + density[..k].iter().rev().take_while(stands).sum::<f64>()
}

impl Peak {
    /// What is said of one that no mode explains.
    pub(super) fn told(&self, column: &str) -> WarningKind {
        WarningKind::PeakWithoutMode {
            column: column.to_owned(),
            frequency_hz: self.frequency_hz,
            above_db: 10.0 * self.above.log10(),
            power_share: self.share,
        }
    }
}
