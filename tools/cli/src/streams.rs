//! Where a command's data and messages go, and where its files.

use std::io::Write;
use std::path::Path;

use serde::Serialize;

use crate::error::CliError;

/// Data on one, messages and progress on the other.
pub struct Streams<'s> {
    /// Data: standard output.
    pub out: &'s mut dyn Write,
    /// Messages and progress: standard error.
    pub messages: &'s mut dyn Write,
}

impl Streams<'_> {
    /// One line of message. That nobody reads messages is no reason to fail.
    pub fn say(&mut self, line: &str) {
        let _best_effort = writeln!(self.messages, "{line}").and_then(|()| self.messages.flush());
    }

    /// Writes text to a file, or to standard output for `-`.
    ///
    /// # Errors
    /// [`CliError::File`] or [`CliError::Output`].
    pub fn write_text(&mut self, file: &str, text: &str) -> Result<(), CliError> {
        if file == "-" {
            self.out.write_all(text.as_bytes())?;
            return Ok(self.out.flush()?);
        }
        write_file(Path::new(file), text)?;
        self.say(&format!("wrote {file}"));
        Ok(())
    }

    /// Writes JSON, indented and ending in a line break.
    ///
    /// # Errors
    /// As [`Streams::write_text`].
    pub fn write_json(&mut self, file: &str, value: &impl Serialize) -> Result<(), CliError> {
        self.write_text(file, &to_json(value)?)
    }
}

/// JSON text, indented and ending in a line break. Numbers that are not finite become `null`.
///
/// # Errors
/// [`CliError::Internal`] for values that JSON cannot hold.
pub fn to_json(value: &impl Serialize) -> Result<String, CliError> {
    let text = serde_json::to_string_pretty(value).map_err(|error| CliError::Internal(error.to_string()))?;
    Ok(text + "\n")
}

/// Writes a whole file.
///
/// # Errors
/// [`CliError::File`].
pub fn write_file(path: &Path, text: &str) -> Result<(), CliError> {
    std::fs::write(path, text).map_err(|error| CliError::file(path.display().to_string(), &error))
}

/// Whether data on standard output would get in the way of JSON there.
pub fn json_on_stdout(json: Option<&str>) -> bool {
    json == Some("-")
}
