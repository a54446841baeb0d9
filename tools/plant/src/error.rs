//! Why a plant could not be built or simulated.

use stillbeam_recording::RecordingError;
use thiserror::Error;

use crate::model::InvalidParameter;

/// A plant that cannot be built or simulated.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PlantError {
    /// A parameter of the model is out of its limits.
    #[error(transparent)]
    Invalid(#[from] InvalidParameter),
    /// The parameters are within their limits one by one, and yet give no finite, positive definite matrices.
    #[error(
        "the beam's mass or stiffness matrix is not finite and positive definite; the parameters span too many orders of magnitude, check their units"
    )]
    Degenerate,
    /// A mode that turns too often, or decays too fast, to be followed from one sample to the next.
    #[error(
        "a frequency or damping of the model is too high to be followed over {duration_s} s; check the model's units and the sampling rate"
    )]
    TooFast {
        /// Distance of two samples, seconds.
        duration_s: f64,
    },
    /// A simulation ran away: a force that grows with the motion, or numbers beyond any machine.
    #[error(
        "the simulated motion grows beyond all bounds by {time_s} s; check signs and sizes of the forces in the model"
    )]
    RanAway {
        /// When it was noticed, seconds.
        time_s: f64,
    },
    /// A prescribed base motion was asked for and the model is driven by something else.
    #[error(
        "the model's input is {}, and what is asked for moves the base: give a recording of that input instead (`--input`), or set input.column to \"setpoint_m\" or \"base_position_m\"",
        found.as_deref().map_or_else(|| "absent".to_owned(), |column| format!("`{column}`"))
    )]
    NotPrescribed {
        /// The model's input column, if any.
        found: Option<String>,
    },
    /// A simulation was asked for and the model has no input.
    #[error("the model has no [input]; a free decay is simulated from its initial state, with `free_decay`")]
    NoInput,
    /// The recording cannot be simulated from.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A gap in the input.
    #[error(
        "{recording}: row {row}: `{column}` is empty; an input needs a value at every time, fill the gap or cut the recording"
    )]
    InputGap {
        /// The recording's name.
        recording: String,
        /// The input column.
        column: String,
        /// Row of the file, the header being row 1.
        row: usize,
    },
    /// A tick or output rate that is no rate.
    #[error("a rate of {found_hz} Hz; give a positive finite number")]
    Rate {
        /// The rate given.
        found_hz: f64,
    },
    /// More output samples than fit in memory, or none.
    #[error("{found} output samples asked for; lower the output rate or shorten the time (at most {most})")]
    OutputSize {
        /// Samples asked for.
        found: f64,
        /// The most that are computed at once.
        most: usize,
    },
    /// One initial state per mode.
    #[error("{found} initial state(s) for {modes} mode(s); give one per mode")]
    InitialStates {
        /// Modes of the model.
        modes: usize,
        /// States given.
        found: usize,
    },
    /// A series of the wrong length.
    #[error("the {what} has {found} entries where {expected} are needed")]
    Length {
        /// Which series.
        what: &'static str,
        /// Entries needed.
        expected: usize,
        /// Entries given.
        found: usize,
    },
    /// A place that the model does not have.
    #[error("{what}: the model has no place \"{found}\"; use one of {}", allowed.join(", "))]
    Place {
        /// What asked for it.
        what: String,
        /// The name given.
        found: String,
        /// The names there are.
        allowed: Vec<String>,
    },
    /// There is nothing to measure.
    #[error("{what}; {remedy}")]
    Measure {
        /// What is wrong with the signal or the move.
        what: &'static str,
        /// What to do about it.
        remedy: &'static str,
    },
}
