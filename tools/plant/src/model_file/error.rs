//! Why a model file was refused.

use thiserror::Error;

use crate::model::InvalidParameter;

/// A model file that cannot be used: which one, where, and why. Lines count from 1.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ModelFileError {
    /// The file could not be read.
    #[error("{file}: cannot be read: {source}; check that the path exists and is UTF-8 text")]
    Unreadable {
        /// The file.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// Not TOML, an unknown or missing key, or a value of the wrong type.
    #[error("{}: {message}; add, rename or correct the key", place(.file, .line))]
    Toml {
        /// The file.
        file: String,
        /// The line, where the parser knows it.
        line: Option<usize>,
        /// What the parser said; it names the key and, for an unknown one, the keys there are.
        message: String,
    },
    /// Written for another version of the format.
    #[error("{}: `schema`: version {found} is not supported; this version reads schema = {}", place(.file, .line), super::SCHEMA)]
    Schema {
        /// The file.
        file: String,
        /// The line.
        line: Option<usize>,
        /// The version found.
        found: i64,
    },
    /// No such kind of model.
    #[error("{}: `kind`: there is no kind \"{kind}\"; use \"beam_on_base\", \"modal\", \"lumped\" or \"state_space\"", place(.file, .line))]
    KindUnknown {
        /// The file.
        file: String,
        /// The line.
        line: Option<usize>,
        /// The kind found.
        kind: String,
    },
    /// A value outside its limits, or values that contradict each other.
    #[error("{}: {invalid}", place(.file, .line))]
    Invalid {
        /// The file.
        file: String,
        /// The line of the key, or of its table when the key is absent.
        line: Option<usize>,
        /// The key, what is wrong and the remedy.
        invalid: InvalidParameter,
    },
}

fn place(file: &str, line: &Option<usize>) -> String {
    match line {
        Some(line) => format!("{file}:{line}"),
        None => file.to_owned(),
    }
}
