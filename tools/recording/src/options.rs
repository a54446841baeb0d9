//! What a file may leave open and its reader has to be told.

use std::str::FromStr;

use crate::format::Format;
use crate::recording::{TIME_COLUMN, unit_of};

/// How to read a file whose content does not say it all.
///
/// The default takes what a file states and refuses what it leaves open.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReadOptions {
    /// The format; `None` goes by the content.
    pub format: Option<Format>,
    /// Where the time comes from, in files that do not say.
    pub time: Option<TimeBase>,
    /// The columns to take and what to call them; none takes all whose name or label states a unit.
    pub columns: Vec<ColumnChoice>,
}

/// Where the time stamps come from.
#[derive(Debug, Clone, PartialEq)]
pub enum TimeBase {
    /// A column or variable that holds the time in seconds.
    Source(String),
    /// A constant interval, s; the first sample is at 0.
    IntervalS(f64),
}

/// One column to take: `NAME_UNIT=SOURCE` or `NAME_UNIT=SOURCE*SCALE`.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnChoice {
    /// What the column is called in the recording, ending in its unit.
    pub name: String,
    /// What the file calls it: a header, a variable (`data.y`, `Y:2` for the second column), a channel.
    pub source: String,
    /// The recording's values are the file's times this.
    pub scale: f64,
}

impl FromStr for ColumnChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const SHAPE: &str =
            "write NAME_UNIT=SOURCE or NAME_UNIT=SOURCE*SCALE, such as tip_deflection_m=y*0.001";
        let (name, source) = text.split_once('=').ok_or_else(|| format!("`{text}` has no `=`; {SHAPE}"))?;
        let (name, source) = (name.trim(), source.trim());
        let (source, scale) = match source.rsplit_once('*') {
            None => (source, 1.0),
            Some((source, factor)) => match factor.trim().parse::<f64>() {
                Ok(scale) if scale.is_finite() && scale != 0.0 => (source.trim(), scale),
                _ => return Err(format!("`{factor}` is no scale; {SHAPE}")),
            },
        };
        if unit_of(name).is_none() || name == TIME_COLUMN || name.contains([',', '"']) {
            return Err(format!("`{name}` does not end in a unit, or names the time; {SHAPE}"));
        }
        if source.is_empty() {
            return Err(format!("`{text}` names no source; {SHAPE}"));
        }
        Ok(Self { name: name.to_owned(), source: source.to_owned(), scale })
    }
}
