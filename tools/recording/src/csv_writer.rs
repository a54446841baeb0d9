//! CSV out.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use crate::error::{Problem, RecordingError};
use crate::recording::Recording;
use crate::side_file;

/// Writes a recording, and its side file when it has a role or notes.
///
/// A side file that is already there is left alone when there is nothing to write into it.
///
/// # Errors
/// [`Problem::Io`], or whatever [`Recording::check`] finds: nothing is written that could not be read.
pub fn write_csv(path: &Path, recording: &Recording) -> Result<(), RecordingError> {
    recording.check()?;
    let failed = |error| RecordingError::new(path.display().to_string(), Problem::Io(error));
    let file = File::create(path).map_err(failed)?;
    let mut writer = BufWriter::new(file);
    write_rows(&mut writer, recording).map_err(failed)?;
    side_file::write_beside(path, recording)
}

/// Writes the CSV text of a recording; every number reads back as the same `f64`.
///
/// # Errors
/// [`Problem::Io`], or whatever [`Recording::check`] finds.
pub fn to_csv(sink: impl Write, recording: &Recording) -> Result<(), RecordingError> {
    recording.check()?;
    write_rows(sink, recording).map_err(|error| recording.error(Problem::Io(error)))
}

fn write_rows(mut sink: impl Write, recording: &Recording) -> std::io::Result<()> {
    writeln!(sink, "{}", recording.column_names().join(","))?;
    for (index, time_s) in recording.time_s.iter().enumerate() {
        write_number(&mut sink, *time_s)?;
        for column in &recording.columns {
            sink.write_all(b",")?;
            match column.samples.get(index) {
                Some(sample) if !sample.is_nan() => write_number(&mut sink, *sample)?,
                _ => {}
            }
        }
        sink.write_all(b"\n")?;
    }
    sink.flush()
}

/// Both of Rust's forms are the shortest that read back the same; the exponent keeps small ones short too.
fn write_number(sink: &mut impl Write, value: f64) -> std::io::Result<()> {
    let size = value.abs();
    if size != 0.0 && !(1e-4..1e15).contains(&size) {
        write!(sink, "{value:e}")
    } else {
        write!(sink, "{value}")
    }
}
