//! Around identification: which columns, several recordings together, and the files that modes go into.

pub mod arguments;
pub mod axis_shapers;
pub mod columns;
pub mod combined;
pub mod from_recordings;
pub mod modal_file;
pub mod modes_file;
pub mod options;
pub mod sweep;
pub mod vibration_share;
