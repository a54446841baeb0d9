//! CSV in.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use csv::{ByteRecord, ReaderBuilder, Trim};

use crate::csv_columns::{Cells, check_cells, chosen_cells, left_out};
use crate::error::{Problem, RecordingError};
use crate::options::ReadOptions;
use crate::recording::{Column, MIN_SAMPLES, Recording, shorten};
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

/// What a parser hands back: time stamps in seconds, columns, remarks.
pub(crate) type Parsed = (Vec<f64>, Vec<Column>, Vec<String>);

fn parse(mut source: impl Read, name: &str) -> Result<Recording, Problem> {
    let mut bytes = Vec::new();
    source.read_to_end(&mut bytes).map_err(Problem::Io)?;
    let (time_s, columns, _) = parse_with(&bytes, &ReadOptions::default())?;
    let mut recording = Recording::new(name, time_s);
    recording.columns = columns;
    Ok(recording)
}

/// Reads CSV text, its columns chosen and named by the options.
pub(crate) fn parse_with(bytes: &[u8], options: &ReadOptions) -> Result<Parsed, Problem> {
    if options.time.is_none() && options.columns.is_empty() {
        return parse_table(bytes, |names| Ok(names.into_iter().map(Cells::take).collect()));
    }
    parse_table(bytes, |names| chosen_cells(&names, options))
}

pub(crate) fn parse_table(
    bytes: &[u8],
    choose: impl FnOnce(Vec<String>) -> Result<Vec<Cells>, Problem>,
) -> Result<Parsed, Problem> {
    let mut lines = LineCounter::new(bytes);
    // The rows are counted and measured here rather than by the csv crate, so that messages can name both.
    let mut reader =
        ReaderBuilder::new().has_headers(false).flexible(true).trim(Trim::All).from_reader(bytes);
    let mut row = ByteRecord::new();

    if !reader.read_byte_record(&mut row).map_err(csv_problem)? {
        return Err(Problem::Empty);
    }
    let mut cells = choose(header_names(&row, lines.line_of(&row))?)?;
    check_cells(&cells)?;
    let time_at = cells.iter().position(Cells::is_time).unwrap_or(0);
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); cells.len()];
    let mut previous_s = f64::NEG_INFINITY;
    while reader.read_byte_record(&mut row).map_err(csv_problem)? {
        let line = lines.line_of(&row);
        if row.len() != cells.len() {
            return Err(Problem::RaggedRow { row: line, expected: cells.len(), found: row.len() });
        }
        for ((text, cell), column) in row.iter().zip(&cells).zip(&mut columns) {
            if cell.name.is_some() {
                column.push(cell.scale * number(text, line, &cell.header)?);
            }
        }
        let time_s = columns.get(time_at).and_then(|time| time.last()).copied();
        let time_s = time_s.filter(|time_s| time_s.is_finite());
        let time_s = time_s.ok_or(Problem::MissingTime { row: line })?;
        if time_s <= previous_s {
            return Err(Problem::TimeNotIncreasing { row: line, previous_s, time_s });
        }
        previous_s = time_s;
    }

    // `check_cells` has seen a time among the cells, so there is one of each to remove.
    let time_s = columns.remove(time_at);
    cells.remove(time_at);
    if time_s.len() < MIN_SAMPLES {
        return Err(Problem::TooFewSamples { found: time_s.len(), required: MIN_SAMPLES });
    }
    let remarks = left_out(&cells);
    let columns = cells.into_iter().zip(columns);
    let columns = columns.filter_map(|(cell, samples)| Some(Column { name: cell.name?, samples })).collect();
    Ok((time_s, columns, remarks))
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
