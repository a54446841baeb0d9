//! What `identify` and `tune` are given: recordings, how they are read, and what to look for in them.

use std::path::{Path, PathBuf};

use clap::Args;

use super::from_recordings::{Identified, JointFit};
use super::options::IdentificationChoices;
use crate::error::CliError;
use crate::reading::ReadArgs;
use crate::streams::Streams;

/// The recordings, how they are read, and what to look for in them.
#[derive(Debug, Args)]
pub struct IdentificationArgs {
    /// Recordings of the same structure
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    #[command(flatten)]
    choices: IdentificationChoices,
    #[command(flatten)]
    reading: ReadArgs,
}

impl IdentificationArgs {
    /// The files that are read.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.recordings.iter().map(PathBuf::as_path)
    }

    /// Reads the recordings and finds their modes, and says on the way what it takes them for.
    ///
    /// # Errors
    /// [`CliError`] for a file, a column or a record without modes.
    pub fn identify(&self, joint: JointFit, streams: &mut Streams<'_>) -> Result<Identified, CliError> {
        let measured = self.recordings.iter().map(|path| self.reading.measurement(path, streams));
        let measured = measured.collect::<Result<Vec<_>, _>>()?;
        self.choices.identify(measured, joint, streams)
    }
}
