//! What a file may leave open and its reader has to be told.

use std::str::FromStr;

use crate::column_name::{TIME_COLUMN, unit_of};
use crate::format::Format;
use crate::table::Separator;

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
    /// Lines to leave out before a table of text.
    pub skip_lines: Option<u32>,
    /// What separates the cells of a table of text; `None` goes by the content.
    pub separator: Option<Separator>,
    /// Whether a table's decimal sign is the comma; `None` goes by the content.
    pub decimal_comma: Option<bool>,
}

/// Where the time stamps come from.
#[derive(Debug, Clone, PartialEq)]
pub enum TimeBase {
    /// A column or variable that holds the time.
    Source {
        /// What the file calls it.
        source: String,
        /// Seconds per unit of its numbers; `None` goes by the unit that the file states, else by seconds.
        scale: Option<f64>,
    },
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
        let (source, scale) = scaled(source)?;
        let scale = scale.unwrap_or(1.0);
        if unit_of(name).is_none() || name == TIME_COLUMN || name.contains([',', '"']) {
            return Err(format!("`{name}` does not end in a unit, or names the time; {SHAPE}"));
        }
        if source.is_empty() {
            return Err(format!("`{text}` names no source; {SHAPE}"));
        }
        Ok(Self { name: name.to_owned(), source: source.to_owned(), scale })
    }
}

/// `SOURCE` or `SOURCE*SCALE`; a star that no number follows belongs to the source.
fn scaled(text: &str) -> Result<(&str, Option<f64>), String> {
    let Some((source, factor)) = text.rsplit_once('*') else { return Ok((text, None)) };
    match factor.trim().parse::<f64>() {
        Ok(scale) if scale.is_finite() && scale != 0.0 => Ok((source.trim(), Some(scale))),
        Ok(_) => Err(format!("`{}` is no scale; give a finite number other than 0", factor.trim())),
        Err(_) => Ok((text, None)),
    }
}

impl FromStr for TimeBase {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (source, scale) = scaled(text.trim())?;
        if source.is_empty() || scale.is_some_and(|scale| scale < 0.0) {
            return Err(format!("`{text}` is no time; write SOURCE or SOURCE*SCALE, such as millis*0.001"));
        }
        Ok(Self::Source { source: source.to_owned(), scale })
    }
}
