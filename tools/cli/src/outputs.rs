//! Files that a command writes, checked before it works.

use std::path::{Path, PathBuf};

use crate::error::CliError;

/// Refuses to write over what is read, or twice to the same file. `-`, standard output, is no file.
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
        seen.push(path);
    }
    Ok(())
}

/// A path by which two names of one file are seen to be equal. A file that is not there yet is known by its folder.
fn identity(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| match (path.parent(), path.file_name()) {
        (Some(folder), Some(name)) => {
            let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
            folder.canonicalize().unwrap_or_else(|_| folder.to_owned()).join(name)
        }
        _ => path.to_owned(),
    })
}
