//! Why a command failed, and the exit status that goes with it.

use std::io::ErrorKind;

use stillbeam_diagnose::DiagnoseError;
use stillbeam_identify::{IdentifyError, ModesFileError};
use stillbeam_plant::{CameraError, ModelFileError, PlantError};
use stillbeam_recording::RecordingError;
use stillbeam_shape::{ModeSpecError, ShapeError, TableFileError};
use thiserror::Error;

use crate::board::BoardError;
use crate::data::DataError;
use crate::live::LiveError;
use crate::project::ProjectError;
use crate::tuning::TuningError;

/// Why a command failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CliError {
    /// A recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// An identification.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// A file of identified modes.
    #[error(transparent)]
    ModesFile(#[from] ModesFileError),
    /// A diagnosis.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
    /// A model file.
    #[error(transparent)]
    ModelFile(#[from] ModelFileError),
    /// A plant or a simulation.
    #[error("{context}: {source}")]
    Plant {
        /// The file or the step.
        context: String,
        /// What is wrong.
        source: PlantError,
    },
    /// The simulated camera.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// A mode on the command line.
    #[error(transparent)]
    ModeSpec(#[from] ModeSpecError),
    /// A shaper's design.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// A shaper's file.
    #[error(transparent)]
    Table(#[from] TableFileError),
    /// A recommendation.
    #[error(transparent)]
    Tuning(#[from] TuningError),
    /// Public recordings.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A board.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// The live page.
    #[error(transparent)]
    Live(#[from] LiveError),
    /// A project.
    #[error(transparent)]
    Project(#[from] ProjectError),
    /// Arguments that contradict each other or that do not fit the files.
    #[error("{0}")]
    Usage(String),
    /// A file that cannot be read as what it should be.
    #[error("{file}: {problem}")]
    File {
        /// The file.
        file: String,
        /// What is wrong, and the remedy.
        problem: String,
    },
    /// Standard output or standard error was closed or is full.
    #[error("cannot write the output: {0}")]
    Output(#[from] std::io::Error),
    /// A program that is needed and not there.
    #[error("{program} is not installed; {remedy}")]
    MissingProgram {
        /// The program.
        program: &'static str,
        /// How to get it.
        remedy: &'static str,
    },
    /// A result that contradicts what the program takes for granted.
    #[error("internal failure: {0}; please report it")]
    Internal(String),
}

impl CliError {
    /// 0 when whoever read the output had enough of it, 2 for bad input, 1 for everything else.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Output(error) if error.kind() == ErrorKind::BrokenPipe => 0,
            Self::Output(_) | Self::Internal(_) => 1,
            Self::Data(error) => match error {
                DataError::NoSuchSet { .. } | DataError::NotKnown { .. } | DataError::Occupied { .. } => 2,
                _ => 1,
            },
            Self::Board(error) => match error {
                BoardError::Open { .. } | BoardError::NoConsole { .. } | BoardError::Refused { .. } => 2,
                _ => 1,
            },
            _ => 2,
        }
    }

    /// A file that could not be written or read, in the system's words.
    pub fn file(file: impl Into<String>, error: &std::io::Error) -> Self {
        Self::File { file: file.into(), problem: format!("{error}; check the path and its permissions") }
    }

    /// A plant error with the file or step that it belongs to.
    pub fn plant(context: impl Into<String>) -> impl FnOnce(PlantError) -> Self {
        let context = context.into();
        move |source| Self::Plant { context, source }
    }
}
