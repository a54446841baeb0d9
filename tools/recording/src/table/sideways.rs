//! Tables with one row per channel.

use super::cells::{Separator, Value, split, value};
use super::lines::Lines;

/// Channels at most, cells of a row at least, and cells per row: a table that is wider than that was not
/// meant to be read downwards.
const MOST_ROWS: usize = 64;
const FEWEST_CELLS: usize = 17;
const WIDER: usize = 4;

/// The table turned, one column per channel, with tabs between its cells; `None` where it stands as it
/// should.
pub(super) fn as_columns(text: &str) -> Option<(String, Separator)> {
    let lines: Vec<&str> = Lines::new(text).take(MOST_ROWS + 1).map(|line| line.text).collect();
    if lines.len() < 2 || lines.len() > MOST_ROWS {
        return None;
    }
    let separators = [b'\t', b';', b',', b'|'].map(Separator::Byte).into_iter().chain([Separator::Blanks]);
    let rows = separators.into_iter().find_map(|separator| rows(&lines, separator))?;
    let width = rows.first()?.len();
    let mut turned = String::with_capacity(text.len());
    for at in 0..width {
        let cells: Vec<&str> = rows.iter().map(|row| row.get(at).copied().unwrap_or("")).collect();
        turned.push_str(&cells.join("\t"));
        turned.push('\n');
    }
    Some((turned, Separator::Byte(b'\t')))
}

/// The cells of lines that are all alike, wide, and begin with a name.
fn rows<'t>(lines: &[&'t str], separator: Separator) -> Option<Vec<Vec<&'t str>>> {
    let mut rows: Vec<Vec<&str>> = Vec::with_capacity(lines.len());
    for line in lines {
        let mut cells = Vec::new();
        split(line, separator, &mut cells);
        if cells.len() > 1 && cells.last() == Some(&"") {
            cells.pop();
        }
        let width = rows.first().map_or(cells.len(), Vec::len);
        if cells.len() != width || width < FEWEST_CELLS.max(WIDER * lines.len()) {
            return None;
        }
        rows.push(cells);
    }
    let is_value = |cell: &&str| {
        [false, true].iter().any(|comma| !matches!(value(cell, *comma), Value::Text | Value::Overflow))
    };
    let named = rows.iter().all(|row| {
        row.split_first().is_some_and(|(name, values)| !is_value(name) && values.iter().all(&is_value))
    });
    named.then_some(rows)
}
