//! Universal files (UFF, UNV): data sets 58 and 58b, with the unit code of data set 164.
//!
//! A file is a sequence of data sets between lines `-1`; the line after the first gives the set's number.
//! Set 58 is one function: eleven header records in fixed columns, then values, as text or (58b) binary.

mod error;
mod fortran;
mod function;
mod lines;
mod units;
mod writer;

pub use error::UffProblem;
pub use writer::{to_uff58, to_uff58b};

use crate::channels::{Channel, select};
use crate::csv_reader::Parsed;
use crate::error::Problem;
use crate::format::Format;
use crate::options::{ColumnChoice, ReadOptions};
use crate::recording::shorten;
use function::{Binary, Function};
use lines::{Lines, is_delimiter};

/// Unit code of data set 164 for metre, newton, kilogram, second.
const SI: i64 = 1;
/// IEEE 754 in data set 58b.
const IEEE: i64 = 2;

/// Reads the time responses of a universal file.
pub(crate) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Parsed, Problem> {
    if options.time.is_some() {
        return Err(Problem::OwnTime { format: Format::Uff58 });
    }
    let Contents { functions, si, others } = contents(bytes)?;
    if functions.is_empty() {
        return Err(UffProblem::NoFunctions { found: others }.into());
    }
    let kinds: Vec<String> = functions.iter().map(Function::kind).collect();
    let responses: Vec<Function> = functions.into_iter().filter(Function::is_time_response).collect();
    if responses.is_empty() {
        return Err(UffProblem::NoTimeResponse { kinds }.into());
    }
    let mut remarks = Vec::new();
    if responses.len() < kinds.len() {
        remarks.push(format!(
            "left out: {} functions that are no time responses",
            kinds.len() - responses.len()
        ));
    }
    let channels: Vec<Channel> = (1..)
        .zip(&responses)
        .map(|(number, function): (u32, _)| Channel {
            source: number.to_string(),
            name: function.column_name(si),
            description: function.description(),
            samples: function.values.clone(),
        })
        .collect();
    let time_s = common_time(&responses, &channels, &options.columns)?;
    let (columns, more) = select(channels, &options.columns)?;
    remarks.extend(more);
    Ok((time_s, columns, remarks))
}

/// The time axis of all functions that are taken.
fn common_time(
    responses: &[Function],
    channels: &[Channel],
    choices: &[ColumnChoice],
) -> Result<Vec<f64>, Problem> {
    let is_taken = |channel: &Channel| match choices {
        [] => channel.name.is_some(),
        _ => choices
            .iter()
            .any(|choice| choice.source == channel.source || channel.name.as_ref() == Some(&choice.source)),
    };
    let mut taken = responses.iter().zip(channels).filter(|(_, channel)| is_taken(channel));
    // With none taken, choosing the columns says why.
    let Some((first, first_channel)) = taken.next() else { return Ok(Vec::new()) };
    let name = |channel: &Channel| channel.name.clone().unwrap_or_else(|| channel.source.clone());
    match taken.find(|(function, _)| function.time_s != first.time_s) {
        None => Ok(first.time_s.clone()),
        Some((_, other)) => Err(UffProblem::DifferentTimes {
            first: name(first_channel),
            second: name(other),
            present: crate::channels::descriptions(channels),
        }
        .into()),
    }
}

struct Contents {
    functions: Vec<Function>,
    /// Whether data set 164 says that the units are SI.
    si: bool,
    /// Numbers of the data sets that are not functions.
    others: Vec<String>,
}

fn contents(bytes: &[u8]) -> Result<Contents, UffProblem> {
    let mut lines = Lines::new(bytes);
    let mut found = Contents { functions: Vec::new(), si: false, others: Vec::new() };
    while let Some(line) = lines.next() {
        if !is_delimiter(&line) {
            continue;
        }
        let Some(mut number) = lines.next() else { break };
        // Some writers end a data set twice.
        while is_delimiter(&number) {
            number = lines.next().unwrap_or_default();
        }
        let mut words = number.split_ascii_whitespace();
        match words.next().unwrap_or_default() {
            "58" => found.functions.push(Function::read(&mut lines, None)?),
            "58b" | "58B" => {
                let binary = binary(&number, lines.line)?;
                found.functions.push(Function::read(&mut lines, Some(binary))?);
            }
            other => {
                found.others.push(shorten(other));
                skip(&mut lines, other == "164", &mut found.si);
            }
        }
    }
    Ok(found)
}

/// Skips a data set, looking at the code of the units on the way if it holds one.
fn skip(lines: &mut Lines<'_>, is_units: bool, si: &mut bool) {
    let mut first = true;
    while let Some(line) = lines.next() {
        if is_delimiter(&line) {
            return;
        }
        if is_units && first {
            *si = fortran::integer(fortran::field(&line, 0, 10)) == Some(SI);
        }
        first = false;
    }
}

/// The header of a data set 58b: byte order, representation, lines of text, bytes.
fn binary(header: &str, line: u64) -> Result<Binary, UffProblem> {
    let mut numbers = header.split_ascii_whitespace().skip(1);
    let mut number = |what| {
        let text = numbers.next().unwrap_or_default();
        text.parse::<i64>().map_err(|_| UffProblem::Field { line, what, found: shorten(text) })
    };
    let order = number("byte order (1 or 2)")?;
    let code = number("floating-point format")?;
    let text_lines = number("number of text lines (11)")?;
    let bytes = number("number of bytes")?;
    if !matches!(order, 1 | 2) {
        return Err(UffProblem::Field { line, what: "byte order (1 or 2)", found: order.to_string() });
    }
    if code != IEEE {
        return Err(UffProblem::FloatingPoint { line, code });
    }
    if text_lines != 11 {
        return Err(UffProblem::Field {
            line,
            what: "number of text lines (11)",
            found: text_lines.to_string(),
        });
    }
    Ok(Binary { little_endian: order == 1, bytes: usize::try_from(bytes).unwrap_or(usize::MAX) })
}
