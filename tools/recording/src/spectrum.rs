//! Functions of frequency, which some files hold instead of a recording.

use crate::format::Format;

/// What a function of frequency is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SpectrumKind {
    /// Response over excitation, complex.
    FrequencyResponse,
    /// Power spectral density: unit squared per hertz.
    PowerDensity,
    /// Power spectrum: unit squared.
    Power,
    /// Amplitude over frequency, real or complex, of one signal.
    Amplitude,
}

impl SpectrumKind {
    /// In words, for messages, such as `a frequency response`.
    pub fn words(self) -> &'static str {
        match self {
            Self::FrequencyResponse => "a frequency response",
            Self::PowerDensity => "a power spectral density",
            Self::Power => "a power spectrum",
            Self::Amplitude => "an amplitude spectrum",
        }
    }
}

/// The values of a function of frequency.
#[derive(Debug, Clone, PartialEq)]
pub enum SpectrumValues {
    /// Magnitudes or powers: the phase is not known.
    Real(Vec<f64>),
    /// Complex values, one real and one imaginary part per frequency.
    Complex {
        /// Real parts.
        real: Vec<f64>,
        /// Imaginary parts.
        imaginary: Vec<f64>,
    },
}

impl SpectrumValues {
    /// How many frequencies have a value.
    pub fn len(&self) -> usize {
        match self {
            Self::Real(values) | Self::Complex { real: values, .. } => values.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// One function of frequency, as a file states it.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// What to call it; unique within its file, such as `acceleration_3_z_over_force_1_z`.
    pub name: String,
    /// What it is.
    pub kind: SpectrumKind,
    /// Unit of the response, or of the only signal, spelled as in column names: `m_s2`. `None` if the file
    /// has none.
    pub unit: Option<String>,
    /// Unit of the excitation that a frequency response is divided by: `N`. `None` if the file has none.
    pub per_unit: Option<String>,
    /// Frequencies, Hz, strictly increasing.
    pub frequency_hz: Vec<f64>,
    /// One value per frequency.
    pub values: SpectrumValues,
}

/// The spectra of one file.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedSpectra {
    /// The file's path, or what the caller named it.
    pub name: String,
    /// In file order; at least one.
    pub spectra: Vec<Spectrum>,
    /// The format they were in.
    pub format: Format,
    /// What a reader of the result should know.
    pub remarks: Vec<String>,
}

impl ImportedSpectra {
    /// What the file holds, in words, such as `a power spectral density of 5 signals`.
    pub fn words(&self) -> String {
        let kind = self.spectra.first().map_or("no spectrum", |spectrum| spectrum.kind.words());
        match self.spectra.len() {
            1 => kind.to_owned(),
            count => format!("{kind} and more, {count} functions of frequency in all"),
        }
    }
}
