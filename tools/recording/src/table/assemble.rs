//! From the columns of a table to a recording: which is the time, what the others are called.

use super::labels::Labels;
use super::stamps::{self, TimeColumn};
use super::{counters, long, spectrum, split_seconds, turns};
use crate::channels::{Channel, select};
use crate::column_name::unit_of;
use crate::content::{Content, Signals};
use crate::error::Problem;
use crate::heading::Heading;
use crate::options::{ColumnChoice, ReadOptions, TimeBase};
use crate::recording::{Column, MIN_SAMPLES, TIME_COLUMN, shorten};
use crate::unit_label::{known, seconds};

/// The unit of columns that state none.
const NO_UNIT: &str = "raw";

/// A table as a file has it.
#[derive(Debug, Default)]
pub(crate) struct Table {
    pub(crate) headings: Vec<Heading>,
    /// Values by column; empty for a column that holds no numbers.
    pub(crate) columns: Vec<Vec<f64>>,
    /// Which columns hold dates or times of day, as seconds after their first.
    pub(crate) clocks: Vec<bool>,
    /// Words of the columns of text.
    pub(crate) labels: Vec<Labels>,
    /// The line of every row, where the table came from lines.
    pub(crate) lines: Vec<u32>,
    /// Whether the names are those of a header.
    pub(crate) has_header: bool,
    /// Interval that the file states beside the table, s.
    pub(crate) interval_s: Option<f64>,
    /// Whether the time starts at 0 whatever the stamps say.
    pub(crate) from_zero: bool,
    pub(crate) remarks: Vec<String>,
}

/// Where the time comes from.
enum Time {
    Columns(TimeColumn),
    Interval(f64),
}

impl Table {
    fn at(&self, source: &str) -> Option<usize> {
        let exact = self.headings.iter().position(|heading| heading.source == source);
        exact.or_else(|| self.headings.iter().position(|heading| heading.is_called(source)))
    }

    fn missing(&self, source: &str) -> Problem {
        let present = self.headings.iter().map(|heading| format!("`{}`", shorten(&heading.source))).collect();
        Problem::MissingSource { source_name: shorten(source), present }
    }

    fn len(&self) -> usize {
        self.columns.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// Whether a column is the time by its name. What stands alone was measured, whatever it is called.
    fn is_time(&self, at: usize) -> bool {
        let holds = |column: &&Vec<f64>| column.iter().any(|value| value.is_finite());
        self.headings.get(at).is_some_and(|heading| heading.is_time(at))
            && self.columns.get(at).is_some_and(|column| holds(&column))
            && self.columns.iter().filter(holds).count() > 1
    }

    pub(super) fn is_empty_column(&self, at: usize) -> bool {
        self.columns.get(at).is_none_or(Vec::is_empty)
    }
}

/// Makes a recording, or spectra, of a table.
pub(crate) fn assemble(mut table: Table, options: &ReadOptions) -> Result<Content, Problem> {
    if options.time.is_none() && table.headings.first().is_some_and(Heading::is_frequency) {
        return spectrum::spectra(table);
    }
    let count = table.len();
    if count < MIN_SAMPLES {
        return Err(Problem::TooFewSamples { found: count, required: MIN_SAMPLES });
    }
    for choice in &options.columns {
        if table.at(&choice.source).is_none() {
            return Err(table.missing(&choice.source));
        }
    }
    let mut found = time(&table, options)?;
    if let Time::Columns(column) = &found
        && long::widen(&mut table, column.at)
    {
        found = time(&table, options)?;
    }
    if let Time::Columns(column) = &found {
        counters::drop_repeated_rows(&mut table, column.at);
    }
    let mut remarks = std::mem::take(&mut table.remarks);
    let mut taken = Vec::new();
    let count = table.len();
    let time_s = match found {
        Time::Columns(column) => {
            taken = column.used();
            stamps::seconds(&table, &column, &mut remarks)?
        }
        Time::Interval(interval_s) => (0..count).map(|k| k as f64 * interval_s).collect(),
    };
    let mut columns = columns(table, &taken, &options.columns, &mut remarks)?;
    turns::go_on(&mut columns, &mut remarks);
    Ok(Content { signals: Signals::OverTime(time_s, columns), remarks })
}

fn time(table: &Table, options: &ReadOptions) -> Result<Time, Problem> {
    match &options.time {
        Some(TimeBase::IntervalS(interval_s)) => return Ok(Time::Interval(*interval_s)),
        Some(TimeBase::Source { source, scale }) => {
            let at = table
                .at(source)
                .filter(|at| !table.is_empty_column(*at))
                .ok_or_else(|| table.missing(source))?;
            return Ok(Time::Columns(TimeColumn {
                at,
                scale: *scale,
                after: stamps::time_of_day_after(table, at),
                fraction: None,
            }));
        }
        None => {}
    }
    // Without a header a unit behind every number says so, too.
    let states = |at: &usize| {
        let unit = table.headings.get(*at).and_then(|heading| heading.unit.as_deref());
        table.has_header || unit.is_some_and(|unit| seconds(unit).is_some())
    };
    let named = |at: &usize| !table.is_empty_column(*at) && table.is_time(*at) && states(at);
    let all = 0..table.headings.len();
    let exact =
        all.clone().find(|at| table.headings.get(*at).is_some_and(|heading| heading.source == TIME_COLUMN));
    let clock = |at: &usize| table.clocks.get(*at) == Some(&true);
    let pair = split_seconds::find(table);
    let found = exact
        .or_else(|| all.clone().find(named))
        .or_else(|| all.clone().find(clock))
        .or(pair.map(|pair| pair.whole));
    if let Some(at) = found {
        return Ok(Time::Columns(TimeColumn {
            at,
            scale: None,
            after: stamps::time_of_day_after(table, at),
            fraction: pair.filter(|pair| pair.whole == at || pair.fraction == at),
        }));
    }
    if let Some(interval_s) = table.interval_s {
        return Ok(Time::Interval(interval_s));
    }
    let increases = |column: &Vec<f64>| column.windows(2).all(|pair| matches!(pair, [a, b] if b > a));
    let several = table.columns.iter().filter(|column| !column.is_empty()).count() > 1;
    match table.columns.first() {
        Some(first) if !table.has_header && several && increases(first) && !counts(first) => {
            Ok(Time::Columns(TimeColumn { at: 0, scale: None, after: None, fraction: None }))
        }
        _ => Err(Problem::NoTimeColumn {
            present: table.headings.iter().map(|heading| format!("`{}`", shorten(&heading.source))).collect(),
        }),
    }
}

/// Whether a column only counts its rows.
fn counts(column: &[f64]) -> bool {
    column.windows(2).all(|pair| matches!(pair, [a, b] if b - a == 1.0))
}

fn columns(
    table: Table,
    time: &[usize],
    choices: &[ColumnChoice],
    remarks: &mut Vec<String>,
) -> Result<Vec<Column>, Problem> {
    let choices: Vec<ColumnChoice> = choices
        .iter()
        .map(|choice| {
            let heading = table.at(&choice.source).and_then(|at| table.headings.get(at));
            let source = heading.map_or_else(|| choice.source.clone(), |heading| heading.source.clone());
            ColumnChoice { source, ..choice.clone() }
        })
        .collect();
    let pair = split_seconds::find(&table);
    let is_of_clock = |at: usize| pair.is_some_and(|pair| at == pair.whole || at == pair.fraction);
    let mut left_out = Vec::new();
    let mut channels = Vec::new();
    let times: Vec<bool> = (0..table.headings.len()).map(|at| table.is_time(at)).collect();
    for (at, (heading, samples)) in table.headings.into_iter().zip(table.columns).enumerate() {
        if time.contains(&at) {
            continue;
        }
        let asked = choices.iter().any(|choice| choice.source == heading.source);
        // Text, a second clock, a column of numbers that only counts.
        let nothing = samples.is_empty()
            || samples.iter().all(|sample| sample.is_nan()) && heading.unit.is_none()
            || table.clocks.get(at) == Some(&true)
            || is_of_clock(at)
            || (if table.has_header { heading.is_counter() } else { at == 0 }) && counts(&samples)
            || times.get(at) == Some(&true);
        if nothing && !asked {
            left_out.push(format!("`{}`", shorten(&heading.source)));
            continue;
        }
        channels.push(Channel {
            source: heading.source.clone(),
            name: heading.name(),
            description: format!("{} values", samples.len()),
            samples,
        });
    }
    if channels.is_empty() {
        return Err(Problem::NoDataColumn);
    }
    if choices.is_empty() {
        name_all(&mut channels, remarks);
        distinguish(&mut channels, remarks);
        if !left_out.is_empty() {
            remarks.push(format!("left out: {}", crate::error::some(&left_out)));
        }
    }
    let (columns, more) = select(channels, &choices)?;
    remarks.extend(more);
    Ok(columns)
}

/// Where no column surely states a unit all are taken, and those that state none are said to have none.
/// Behind the last `_` of a name anything may stand: of `seconds_elapsed,z,y,x` the first states no unit
/// either.
pub(crate) fn name_all(channels: &mut [Channel], remarks: &mut Vec<String>) {
    let surely = |name: &String| unit_of(name).is_some_and(|unit| known(unit).is_some());
    let open = channels.iter().filter(|channel| channel.name.is_none()).count();
    if open == 0 || channels.iter().filter_map(|channel| channel.name.as_ref()).any(surely) {
        return;
    }
    let mut names = Vec::new();
    for (position, channel) in (1..).zip(channels.iter_mut()).filter(|(_, channel)| channel.name.is_none()) {
        let heading = Heading::parse(&channel.source, position, None);
        let number = channel.source.parse::<usize>().is_ok();
        let quantity = if number { format!("column_{}", channel.source) } else { heading.quantity.clone() };
        let quantity = if heading.unit.is_some() { Heading::whole(&channel.source) } else { quantity };
        let name = format!("{quantity}_{NO_UNIT}");
        names.push(format!("`{name}`"));
        channel.name = Some(name);
    }
    remarks.push(format!(
        "no column states a unit that is known: called {}; frequencies and damping do not depend on it, --column NAME_UNIT=SOURCE states one",
        crate::error::some(&names)
    ));
}

/// Tells columns apart that the file calls alike, by their number.
fn distinguish(channels: &mut [Channel], remarks: &mut Vec<String>) {
    let mut seen = std::collections::HashSet::new();
    for channel in channels {
        let Some(name) = channel.name.clone() else { continue };
        if seen.insert(name.clone()) {
            continue;
        }
        let unit = unit_of(&name).unwrap_or(NO_UNIT).to_owned();
        let quantity = name.strip_suffix(&unit).unwrap_or(&name).trim_end_matches('_');
        let free =
            (2..).map(|number| format!("{quantity}_{number}_{unit}")).find(|free| !seen.contains(free));
        let Some(free) = free else { continue };
        remarks.push(format!("another column is called `{}`: it became `{free}`", shorten(&channel.source)));
        seen.insert(free.clone());
        channel.name = Some(free);
    }
}
