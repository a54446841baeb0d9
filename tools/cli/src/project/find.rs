//! Which project a command is run in.

use std::path::{Path, PathBuf};

use super::error::ProjectError;
use super::file::ProjectFile;

/// What a project's file is called.
pub const FILE_NAME: &str = "stillbeam.toml";

/// A project, as it is seen from the working directory.
#[derive(Clone, Debug, PartialEq)]
pub struct Project {
    /// Its folder, as short as it can be said from the working directory: empty, or `..` a few times.
    pub folder: PathBuf,
    /// What its file says.
    pub file: ProjectFile,
}

impl Project {
    /// The project of the nearest folder from the working directory upwards that holds its file.
    ///
    /// # Errors
    /// [`ProjectError`] for a file that cannot be read.
    pub fn around(working_directory: &Path) -> Result<Option<Self>, ProjectError> {
        let holds_one = |folder: &Path| folder.join(FILE_NAME).is_file();
        let Some(above) = working_directory.ancestors().position(holds_one) else { return Ok(None) };
        let folder: PathBuf = std::iter::repeat_n("..", above).collect();
        let path = folder.join(FILE_NAME);
        let text = std::fs::read_to_string(working_directory.join(&path))
            .map_err(|error| ProjectError::system(&path, &error))?;
        let file = ProjectFile::parse(&text, &path.display().to_string())?;
        Ok(Some(Self { folder, file }))
    }

    /// Its file.
    pub fn path(&self) -> PathBuf {
        self.folder.join(FILE_NAME)
    }
}
