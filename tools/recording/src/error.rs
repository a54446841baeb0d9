//! What can be wrong with a recording, where, and what to do about it.

use thiserror::Error;

use crate::format::Format;
use crate::mat::MatProblem;
use crate::npy::NpyProblem;
use crate::uff::UffProblem;
use crate::wav::WavProblem;

/// A recording that cannot be used as it is: which one, and why.
#[derive(Debug, Error)]
#[error("{file}: {problem}")]
pub struct RecordingError {
    /// The file's path, or the recording's name when it did not come from a file.
    pub file: String,
    /// What is wrong, where in the file, and the remedy.
    pub problem: Problem,
}

impl RecordingError {
    /// Ties a problem to the recording it was found in.
    pub fn new(file: impl Into<String>, problem: Problem) -> Self {
        Self { file: file.into(), problem }
    }
}

/// The problem itself. `row` is the 1-based line of the file, the header being line 1.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Problem {
    /// The file could not be opened, read or written.
    #[error("cannot be read or written: {0}; check that the path exists and is accessible")]
    Io(std::io::Error),
    /// There is nothing in the file.
    #[error("the file is empty; a recording starts with a header line such as `time_s,tip_deflection_m`")]
    Empty,
    /// The first line holds numbers.
    #[error(
        "read as CSV: row 1 holds numbers, not names; add a header line such as `time_s,tip_deflection_m`"
    )]
    NoHeader,
    /// Bytes that are not UTF-8 text.
    #[error("row {row} is not UTF-8 text; save the file as plain UTF-8 CSV")]
    NotUtf8 {
        /// Line of the file.
        row: u64,
    },
    /// The first column is not the time.
    #[error(
        "read as CSV: the first column is `{found}`, not `time_s`; put the time in seconds first, columns separated by \
         commas, or say which it is, with --time COLUMN"
    )]
    FirstColumnNotTime {
        /// The name found instead.
        found: String,
    },
    /// There is a time and nothing else.
    #[error("there is no column besides `time_s`; add at least one measured column")]
    NoDataColumn,
    /// Two columns carry the same name.
    #[error("column `{column}` appears more than once (columns {first} and {second}); rename or remove one")]
    DuplicateColumn {
        /// The repeated name.
        column: String,
        /// 1-based position of the first one.
        first: usize,
        /// 1-based position of the second one.
        second: usize,
    },
    /// A column name that does not end in a unit.
    #[error(
        "column {position} is named `{column}`, which does not end in a unit; name it like `tip_deflection_m` or `force_N`"
    )]
    ColumnWithoutUnit {
        /// The name found.
        column: String,
        /// 1-based position of the column.
        position: usize,
    },
    /// A row with more or fewer cells than the header.
    #[error(
        "row {row} has {found} cells where the header has {expected}; leave a missing value as an empty cell between its commas"
    )]
    RaggedRow {
        /// Line of the file.
        row: u64,
        /// Cells in the header.
        expected: usize,
        /// Cells in this row.
        found: usize,
    },
    /// A cell that is not a number.
    #[error(
        "row {row}, column `{column}`: `{text}` is not a number; write decimals with a point and leave missing values empty"
    )]
    NotANumber {
        /// Line of the file.
        row: u64,
        /// Name of the column.
        column: String,
        /// The cell, shortened.
        text: String,
    },
    /// NaN or an infinity, written out or from a number too large for `f64`.
    #[error("row {row}, column `{column}`: `{text}` is not a finite number; leave missing values empty")]
    NotFinite {
        /// Line of the file.
        row: u64,
        /// Name of the column.
        column: String,
        /// The cell, shortened.
        text: String,
    },
    /// A row without a time stamp.
    #[error("row {row}: the time stamp is missing; remove the row or fill in its time")]
    MissingTime {
        /// Line of the file.
        row: u64,
    },
    /// A time stamp that is not later than the one before.
    #[error(
        "row {row}, column `time_s`: {time_s} s does not come after {previous_s} s in the row before; \
         sort the rows, remove repeated ones, and record stamps finely enough to tell samples apart; where the \
         clock was set and the samples are even, --sample-rate HZ does without stamps"
    )]
    TimeNotIncreasing {
        /// Line of the file.
        row: u64,
        /// The stamp before, in seconds.
        previous_s: f64,
        /// The stamp at fault, in seconds.
        time_s: f64,
    },
    /// Too short to say anything.
    #[error("{found} samples; a recording needs at least {required}")]
    TooFewSamples {
        /// Samples found.
        found: usize,
        /// Samples required.
        required: usize,
    },
    /// A column whose length differs from the time's (only possible for recordings built in memory).
    #[error(
        "column `{column}` has {found} samples and `time_s` has {expected}; give every column one sample per stamp"
    )]
    ColumnLength {
        /// Name of the column.
        column: String,
        /// Samples in `time_s`.
        expected: usize,
        /// Samples in the column.
        found: usize,
    },
    /// A column that was asked for and is not there.
    #[error("there is no column `{column}`; the columns are {}; name one of these", list(present))]
    MissingColumn {
        /// The name asked for.
        column: String,
        /// The names there are.
        present: Vec<String>,
    },
    /// A column that was asked for holds no value at all.
    #[error("column `{column}` holds no value; choose another column or record it again")]
    EmptyColumn {
        /// Name of the column.
        column: String,
    },
    /// The side file cannot be understood.
    #[error("side file {side_file}: {reason}; correct or remove it")]
    SideFile {
        /// Path of the side file.
        side_file: String,
        /// What the reader said.
        reason: String,
    },
    /// The content is none of the formats.
    #[error("not a recording: it looks like {looks_like}; formats that can be read: {}", Format::readable().join(", "))]
    UnknownFormat {
        /// What the bytes look like, and the remedy.
        looks_like: &'static str,
    },
    /// The file is too large to be taken into memory.
    #[error("the file is larger than {limit_mib} MiB; divide it")]
    TooLarge {
        /// The limit, MiB.
        limit_mib: u64,
    },
    /// A format that is only read.
    #[error("{format} is read and not written; formats that can be written: {}", Format::writable().join(", "))]
    NotWritable {
        /// The format.
        format: Format,
    },
    /// A file name that does not say in which format to write.
    #[error(
        "`.{extension}` means no format; end the name in .csv, .uff or .json, or name the format with --to"
    )]
    NoFormat {
        /// The end of the name.
        extension: String,
    },
    /// A time was given for a format that carries its own.
    #[error("read as {format}, which carries its own time; leave --time and --sample-rate out")]
    OwnTime {
        /// The format.
        format: Format,
    },
    /// No signal states its unit.
    #[error(
        "no signal states a unit; name the columns, with --column NAME_UNIT=SOURCE (tip_deflection_m=y*0.001); the file holds {}",
        some(present)
    )]
    NoUnits {
        /// The signals there are.
        present: Vec<String>,
    },
    /// A signal that was asked for and is not there.
    #[error("there is no signal `{source_name}`; the file holds {}; name one of these", some(present))]
    MissingSource {
        /// The name asked for.
        source_name: String,
        /// The signals there are.
        present: Vec<String>,
    },
    /// Functions of frequency where a recording is needed.
    #[error(
        "the file holds {holds}, not a recording; record the signal over time: of Klipper the raw data \
         (`TEST_RESONANCES ... OUTPUT=raw_data`, raw_data_*.csv), of an analyser the time responses"
    )]
    Spectrum {
        /// What it holds, in words.
        holds: String,
    },
    /// A universal file at fault.
    #[error("read as a universal file: {0}")]
    Uff(Box<UffProblem>),
    /// A MATLAB file at fault.
    #[error("read as a MATLAB file: {0}")]
    Mat(Box<MatProblem>),
    /// A WAV file at fault.
    #[error("read as a WAV file: {0}")]
    Wav(Box<WavProblem>),
    /// No column of a table is the time.
    #[error(
        "no column is a time: the file holds {}; say which it is, with --time COLUMN, or give --sample-rate HZ",
        some(present)
    )]
    NoTimeColumn {
        /// The columns there are.
        present: Vec<String>,
    },
    /// Text without a table in it.
    #[error(
        "no table of numbers is found, the text begins with `{first}`; state --separator, --decimal or --skip-lines, or save it as CSV"
    )]
    NoTable {
        /// Its first line, shortened.
        first: String,
    },
    /// A spectrum whose frequencies do not increase.
    #[error("row {row}: the frequency does not increase; sort the rows and remove repeated ones")]
    FrequencyNotIncreasing {
        /// Line of the file.
        row: u64,
    },
    /// An accelerometer log of RepRapFirmware without its last line.
    #[error("the last line, `Rate ..., overflows ...`, is missing; give --sample-rate HZ")]
    NoRate,
    /// A LabVIEW measurement file at fault.
    #[error("read as a LabVIEW measurement file: {what} is missing; export it again, or save it as CSV")]
    Lvm {
        /// What is missing.
        what: &'static str,
    },
    /// A text file of Octave at fault.
    #[error("read as Octave's text format: line {line}: {what}; save the file again, or with -v7")]
    Octave {
        /// Line of the file.
        line: u32,
        /// What is wrong.
        what: &'static str,
    },
    /// Text that is no JSON.
    #[error("read as JSON: {}; write the file again, or as CSV", reason.lines().next().unwrap_or_default())]
    Json {
        /// Line of the file.
        line: usize,
        /// What the reader said.
        reason: String,
    },
    /// JSON of something else.
    #[error(
        "read as JSON: it holds no arrays of numbers; a recording is {{\"columns\": {{\"time_s\": [...], \"tip_deflection_m\": [...]}}}}"
    )]
    JsonWithoutSignals,
    /// A NumPy file at fault.
    #[error("read as a NumPy array: {0}")]
    Npy(Box<NpyProblem>),
}

fn list(names: &[String]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    quoted.join(", ")
}

impl From<UffProblem> for Problem {
    fn from(problem: UffProblem) -> Self {
        Self::Uff(Box::new(problem))
    }
}

impl From<NpyProblem> for Problem {
    fn from(problem: NpyProblem) -> Self {
        Self::Npy(Box::new(problem))
    }
}

impl From<MatProblem> for Problem {
    fn from(problem: MatProblem) -> Self {
        Self::Mat(Box::new(problem))
    }
}

impl From<WavProblem> for Problem {
    fn from(problem: WavProblem) -> Self {
        Self::Wav(Box::new(problem))
    }
}

/// At most a dozen entries: a file may hold thousands.
pub(crate) fn some(entries: &[String]) -> String {
    const SHOWN: usize = 12;
    let mut text = entries.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(", ");
    if entries.len() > SHOWN {
        text.push_str(&format!(" and {} more", entries.len() - SHOWN));
    }
    if text.is_empty() { "nothing".to_owned() } else { text }
}
