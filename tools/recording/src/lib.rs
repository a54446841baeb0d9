//! Recordings of an experiment: time stamps, named columns with units, and nothing guessed.
//!
//! A recording is a CSV file whose first line is the header, whose first column is `time_s` and whose
//! column names end in their unit (`force_N`, `tip_deflection_m`). Stamps increase strictly but need not
//! be uniform; a missing value is an empty cell, [`f64::NAN`] in memory. A side file of the same stem,
//! `.toml`, may carry a [`Role`] and free-form notes.
//!
//! ```
//! use stillbeam_recording::{parse_csv, Recording};
//! let text = "time_s,tip_deflection_m\n0,0\n0.01,1e-6\n0.02,\n0.03,3e-6\n";
//! let recording: Recording = parse_csv(text.as_bytes(), "example.csv")?;
//! assert_eq!(recording.column("tip_deflection_m")?[1], 1e-6);
//! assert!(recording.column("tip_deflection_m")?[2].is_nan());
//! # Ok::<(), stillbeam_recording::RecordingError>(())
//! ```
//!
//! [`read_recording`] also takes universal files (data sets 58 and 58b), MATLAB files, WAV and Klipper's
//! accelerometer logs, told apart by their content; [`write_recording`] writes CSV, universal files and JSON.
//!
//! Bad input is a [`RecordingError`] that names file, row, column and the remedy; reading never panics.

mod channels;
mod column_name;
mod content;
mod csv_reader;
mod csv_writer;
mod error;
mod export;
mod format;
mod grid;
mod gzip;
mod heading;
mod import;
mod json_reader;
mod json_writer;
mod klipper;
mod lvm;
mod mat;
mod named;
mod npy;
mod octave;
mod options;
mod recording;
mod side_file;
mod spectrum;
mod table;
mod uff;
mod unit_label;
mod wav;

pub use csv_reader::{parse_csv, read_csv};
pub use csv_writer::{to_csv, write_csv};
pub use error::{Problem, RecordingError};
pub use export::{to_format, write_recording};
pub use format::Format;
pub use import::{
    Imported, MAX_FILE_BYTES, Measurement, parse_measurement, parse_recording, read_measurement,
    read_recording,
};
pub use json_writer::to_json;
pub use mat::{MatProblem, Value as MatValue, Variable as MatVariable, read_mat_variables};
pub use npy::NpyProblem;
pub use options::{ColumnChoice, ReadOptions, TimeBase};
pub use recording::{Column, MIN_SAMPLES, Recording, Role, TIME_COLUMN};
pub use spectrum::{ImportedSpectra, Spectrum, SpectrumKind, SpectrumValues};
pub use table::Separator;
pub use uff::{UffProblem, to_uff58, to_uff58b};
pub use wav::WavProblem;
