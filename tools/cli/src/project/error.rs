//! What is wrong with a project.

use thiserror::Error;

use super::find::FILE_NAME;

/// What is wrong with a project.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ProjectError {
    /// A file or folder that the system does not give or take.
    #[error("{path}: {problem}; check the path and its permissions")]
    System {
        /// The file or folder.
        path: String,
        /// In the system's words.
        problem: String,
    },
    /// The file is no TOML, or has an entry that it cannot have.
    #[error("{file}: {problem}; docs/formats.md lists the entries, --no-project goes without the file")]
    Content {
        /// The file.
        file: String,
        /// The parser's words, with line and column.
        problem: String,
    },
    /// The file is of a kind that this program does not know.
    #[error(
        "{file}: schema = {found}, and this program reads 1; write `schema = 1`, or use the program that wrote it"
    )]
    Schema {
        /// The file.
        file: String,
        /// What it says, or that it says nothing.
        found: String,
    },
    /// A value that its option does not take.
    #[error("{file}: {key}: {problem}; correct it there, or go without the file with --no-project")]
    Value {
        /// The file.
        file: String,
        /// The entry, with its table.
        key: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The folder of a new project is one already.
    #[error("{folder} is a project already: it has a {FILE_NAME}; edit that, or name another folder")]
    Occupied {
        /// The folder.
        folder: String,
    },
}

impl ProjectError {
    /// What the system said of a path.
    pub(crate) fn system(path: &std::path::Path, error: &std::io::Error) -> Self {
        Self::System { path: path.display().to_string(), problem: error.to_string() }
    }
}
