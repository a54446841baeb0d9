//! The matrices of a MAT-file as they are, for models: no time, no columns, no units.

use std::path::Path;

use super::variable::Variable;
use super::{MAX_INFLATED, MatProblem, is_level_4, level_4, variables};
use crate::error::{Problem, RecordingError};
use crate::format::Format;
use crate::import::MAX_FILE_BYTES;

/// Reads all variables of a MAT-file of level 4 or 5 (`-v4`, `-v6`, `-v7`), in the file's order.
///
/// # Errors
/// A [`RecordingError`] that names the file, the place in it and the remedy.
pub fn read_mat_variables(path: &Path) -> Result<Vec<Variable>, RecordingError> {
    let failed = |problem| RecordingError::new(path.display().to_string(), problem);
    let size = std::fs::metadata(path).map_err(|error| failed(Problem::Io(error)))?.len();
    if size > MAX_FILE_BYTES {
        return Err(failed(Problem::TooLarge { limit_mib: MAX_FILE_BYTES >> 20 }));
    }
    let bytes = std::fs::read(path).map_err(|error| failed(Problem::Io(error)))?;
    let format = Format::detect(&bytes).map_err(failed)?;
    if format != Format::Mat {
        return Err(failed(MatProblem::NotMat { looks_like: format.to_string() }.into()));
    }
    let level_4 = is_level_4(&bytes);
    let found = if level_4 { level_4::variables(&bytes) } else { variables(&bytes, MAX_INFLATED) };
    found.map_err(|problem| failed(problem.into()))
}
