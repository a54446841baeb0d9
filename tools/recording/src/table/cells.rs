//! A line of a table and its cells.

use std::fmt;
use std::str::FromStr;

use crate::unit_label::known;

/// What stands between the cells of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Separator {
    /// One such byte: `,`, `;`, a tab, `|`.
    Byte(u8),
    /// One or more blanks or tabs.
    Blanks,
}

impl Separator {
    /// Separators that are looked for.
    pub(super) const ALL: [Self; 5] =
        [Self::Byte(b'\t'), Self::Byte(b';'), Self::Byte(b','), Self::Byte(b'|'), Self::Blanks];
}

impl fmt::Display for Separator {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Byte(b'\t') => formatter.write_str("tabs"),
            Self::Byte(byte) => write!(formatter, "`{}`", char::from(*byte)),
            Self::Blanks => formatter.write_str("blanks"),
        }
    }
}

impl FromStr for Separator {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "," | "comma" => Ok(Self::Byte(b',')),
            ";" | "semicolon" => Ok(Self::Byte(b';')),
            "\t" | "tab" | "\\t" => Ok(Self::Byte(b'\t')),
            "|" => Ok(Self::Byte(b'|')),
            ":" => Ok(Self::Byte(b':')),
            " " | "blank" | "blanks" | "space" => Ok(Self::Blanks),
            _ => Err(format!("`{text}` is no separator; write comma, semicolon, tab, blanks, | or :")),
        }
    }
}

/// Splits a line into its cells, without the quotes and blanks around them.
pub(super) fn split<'t>(line: &'t str, separator: Separator, cells: &mut Vec<&'t str>) {
    cells.clear();
    match separator {
        Separator::Byte(byte) => split_at(line, byte, cells),
        Separator::Blanks if line.contains('"') => split_blanks(line, cells),
        Separator::Blanks => cells.extend(line.split_ascii_whitespace()),
    }
}

fn split_at<'t>(line: &'t str, separator: u8, cells: &mut Vec<&'t str>) {
    let mut rest = line;
    loop {
        // What goes on behind its closing quote is not a quoted cell.
        let ends =
            |after: &str| after.trim_start_matches(' ').bytes().next().is_none_or(|byte| byte == separator);
        let quoted = rest.trim_start_matches(' ').strip_prefix('"').and_then(close);
        let (cell, after) =
            match quoted.filter(|(_, after)| after.starts_with(char::from(separator)) || ends(after)) {
                Some((cell, after)) => (cell, after),
                None => {
                    let end = rest.bytes().position(|byte| byte == separator).unwrap_or(rest.len());
                    (rest.get(..end).unwrap_or(rest), rest.get(end..).unwrap_or(""))
                }
            };
        cells.push(cell.trim_ascii());
        match after.bytes().position(|byte| byte == separator) {
            Some(at) => rest = after.get(at + 1..).unwrap_or(""),
            None => return,
        }
    }
}

fn split_blanks<'t>(line: &'t str, cells: &mut Vec<&'t str>) {
    let mut rest = line.trim_ascii();
    while !rest.is_empty() {
        let (cell, after) = match rest.strip_prefix('"').and_then(close) {
            Some((cell, after)) => (cell.trim_ascii(), after),
            None => {
                let end = rest.bytes().position(|byte| byte.is_ascii_whitespace()).unwrap_or(rest.len());
                (rest.get(..end).unwrap_or(rest), rest.get(end..).unwrap_or(""))
            }
        };
        cells.push(cell);
        rest = after.trim_ascii_start();
    }
}

/// The content of a quoted cell and what follows its closing quote. A quote that is written twice does not
/// close it.
fn close(inner: &str) -> Option<(&str, &str)> {
    let bytes = inner.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        if bytes.get(at) == Some(&b'"') {
            if bytes.get(at + 1) != Some(&b'"') {
                return Some((inner.get(..at)?, inner.get(at + 1..)?));
            }
            at += 1;
        }
        at += 1;
    }
    None
}

/// What a cell holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value {
    Number(f64),
    /// Nothing, or a word for it.
    Missing,
    /// An infinity, or a word for a value beyond the range.
    Overflow,
    /// Something else.
    Text,
}

/// Words that stand for no value.
const MISSING: [&str; 16] = [
    "nan",
    "-nan",
    "na",
    "n/a",
    "null",
    "none",
    "-",
    "--",
    "---",
    "#n/a",
    "#nv",
    "nil",
    "nan(ind)",
    "-nan(ind)",
    "1.#qnan",
    "-1.#ind",
];
/// Words that stand for a value beyond the range.
const OVERFLOW: [&str; 13] = [
    "inf",
    "+inf",
    "-inf",
    "ovf",
    "overflow",
    "over",
    "ol",
    "o.l",
    "1.#inf",
    "-1.#inf",
    "\u{221e}",
    "+\u{221e}",
    "-\u{221e}",
];

/// Reads a cell.
pub(super) fn value(cell: &str, decimal_comma: bool) -> Value {
    let parsed = if decimal_comma && cell.contains(',') { comma_number(cell) } else { cell.parse().ok() };
    match parsed {
        Some(number) if number.is_finite() && !(decimal_comma && is_grouped(cell)) => Value::Number(number),
        Some(number) if number.is_nan() => Value::Missing,
        Some(number) if number.is_infinite() => Value::Overflow,
        _ => unusual(cell, decimal_comma),
    }
}

/// A number with its unit behind a blank, as some programs write every value (`0.005 sec`); the cell of a
/// number alone has none.
pub(super) fn with_unit(cell: &str, decimal_comma: bool) -> Option<(f64, &str)> {
    let (number, unit) = cell.split_once(' ')?;
    let unit = unit.trim_start();
    match value(number, decimal_comma) {
        Value::Number(number) if known(unit).is_some() => Some((number, unit)),
        _ => None,
    }
}

/// Whether the points of a cell may group thousands, where the comma is the decimal sign.
fn is_grouped(cell: &str) -> bool {
    let digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    match cell.trim_start_matches(['-', '+']).split_once('.') {
        Some((whole, rest)) => {
            !whole.is_empty()
                && whole.len() <= 3
                && digits(whole)
                && whole != "0"
                && rest.len() == 3
                && digits(rest)
        }
        None => false,
    }
}

/// A number whose thousands commas group, where nothing else can be meant: `12,345.6` and `1,234,567`.
fn grouped_by_commas(cell: &str) -> Option<f64> {
    let (whole, fraction) = cell.split_once('.').unwrap_or((cell, ""));
    let mut groups = whole.trim_start_matches(['-', '+']).split(',');
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    let first = groups.next().filter(|first| digits(first) && first.len() <= 3 && !first.starts_with('0'));
    let commas = whole.matches(',').count();
    let is_sure = first.is_some() && commas >= 1 && (commas >= 2 || digits(fraction));
    let thousands = groups.all(|group| group.len() == 3 && digits(group));
    (is_sure && thousands).then(|| cell.replace(',', "").parse().ok()).flatten()
}

fn comma_number(cell: &str) -> Option<f64> {
    let mut plain = String::with_capacity(cell.len());
    let (whole, fraction) = cell.split_once(',')?;
    // Points before the comma group thousands.
    let grouped = whole.split('.').skip(1).all(|group| group.len() == 3);
    if !grouped || fraction.contains(['.', ',']) {
        return None;
    }
    plain.extend(whole.chars().filter(|character| *character != '.'));
    plain.push('.');
    plain.push_str(fraction);
    plain.parse().ok()
}

fn unusual(cell: &str, decimal_comma: bool) -> Value {
    let word = |words: &[&str]| words.iter().any(|word| cell.eq_ignore_ascii_case(word));
    if cell.is_empty() || word(&MISSING) {
        return Value::Missing;
    }
    if word(&OVERFLOW) || (cell.len() > 2 && cell.bytes().all(|byte| byte == b'#')) {
        return Value::Overflow;
    }
    if let Some(number) = grouped_by_commas(cell).filter(|_| !decimal_comma) {
        return Value::Number(number);
    }
    if is_grouped(cell) || !cell.bytes().any(|byte| byte.is_ascii_digit()) {
        return Value::Text;
    }
    // A minus sign of typography, an exponent as Fortran writes it.
    let plain = cell.replace('\u{2212}', "-").replace(['D', 'd'], "e");
    let parsed = if decimal_comma && plain.contains(',') { comma_number(&plain) } else { plain.parse().ok() };
    match parsed {
        Some(number) if plain != cell && number.is_finite() => Value::Number(number),
        _ => Value::Text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(line: &str, separator: Separator) -> Vec<&str> {
        let mut found = Vec::new();
        split(line, separator, &mut found);
        found
    }

    #[test]
    fn cells_lose_their_quotes_and_blanks() {
        let comma = Separator::Byte(b',');
        assert_eq!(cells("a, b ,c", comma), ["a", "b", "c"]);
        assert_eq!(cells("\"1,5\",\"say \"\"x\"\"\", 3", comma), ["1,5", "say \"\"x\"\"", "3"]);
        assert_eq!(cells("1,,", comma), ["1", "", ""]);
        assert_eq!(cells("\"open,1", comma), ["\"open", "1"]);
        assert_eq!(cells("  1\t 2  3 ", Separator::Blanks), ["1", "2", "3"]);
        assert_eq!(cells("\"Time [s]\" \"Acc X\"", Separator::Blanks), ["Time [s]", "Acc X"]);
        assert_eq!(cells("", comma), [""]);
        assert_eq!(cells("\"1\"\t\t\"2\"", Separator::Byte(b'\t')), ["1", "", "2"]);
    }

    #[test]
    fn a_unit_behind_a_number_is_told_from_other_words() {
        assert_eq!(with_unit("0.005 sec", false), Some((0.005, "sec")));
        assert_eq!(with_unit("-1,5  mV", true), Some((-1.5, "mV")));
        for cell in ["0.005", "12 oops", "V 3", "3 ", "2025-03-02 09:15:07", "1 2", ""] {
            assert_eq!(with_unit(cell, false), None, "{cell}");
        }
    }

    #[test]
    fn numbers_are_read_in_both_decimals_and_other_words_are_what_they_are() {
        let grid = [
            ("1.5", false, Value::Number(1.5)),
            ("-1,5e-3", true, Value::Number(-1.5e-3)),
            ("1.234,5", true, Value::Number(1234.5)),
            ("+2", true, Value::Number(2.0)),
            ("0.25", true, Value::Number(0.25)),
            ("1.234", true, Value::Text),
            ("1,5", false, Value::Text),
            ("1.5D-03", false, Value::Number(1.5e-3)),
            ("\u{2212}3", false, Value::Number(-3.0)),
            ("", false, Value::Missing),
            ("NaN", true, Value::Missing),
            ("#N/A", false, Value::Missing),
            ("1e999", false, Value::Overflow),
            ("-Inf", false, Value::Overflow),
            ("OVF", false, Value::Overflow),
            ("oops", false, Value::Text),
            ("1.2.3", false, Value::Text),
            ("12,345.67", false, Value::Number(12345.67)),
            ("-1,234,567", false, Value::Number(-1_234_567.0)),
            ("12,345", false, Value::Text),
            ("0,123.5", false, Value::Text),
            ("1,23.5", false, Value::Text),
        ];
        for (cell, comma, wanted) in grid {
            assert_eq!(value(cell, comma), wanted, "{cell}");
        }
    }
}
