//! Rows in brackets, as Python prints its tuples and lists.

use super::cells::{Separator, Value, split, value};
use super::lines::{Lines, on_their_lines};

/// Lines that are looked at, and the share of them that has to stand in brackets.
const LOOKED_AT: usize = 60;
const MOST: f64 = 0.8;

/// The rows without the brackets around them; `None` for text whose rows have none.
pub(super) fn without_brackets(text: &str) -> Option<String> {
    let lines = || Lines::new(text).take(LOOKED_AT);
    let found = lines().filter(|line| inner(line.text).is_some()).count();
    if found < 3 || (found as f64) < MOST * lines().count() as f64 {
        return None;
    }
    Some(on_their_lines(text, |line| inner(line).unwrap_or(line).to_owned()))
}

/// What stands in the brackets of a row of numbers.
fn inner(line: &str) -> Option<&str> {
    let line = line.trim().trim_end_matches(',');
    let pairs = [('(', ')'), ('[', ']')];
    let inner = pairs.iter().find_map(|(open, close)| line.strip_prefix(*open)?.strip_suffix(*close))?;
    let inner = inner.trim();
    let separator = if inner.contains(',') { Separator::Byte(b',') } else { Separator::Blanks };
    let mut cells = Vec::new();
    split(inner, separator, &mut cells);
    let are_numbers =
        cells.iter().all(|cell| matches!(value(cell, false), Value::Number(_) | Value::Missing));
    (are_numbers && !inner.is_empty()).then_some(inner)
}
