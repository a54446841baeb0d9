//! Where a project keeps what, relative to its folder.

use std::path::{Path, PathBuf};

use super::error::ProjectError;

/// Recordings, and their side files.
pub const RECORDINGS: &str = "recordings";
/// What `identify` and `tune` found.
pub const MODES: &str = "modes";
/// Models of the machine.
pub const MODELS: &str = "models";
/// Shapers and planned moves, for the board.
pub const TABLES: &str = "tables";
/// Pages to look at.
pub const REPORTS: &str = "reports";

/// All folders of a project.
pub const ALL: [&str; 5] = [RECORDINGS, MODES, MODELS, TABLES, REPORTS];

/// The modes, which `shape`, `plan` and `apply` read.
pub const MODES_FILE: &str = "modes/modes.json";
/// The shaper, which `upload` sends.
pub const TABLE_FILE: &str = "tables/table.json";
/// The model that `identify` writes: never the one that a person writes.
pub const IDENTIFIED_MODEL: &str = "models/identified.toml";

/// The recordings of a project, sorted by name: the files in their folder that are neither side files (which
/// end in `.toml`) nor hidden. None where there is no such folder.
///
/// # Errors
/// [`ProjectError::System`] for a folder that cannot be listed.
pub fn recordings(project_folder: &Path) -> Result<Vec<PathBuf>, ProjectError> {
    let folder = project_folder.join(RECORDINGS);
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let failed = |error: std::io::Error| ProjectError::system(&folder, &error);
    let mut found = Vec::new();
    for entry in std::fs::read_dir(&folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        let is_side_file = path.extension().is_some_and(|extension| extension == "toml");
        if path.is_file() && !is_hidden && !is_side_file {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_are_the_files_that_are_no_side_files_by_name() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(recordings(folder.path()).unwrap(), Vec::<PathBuf>::new());
        let place = folder.path().join(RECORDINGS);
        std::fs::create_dir_all(place.join("older.csv")).unwrap();
        for name in ["b.csv", "a.uff", "b.toml", ".hidden.csv"] {
            std::fs::write(place.join(name), "").unwrap();
        }
        assert_eq!(recordings(folder.path()).unwrap(), [place.join("a.uff"), place.join("b.csv")]);
    }
}
