//! The recordings' own CSV in.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use crate::error::{Problem, RecordingError};
use crate::recording::{Column, Recording};
use crate::{side_file, table};

/// Byte-order mark that some spreadsheet programs put before the header.
const UTF8_BOM: &[u8] = b"\xef\xbb\xbf";

/// Reads a recording in stillbeam's own format, and its side file (`same_stem.toml`) if there is one.
///
/// # Errors
/// A [`RecordingError`] naming file, row, column and remedy. Nothing is made allowances for:
/// [`read_recording`](crate::read_recording) takes other dialects and says what it made of them.
pub fn read_csv(path: &Path) -> Result<Recording, RecordingError> {
    let name = path.display().to_string();
    let file = File::open(path).map_err(|error| RecordingError::new(name.clone(), Problem::Io(error)))?;
    let mut recording = parse_csv(BufReader::new(file), name)?;
    side_file::read_into(path, &mut recording)?;
    Ok(recording)
}

/// Reads a recording in stillbeam's own format from text; `name` is what errors call it.
///
/// # Errors
/// A [`RecordingError`] naming row, column and remedy.
pub fn parse_csv(source: impl Read, name: impl Into<String>) -> Result<Recording, RecordingError> {
    let name = name.into();
    match parse(source, &name) {
        Ok(recording) => Ok(recording),
        Err(problem) => Err(RecordingError::new(name, problem)),
    }
}

/// What a parser hands back: time stamps in seconds, columns, remarks.
pub(crate) type Parsed = (Vec<f64>, Vec<Column>, Vec<String>);

fn parse(mut source: impl Read, name: &str) -> Result<Recording, Problem> {
    let mut bytes = Vec::new();
    source.read_to_end(&mut bytes).map_err(Problem::Io)?;
    let bytes = bytes.strip_prefix(UTF8_BOM).unwrap_or(&bytes);
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => {
            let before = bytes.get(..error.valid_up_to()).unwrap_or(&[]);
            let row = 1 + before.iter().filter(|byte| **byte == b'\n').count() as u64;
            return Err(Problem::NotUtf8 { row });
        }
    };
    let (time_s, columns) = table::parse_contract(text)?;
    let mut recording = Recording::new(name, time_s);
    recording.columns = columns;
    Ok(recording)
}
