//! Why recordings cannot be diagnosed, where, and what to do about it.

use stillbeam_plant::PlantError;
use stillbeam_recording::RecordingError;
use thiserror::Error;

/// Recordings and a model that cannot be compared.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DiagnoseError {
    /// A recording is malformed or lacks a column that the model names.
    #[error("{source}; the model needs {}", list(needed))]
    Column {
        /// What the recording says.
        source: RecordingError,
        /// Columns that the model names: input, outputs, reference.
        needed: Vec<String>,
    },
    /// None of the model's outputs is recorded.
    #[error(
        "{recording}: none of the model's outputs ({}) is among the columns ({}); rename the columns or the model's [[output]]",
        list(outputs),
        list(present)
    )]
    NoOutput {
        /// The recording's name.
        recording: String,
        /// The model's outputs.
        outputs: Vec<String>,
        /// The recording's columns.
        present: Vec<String>,
    },
    /// A column's unit does not fit what the model computes.
    #[error(
        "{recording}: column `{column}` has an rms of {largest:.3e}, where the model, driven by the same input, has {expected:.3e}: \
         the unit in its name cannot be right by that much; check units (mm as m, degrees as rad) and the model's gain, and, \
         where it is far smaller, whether something holds the machine fast: then drive it harder"
    )]
    Unit {
        /// The recording's name.
        recording: String,
        /// The column.
        column: String,
        /// Root mean square about its mean, recorded.
        largest: f64,
        /// Root mean square about its mean, simulated.
        expected: f64,
    },
    /// Too short for what has to be estimated.
    #[error(
        "{recording}: {found} samples of `{column}` over {duration_s:.3} s; diagnosis needs at least {required} samples \
         and {required_s:.3} s (three periods of the slowest mode); record longer"
    )]
    TooShort {
        /// The recording's name.
        recording: String,
        /// The output.
        column: String,
        /// Samples with a value.
        found: usize,
        /// Samples needed.
        required: usize,
        /// Length of the recording, seconds.
        duration_s: f64,
        /// Length needed, seconds.
        required_s: f64,
    },
    /// The input never changes although the model has one.
    #[error(
        "{recording}: the input `{column}` is {value} throughout, so nothing was excited; \
         check that the column was recorded, or remove [input] from the model for a free decay"
    )]
    FlatInput {
        /// The recording's name.
        recording: String,
        /// The input column.
        column: String,
        /// Its constant value.
        value: f64,
    },
    /// An output never changes.
    #[error("{recording}: `{column}` is {value} throughout; the sensor was not connected or not recorded")]
    FlatOutput {
        /// The recording's name.
        recording: String,
        /// The output column.
        column: String,
        /// Its constant value.
        value: f64,
    },
    /// Nothing to fit to.
    #[error(
        "no training recording is left; every recording given says role = \"held_out\", give one to train on"
    )]
    NoTraining,
    /// What was trained on cannot judge.
    #[error(
        "{recording} is both trained on and held out; a recording that was trained on says nothing about what the model has \
         not seen: leave it out of one list"
    )]
    BothRoles {
        /// The recording's name.
        recording: String,
    },
    /// A limit that is none.
    #[error("a limit of {seconds} s; give a number of seconds, 0 or more")]
    Limit {
        /// What was asked for.
        seconds: f64,
    },
    /// The model cannot be simulated over a recording.
    #[error("{recording}: {source}")]
    Simulation {
        /// The recording's name.
        recording: String,
        /// What the plant says.
        source: PlantError,
    },
    /// The model itself cannot be built.
    #[error(transparent)]
    Model(#[from] PlantError),
    /// The simulation is not finite at the parameters given.
    #[error("{recording}: the model's simulation grows beyond all bounds; check its units and signs")]
    Diverged {
        /// The recording's name.
        recording: String,
    },
}

fn list(names: &[String]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    quoted.join(", ")
}
