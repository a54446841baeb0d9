//! Model files: TOML in, a checked [`Model`] out, and back to TOML.
//!
//! A file is read in three steps, so that the first thing that is wrong is what gets reported: `schema` and
//! `kind`; the keys of that kind, none unknown; the values.

mod beam_on_base;
mod error;
mod locate;
mod lumped;
mod matrix_values;
mod modal;
mod setup;
mod signals;
mod state_space;

use std::path::Path;

use serde::Deserialize;

pub use error::ModelFileError;

use crate::model::{ModalModel, Model};

/// The schema that this version reads and writes.
pub const SCHEMA: i64 = 1;

/// What every model file starts with, whatever else is in it.
#[derive(Deserialize)]
struct Head {
    schema: i64,
    kind: String,
}

impl Model {
    /// Reads and checks a model file.
    ///
    /// # Errors
    /// [`ModelFileError`], naming the file and, where it can, line, key and remedy.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ModelFileError> {
        let path = path.as_ref();
        let file = path.display().to_string();
        match std::fs::read_to_string(path) {
            Ok(text) => Self::from_toml(&file, &text),
            Err(source) => Err(ModelFileError::Unreadable { file, source }),
        }
    }

    /// Reads and checks the text of a model file; `file` is what messages call it, and its folder is where a
    /// file that it names is looked for. Matrices and transfer functions become a [`Model::Modal`].
    ///
    /// # Errors
    /// As [`Model::read`].
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ModelFileError> {
        let head: Head = parse(file, text)?;
        let line_of = |key: &str| locate::line_of_key(text, key);
        if head.schema != SCHEMA {
            return Err(ModelFileError::Schema {
                file: file.to_owned(),
                line: line_of("schema"),
                found: head.schema,
            });
        }
        let model = match head.kind.as_str() {
            "beam_on_base" => {
                let raw: beam_on_base::File = parse(file, text)?;
                raw.into_model().map(Self::BeamOnBase)
            }
            "modal" => {
                let raw: modal::File = parse(file, text)?;
                raw.into_model().map(Self::Modal)
            }
            "lumped" => {
                let raw: lumped::File = parse(file, text)?;
                raw.into_model().map(Self::Lumped)
            }
            "state_space" => {
                let raw: state_space::File = parse(file, text)?;
                let folder = Path::new(file).parent().unwrap_or(Path::new(""));
                raw.into_model(folder).map(Self::Modal)
            }
            kind => {
                let (file, line, kind) = (file.to_owned(), line_of("kind"), kind.to_owned());
                return Err(ModelFileError::KindUnknown { file, line, kind });
            }
        };
        model.and_then(|model| model.check().map(|()| model)).map_err(|invalid| ModelFileError::Invalid {
            file: file.to_owned(),
            line: line_of(&invalid.key),
            invalid,
        })
    }
}

impl Model {
    /// The model as the text of a model file, which [`Model::from_toml`] reads back unchanged.
    ///
    /// # Errors
    /// [`ModelFileError`] when the model does not pass [`Model::check`]: nothing is written that could not be
    /// read.
    pub fn to_toml(&self) -> Result<String, ModelFileError> {
        if let Err(invalid) = self.check() {
            let (file, line) = ("model".to_owned(), None);
            return Err(ModelFileError::Invalid { file, line, invalid });
        }
        let text = match self {
            Self::BeamOnBase(model) => toml::to_string(&beam_on_base::File::from_model(model)),
            Self::Modal(model) => toml::to_string(&modal::File::from_model(model)),
            Self::Lumped(model) => toml::to_string(&lumped::File::from_model(model)),
        };
        text.map_err(|error| ModelFileError::Toml {
            file: "model".to_owned(),
            line: None,
            message: error.to_string(),
        })
    }
}

impl ModalModel {
    /// As [`Model::to_toml`].
    ///
    /// # Errors
    /// As [`Model::to_toml`].
    pub fn to_toml(&self) -> Result<String, ModelFileError> {
        Model::Modal(self.clone()).to_toml()
    }
}

fn parse<'text, T: Deserialize<'text>>(file: &str, text: &'text str) -> Result<T, ModelFileError> {
    toml::from_str(text).map_err(|error| ModelFileError::Toml {
        file: file.to_owned(),
        line: error
            .span()
            // A key missing at the top is missing from no line in particular.
            .filter(|span| span.start > 0 || !error.message().starts_with("missing"))
            .map(|span| locate::line_at(text, span.start)),
        message: error.message().to_owned(),
    })
}
