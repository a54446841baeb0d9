//! Why no shaper can be recommended.

use thiserror::Error;

use super::left_out::LeftOut;

/// Why no shaper can be recommended.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum TuningError {
    /// Nothing that was found can be shaped for.
    #[error(
        "no mode is left to shape for: {left_out}; excite the machine more and record again, or choose other modes with --use or --modes"
    )]
    NoUsableMode {
        /// What was found, and why it is of no use.
        left_out: String,
    },
    /// A number that no mode has.
    #[error("--use {number}: the recordings show the modes 1 to {count}")]
    NoSuchMode {
        /// The number.
        number: usize,
        /// How many modes there are.
        count: usize,
    },
    /// No shaper fits the board.
    #[error(
        "the board's memory is too short for any shaper of these modes at {rate_hz} Hz; choose a lower --rate, or leave the slowest mode out with --use"
    )]
    NothingRuns {
        /// Ticks per second.
        rate_hz: f64,
    },
    /// The boxes are too wide.
    #[error(
        "no shaper that the board can run keeps every mode within {tolerance} wherever it may be: {name} leaves least, {worst} with a length of {length}; allow more with --tolerance, or make the boxes narrower with better recordings or a smaller --box-floor"
    )]
    NothingHolds {
        /// What may be left, in words.
        tolerance: String,
        /// The one that leaves least.
        name: String,
        /// What it leaves, in words.
        worst: String,
        /// How long it is, in words.
        length: String,
    },
}

impl TuningError {
    /// All modes were left out.
    pub(super) fn no_usable_mode(left_out: &[LeftOut]) -> Self {
        let reasons: Vec<&str> = left_out.iter().map(|mode| mode.why.as_str()).collect();
        Self::NoUsableMode { left_out: reasons.join("; ") }
    }
}
