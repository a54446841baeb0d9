//! Files that a command writes, checked before it works.

use std::fs::OpenOptions;
use std::path::{Path, PathBuf};

use crate::error::CliError;

/// Refuses to write over what is read, twice to the same file, or where nothing can be written: better now
/// than after minutes of work. `-`, standard output, is no file.
///
/// # Errors
/// [`CliError::Usage`] names the file.
pub fn keep_apart<'p>(
    inputs: impl IntoIterator<Item = &'p Path>,
    outputs: impl IntoIterator<Item = Option<&'p str>>,
) -> Result<(), CliError> {
    let inputs: Vec<PathBuf> = inputs.into_iter().map(identity).collect();
    let mut seen: Vec<PathBuf> = Vec::new();
    for output in outputs.into_iter().flatten().filter(|output| *output != "-") {
        let path = identity(Path::new(output));
        if inputs.contains(&path) {
            return Err(CliError::Usage(format!(
                "{output} is read by this command and would be written over; name another output"
            )));
        }
        if seen.contains(&path) {
            return Err(CliError::Usage(format!("two outputs are named {output}; give each its own")));
        }
        check_writable(Path::new(output))?;
        seen.push(path);
    }
    Ok(())
}

/// Opens the file for writing, and leaves everything as it was.
fn check_writable(path: &Path) -> Result<(), CliError> {
    let found = path.metadata();
    // A pipe would take the opening for its use.
    if found.as_ref().is_ok_and(|found| !found.is_file() && !found.is_dir()) {
        return Ok(());
    }
    let was_there = found.is_ok();
    let opened = OpenOptions::new().append(true).create(true).open(path);
    opened.map_err(|error| {
        CliError::Usage(format!(
            "{} cannot be written: {error}; name a file in a folder that exists and may be written to",
            path.display()
        ))
    })?;
    if !was_there {
        // What cannot be taken away again is empty, and is about to be written.
        let _removed = std::fs::remove_file(path);
    }
    Ok(())
}

/// A path by which two names of one file are seen to be equal. A file that is not there yet is known by its
/// folder.
fn identity(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| match (path.parent(), path.file_name()) {
        (Some(folder), Some(name)) => {
            let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
            folder.canonicalize().unwrap_or_else(|_| folder.to_owned()).join(name)
        }
        _ => path.to_owned(),
    })
}
