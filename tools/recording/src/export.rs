//! One way out for every format that is written.

use std::io::Write;
use std::path::Path;

use crate::error::{Problem, RecordingError};
use crate::format::Format;
use crate::recording::Recording;
use crate::{csv_writer, json_writer, side_file, uff};

/// Writes a recording in the format asked for or, without one, that of the file's extension; formats that
/// have no place for a role and notes get a side file.
///
/// Nothing is left behind when the recording cannot be written in the format.
///
/// # Errors
/// [`Problem::NoFormat`] for an extension that means none, [`Problem::NotWritable`] for one that is only
/// read, and what the format's writer says.
pub fn write_recording(
    path: &Path,
    recording: &Recording,
    format: Option<Format>,
) -> Result<Format, RecordingError> {
    let name = path.display().to_string();
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let format = match format.or_else(|| Format::of_extension(extension)) {
        Some(format) => format,
        None => {
            let problem = Problem::NoFormat { extension: crate::recording::shorten(extension) };
            return Err(RecordingError::new(name, problem));
        }
    };
    let mut bytes = Vec::new();
    to_format(&mut bytes, recording, format)?;
    std::fs::write(path, bytes).map_err(|error| RecordingError::new(name, Problem::Io(error)))?;
    if format != Format::Json {
        side_file::write_beside(path, recording)?;
    }
    Ok(format)
}

/// Writes a recording in a format.
///
/// # Errors
/// As [`write_recording`].
pub fn to_format(sink: impl Write, recording: &Recording, format: Format) -> Result<(), RecordingError> {
    match format {
        Format::Csv => csv_writer::to_csv(sink, recording),
        Format::Uff58 => uff::to_uff58(sink, recording),
        Format::Uff58b => uff::to_uff58b(sink, recording),
        Format::Json => json_writer::to_json(sink, recording),
        Format::Klipper
        | Format::RepRap
        | Format::Lvm
        | Format::Mat
        | Format::Octave
        | Format::Npy
        | Format::Wav => Err(recording.error(Problem::NotWritable { format })),
    }
}
