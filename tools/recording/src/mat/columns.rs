//! Which variable is the time, and which are columns.

use super::error::MatProblem;
use super::variable::{Value, Variable};
use crate::channels::{Channel, select};
use crate::column_name::{TIME_COLUMN, unit_of};
use crate::csv_reader::Parsed;
use crate::error::Problem;
use crate::heading::Heading;
use crate::options::{ColumnChoice, ReadOptions, TimeBase};
use crate::table::{interval_of, name_all};
use crate::unit_label::seconds;

/// Scalars that stand for the time, by convention.
const INTERVAL: &str = "interval_s";
const RATE: &str = "rate_hz";

/// Time and columns, by the options or else the conventions.
pub(super) fn parsed(variables: &[Variable], options: &ReadOptions) -> Result<Parsed, Problem> {
    let time = time(variables, options.time.as_ref())?;
    let count = match &time {
        Time::Stamps(_, stamps) => stamps.len(),
        Time::Interval { .. } => count(variables, &options.columns),
    };
    let mut remarks = Vec::new();
    let mut channels = Vec::new();
    for variable in variables.iter().filter(|variable| variable.name != time.name()) {
        let found = as_channels(variable, count);
        if found.is_empty() {
            remarks.push(format!("left out, no signal of {count} values: {}", named(variable)));
        }
        channels.extend(found);
    }
    if options.columns.is_empty() {
        name_all(&mut channels, &mut remarks);
    }
    let (columns, more) = select(channels, &options.columns)?;
    remarks.extend(more);
    let time_s = match time {
        Time::Stamps(_, stamps) => stamps,
        Time::Interval { interval_s, .. } => (0..count).map(|k| k as f64 * interval_s).collect(),
    };
    Ok((time_s, columns, remarks))
}

enum Time {
    Stamps(String, Vec<f64>),
    Interval { name: String, interval_s: f64 },
}

impl Time {
    fn name(&self) -> &str {
        match self {
            Self::Stamps(name, _) | Self::Interval { name, .. } => name,
        }
    }
}

fn named(variable: &Variable) -> String {
    format!("`{}` ({})", variable.name, variable.description())
}

/// The last part of a name: `run1.time_s` counts as `time_s`.
fn last(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

fn time(variables: &[Variable], asked: Option<&TimeBase>) -> Result<Time, MatProblem> {
    let present = || variables.iter().map(named).collect::<Vec<_>>();
    let bad = |variable: &Variable, wanted| MatProblem::BadTime {
        variable: variable.name.clone(),
        found: variable.description(),
        wanted,
        present: present(),
    };
    let (asked, scale) = match asked {
        Some(TimeBase::IntervalS(interval_s)) => {
            return Ok(Time::Interval { name: String::new(), interval_s: *interval_s });
        }
        Some(TimeBase::Source { source, scale }) => (Some(source.as_str()), scale.unwrap_or(1.0)),
        None => (None, 1.0),
    };
    let find = |wanted: &str| variables.iter().find(|variable| last(&variable.name) == wanted);
    let stamps = match asked {
        Some(source) => match variables.iter().find(|variable| variable.name == source) {
            Some(variable) => Some(variable),
            None => return Err(MatProblem::NoTime { present: present() }),
        },
        None => find(TIME_COLUMN).or_else(|| variables.iter().find(|variable| is_time(variable))),
    };
    let scale = match (asked, stamps) {
        (None, Some(variable)) => {
            let unit = Heading::parse(last(&variable.name), 1, None).unit;
            unit.as_deref().and_then(seconds).unwrap_or(scale)
        }
        _ => scale,
    };
    if let Some(variable) = stamps {
        return match &variable.value {
            Value::Matrix { rows, columns, numbers } if *rows.min(columns) == 1 && numbers.len() > 1 => {
                let stamps = numbers.iter().map(|stamp| stamp * scale).collect();
                Ok(Time::Stamps(variable.name.clone(), stamps))
            }
            _ => Err(bad(variable, "a vector of stamps in seconds")),
        };
    }
    for (wanted, inverse) in [(INTERVAL, false), (RATE, true)] {
        if let Some(variable) = find(wanted) {
            return match &variable.value {
                Value::Matrix { numbers, .. } if matches!(numbers.as_slice(), [one] if *one > 0.0) => {
                    let number = numbers.iter().sum::<f64>();
                    let interval_s = if inverse { 1.0 / number } else { number };
                    Ok(Time::Interval { name: variable.name.clone(), interval_s })
                }
                _ => Err(bad(variable, "one number above zero")),
            };
        }
    }
    // Other people's names of a rate or an interval.
    let stated = variables.iter().find_map(|variable| match &variable.value {
        Value::Matrix { numbers, .. } => match numbers.as_slice() {
            [number] => Some((variable, interval_of(last(&variable.name), *number)?)),
            _ => None,
        },
        _ => None,
    });
    match stated {
        Some((variable, interval_s)) => Ok(Time::Interval { name: variable.name.clone(), interval_s }),
        None => Err(MatProblem::NoTime { present: present() }),
    }
}

/// Whether a variable is a vector that is called as times are.
fn is_time(variable: &Variable) -> bool {
    let is_vector = matches!(&variable.value, Value::Matrix { rows, columns, numbers }
        if *rows.min(columns) == 1 && numbers.len() > 1);
    is_vector && Heading::parse(last(&variable.name), 1, None).is_time(0)
}

/// Samples per signal where no time vector says so: the longer side of the first variable that is taken.
fn count(variables: &[Variable], choices: &[ColumnChoice]) -> usize {
    let is_taken = |variable: &&Variable| match choices.first() {
        None => unit_of(last(&variable.name)).is_some(),
        Some(choice) => {
            let source = choice.source.split(':').next().unwrap_or_default();
            variable.name == source || variable.name == choice.source
        }
    };
    let side = |variable: &Variable| match &variable.value {
        Value::Matrix { rows, columns, .. } if rows * columns > 1 => Some(*rows.max(columns)),
        _ => None,
    };
    let taken = variables.iter().filter(is_taken).filter_map(side).next();
    // Where no variable states a unit the longest ones are the signals.
    taken.or_else(|| variables.iter().filter_map(side).max()).unwrap_or(0)
}

/// One channel per signal of a variable that has `count` samples along one side.
fn as_channels(variable: &Variable, count: usize) -> Vec<Channel> {
    let Value::Matrix { rows, columns, numbers } = &variable.value else { return Vec::new() };
    // Columns are signals, as MATLAB's own functions have it, unless only the rows are long enough.
    let (signals, along, across) = match (*rows == count, *columns == count) {
        _ if count == 0 => return Vec::new(),
        (true, _) => (*columns, 1, *rows),
        (false, true) => (*rows, *rows, 1),
        (false, false) => return Vec::new(),
    };
    let column_name = |signal: usize| {
        let name = last(&variable.name);
        let unit = unit_of(name)?;
        let quantity = name.strip_suffix(unit)?;
        Some(if signals == 1 { name.to_owned() } else { format!("{quantity}{}_{unit}", signal + 1) })
    };
    (0..signals)
        .map(|signal| Channel {
            source: match signals {
                1 => variable.name.clone(),
                _ => format!("{}:{}", variable.name, signal + 1),
            },
            name: column_name(signal),
            description: variable.description(),
            samples: numbers
                .iter()
                .skip(signal * across)
                .step_by(along.max(1))
                .take(count)
                .copied()
                .collect(),
        })
        .collect()
}
