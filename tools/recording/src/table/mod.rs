//! Tables of numbers as text, in whatever dialect people and programs write them.
//!
//! The bytes become text (`encoding`), the dialect is told from the first lines (`dialect`), the header says
//! what the columns are (`heading`), the rows are read (`rows`), and a recording is made of them
//! (`assemble`).

mod assemble;
mod beside;
mod cells;
mod clock;
mod counters;
mod dialect;
mod encoding;
mod labels;
mod lines;
mod long;
mod one_signal;
mod preamble;
mod rows;
mod serial_log;
mod sideways;
mod spectrum;
mod split_seconds;
mod stamps;
mod thousands;
mod turns;
mod wrapped;

pub use cells::Separator;

pub(crate) use crate::heading::Heading;
pub(crate) use assemble::{Table, assemble, name_all};
pub(crate) use clock::seconds_after;
pub(crate) use encoding::{decode, is_text};
pub(crate) use lines::{Line, Lines};
pub(crate) use preamble::interval_of;

use std::borrow::Cow;

use crate::content::Content;
use crate::error::Problem;
use crate::options::ReadOptions;
use crate::recording::{MIN_SAMPLES, TIME_COLUMN};
use cells::{Value, split, value, with_unit};
use dialect::{Dialect, Given};
use rows::{Kind, Rules};

/// Reads a table in any dialect.
pub(crate) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, Problem> {
    assemble(read(bytes, options)?.0, options)
}

/// Reads a table and gives the text after it.
pub(crate) fn read(bytes: &[u8], options: &ReadOptions) -> Result<(Table, Vec<String>), Problem> {
    let (text, encoding) = decode(bytes);
    if text.trim().is_empty() {
        return Err(Problem::Empty);
    }
    let mut given = Given { separator: options.separator, decimal_comma: options.decimal_comma };
    let plain = options.skip_lines.is_none() && given == Given::default();
    let plain_text = if plain { thousands::ungrouped(&text) } else { None };
    let grouped = plain_text.is_some();
    let text = plain_text.map_or(text, Cow::Owned);
    let (text, laid_out) = if plain { laid_out(text) } else { (text, None) };
    if let Some(Layout::Labels(separator) | Layout::Sideways(separator)) = laid_out {
        given.separator = Some(separator);
    }
    // The names of a log stand in a line before it.
    let before = u32::from(matches!(laid_out, Some(Layout::Labels(_))));
    let lines = Lines::new(&text).after_own(before).skip_lines(options.skip_lines.unwrap_or(0));
    let dialect =
        match contract(&lines).filter(|_| given.separator.is_none() && given.decimal_comma.is_none()) {
            Some(dialect) => dialect,
            None => dialect::detect(&lines, given).ok_or_else(|| no_table(&lines, &given))?,
        };
    let (mut table, trailer) = read_as(&text, lines, &dialect)?;
    table.remarks.splice(0..0, laid_out.map(Layout::remark));
    if grouped {
        table.remarks.insert(0, "commas before three digits group thousands".to_owned());
    }
    let said = describe(&dialect, encoding);
    if !said.is_empty() {
        table.remarks.insert(0, said);
    }
    Ok((table, trailer))
}

/// How a text was laid out that is no table by itself.
#[derive(Debug, Clone, Copy)]
enum Layout {
    Beside,
    Labels(Separator),
    Stamps,
    Sideways(Separator),
    OneSignal,
    Wrapped,
}

impl Layout {
    fn remark(self) -> String {
        match self {
            Self::Beside => "what stands beside the first rows was left out",
            Self::Labels(_) => "every line names its values: read as a table of them",
            Self::Stamps => "what a terminal or a logger put before every line is the time, by its clock",
            Self::Sideways(_) => "every row is a channel: read as columns",
            Self::OneSignal => "the lines hold one signal, several values each, by the count in its head",
            Self::Wrapped => "the brackets around every row were left out",
        }
        .to_owned()
    }
}

/// The text as a table, where it is one that is laid out in another way.
fn laid_out(text: Cow<'_, str>) -> (Cow<'_, str>, Option<Layout>) {
    if let Some((table, separator)) = serial_log::as_table(&text) {
        return (Cow::Owned(table), Some(Layout::Labels(separator)));
    }
    if let Some(table) = serial_log::stamps_as_cells(&text) {
        return (Cow::Owned(table), Some(Layout::Stamps));
    }
    if let Some(table) = one_signal::as_table(&text) {
        return (Cow::Owned(table), Some(Layout::OneSignal));
    }
    if let Some((table, separator)) = sideways::as_columns(&text) {
        return (Cow::Owned(table), Some(Layout::Sideways(separator)));
    }
    if let Some(rows) = wrapped::without_brackets(&text) {
        return (Cow::Owned(rows), Some(Layout::Wrapped));
    }
    match beside::without(&text) {
        Some(rows) => (Cow::Owned(rows), Some(Layout::Beside)),
        None => (text, None),
    }
}

/// Reads the rows of a dialect that is known.
fn read_as(text: &str, lines: Lines<'_>, dialect: &Dialect) -> Result<(Table, Vec<String>), Problem> {
    let mut rest = lines.clone();
    let mut at_row = lines.clone();
    let mut preamble = Vec::new();
    while let Some(line) = rest.next() {
        if line.number >= dialect.first_row {
            break;
        }
        preamble.push(line.text);
        at_row = rest.clone();
    }
    let units = units_of_cells(&at_row, dialect);
    let headings = headings(dialect, &units);
    let names: Vec<String> = headings.iter().map(|heading| heading.source.clone()).collect();
    let kinds = kinds(&at_row, dialect);
    let rules = Rules {
        separator: dialect.separator,
        decimal_comma: dialect.decimal_comma,
        names: &names,
        kinds: &kinds,
        units: &units,
        strict: false,
        ragged: false,
    };
    let found = rows::read(at_row, &rules, text.ends_with(['\n', '\r']))?;
    let trailer = found.trailer.iter().map(|line| line.text.to_owned()).collect();
    let table = Table {
        clocks: kinds.iter().map(|kind| *kind == Kind::Clock).collect(),
        has_header: dialect.header.is_some(),
        interval_s: preamble::interval_s(&preamble, dialect),
        headings,
        columns: found.columns,
        labels: found.labels,
        lines: found.lines,
        from_zero: false,
        remarks: found.remarks,
    };
    Ok((table, trailer))
}

/// What was read of a table whose dialect and names are known.
pub(crate) struct ReadRows {
    pub(crate) columns: Vec<Vec<f64>>,
    pub(crate) lines: Vec<u32>,
    pub(crate) remarks: Vec<String>,
}

/// Reads the rows of a table whose dialect and names are known; nothing of the columns in `left_out`.
pub(crate) fn read_rows(
    lines: Lines<'_>,
    separator: Separator,
    decimal_comma: bool,
    names: &[String],
    left_out: &[usize],
) -> Result<ReadRows, Problem> {
    let kind = |at| if left_out.contains(&at) { Kind::Text } else { Kind::Number };
    let kinds: Vec<Kind> = (0..names.len()).map(kind).collect();
    let rules =
        Rules { separator, decimal_comma, names, kinds: &kinds, units: &[], strict: false, ragged: true };
    let ends_in_line_end = lines.rest().ends_with(['\n', '\r']);
    let rows::Rows { columns, lines, remarks, .. } = rows::read(lines, &rules, ends_in_line_end)?;
    Ok(ReadRows { columns, lines, remarks })
}

/// Reads what stillbeam itself writes, and nothing else: a header of names, commas, points, empty cells.
pub(crate) fn parse_contract(text: &str) -> Result<(Vec<f64>, Vec<crate::recording::Column>), Problem> {
    let mut lines = Lines::new(text);
    let Some(header) = lines.next() else { return Err(Problem::Empty) };
    let mut cells = Vec::new();
    split(header.text, Separator::Byte(b','), &mut cells);
    let names: Vec<String> = cells.iter().map(|cell| (*cell).to_owned()).collect();
    crate::recording::check_names(&names)?;
    let kinds = vec![Kind::Number; names.len()];
    let rules = Rules {
        separator: Separator::Byte(b','),
        decimal_comma: false,
        names: &names,
        kinds: &kinds,
        units: &[],
        strict: true,
        ragged: false,
    };
    let found = rows::read(lines, &rules, true)?;
    let mut columns = found.columns.into_iter();
    let time_s = columns.next().unwrap_or_default();
    let mut previous_s = f64::NEG_INFINITY;
    for (line, stamp) in found.lines.iter().zip(&time_s) {
        let row = u64::from(*line);
        if !stamp.is_finite() {
            return Err(Problem::MissingTime { row });
        }
        if *stamp <= previous_s {
            return Err(Problem::TimeNotIncreasing { row, previous_s, time_s: *stamp });
        }
        previous_s = *stamp;
    }
    if time_s.len() < MIN_SAMPLES {
        return Err(Problem::TooFewSamples { found: time_s.len(), required: MIN_SAMPLES });
    }
    let columns = names.into_iter().skip(1).zip(columns);
    Ok((time_s, columns.map(|(name, samples)| crate::recording::Column { name, samples }).collect()))
}

/// The dialect of stillbeam's own files, which is not for guessing: their errors name rows that a guess would
/// step over.
fn contract(lines: &Lines<'_>) -> Option<Dialect> {
    let first = lines.clone().next()?;
    let mut cells = Vec::new();
    split(first.text, Separator::Byte(b','), &mut cells);
    if cells.first() != Some(&TIME_COLUMN) {
        return None;
    }
    let mut row = Vec::new();
    // Between commas a decimal comma stands in quotes.
    let decimal_comma = lines.clone().skip(1).take(5).any(|line| {
        split(line.text, Separator::Byte(b','), &mut row);
        row.iter().any(|cell| cell.contains(',') && matches!(value(cell, true), Value::Number(_)))
    });
    Some(Dialect {
        separator: Separator::Byte(b','),
        decimal_comma,
        width: cells.len(),
        first_row: first.number + 1,
        header: Some((first.number, cells.iter().map(|cell| (*cell).to_owned()).collect())),
        units: None,
    })
}

fn headings(dialect: &Dialect, of_cells: &[Option<String>]) -> Vec<Heading> {
    let cell = |row: &Option<(u32, Vec<String>)>, at: usize| {
        row.as_ref().and_then(|(_, cells)| cells.get(at)).cloned()
    };
    let mut headings: Vec<Heading> = (0..dialect.width)
        .map(|at| {
            let name = cell(&dialect.header, at).unwrap_or_default();
            let unit = cell(&dialect.units, at).or_else(|| of_cells.get(at).cloned().flatten());
            Heading::parse(&name, at + 1, unit.as_deref())
        })
        .collect();
    crate::heading::without_letters(&mut headings);
    headings
}

/// The units in the cells of the first row, by column.
fn units_of_cells(lines: &Lines<'_>, dialect: &Dialect) -> Vec<Option<String>> {
    let mut cells = Vec::new();
    if let Some(line) = lines.clone().next() {
        split(line.text, dialect.separator, &mut cells);
    }
    let unit = |cell: &&str| Some(with_unit(cell, dialect.decimal_comma)?.1.to_owned());
    cells.iter().map(unit).collect()
}

/// What the columns hold, by their first cells that hold anything.
fn kinds(lines: &Lines<'_>, dialect: &Dialect) -> Vec<Kind> {
    let mut kinds = vec![None; dialect.width];
    let mut cells = Vec::new();
    for line in lines.clone().take(50) {
        split(line.text, dialect.separator, &mut cells);
        if cells.len() < dialect.width || cells.len() > dialect.width + 1 {
            continue;
        }
        for (kind, cell) in kinds.iter_mut().zip(&cells) {
            let found = match value(cell, dialect.decimal_comma) {
                Value::Number(_) | Value::Overflow => Some(Kind::Number),
                Value::Text if clock::parse(cell).is_some() => Some(Kind::Clock),
                Value::Text if with_unit(cell, dialect.decimal_comma).is_some() => Some(Kind::Number),
                Value::Text => Some(Kind::Text),
                Value::Missing => None,
            };
            // A number settles it: one bad cell does not make a column of text.
            if kind.is_none() || found == Some(Kind::Number) && *kind == Some(Kind::Text) {
                *kind = found;
            }
        }
    }
    // In stillbeam's own files there is nothing but numbers.
    let own = dialect
        .header
        .as_ref()
        .is_some_and(|(_, cells)| cells.first().is_some_and(|cell| cell == TIME_COLUMN));
    kinds.into_iter().map(|kind| if own { Kind::Number } else { kind.unwrap_or(Kind::Number) }).collect()
}

/// What was made of the file, where it is not as stillbeam would write it.
fn describe(dialect: &Dialect, encoding: Option<&str>) -> String {
    let mut parts: Vec<String> = encoding.map(|name| format!("text in {name}")).into_iter().collect();
    if dialect.separator != Separator::Byte(b',') && dialect.width > 1 {
        parts.push(format!("cells separated by {}", dialect.separator));
    }
    if dialect.decimal_comma {
        parts.push("decimal comma".to_owned());
    }
    match &dialect.header {
        Some((number, _)) if *number > 1 => parts.push(format!("names in row {number}")),
        None => parts.push("no row of names".to_owned()),
        Some(_) => {}
    }
    if let Some((number, _)) = &dialect.units {
        parts.push(format!("units in row {number}"));
    }
    let shown = !parts.is_empty();
    if shown && dialect.first_row > 2 {
        parts.push(format!("first values in row {}", dialect.first_row));
    }
    if shown { format!("read as a table: {}", parts.join(", ")) } else { String::new() }
}

fn no_table(lines: &Lines<'_>, given: &Given) -> Problem {
    let first = lines.clone().next().map_or("", |line| line.text);
    if given.separator.is_none() && is_header_alone(first) {
        return Problem::TooFewSamples { found: 0, required: MIN_SAMPLES };
    }
    Problem::NoTable { first: crate::recording::shorten(first) }
}

fn is_header_alone(text: &str) -> bool {
    text.starts_with("#time,") || text.starts_with("freq,")
}
