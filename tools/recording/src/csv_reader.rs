//! CSV in.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use csv::{ByteRecord, ReaderBuilder, Trim};

use crate::error::{Problem, RecordingError};
use crate::recording::{Column, MIN_SAMPLES, Recording, TIME_COLUMN, check_names, shorten};
use crate::side_file;

/// Byte-order mark that some spreadsheet programs put before the header.
const UTF8_BOM: &[u8] = b"\xef\xbb\xbf";

/// Reads a recording and its side file (`same_stem.toml`), if there is one.
///
/// # Errors
/// A [`RecordingError`] naming file, row, column and remedy.
pub fn read_csv(path: &Path) -> Result<Recording, RecordingError> {
    let name = path.display().to_string();
    let file = File::open(path).map_err(|error| RecordingError::new(name.clone(), Problem::Io(error)))?;
    let mut recording = parse_csv(BufReader::new(file), name)?;
    side_file::read_into(path, &mut recording)?;
    Ok(recording)
}

/// Reads a recording from text; `name` is what errors call it.
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

fn parse(mut source: impl Read, name: &str) -> Result<Recording, Problem> {
    let mut bytes = Vec::new();
    source.read_to_end(&mut bytes).map_err(Problem::Io)?;
    let mut lines = LineCounter::new(&bytes);
    // The rows are counted and measured here rather than by the csv crate, so that messages can name both.
    let mut reader =
        ReaderBuilder::new().has_headers(false).flexible(true).trim(Trim::All).from_reader(bytes.as_slice());
    let mut row = ByteRecord::new();

    if !reader.read_byte_record(&mut row).map_err(csv_problem)? {
        return Err(Problem::Empty);
    }
    let names = header_names(&row, lines.line_of(&row))?;
    check_names(&names)?;

    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
    let mut previous_s = f64::NEG_INFINITY;
    while reader.read_byte_record(&mut row).map_err(csv_problem)? {
        let line = lines.line_of(&row);
        if row.len() != names.len() {
            return Err(Problem::RaggedRow { row: line, expected: names.len(), found: row.len() });
        }
        for ((cell, name), column) in row.iter().zip(&names).zip(&mut columns) {
            column.push(number(cell, line, name)?);
        }
        let time_s = columns.first().and_then(|time| time.last()).copied();
        let time_s = time_s.filter(|time_s| time_s.is_finite());
        let time_s = time_s.ok_or(Problem::MissingTime { row: line })?;
        if time_s <= previous_s {
            return Err(Problem::TimeNotIncreasing { row: line, previous_s, time_s });
        }
        previous_s = time_s;
    }

    let mut columns = columns.into_iter();
    let time_s = columns.next().unwrap_or_default();
    if time_s.len() < MIN_SAMPLES {
        return Err(Problem::TooFewSamples { found: time_s.len(), required: MIN_SAMPLES });
    }
    let mut recording = Recording::new(name, time_s);
    recording.columns = names
        .into_iter()
        .filter(|name| name != TIME_COLUMN)
        .zip(columns)
        .map(|(name, samples)| Column { name, samples })
        .collect();
    Ok(recording)
}

fn header_names(header: &ByteRecord, row: u64) -> Result<Vec<String>, Problem> {
    let mut names = Vec::with_capacity(header.len());
    for (position, cell) in header.iter().enumerate() {
        let cell = match position {
            0 => cell.strip_prefix(UTF8_BOM).unwrap_or(cell),
            _ => cell,
        };
        let text = std::str::from_utf8(cell).map_err(|_| Problem::NotUtf8 { row })?;
        names.push(text.trim().to_owned());
    }
    Ok(names)
}

/// An empty cell is a missing value; anything else must be a finite number.
fn number(cell: &[u8], row: u64, column: &str) -> Result<f64, Problem> {
    if cell.is_empty() {
        return Ok(f64::NAN);
    }
    let text = std::str::from_utf8(cell).map_err(|_| Problem::NotUtf8 { row })?;
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(Problem::NotFinite { row, column: column.to_owned(), text: shorten(text) }),
        Err(_) => Err(Problem::NotANumber { row, column: column.to_owned(), text: shorten(text) }),
    }
}

/// Finds the line a record stands on. The csv crate reports where it began to look, which is before any
/// blank lines.
struct LineCounter<'a> {
    bytes: &'a [u8],
    at: usize,
    line: u64,
}

impl<'a> LineCounter<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, line: 1 }
    }

    /// 1-based line of a record; records are asked for in file order.
    fn line_of(&mut self, record: &ByteRecord) -> u64 {
        let start = record.position().map_or(0, csv::Position::byte);
        let start = usize::try_from(start).unwrap_or(usize::MAX);
        while let Some(&byte) = self.bytes.get(self.at) {
            let ends_line = matches!(byte, b'\n' | b'\r');
            if self.at >= start && !ends_line {
                break;
            }
            self.at += 1;
            // Of a CR LF pair only the LF counts.
            if ends_line && !(byte == b'\r' && self.bytes.get(self.at) == Some(&b'\n')) {
                self.line += 1;
            }
        }
        self.line
    }
}

fn csv_problem(error: csv::Error) -> Problem {
    let row = error.position().map_or(0, csv::Position::line);
    let reason = error.to_string();
    match error.into_kind() {
        csv::ErrorKind::Io(error) => Problem::Io(error),
        csv::ErrorKind::Utf8 { .. } => Problem::NotUtf8 { row },
        _ => Problem::Malformed { row, reason },
    }
}
