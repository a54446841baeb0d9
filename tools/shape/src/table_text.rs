//! The text of a table file, for every type that is read from one.

use std::path::Path;

use crate::error::{TableFileError, TableProblem};

/// Reads the file and hands its name, as messages call it, and its text to `parse`.
pub(crate) fn read_table<T>(
    path: &Path,
    parse: impl FnOnce(&str, &str) -> Result<T, TableFileError>,
) -> Result<T, TableFileError> {
    let file = path.display().to_string();
    match std::fs::read_to_string(path) {
        Ok(text) => parse(&file, &text),
        Err(error) => Err(TableFileError { file, problem: TableProblem::Io(error) }),
    }
}
