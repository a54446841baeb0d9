//! The recording in memory and the rules that make it usable.

use serde::{Deserialize, Serialize};

pub use crate::column_name::TIME_COLUMN;
use crate::column_name::unit_of;
use crate::error::{Problem, RecordingError};
use crate::heading::Heading;

/// The fewest samples that can be read as a recording.
pub const MIN_SAMPLES: usize = 4;

/// What a recording is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Models are fitted to it.
    Train,
    /// Models are judged on it and never see it before.
    HeldOut,
}

/// One measured quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name ending in its unit, such as `tip_deflection_m`.
    pub name: String,
    /// One value per time stamp in the unit of the name; [`f64::NAN`] where the value is missing.
    pub samples: Vec<f64>,
}

impl Column {
    /// The unit: the part of the name after the last `_`, or a known compound one (`speed_m_s` gives `m_s`).
    ///
    /// Empty when the name carries none; no column read from a file is like that.
    pub fn unit(&self) -> &str {
        unit_of(&self.name).unwrap_or("")
    }
}

/// Time stamps and the columns measured at them.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// What messages call it: the file's path, or a name given by the maker.
    pub name: String,
    /// Time stamps in seconds, strictly increasing, not necessarily uniform.
    pub time_s: Vec<f64>,
    /// The measured columns, in file order, without the time.
    pub columns: Vec<Column>,
    /// From the side file, if there is one and it says so.
    pub role: Option<Role>,
    /// Everything else in the side file.
    pub notes: toml::Table,
}

impl Recording {
    /// A recording with time stamps (seconds) and no columns yet.
    pub fn new(name: impl Into<String>, time_s: Vec<f64>) -> Self {
        Self { name: name.into(), time_s, columns: Vec::new(), role: None, notes: toml::Table::new() }
    }

    /// The same with one more column; `name` ends in its unit. Checked by [`Recording::check`].
    #[must_use]
    pub fn with_column(mut self, name: impl Into<String>, samples: Vec<f64>) -> Self {
        self.columns.push(Column { name: name.into(), samples });
        self
    }

    /// The same with a role.
    #[must_use]
    pub fn with_role(mut self, role: Role) -> Self {
        self.role = Some(role);
        self
    }

    /// Samples of the named column; `time_s` names the time. A column may be called as its file calls it,
    /// such as `torque_Nm` for `torque_N_m`.
    ///
    /// # Errors
    /// [`Problem::MissingColumn`], listing the columns there are.
    pub fn column(&self, name: &str) -> Result<&[f64], RecordingError> {
        if name == TIME_COLUMN {
            return Ok(&self.time_s);
        }
        let called = |name: &str| self.columns.iter().find(|column| column.name == name);
        let column = called(name).or_else(|| called(&Heading::parse(name, 1, None).name()?));
        match column {
            Some(column) => Ok(&column.samples),
            None => {
                Err(self
                    .error(Problem::MissingColumn { column: name.to_owned(), present: self.column_names() }))
            }
        }
    }

    /// All names in file order, `time_s` first.
    pub fn column_names(&self) -> Vec<String> {
        let mut names = vec![TIME_COLUMN.to_owned()];
        names.extend(self.columns.iter().map(|column| column.name.clone()));
        names
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Last stamp minus first stamp, in seconds; 0 when there are fewer than two.
    pub fn duration_s(&self) -> f64 {
        match (self.time_s.first(), self.time_s.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Median distance of neighbouring stamps, in seconds; 0 when there are fewer than two.
    pub fn median_interval_s(&self) -> f64 {
        let mut intervals = self.intervals_s();
        if intervals.is_empty() {
            return 0.0;
        }
        let middle = intervals.len() / 2;
        *intervals.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// Mean distance of neighbouring stamps, in seconds; 0 when there are fewer than two.
    ///
    /// Unlike the median it is not biased by stamps that were rounded when they were written.
    pub fn mean_interval_s(&self) -> f64 {
        match self.time_s.len() {
            0 | 1 => 0.0,
            len => self.duration_s() / (len - 1) as f64,
        }
    }

    /// Whether every interval is within `tolerance` (a fraction) of the mean one.
    pub fn is_uniform(&self, tolerance: f64) -> bool {
        let mean = self.mean_interval_s();
        let mut intervals = self.intervals_s().into_iter();
        intervals.all(|interval| (interval - mean).abs() <= tolerance * mean)
    }

    /// Distances of neighbouring stamps, in seconds.
    pub fn intervals_s(&self) -> Vec<f64> {
        let pairs = self.time_s.iter().zip(self.time_s.iter().skip(1));
        pairs.map(|(earlier, later)| later - earlier).collect()
    }

    /// An error about this recording.
    pub fn error(&self, problem: Problem) -> RecordingError {
        RecordingError::new(self.name.clone(), problem)
    }

    /// Whether a reader would accept the recording. Reading and writing both call it, so that nothing is
    /// written which could not be read again.
    ///
    /// # Errors
    /// The first [`Problem`] found; rows are counted as in the file this recording would be written to.
    pub fn check(&self) -> Result<(), RecordingError> {
        check_names(&self.column_names()).map_err(|problem| self.error(problem))?;
        if self.len() < MIN_SAMPLES {
            return Err(self.error(Problem::TooFewSamples { found: self.len(), required: MIN_SAMPLES }));
        }
        let mut previous_s = f64::NEG_INFINITY;
        for (row, &time_s) in (2..).zip(&self.time_s) {
            if !time_s.is_finite() {
                return Err(self.error(Problem::NotFinite {
                    row,
                    column: TIME_COLUMN.to_owned(),
                    text: time_s.to_string(),
                }));
            }
            if time_s <= previous_s {
                return Err(self.error(Problem::TimeNotIncreasing { row, previous_s, time_s }));
            }
            previous_s = time_s;
        }
        self.columns.iter().try_for_each(|column| self.check_column(column))
    }

    fn check_column(&self, column: &Column) -> Result<(), RecordingError> {
        if column.samples.len() != self.len() {
            return Err(self.error(Problem::ColumnLength {
                column: column.name.clone(),
                expected: self.len(),
                found: column.samples.len(),
            }));
        }
        match (2..).zip(&column.samples).find(|(_, sample)| sample.is_infinite()) {
            Some((row, sample)) => Err(self.error(Problem::NotFinite {
                row,
                column: column.name.clone(),
                text: sample.to_string(),
            })),
            None => Ok(()),
        }
    }
}

/// Checks a header: `time_s` first, at least one more, units, no name twice.
pub(crate) fn check_names(names: &[String]) -> Result<(), Problem> {
    match names.first() {
        None => return Err(Problem::Empty),
        Some(first) if first != TIME_COLUMN => {
            let all_numbers = names.iter().all(|name| name.is_empty() || name.parse::<f64>().is_ok());
            return Err(if all_numbers {
                Problem::NoHeader
            } else {
                Problem::FirstColumnNotTime { found: shorten(first) }
            });
        }
        Some(_) => {}
    }
    if names.len() < 2 {
        return Err(Problem::NoDataColumn);
    }
    let mut seen = std::collections::HashMap::new();
    for (position, name) in (1..).zip(names) {
        if let Some(first) = seen.insert(name.as_str(), position) {
            return Err(Problem::DuplicateColumn { column: shorten(name), first, second: position });
        }
        // A comma or line break inside a name would survive quoting, but no other tool could ask for it.
        let plain = !name.contains([',', '"', '\n', '\r']) && name.trim() == name;
        if !plain || unit_of(name).is_none() {
            return Err(Problem::ColumnWithoutUnit { column: shorten(name), position });
        }
    }
    Ok(())
}

/// A cell as it may appear in a message: one line, at most 40 characters.
pub(crate) fn shorten(text: &str) -> String {
    let mut short: String =
        text.chars().map(|character| if character.is_control() { ' ' } else { character }).take(40).collect();
    if text.chars().count() > 40 {
        short.push_str("...");
    }
    short
}
