//! One way in for every format.

use std::path::Path;

use crate::error::{Problem, RecordingError};
use crate::format::Format;
use crate::options::ReadOptions;
use crate::recording::Recording;
use crate::{csv_reader, klipper, mat, side_file, uff, wav};

/// Files beyond this size are refused rather than taken into memory, bytes.
pub const MAX_FILE_BYTES: u64 = 1 << 30;

/// A recording as it came out of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The recording.
    pub recording: Recording,
    /// The format it was in.
    pub format: Format,
    /// What a reader of the result should know: signals left out, a clock set to zero.
    pub remarks: Vec<String>,
}

/// Reads a recording in any of the formats, and its side file (`same_stem.toml`) if there is one.
///
/// # Errors
/// A [`RecordingError`] that names the file, the place in it and the remedy.
pub fn read_recording(path: &Path, options: &ReadOptions) -> Result<Imported, RecordingError> {
    let name = path.display().to_string();
    let failed = |problem| RecordingError::new(name.clone(), problem);
    let size = std::fs::metadata(path).map_err(|error| failed(Problem::Io(error)))?.len();
    if size > MAX_FILE_BYTES {
        return Err(failed(Problem::TooLarge { limit_mib: MAX_FILE_BYTES >> 20 }));
    }
    let bytes = std::fs::read(path).map_err(|error| failed(Problem::Io(error)))?;
    let mut imported = parse_recording(&bytes, name.as_str(), options)?;
    side_file::read_into(path, &mut imported.recording)?;
    Ok(imported)
}

/// Reads a recording from the bytes of a file; `name` is what errors call it.
///
/// # Errors
/// A [`RecordingError`] that names the place and the remedy.
pub fn parse_recording(
    bytes: &[u8],
    name: impl Into<String>,
    options: &ReadOptions,
) -> Result<Imported, RecordingError> {
    let name = name.into();
    let parsed = options.format.map_or_else(|| Format::detect(bytes), Ok).and_then(|format| {
        let (time_s, columns, remarks) = match format {
            Format::Csv => csv_reader::parse_with(bytes, options)?,
            Format::Klipper => klipper::parse(bytes, options)?,
            Format::Uff58 | Format::Uff58b => uff::parse(bytes, options)?,
            Format::Mat => mat::parse(bytes, options)?,
            Format::Wav => wav::parse(bytes, options)?,
            Format::Json => return Err(Problem::NotReadable { format }),
        };
        let mut recording = Recording::new(name.clone(), time_s);
        recording.columns = columns;
        Ok(Imported { recording, format, remarks })
    });
    let imported = parsed.map_err(|problem| RecordingError::new(name, problem))?;
    imported.recording.check()?;
    Ok(imported)
}
