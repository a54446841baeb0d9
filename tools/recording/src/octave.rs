//! Octave's text format in: `# name:`, `# type:`, the numbers.

use crate::csv_reader::Parsed;
use crate::error::Problem;
use crate::mat::{self, Value, Variable};
use crate::options::ReadOptions;
use crate::table::{Line, Lines, decode};

/// Numbers that are taken into memory.
const MAX_NUMBERS: usize = 1 << 26;

/// Whether text begins as Octave writes it.
pub(crate) fn is_octave(text: &str) -> bool {
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).take(12).collect();
    let named = lines.iter().position(|line| line.starts_with("# name:"));
    named.and_then(|at| lines.get(at + 1)).is_some_and(|line| line.starts_with("# type:"))
}

/// Reads the variables of a text file of Octave.
pub(crate) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Parsed, Problem> {
    let (text, _) = decode(bytes);
    let mut lines = Lines::new(&text).peekable();
    let mut variables = Vec::new();
    while let Some(line) = lines.next() {
        let Some(name) = key(line, "name") else { continue };
        let kind = lines.next().and_then(|line| key(line, "type")).unwrap_or_default();
        let value = match kind {
            "scalar" => scalar(&mut lines, line)?,
            "matrix" | "int32 matrix" | "range" => matrix(&mut lines, line)?,
            other => Value::Other(other.to_owned()),
        };
        variables.push(Variable { name: name.to_owned(), value });
    }
    mat::of_variables(&variables, options)
}

fn key<'t>(line: Line<'t>, name: &str) -> Option<&'t str> {
    Some(
        line.text
            .trim()
            .strip_prefix('#')?
            .trim_start()
            .strip_prefix(name)?
            .trim_start()
            .strip_prefix(':')?
            .trim(),
    )
}

fn number(text: &str) -> Option<f64> {
    match text {
        "NA" => Some(f64::NAN),
        _ => text.parse::<f64>().ok().map(|number| if number.is_finite() { number } else { f64::NAN }),
    }
}

fn scalar<'t>(lines: &mut impl Iterator<Item = Line<'t>>, name: Line<'_>) -> Result<Value, Problem> {
    let found = lines.next().and_then(|line| number(line.text.trim()));
    let number = found.ok_or(Problem::Octave { line: name.number + 2, what: "a number is missing" })?;
    Ok(Value::Matrix { rows: 1, columns: 1, numbers: vec![number] })
}

fn matrix<'t, I: Iterator<Item = Line<'t>>>(
    lines: &mut std::iter::Peekable<I>,
    name: Line<'_>,
) -> Result<Value, Problem> {
    let mut size = |wanted: &str| {
        let found =
            lines.peek().and_then(|line| key(*line, wanted)).and_then(|text| text.parse::<usize>().ok());
        if found.is_some() {
            lines.next();
        }
        found
    };
    let (Some(rows), Some(columns)) = (size("rows"), size("columns")) else {
        // More than two dimensions, or ranges: no signals.
        return Ok(Value::Other("no matrix of two dimensions".to_owned()));
    };
    let bad = |line, what| Problem::Octave { line, what };
    if rows.saturating_mul(columns) > MAX_NUMBERS {
        return Err(bad(name.number, "the matrix is larger than can be read"));
    }
    let mut by_rows = Vec::new();
    let mut read = 0;
    while read < rows {
        let Some(line) = lines.peek().copied().filter(|line| !line.text.starts_with('#')) else { break };
        let numbers: Option<Vec<f64>> = line.text.split_ascii_whitespace().map(number).collect();
        match numbers.filter(|numbers| numbers.len() == columns) {
            Some(numbers) => by_rows.extend(numbers),
            None => return Err(bad(line.number, "the row has other numbers than the header announces")),
        }
        lines.next();
        read += 1;
    }
    if read < rows {
        return Err(bad(name.number, "the matrix has fewer rows than its header announces"));
    }
    let at = |row: usize, column: usize| by_rows.get(row * columns + column).copied().unwrap_or(f64::NAN);
    let numbers = (0..columns)
        .flat_map(|column| (0..rows).map(move |row| (row, column)))
        .map(|(r, c)| at(r, c))
        .collect();
    Ok(Value::Matrix { rows, columns, numbers })
}
