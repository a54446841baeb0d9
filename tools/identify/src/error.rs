//! Input from which no modes can be had, and what to do about it.

use stillbeam_recording::RecordingError;
use thiserror::Error;

use crate::record_kind::Recognised;

/// Why no modes could be identified.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// The recording itself is at fault: a missing column, for instance.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Too few rows carry what the fit needs.
    #[error(
        "{recording}: column `{column}` has {found} usable samples{context}; at least {required} are needed: record longer or faster"
    )]
    TooFewSamples {
        /// Name of the recording.
        recording: String,
        /// The column that is short.
        column: String,
        /// Samples that can be used.
        found: usize,
        /// Samples needed.
        required: usize,
        /// Where they were counted.
        context: &'static str,
    },
    /// The input never changes.
    #[error(
        "{recording}: input column `{column}` is constant ({value}), so nothing was excited; choose the moving input, or leave it out to read a free decay"
    )]
    NoExcitation {
        /// Name of the recording.
        recording: String,
        /// The input column.
        column: String,
        /// Its constant value.
        value: f64,
    },
    /// The output never changes.
    #[error("{recording}: output column `{column}` is constant ({value}); check the sensor and its cable")]
    NoResponse {
        /// Name of the recording.
        recording: String,
        /// The output column.
        column: String,
        /// Its constant value.
        value: f64,
    },
    /// The column holds a size without its sign.
    #[error(
        "{recording}: column `{column}` never goes below zero and turns back sharply where it comes down to it: it is a magnitude, which rings at twice the frequency and its multiples; record the signed signal of one axis{}",
        of_axes(others)
    )]
    Magnitude {
        /// Name of the recording.
        recording: String,
        /// The column.
        column: String,
        /// The other columns of the recording.
        others: Vec<String>,
    },
    /// The unit does not say what the column is.
    #[error(
        "{recording}: column `{column}` ends in the unit `{unit}`, which does not say {wanted}; state it with {option}, or give the column an SI unit"
    )]
    AmbiguousUnit {
        /// Name of the recording.
        recording: String,
        /// The column.
        column: String,
        /// Its unit.
        unit: String,
        /// What could not be told from it.
        wanted: &'static str,
        /// The command line's option that says it, and its values.
        option: &'static str,
    },
    /// Input and output are one column.
    #[error(
        "{recording}: `{column}` is both input and output; name the column that drives the structure with --input and the one that responds with --output"
    )]
    SameColumn {
        /// Name of the recording.
        recording: String,
        /// The column.
        column: String,
    },
    /// Samples so far apart that the stamps are hardly seconds.
    #[error(
        "{recording}: its samples are {interval_s:.4} s apart, which no machine is sampled at: `time_s` counts seconds; divide stamps in milliseconds by 1000, in microseconds by 1000000, or say what they count, with --time COLUMN*0.001"
    )]
    StampsNotSeconds {
        /// Name of the recording.
        recording: String,
        /// The usual interval, s.
        interval_s: f64,
    },
    /// The parameters of the modes cannot be told apart.
    #[error(
        "{recording}: column `{column}` does not determine the {modes} modes fitted to it (none has a finite standard error); ask for fewer modes, record longer, and check the units of its columns"
    )]
    NotDetermined {
        /// Name of the recording.
        recording: String,
        /// The output column.
        column: String,
        /// Modes of the fit.
        modes: usize,
    },
    /// Fewer modes stand out than were asked for.
    #[error(
        "{recording}: {requested} modes were asked for but only {found} stand out of column `{column}` (at {} Hz); ask for fewer, or excite the others",
        frequencies(frequencies_hz)
    )]
    TooFewPeaks {
        /// Name of the recording.
        recording: String,
        /// The output column.
        column: String,
        /// Modes asked for.
        requested: usize,
        /// Modes found.
        found: usize,
        /// Where they were found, Hz.
        frequencies_hz: Vec<f64>,
    },
    /// Nothing in the output looks like a mode.
    #[error(
        "{recording}: column `{column}` shows no resonance above its noise; check that it is the response, and that the excitation covers the modes"
    )]
    NoPeaks {
        /// Name of the recording.
        recording: String,
        /// The output column.
        column: String,
    },
    /// What stands out is driven.
    #[error(
        "{recording}: column `{column}` shows no mode that decays, only forced tones ({}); stop what drives them, knock the structure and record again",
        tones.iter().map(|(hz, reason)| format!("{hz:.2} Hz: {reason}")).collect::<Vec<_>>().join("; ")
    )]
    OnlyTones {
        /// Name of the recording.
        recording: String,
        /// The output column.
        column: String,
        /// Frequency of each tone, Hz, and how it was recognised.
        tones: Vec<(f64, String)>,
    },
    /// The record is no free decay.
    #[error("{recording}: column `{column}` is no free decay. {} {}", found.statement(), sentence(remedy))]
    NoDecay {
        /// Name of the recording.
        recording: String,
        /// The output column.
        column: String,
        /// What it is.
        found: Box<Recognised>,
        /// What to do.
        remedy: String,
    },
    /// A function of frequency was asked for that the file does not hold.
    #[error("{file}: there is no spectrum `{name}`; it holds {}", known.join(", "))]
    NoSuchSpectrum {
        /// The file.
        file: String,
        /// What was asked for.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// The response is none to the sweep that was stated.
    #[error(
        "{recording}: column `{column}` is no answer to a sweep from {from_hz} to {to_hz} Hz: it keeps step with {coherent_percent:.0} % of it; check its ends, its rate or length and whether it is exponential (--sweep FROM,TO,RATE_OR_SECONDS[,exponential])"
    )]
    SweepNotFound {
        /// Name of the recording.
        recording: String,
        /// The output column.
        column: String,
        /// First frequency of the sweep, Hz.
        from_hz: f64,
        /// Last frequency of the sweep, Hz.
        to_hz: f64,
        /// Correlation of the best alignment, percent.
        coherent_percent: f64,
    },
    /// An option is out of its range.
    #[error("option `{option}` is {value}; {remedy}")]
    BadOption {
        /// Name of the option.
        option: &'static str,
        /// The value given.
        value: String,
        /// What it may be.
        remedy: &'static str,
    },
    /// The fit met values it cannot compute with.
    #[error(
        "{recording}: the fit of column `{column}` met values too large or too small to compute with; check the units of the columns"
    )]
    NotComputable {
        /// Name of the recording.
        recording: String,
        /// The output column.
        column: String,
    },
}

/// The same with a capital letter at its beginning, unless it begins with an option.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn frequencies(list: &[f64]) -> String {
    let shown: Vec<String> = list.iter().map(|f| format!("{f:.4}")).collect();
    if shown.is_empty() { "no".to_owned() } else { shown.join(", ") }
}

/// Which columns to name instead of a magnitude.
fn of_axes(others: &[String]) -> String {
    match others {
        [] => String::new(),
        some => format!(", or name one with --output: {}", some.join(", ")),
    }
}
