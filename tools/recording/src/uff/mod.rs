//! Universal files (UFF, UNV): data sets 58 and 58b, with the unit code of data set 164.
//!
//! A file is a sequence of data sets between lines `-1`; the line after the first gives the set's number.
//! Set 58 is one function: eleven header records in fixed columns, then values, as text or (58b) binary.

mod error;
mod fortran;
mod function;
mod lines;
mod names;
mod spectra;
mod time_axis;
mod units;
mod values;
mod writer;

pub use error::UffProblem;
pub use writer::{to_uff58, to_uff58b};

use crate::channels::{Channel, select};
use crate::content::{Content, Signals};
use crate::error::Problem;
use crate::format::Format;
use crate::options::{ReadOptions, TimeBase};
use crate::recording::shorten;
use function::Function;
use lines::{Lines, is_delimiter};
use time_axis::common_time;
use values::Binary;

/// Unit code of data set 164 for metre, newton, kilogram, second.
const SI: i64 = 1;
/// IEEE 754 in data set 58b.
const IEEE: i64 = 2;

/// Reads the time responses of a universal file or, where it holds none, its functions of frequency.
pub(crate) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, Problem> {
    if matches!(options.time, Some(TimeBase::Source { .. })) {
        return Err(Problem::OwnTime { format: Format::Uff58 });
    }
    let Contents { functions, si, others } = contents(bytes)?;
    if functions.is_empty() {
        return Err(UffProblem::NoFunctions { found: others }.into());
    }
    let mut remarks: Vec<String> = functions.iter().filter_map(cut_remark).collect();
    let (responses, rest): (Vec<Function>, Vec<Function>) =
        functions.into_iter().partition(time_axis::is_time_response);
    if responses.is_empty() {
        let spectra = spectra::spectra(&rest, si);
        if spectra.is_empty() {
            let kinds = rest.iter().map(Function::kind).collect();
            return Err(UffProblem::NoTimeResponse { kinds }.into());
        }
        return Ok(Content { signals: Signals::Spectra(spectra), remarks });
    }
    if !rest.is_empty() {
        remarks.push(format!("left out: {} functions that are no time responses", rest.len()));
    }
    let names = names::column_names(&responses, si);
    let channels: Vec<Channel> = (1..)
        .zip(responses.iter().zip(names))
        .map(|(number, (function, name)): (u32, _)| Channel {
            source: number.to_string(),
            name,
            description: function.description(),
            samples: function.values.clone(),
        })
        .collect();
    let (time_s, channels) = common_time(&responses, channels, &options.columns, &mut remarks)?;
    let (columns, more) = select(channels, &options.columns)?;
    remarks.extend(more);
    Ok(Content { signals: Signals::OverTime(time_s, columns), remarks })
}

fn cut_remark(function: &Function) -> Option<String> {
    let announced = function.cut?;
    let read = function.values.len();
    Some(format!(
        "the file ends within the function of line {}: {read} of {announced} values were read",
        function.line
    ))
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
