//! Recordings between Rust and Python: a name, stamps, named columns, a role, and notes as JSON.

use std::path::PathBuf;

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::{Bound, FromPyObject, PyResult, Python, pyfunction};
use stillbeam::error::CliError;
use stillbeam_recording::{
    ColumnChoice, Format, Imported, Measurement, ReadOptions, Recording, Role, Separator, TimeBase,
    read_measurement, read_recording, write_recording,
};

use crate::failures::{exception, unusable};
use crate::work;

/// One that Python made.
#[derive(FromPyObject)]
pub struct GivenRecording<'py>(
    String,
    PyReadonlyArray1<'py, f64>,
    Vec<(String, PyReadonlyArray1<'py, f64>)>,
    Option<String>,
    String,
);

/// One for Python.
pub type TakenRecording<'py> = (
    String,
    Bound<'py, PyArray1<f64>>,
    Vec<(String, Bound<'py, PyArray1<f64>>)>,
    Option<&'static str>,
    String,
);

/// A file, or a recording that was read or made before.
#[derive(FromPyObject)]
pub enum GivenMeasurement<'py> {
    /// In memory.
    Recording(GivenRecording<'py>),
    /// In a file.
    File(PathBuf),
}

/// What a file leaves open; see `stillbeam.read`.
#[derive(Default, FromPyObject)]
#[pyo3(from_item_all)]
pub struct Reading {
    format: Option<String>,
    time: Option<String>,
    sample_rate_hz: Option<f64>,
    columns: Vec<String>,
    skip_lines: Option<u32>,
    separator: Option<String>,
    decimal: Option<String>,
}

impl Reading {
    /// As the reader takes it.
    ///
    /// # Errors
    /// `InputError` for a word or a rate that is none.
    pub fn options(&self) -> PyResult<ReadOptions> {
        let time = match (&self.time, self.sample_rate_hz) {
            (Some(_), Some(_)) => {
                return Err(unusable("time and sample_rate_hz both say when samples were taken; give one"));
            }
            (Some(source), None) => Some(source.parse::<TimeBase>().map_err(unusable)?),
            (None, Some(rate_hz)) if rate_hz.is_finite() && rate_hz > 0.0 => {
                Some(TimeBase::IntervalS(1.0 / rate_hz))
            }
            (None, Some(rate_hz)) => {
                return Err(unusable(format!("sample_rate_hz {rate_hz}: give samples per second, above 0")));
            }
            (None, None) => None,
        };
        let columns = self.columns.iter().map(|text| text.parse::<ColumnChoice>().map_err(unusable));
        let decimal_comma = match self.decimal.as_deref() {
            None => None,
            Some("," | "comma") => Some(true),
            Some("." | "point") => Some(false),
            Some(other) => return Err(unusable(format!("decimal {other:?}: give \".\" or \",\""))),
        };
        let parsed = |text: &String| text.parse::<Separator>().map_err(unusable);
        Ok(ReadOptions {
            format: self.format.as_deref().map(str::parse::<Format>).transpose().map_err(unusable)?,
            time,
            columns: columns.collect::<PyResult<_>>()?,
            skip_lines: self.skip_lines,
            separator: self.separator.as_ref().map(parsed).transpose()?,
            decimal_comma,
        })
    }
}

impl GivenRecording<'_> {
    /// Copied into Rust's memory and checked.
    ///
    /// # Errors
    /// `InputError` in the reader's words.
    pub fn copied(&self) -> PyResult<Recording> {
        let Self(name, time_s, columns, role, notes) = self;
        let samples = |array: &PyReadonlyArray1<'_, f64>| array.as_array().iter().copied().collect();
        let mut recording = Recording::new(name, samples(time_s));
        for (column, array) in columns {
            recording = recording.with_column(column, samples(array));
        }
        recording.role = match role.as_deref() {
            None => None,
            Some("train") => Some(Role::Train),
            Some("held_out") => Some(Role::HeldOut),
            Some(other) => {
                return Err(unusable(format!(
                    "{name}: role {other:?}: give \"train\", \"held_out\" or None"
                )));
            }
        };
        recording.notes = serde_json::from_str(notes)
            .map_err(|error| unusable(format!("{name}: notes that a side file cannot hold: {error}")))?;
        recording.check().map_err(exception)?;
        Ok(recording)
    }
}

impl GivenMeasurement<'_> {
    /// Read or copied.
    ///
    /// # Errors
    /// `InputError` in the reader's words.
    pub fn taken(&self, py: Python<'_>, reading: &Reading) -> PyResult<Measurement> {
        match self {
            Self::Recording(given) => Ok(Measurement::Recording(Imported {
                recording: given.copied()?,
                format: Format::Csv,
                remarks: Vec::new(),
            })),
            Self::File(path) => {
                let (path, options) = (path.clone(), reading.options()?);
                let read = move || read_measurement(&path, &options).map_err(CliError::from);
                Ok(work::run(py, move |_| read())?.result)
            }
        }
    }
}

/// A recording as Python gets it.
pub fn taken<'py>(py: Python<'py>, recording: Recording) -> TakenRecording<'py> {
    let role = recording.role.map(|role| match role {
        Role::Train => "train",
        Role::HeldOut => "held_out",
    });
    let columns = recording.columns.into_iter();
    let columns = columns.map(|column| (column.name, column.samples.into_pyarray(py)));
    let notes = serde_json::to_string(&recording.notes).unwrap_or_else(|_| "{}".to_owned());
    (recording.name, recording.time_s.into_pyarray(py), columns.collect(), role, notes)
}

/// Reads a recording, and says what was understood and left out.
#[pyfunction]
pub fn read<'py>(
    py: Python<'py>,
    path: PathBuf,
    reading: Reading,
) -> PyResult<(TakenRecording<'py>, String, Vec<String>)> {
    let options = reading.options()?;
    let done = work::run(py, move |_| Ok(read_recording(&path, &options)?))?;
    let Imported { recording, format, remarks } = done.result;
    Ok((taken(py, recording), format.to_string(), remarks))
}

/// Writes a recording, and its side file where it has a role or notes.
#[pyfunction]
pub fn write(recording: GivenRecording<'_>, path: PathBuf) -> PyResult<()> {
    write_recording(&path, &recording.copied()?, None).map(|_| ()).map_err(exception)
}

/// Refuses what no reader would accept.
#[pyfunction]
pub fn check(recording: GivenRecording<'_>) -> PyResult<()> {
    recording.copied().map(|_| ())
}
