//! Responses and spectra as they stand in the JSON.

use serde::{Deserialize, Serialize};

/// A complex curve over the frequencies beside it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Response {
    /// Real part.
    pub real: Vec<f64>,
    /// Imaginary part.
    pub imag: Vec<f64>,
}

/// Frequency response output/input (Hamming window, averaged segments), as recorded: no scaling, no model.
/// Unit: output unit per input unit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Frf {
    /// Frequencies, Hz.
    pub frequency_hz: Vec<f64>,
    /// Real part of H1, unbiased where the noise is on the output.
    pub real: Vec<f64>,
    /// Imaginary part of H1.
    pub imag: Vec<f64>,
    /// H2, unbiased where the noise is on the input.
    #[serde(default)]
    pub h2: Response,
    /// Hv, between the two: noise on either side.
    #[serde(default)]
    pub hv: Response,
    /// Ordinary coherence, 0 to 1. A lightly damped mode that rings for longer than a segment lowers it
    /// even without noise.
    pub coherence: Vec<f64>,
    /// Power spectral density of the input, its unit squared per Hz.
    #[serde(default)]
    pub input_density: Vec<f64>,
    /// Power spectral density of the output, its unit squared per Hz.
    #[serde(default)]
    pub output_density: Vec<f64>,
}

/// Power spectral density of a free decay's output (averaged segments).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Spectrum {
    /// Frequencies, Hz.
    pub frequency_hz: Vec<f64>,
    /// Output unit squared per Hz.
    pub density: Vec<f64>,
}
