//! Frequency responses: averaged (H1, H2, Hv) and local (polynomial, rational).
//!
//! An averaged response resolves one over the length of a segment and leaks: where a mode rings for longer
//! than a segment it is too low and too wide, whatever the noise. A local one uses the spectrum of the whole
//! record and removes the leakage, as a smooth function of frequency within a window of a few lines; the
//! polynomial method follows a resonance as far as a polynomial can, the rational one exactly. Both estimate
//! the noise as they go, so their responses come with a variance even from one record.

mod averaged;
mod least_squares;
mod local;
mod record;

pub use averaged::{AveragedSpectra, DEFAULT_SEGMENTS};
pub(crate) use local::rational_at;
pub use local::{LocalOptions, local_polynomial, local_rational};
pub use record::UniformRecord;

use rustfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// How a frequency response was estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FrfEstimator {
    /// Cross-spectrum over input spectrum: unbiased where the noise is on the output.
    H1,
    /// Output spectrum over cross-spectrum: unbiased where the noise is on the input.
    H2,
    /// Geometric mean of both: noise on either side.
    Hv,
    /// Local polynomial method.
    LocalPolynomial,
    /// Local rational method.
    LocalRational,
}

/// A frequency response, output over input as recorded, in output unit per input unit.
#[derive(Debug, Clone, PartialEq)]
pub struct FrfEstimate {
    /// How it was estimated.
    pub estimator: FrfEstimator,
    /// Frequencies, Hz, evenly spaced and rising.
    pub frequency_hz: Vec<f64>,
    /// The response.
    pub response: Vec<Complex64>,
    /// Variance of the response (mean square of its complex error), where the method has one.
    pub variance: Option<Vec<f64>>,
    /// Coherence, 0 to 1, where the method has one.
    pub coherence: Option<Vec<f64>>,
}

impl FrfEstimate {
    /// Distance of neighbouring lines, Hz; 0 when there are fewer than two.
    pub fn resolution_hz(&self) -> f64 {
        match self.frequency_hz.as_slice() {
            [first, second, ..] => second - first,
            _ => 0.0,
        }
    }

    /// The lines within a band, ends included.
    #[must_use]
    pub fn within(&self, band_hz: [f64; 2]) -> Self {
        let inside: Vec<bool> =
            self.frequency_hz.iter().map(|f| (band_hz[0]..=band_hz[1]).contains(f)).collect();
        let kept = |values: &[f64]| -> Vec<f64> {
            values.iter().zip(&inside).filter(|(_, inside)| **inside).map(|(value, _)| *value).collect()
        };
        let response = self.response.iter().zip(&inside).filter(|(_, inside)| **inside);
        Self {
            estimator: self.estimator,
            frequency_hz: kept(&self.frequency_hz),
            response: response.map(|(value, _)| *value).collect(),
            variance: self.variance.as_deref().map(kept),
            coherence: self.coherence.as_deref().map(kept),
        }
    }
}
