//! The rows of a table.

use super::cells::{Separator, Value, split, value, with_unit};
use super::clock::{self, Instant, Reading};
use super::labels::Labels;
use super::lines::{Line, Lines, comment};
use crate::error::Problem;
use crate::recording::shorten;

/// Seconds of a day.
const DAY_S: f64 = 86_400.0;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Number,
    /// Dates or times of day: read as seconds after the first.
    Clock,
    /// Neither; nothing is read.
    Text,
}

/// How rows are read.
pub(super) struct Rules<'n> {
    pub(super) separator: Separator,
    pub(super) decimal_comma: bool,
    /// Names of the columns, for messages; one for every cell.
    pub(super) names: &'n [String],
    pub(super) kinds: &'n [Kind],
    /// The unit that stands in every cell of a column, behind the number.
    pub(super) units: &'n [Option<String>],
    /// Only what stillbeam writes itself: nothing but numbers and empty cells, to the end of the file.
    pub(super) strict: bool,
    /// Whether a row may lack cells at its end.
    pub(super) ragged: bool,
}

/// What was read.
#[derive(Debug, Default)]
pub(super) struct Rows<'t> {
    /// Values by column; nothing for a column of text.
    pub(super) columns: Vec<Vec<f64>>,
    /// The line of every row.
    pub(super) lines: Vec<u32>,
    /// Lines after the table, which are no rows of it.
    pub(super) trailer: Vec<Line<'t>>,
    pub(super) remarks: Vec<String>,
    /// Cells beyond the range and taken as missing, by column; and the line of the first.
    overflows: Vec<(usize, u32)>,
    /// Origin and last value of the columns of dates and times.
    clocks: Vec<Option<(Instant, f64)>>,
    /// The words of the columns of text.
    pub(super) labels: Vec<Labels>,
}

/// Reads rows to the end of the lines. `ends_in_line_end` says whether the last one is complete.
pub(super) fn read<'t>(
    mut lines: Lines<'t>,
    rules: &Rules<'_>,
    ends_in_line_end: bool,
) -> Result<Rows<'t>, Problem> {
    let width = rules.names.len();
    let mut rows = Rows {
        columns: vec![Vec::new(); width],
        overflows: vec![(0, 0); width],
        clocks: vec![None; width],
        labels: vec![Labels::default(); width],
        ..Rows::default()
    };
    let semicolons = rules.separator == Separator::Byte(b';');
    let mut cells: Vec<&'t str> = Vec::with_capacity(width + 1);
    let (mut comments, mut headers) = (0, 0);
    // The last rows, oldest first: what a cut one is compared with.
    let mut latest: [&'t str; 8] = [""; 8];
    while let Some(line) = lines.next() {
        split(line.text, rules.separator, &mut cells);
        match rows.push(&mut cells, line, rules) {
            Ok(()) => {
                latest.rotate_left(1);
                latest[7] = line.text;
            }
            Err(_) if !rules.strict && comment(line.text, semicolons).is_some() => comments += 1,
            Err(_) if !rules.strict && cells.iter().all(|cell| cell.is_empty()) => {}
            Err(_) if !rules.strict && is_header_again(&cells, rules) => headers += 1,
            Err(problem) => {
                if rules.strict || rows.lines.is_empty() || any_row(lines.clone(), rules) {
                    return Err(problem);
                }
                rows.trailer.push(line);
                rows.trailer.extend(lines.by_ref().take(20));
                break;
            }
        }
    }
    if comments > 0 {
        rows.remarks.push(format!("{comments} comment lines between the rows were left out"));
    }
    if headers > 0 {
        rows.remarks.push(format!(
            "the row of names stands {headers} times more between the rows, and was left out there"
        ));
    }
    if !rules.strict {
        rows.judge_end(&latest, rules, ends_in_line_end);
        rows.say_overflows(rules);
    }
    Ok(rows)
}

/// Whether a cell is a number with the unit that all of its column have: another one would be another scale.
fn has_unit(at: usize, cell: &str, rules: &Rules<'_>) -> bool {
    let own = rules.units.get(at).and_then(Option::as_deref);
    own.is_some() && with_unit(cell, rules.decimal_comma).map(|(_, unit)| unit) == own
}

/// Whether a row repeats the names, as loggers write them that start anew or append to a file.
fn is_header_again(cells: &[&str], rules: &Rules<'_>) -> bool {
    let names = rules.names.iter().map(String::as_str);
    cells.len() >= rules.names.len() && cells.iter().copied().take(rules.names.len()).eq(names)
}

/// Whether any of the lines is a row.
fn any_row(lines: Lines<'_>, rules: &Rules<'_>) -> bool {
    let mut cells = Vec::new();
    for line in lines {
        split(line.text, rules.separator, &mut cells);
        let read = |(at, cell): (usize, &&str)| {
            if has_unit(at, cell, rules) { Value::Number(0.0) } else { value(cell, rules.decimal_comma) }
        };
        let found: Vec<Value> = cells.iter().enumerate().map(read).collect();
        let numbers = found.iter().filter(|value| matches!(value, Value::Number(_))).count();
        // Empty cells do not make a row less of one.
        let only_numbers = numbers > 0 && !found.contains(&Value::Text);
        if cells.len() == rules.names.len() && (2 * numbers > cells.len() || only_numbers) {
            return true;
        }
    }
    false
}

impl Rows<'_> {
    /// Takes one row, or nothing of it.
    fn push(&mut self, cells: &mut Vec<&str>, line: Line<'_>, rules: &Rules<'_>) -> Result<(), Problem> {
        let (width, row) = (rules.names.len(), u64::from(line.number));
        if cells.len() == width + 1 && !rules.strict && cells.last().is_some_and(|cell| cell.is_empty()) {
            cells.pop();
        }
        if rules.ragged && (2..width).contains(&cells.len()) {
            cells.resize(width, "");
        }
        if cells.len() != width {
            return Err(Problem::RaggedRow { row, expected: width, found: cells.len() });
        }
        let taken = self.lines.len();
        for (at, cell) in cells.iter().enumerate() {
            let found = match rules.kinds.get(at) {
                Some(Kind::Number) => self.number(at, cell, row, rules),
                Some(Kind::Clock) => self.clock(at, cell, row, rules),
                _ => {
                    self.labels.get_mut(at).into_iter().for_each(|labels| labels.push(taken, cell));
                    continue;
                }
            };
            match found {
                Ok(number) => self.columns.get_mut(at).into_iter().for_each(|column| column.push(number)),
                Err(problem) => {
                    self.columns.iter_mut().for_each(|column| column.truncate(taken));
                    return Err(problem);
                }
            }
        }
        if !rules.strict && self.columns.iter().all(|column| column.get(taken).is_none_or(|x| x.is_nan())) {
            // Spreadsheets leave rows of nothing but separators.
            self.columns.iter_mut().for_each(|column| column.truncate(taken));
            return Ok(());
        }
        self.lines.push(line.number);
        Ok(())
    }

    fn number(&mut self, at: usize, cell: &str, row: u64, rules: &Rules<'_>) -> Result<f64, Problem> {
        let column = || rules.names.get(at).cloned().unwrap_or_default();
        match value(cell, rules.decimal_comma) {
            Value::Number(number) => Ok(number),
            Value::Text if has_unit(at, cell, rules) => {
                Ok(with_unit(cell, rules.decimal_comma).map_or(f64::NAN, |(number, _)| number))
            }
            Value::Missing if !rules.strict || cell.is_empty() => Ok(f64::NAN),
            Value::Overflow if !rules.strict => {
                if let Some((count, first)) = self.overflows.get_mut(at) {
                    *count += 1;
                    if *count == 1 {
                        *first = u32::try_from(row).unwrap_or(u32::MAX);
                    }
                }
                Ok(f64::NAN)
            }
            _ => Err(match cell.parse::<f64>() {
                Ok(number) if !number.is_finite() => {
                    Problem::NotFinite { row, column: column(), text: shorten(cell) }
                }
                _ => Problem::NotANumber { row, column: column(), text: shorten(cell) },
            }),
        }
    }

    fn clock(&mut self, at: usize, cell: &str, row: u64, rules: &Rules<'_>) -> Result<f64, Problem> {
        let Some(state) = self.clocks.get_mut(at) else { return Ok(f64::NAN) };
        let instant = match clock::parse(cell) {
            Some(Reading::DateTime(at) | Reading::TimeOfDay(at)) => at,
            Some(Reading::Date(days)) => Instant { whole_s: days.saturating_mul(86_400), fraction_s: 0.0 },
            None if cell.is_empty() => return Ok(f64::NAN),
            None => {
                let column = rules.names.get(at).cloned().unwrap_or_default();
                return Err(Problem::NotANumber { row, column, text: shorten(cell) });
            }
        };
        let (origin, last_s) = state.get_or_insert((instant, 0.0));
        let mut after_s = instant.since(*origin);
        // A time of day begins anew at midnight.
        while *last_s - after_s > DAY_S / 2.0 && *last_s - after_s < 400.0 * DAY_S {
            after_s += DAY_S;
        }
        *last_s = after_s;
        Ok(after_s)
    }

    /// Drops a last row that the end of the file cut within a number: it has fewer decimals than all before
    /// it.
    fn judge_end(&mut self, latest: &[&str; 8], rules: &Rules<'_>, ends_in_line_end: bool) {
        let [.., last_text] = latest;
        if let Some(first) = self.trailer.first() {
            let rest = self.trailer.len();
            self.remarks.push(match rest {
                1 if !ends_in_line_end
                    || first.text.len() < last_text.len() && starts_as_row(first.text, rules) =>
                {
                    format!("the last row, row {}, is cut and was left out", first.number)
                }
                1 => format!("row {} after the table was left out: `{}`", first.number, shorten(first.text)),
                _ => format!(
                    "the rows from row {} on, after the table, were left out: `{}`",
                    first.number,
                    shorten(first.text)
                ),
            });
            return;
        }
        if ends_in_line_end || self.lines.len() < 8 {
            return;
        }
        let sign = if rules.decimal_comma { ',' } else { '.' };
        let decimals = |text: &str| {
            let tail = text.trim_end().trim_end_matches('"');
            tail.bytes()
                .rev()
                .take_while(u8::is_ascii_digit)
                .count()
                .min(tail.rfind(sign).map_or(0, |at| tail.len() - at - 1))
        };
        // A last cell that is empty, or a word, is whole.
        let last = last_text.trim_end().trim_end_matches('"').chars().next_back();
        let separates = rules.separator == Separator::Byte(sign as u8);
        if !last.is_some_and(|c| c.is_ascii_digit() || c == sign && !separates) {
            return;
        }
        let found = decimals(last_text);
        let usual = decimals(latest[0]);
        if usual > found
            && latest[..7].iter().all(|text| decimals(text) == usual)
            && let Some(line) = self.lines.pop()
        {
            let left = self.lines.len();
            self.columns.iter_mut().for_each(|column| column.truncate(left));
            self.remarks.push(format!("the last row, row {line}, is cut and was left out"));
        }
    }

    fn say_overflows(&mut self, rules: &Rules<'_>) {
        for (name, (count, first)) in rules.names.iter().zip(&self.overflows) {
            if *count > 0 {
                self.remarks.push(format!(
                    "column `{}`: {count} values beyond the range, the first in row {first}, were taken as missing",
                    shorten(name)
                ));
            }
        }
    }
}

/// Whether a line begins with a number, as a row does that was cut.
fn starts_as_row(text: &str, rules: &Rules<'_>) -> bool {
    let mut cells = Vec::new();
    split(text, rules.separator, &mut cells);
    let first = cells.first().copied().unwrap_or("");
    matches!(value(first, rules.decimal_comma), Value::Number(_)) || clock::parse(first).is_some()
}
