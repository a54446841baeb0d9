//! How a table is written: what separates its cells, its decimal sign, where it begins, which lines are its
//! header.

use super::cells::{Separator, Value, split, value, with_unit};
use super::clock;
use super::lines::{Line, Lines, comment};
use crate::heading::{Heading, are_units};
use crate::unit_label::{known, seconds};

/// Lines from which the dialect is told.
const LOOKED_AT: usize = 500;
/// Rows that are alike before a table is believed.
const FEWEST: usize = 3;

/// The dialect of a table.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Dialect {
    pub(super) separator: Separator,
    pub(super) decimal_comma: bool,
    /// Cells of a row.
    pub(super) width: usize,
    /// Line of the first row.
    pub(super) first_row: u32,
    /// Lines of the header and of the units, as they stand, the sign of a comment taken off.
    pub(super) header: Option<(u32, Vec<String>)>,
    pub(super) units: Option<(u32, Vec<String>)>,
}

/// What options say about the dialect.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Given {
    pub(super) separator: Option<Separator>,
    pub(super) decimal_comma: Option<bool>,
}

/// What kind of line it is under a dialect.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Row {
    cells: usize,
    numbers: usize,
    texts: usize,
    /// Whether nothing stands in the last cell.
    ends_empty: bool,
}

fn row<'t>(text: &'t str, separator: Separator, decimal_comma: bool, cells: &mut Vec<&'t str>) -> Row {
    split(text, separator, cells);
    let ends_empty = cells.len() > 1 && cells.last() == Some(&"");
    let mut row = Row { cells: cells.len(), numbers: 0, texts: 0, ends_empty };
    for cell in cells.iter() {
        match value(cell, decimal_comma) {
            Value::Number(_) => row.numbers += 1,
            Value::Text if clock::parse(cell).is_some() || with_unit(cell, decimal_comma).is_some() => {
                row.numbers += 1;
            }
            Value::Text => row.texts += 1,
            _ => {}
        }
    }
    row
}

/// A way to read the lines, and how much of them it explains.
struct Candidate {
    separator: Separator,
    decimal_comma: bool,
    width: usize,
    /// Rows of that width.
    rows: usize,
    /// Whether some cells are text.
    mixed: bool,
    /// Index of the first row among the lines.
    first: usize,
    /// Whether the line before has as many cells.
    headed: bool,
}

/// Tells the dialect of a table; `None` where no lines are alike.
pub(super) fn detect(lines: &Lines<'_>, given: Given) -> Option<Dialect> {
    let lines: Vec<Line<'_>> = lines.clone().take(LOOKED_AT).collect();
    let mut given = given;
    if let Some(first) = lines.first() {
        given.separator = given.separator.or_else(|| stated_separator(first.text));
    }
    let separators: Vec<Separator> =
        given.separator.map_or(Separator::ALL.to_vec(), |separator| vec![separator]);
    let decimals: Vec<bool> = given.decimal_comma.map_or(vec![false, true], |comma| vec![comma]);
    let mut best: Option<Candidate> = None;
    for separator in &separators {
        for decimal_comma in &decimals {
            for mixed in [false, true] {
                let found = candidate(&lines, *separator, *decimal_comma, mixed);
                if let Some(found) =
                    found.filter(|found| best.as_ref().is_none_or(|best| better(found, best)))
                {
                    best = Some(found);
                }
            }
        }
    }
    let best = best?;
    let (header, units) = header(&lines, &best);
    Some(Dialect {
        separator: best.separator,
        decimal_comma: best.decimal_comma,
        width: best.width,
        first_row: lines.get(best.first)?.number,
        header,
        units,
    })
}

/// Spreadsheets state the separator in a line of its own.
fn stated_separator(text: &str) -> Option<Separator> {
    let sign = text.trim_matches('"').strip_prefix("sep=")?;
    sign.bytes().next().map(Separator::Byte)
}

/// A dialect explains a table better when it makes more rows of it, without text in them, headed by a line of
/// as many cells.
fn better(a: &Candidate, b: &Candidate) -> bool {
    // Text among the numbers must explain twice as many rows to be believed.
    let weight = |c: &Candidate| if c.mixed { c.rows } else { 2 * c.rows };
    match weight(a).cmp(&weight(b)) {
        std::cmp::Ordering::Equal if a.headed != b.headed => a.headed,
        std::cmp::Ordering::Equal => a.width > b.width,
        other => other.is_gt(),
    }
}

fn candidate(
    lines: &[Line<'_>],
    separator: Separator,
    decimal_comma: bool,
    mixed: bool,
) -> Option<Candidate> {
    let semicolons = separator == Separator::Byte(b';');
    let mut cells = Vec::new();
    let rows: Vec<Option<Row>> = lines
        .iter()
        .map(|line| {
            if comment(line.text, semicolons).is_some() {
                return None;
            }
            Some(row(line.text, separator, decimal_comma, &mut cells))
        })
        .collect();
    let counts =
        |row: &Row| row.numbers > 0 && (row.texts == 0 || mixed && row.texts <= row.numbers && row.cells > 2);
    let mut widths: Vec<usize> =
        rows.iter().flatten().filter(|row| counts(row)).map(|row| row.cells).collect();
    widths.sort_unstable();
    let width = most_frequent(&widths)?;
    let is_row = |row: &Option<Row>| row.is_some_and(|row| counts(&row) && row.cells == width);
    let count = rows.iter().filter(|row| is_row(row)).count();
    // A table begins where a row is followed by another one; comments may stand between.
    let places: Vec<usize> =
        (0..rows.len()).filter(|at| rows.get(*at).is_some_and(Option::is_some)).collect();
    let first = places.windows(2).find_map(|pair| {
        let [at, next] = pair else { return None };
        (is_row(rows.get(*at)?) && is_row(rows.get(*next)?)).then_some(*at)
    })?;
    let named = first.checked_sub(1).and_then(|before| lines.get(before)).map(|line| {
        split(comment(line.text, semicolons).unwrap_or(line.text), separator, &mut cells);
        (cells.len(), cells.last() == Some(&""))
    });
    // A separator behind every row ends it and begins no cell, unless that cell has a name.
    let closed = width > 1 && rows.iter().filter(|row| is_row(row)).flatten().all(|row| row.ends_empty);
    let closed = closed && named != Some((width, false));
    let headed = named.is_some_and(|(cells, empty)| {
        cells == width || closed && cells + 1 == width || cells == width + 1 && empty
    });
    let width = if closed { width - 1 } else { width };
    (count >= FEWEST).then_some(Candidate {
        separator,
        decimal_comma,
        width,
        rows: count,
        mixed,
        first,
        headed,
    })
}

fn most_frequent(sorted: &[usize]) -> Option<usize> {
    sorted.chunk_by(|a, b| a == b).max_by_key(|chunk| chunk.len())?.first().copied()
}

type Header = Option<(u32, Vec<String>)>;

/// Lines before the first row among which the names are looked for.
const LINES_OF_HEADER: usize = 8;

/// The lines before the first row that name its columns and state their units.
///
/// The names stand nearest to the rows, or above a row of units, or above rows that say something else about
/// every channel (its gain, its rate, who made it): then the row that names the time is theirs.
fn header(lines: &[Line<'_>], best: &Candidate) -> (Header, Header) {
    let before = lines.get(..best.first).unwrap_or(&[]);
    let rows: Vec<(u32, Vec<String>)> = before
        .iter()
        .rev()
        .take(LINES_OF_HEADER)
        .filter_map(|line| Some((line.number, header_cells(line.text, best)?)))
        .collect();
    let names_all = |row: &(u32, Vec<String>)| row.1.iter().all(|name| name.is_empty() || is_name(name));
    let Some(nearest) = rows.first() else { return (None, None) };
    let cells: Vec<&str> = nearest.1.iter().map(String::as_str).collect();
    if let Some(names) = rows.get(1).filter(|row| names_all(row))
        && (are_units(&cells) || is_row_of_units(&cells, &names.1))
    {
        return (Some(names.clone()), Some(nearest.clone()));
    }
    let names_time = |row: &(u32, Vec<String>)| {
        row.1.iter().enumerate().any(|(at, cell)| Heading::parse(cell, at + 1, None).is_time(at))
    };
    let is_bare = !names_time(nearest);
    let above = rows.iter().skip(1).find(|row| is_bare && names_all(row) && names_time(row));
    (Some(above.unwrap_or(nearest).clone()), None)
}

/// Whether a row below names holds their units though not all of them are known: a unit of time stands alone
/// below the name of the time.
fn is_row_of_units(cells: &[&str], names: &[String]) -> bool {
    let unit_of_time = |cell: &str| known(cell).is_some_and(|unit| seconds(&unit).is_some());
    let pairs = || cells.iter().zip(names).enumerate();
    let short = |cell: &str| cell.chars().count() <= LONGEST_UNIT;
    pairs().any(|(at, (cell, name))| unit_of_time(cell) && Heading::parse(name, at + 1, None).is_time(at))
        && cells.iter().all(|cell| short(cell))
        && names.iter().filter(|name| !name.is_empty()).count() == names.len()
}

/// Characters of a unit at most.
const LONGEST_UNIT: usize = 12;

fn is_name(cell: &str) -> bool {
    cell.chars().any(char::is_alphabetic)
}

/// The cells of a line that has one for every column and at least one that is no number.
fn header_cells(text: &str, best: &Candidate) -> Option<Vec<String>> {
    let semicolons = best.separator == Separator::Byte(b';');
    let text = comment(text, semicolons).unwrap_or(text);
    let mut cells = Vec::new();
    split(text, best.separator, &mut cells);
    let mut cells: Vec<String> = cells.into_iter().map(|cell| cell.replace("\"\"", "\"")).collect();
    if cells.len() == best.width + 1 && cells.last().is_some_and(String::is_empty) {
        cells.pop();
    }
    if cells.len() != best.width && best.separator == Separator::Blanks {
        cells = wide_cells(text, best.width)?;
    }
    let text = |cell: &String| {
        value(cell, best.decimal_comma) == Value::Text
            && clock::parse(cell).is_none()
            && with_unit(cell, best.decimal_comma).is_none()
    };
    (cells.len() == best.width && cells.iter().any(text)).then_some(cells)
}

/// Names with blanks in them, above columns that blanks separate: two blanks or a tab then end a name, or a
/// unit in brackets does.
fn wide_cells(text: &str, width: usize) -> Option<Vec<String>> {
    let apart: Vec<String> = text
        .split('\t')
        .flat_map(|part| part.split("  "))
        .map(|part| part.trim().to_owned())
        .filter(|part| !part.is_empty())
        .collect();
    if apart.len() == width {
        return Some(apart);
    }
    let mut joined: Vec<String> = Vec::new();
    for word in text.split_ascii_whitespace() {
        match joined.last_mut() {
            Some(last) if word.starts_with(['[', '(']) => {
                last.push(' ');
                last.push_str(word);
            }
            _ => joined.push(word.to_owned()),
        }
    }
    (joined.len() == width).then_some(joined)
}
