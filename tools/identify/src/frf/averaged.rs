//! H1, H2 and Hv from averaged segments with a Hamming window.

use rustfft::num_complex::Complex64;

use super::{FrfEstimate, FrfEstimator, UniformRecord};
use crate::spectra::{CrossSpectra, Window};

/// Segments a record is cut into by default: a quarter of it each, overlapping by half.
pub const DEFAULT_SEGMENTS: usize = 4;

/// Averaged densities of input and output, one-sided, per Hz.
#[derive(Debug, Clone, PartialEq)]
pub struct AveragedSpectra {
    /// Frequencies, Hz.
    pub frequency_hz: Vec<f64>,
    /// Density of the input, its unit squared per Hz.
    pub input: Vec<f64>,
    /// Density of the output, its unit squared per Hz.
    pub output: Vec<f64>,
    /// Cross density, input conjugated.
    pub cross: Vec<Complex64>,
}

impl From<CrossSpectra> for AveragedSpectra {
    fn from(spectra: CrossSpectra) -> Self {
        let CrossSpectra { frequency_hz, input, output, cross } = spectra;
        Self { frequency_hz, input, output, cross }
    }
}

impl AveragedSpectra {
    /// Averages over segments of one `segments`-th of the record, overlapping by half, Hamming window. One
    /// segment is the paper's whole-record DFT, whose coherence is 1 by construction.
    pub fn new(record: &UniformRecord, segments: usize) -> Self {
        let length = (record.input.len() / segments.max(1)).max(8);
        let spectra =
            CrossSpectra::welch(&record.input, &record.output, record.interval_s, length, Window::Hamming);
        spectra.into()
    }

    /// Ordinary coherence |S_xy|² / (S_xx S_yy), 0 to 1.
    pub fn coherence(&self) -> Vec<f64> {
        self.cross
            .iter()
            .zip(self.input.iter().zip(&self.output))
            .map(|(cross, (x, y))| {
                let power = x * y;
                if power > 0.0 { (cross.norm_sqr() / power).min(1.0) } else { 0.0 }
            })
            .collect()
    }

    /// H1 = S_xy / S_xx.
    pub fn h1(&self) -> FrfEstimate {
        self.response(FrfEstimator::H1, |cross, x, _| cross / x)
    }

    /// H2 = S_yy / S_yx.
    pub fn h2(&self) -> FrfEstimate {
        self.response(FrfEstimator::H2, |cross, _, y| Complex64::from(y) / cross.conj())
    }

    /// Hv: the phase of both, the size of their geometric mean.
    pub fn hv(&self) -> FrfEstimate {
        self.response(FrfEstimator::Hv, |cross, x, y| cross / cross.norm() * (y / x).sqrt())
    }

    fn response(
        &self,
        estimator: FrfEstimator,
        ratio: impl Fn(Complex64, f64, f64) -> Complex64,
    ) -> FrfEstimate {
        let lines = self.cross.iter().zip(self.input.iter().zip(&self.output));
        let response = lines.map(|(cross, (x, y))| {
            let value = ratio(*cross, *x, *y);
            if value.is_finite() { value } else { Complex64::new(0.0, 0.0) }
        });
        FrfEstimate {
            estimator,
            frequency_hz: self.frequency_hz.clone(),
            response: response.collect(),
            variance: None,
            coherence: Some(self.coherence()),
        }
    }
}
