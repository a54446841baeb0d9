//! The side file: `same_stem.toml`, with a role and free-form notes.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::error::{Problem, RecordingError};
use crate::recording::{Recording, Role};

const ROLE: &str = "role";

/// Reads the side file of `csv_path` into the recording; none is fine.
pub(crate) fn read_into(csv_path: &Path, recording: &mut Recording) -> Result<(), RecordingError> {
    let path = side_path(csv_path);
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(refused(recording, &path, error.to_string())),
    };
    let mut table: toml::Table = match text.parse() {
        Ok(table) => table,
        Err(error) => return Err(refused(recording, &path, toml_reason(&error))),
    };
    if let Some(value) = table.remove(ROLE) {
        let shown = value.to_string();
        let role = Role::deserialize(value).map_err(|_| {
            let reason = format!("role = {shown}, where \"train\" or \"held_out\" is expected");
            refused(recording, &path, reason)
        })?;
        recording.role = Some(role);
    }
    recording.notes = table;
    Ok(())
}

/// Writes the side file when there is something to say.
pub(crate) fn write_beside(csv_path: &Path, recording: &Recording) -> Result<(), RecordingError> {
    let mut table = recording.notes.clone();
    if let Some(role) = recording.role {
        let role = match role {
            Role::Train => "train",
            Role::HeldOut => "held_out",
        };
        table.insert(ROLE.to_owned(), role.into());
    }
    if table.is_empty() {
        return Ok(());
    }
    let path = side_path(csv_path);
    let text = toml::to_string(&table).map_err(|error| refused(recording, &path, error.to_string()))?;
    std::fs::write(&path, text).map_err(|error| refused(recording, &path, error.to_string()))
}

fn side_path(csv_path: &Path) -> PathBuf {
    csv_path.with_extension("toml")
}

fn refused(recording: &Recording, path: &Path, reason: String) -> RecordingError {
    recording.error(Problem::SideFile { side_file: path.display().to_string(), reason })
}

/// TOML errors span several lines; messages here are one line.
fn toml_reason(error: &toml::de::Error) -> String {
    error.message().lines().collect::<Vec<_>>().join(" ")
}
