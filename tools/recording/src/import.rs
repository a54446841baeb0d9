//! One way in for every format.

use std::path::Path;

use crate::content::{Content, Signals};
use crate::error::{Problem, RecordingError};
use crate::format::Format;
use crate::options::{ReadOptions, TimeBase};
use crate::recording::Recording;
use crate::spectrum::ImportedSpectra;
use crate::{gzip, json_reader, klipper, lvm, mat, npy, octave, side_file, table, uff, wav};

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

/// What a file may hold.
#[derive(Debug, Clone, PartialEq)]
pub enum Measurement {
    /// Signals over time.
    Recording(Imported),
    /// Functions of frequency.
    Spectra(ImportedSpectra),
}

/// Reads a recording in any of the formats, and its side file (`same_stem.toml`) if there is one.
///
/// # Errors
/// A [`RecordingError`] that names the file, the place in it and the remedy; [`Problem::Spectrum`] for a file
/// that holds functions of frequency.
pub fn read_recording(path: &Path, options: &ReadOptions) -> Result<Imported, RecordingError> {
    recording_only(read_measurement(path, options)?)
}

/// Reads whatever a file holds, a recording (and its side file) or spectra.
///
/// # Errors
/// A [`RecordingError`] that names the file, the place in it and the remedy.
pub fn read_measurement(path: &Path, options: &ReadOptions) -> Result<Measurement, RecordingError> {
    let name = path.display().to_string();
    let failed = |problem| RecordingError::new(name.clone(), problem);
    let size = std::fs::metadata(path).map_err(|error| failed(Problem::Io(error)))?.len();
    if size > MAX_FILE_BYTES {
        return Err(failed(Problem::TooLarge { limit_mib: MAX_FILE_BYTES >> 20 }));
    }
    let bytes = std::fs::read(path).map_err(|error| failed(Problem::Io(error)))?;
    let mut measurement = parse_measurement(&bytes, name.as_str(), options)?;
    if let Measurement::Recording(imported) = &mut measurement {
        side_file::read_into(path, &mut imported.recording)?;
    }
    Ok(measurement)
}

fn recording_only(measurement: Measurement) -> Result<Imported, RecordingError> {
    match measurement {
        Measurement::Recording(imported) => Ok(imported),
        Measurement::Spectra(spectra) => {
            let holds = spectra.words();
            Err(RecordingError::new(spectra.name, Problem::Spectrum { holds }))
        }
    }
}

/// Reads a recording from the bytes of a file; `name` is what errors call it.
///
/// # Errors
/// As [`read_recording`].
pub fn parse_recording(
    bytes: &[u8],
    name: impl Into<String>,
    options: &ReadOptions,
) -> Result<Imported, RecordingError> {
    recording_only(parse_measurement(bytes, name, options)?)
}

/// Reads whatever the bytes of a file hold; `name` is what errors call it.
///
/// # Errors
/// A [`RecordingError`] that names the place and the remedy.
pub fn parse_measurement(
    bytes: &[u8],
    name: impl Into<String>,
    options: &ReadOptions,
) -> Result<Measurement, RecordingError> {
    let name = name.into();
    let failed = |problem| RecordingError::new(name.clone(), problem);
    let unpacked = gzip::unpacked(bytes).map_err(failed)?;
    let (bytes, packed) = match &unpacked {
        Some((contents, said)) => (contents.as_slice(), Some((*said).to_owned())),
        None => (bytes, None),
    };
    let format = options.format.map_or_else(|| Format::detect(bytes), Ok).map_err(failed)?;
    let Content { signals, mut remarks } = content(bytes, format, options).map_err(failed)?;
    remarks.splice(0..0, packed);
    let (time_s, columns) = match signals {
        Signals::OverTime(time_s, columns) => (time_s, columns),
        Signals::Spectra(spectra) => {
            return Ok(Measurement::Spectra(ImportedSpectra { name, spectra, format, remarks }));
        }
    };
    let mut recording = Recording::new(name.clone(), time_s);
    recording.columns = columns;
    if format == Format::Json {
        let about = json_reader::about(bytes).map_err(failed)?;
        (recording.role, recording.notes) = (about.role, about.notes);
    }
    if let Some(TimeBase::IntervalS(interval_s)) = options.time {
        remarks.extend(give_rate(&mut recording, interval_s));
    }
    recording.check()?;
    Ok(Measurement::Recording(Imported { recording, format, remarks }))
}

fn content(bytes: &[u8], format: Format, options: &ReadOptions) -> Result<Content, Problem> {
    match format {
        Format::Csv => table::parse(bytes, options),
        Format::Klipper => klipper::parse(bytes, options),
        Format::RepRap => klipper::parse_reprap(bytes, options),
        Format::Lvm => lvm::parse(bytes, options),
        Format::Uff58 | Format::Uff58b => uff::parse(bytes, options),
        Format::Mat => mat::parse(bytes, options).map(Content::from),
        Format::Octave => octave::parse(bytes, options).map(Content::from),
        Format::Npy => npy::parse(bytes, options),
        Format::Wav => wav::parse(bytes, options).map(Content::from),
        Format::Json => json_reader::parse(bytes, options),
    }
}

/// Puts the rate that was given in the place of the file's own stamps, and says so where these differ.
fn give_rate(recording: &mut Recording, interval_s: f64) -> Option<String> {
    let given: Vec<f64> = (0..recording.len()).map(|k| k as f64 * interval_s).collect();
    let own = std::mem::replace(&mut recording.time_s, given);
    let moved = own.iter().zip(&recording.time_s).any(|(own, given)| (own - given).abs() > 1e-6 * interval_s);
    moved.then(|| "the file's own time stamps gave way to the sample rate that was given".to_owned())
}
