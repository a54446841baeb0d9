//! A folder for one machine: what is always the same is said once, in its `stillbeam.toml`.
//!
//! | sentence | module |
//! |---|---|
//! | what the file says | [`file`] |
//! | which folder it is | [`find`] |
//! | where recordings, modes, models, tables and reports are | [`places`] |
//! | what a command would be told of it | [`offers`] |
//! | the words of a person and what the project adds to them | [`words`] |
//! | a new file, with a comment on every entry | [`new_file`] |
//! | what a recording suggests for it | [`proposal`] |
//! | its columns in SI units, as models name them | [`si_columns`] |
//! | what a person is asked for it | [`questions`] |
//!
//! The file only gives defaults to options that exist: what is typed wins, and an option that excludes
//! another one also excludes what the project has for that.

mod error;
pub mod file;
pub mod find;
pub mod new_file;
pub mod offers;
pub mod places;
pub mod proposal;
pub mod questions;
pub mod si_columns;
pub mod words;

pub use error::ProjectError;
pub use file::ProjectFile;
pub use find::Project;
