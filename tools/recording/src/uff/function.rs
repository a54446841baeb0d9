//! One data set 58: its eleven header records and its values.

use super::error::UffProblem;
use super::fortran::{field, integer, real, reals};
use super::lines::{Lines, is_delimiter};
use super::units;
use crate::recording::{shorten, unit_of};

/// Function type of a time response.
const TIME_RESPONSE: i64 = 1;
/// Function type that states nothing.
const GENERAL: i64 = 0;

/// A function as the file has it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Function {
    /// Line at which it begins.
    pub(super) line: u64,
    /// First identification line.
    title: String,
    kind: i64,
    node: i64,
    direction: i64,
    complex: bool,
    abscissa_type: i64,
    data_type: i64,
    label: String,
    /// Stamps, s.
    pub(super) time_s: Vec<f64>,
    /// Values; empty when they are complex, and so no time response.
    pub(super) values: Vec<f64>,
}

/// How the values of a data set 58b are stored.
#[derive(Debug, Clone, Copy)]
pub(super) struct Binary {
    pub(super) little_endian: bool,
    pub(super) bytes: usize,
}

/// Records 6 and 7: how many values, of what width, at which abscissas.
struct Layout {
    double: bool,
    even: bool,
    count: u64,
    start: f64,
    step: f64,
}

impl Function {
    /// Reads on from the line after the data set's number, up to its end.
    pub(super) fn read(lines: &mut Lines<'_>, binary: Option<Binary>) -> Result<Self, UffProblem> {
        let line = lines.line;
        let mut header: Vec<String> = Vec::with_capacity(11);
        for _ in 0..11 {
            let text =
                lines.next().ok_or(UffProblem::Ends { line: lines.line, what: "a function's header" })?;
            header.push(text.into_owned());
        }
        let record = |number: usize| header.get(number - 1).map_or("", String::as_str);
        let at = |number: u64| line + number;
        let int = |number: u64, from, width, what| {
            let text = field(record(number as usize), from, width);
            integer(text).ok_or_else(|| UffProblem::Field { line: at(number), what, found: shorten(text) })
        };
        let ordinate = int(7, 0, 10, "ordinate data type")?;
        let (double, complex) = match ordinate {
            2 => (false, false),
            4 => (true, false),
            5 => (false, true),
            6 => (true, true),
            other => {
                let what = "ordinate data type (2, 4, 5 or 6)";
                return Err(UffProblem::Field { line: at(7), what, found: other.to_string() });
            }
        };
        let number = |from, what| {
            let text = field(record(7), from, 13);
            let found = || UffProblem::Field { line: at(7), what, found: shorten(text) };
            if text.trim().is_empty() { Ok(0.0) } else { real(text).ok_or_else(found) }
        };
        let layout = Layout {
            double,
            even: int(7, 20, 10, "abscissa spacing")? == 1,
            count: u64::try_from(int(7, 10, 10, "number of values")?).unwrap_or(0),
            start: number(30, "abscissa's minimum")?,
            step: number(43, "abscissa's increment")?,
        };
        let mut function = Self {
            line,
            title: record(1).trim().to_owned(),
            kind: int(6, 0, 5, "function type")?,
            // Node and direction are only used for the name: 41 columns in, after an entity's name.
            node: integer(field(record(6), 41, 10)).unwrap_or(0),
            direction: integer(field(record(6), 51, 4)).unwrap_or(0),
            complex,
            abscissa_type: int(8, 0, 10, "abscissa's data type")?,
            data_type: int(9, 0, 10, "ordinate's data type")?,
            label: field(record(9), 47, 20).trim().to_owned(),
            time_s: Vec::new(),
            values: Vec::new(),
        };
        let numbers = match binary {
            Some(binary) => binary_numbers(lines, binary, &layout, complex)?,
            None => text_numbers(lines, &layout, complex)?,
        };
        if !complex {
            function.place(numbers, &layout, line + 12)?;
        }
        Ok(function)
    }

    /// Splits the numbers into stamps and values.
    fn place(&mut self, numbers: Vec<f64>, layout: &Layout, line: u64) -> Result<(), UffProblem> {
        (self.time_s, self.values) = if layout.even {
            let stamps = (0..numbers.len()).map(|k| layout.start + k as f64 * layout.step);
            (stamps.collect(), numbers)
        } else {
            numbers.chunks_exact(2).filter_map(|pair| Some((*pair.first()?, *pair.get(1)?))).unzip()
        };
        let found = self.values.len() as u64;
        if found != layout.count {
            return Err(UffProblem::Count { line, announced: layout.count, found });
        }
        Ok(())
    }

    /// Whether it is a real function of time.
    pub(super) fn is_time_response(&self) -> bool {
        let over_time = matches!(self.abscissa_type, units::TIME | 0);
        let kind = self.kind == TIME_RESPONSE || (self.kind == GENERAL && self.abscissa_type == units::TIME);
        kind && over_time && !self.complex
    }

    /// What kind of function it is, for messages.
    pub(super) fn kind(&self) -> String {
        let name = match self.kind {
            0 => "general",
            1 => "time response",
            2 => "auto spectrum",
            3 => "cross spectrum",
            4 => "frequency response",
            5 => "transmissibility",
            6 => "coherence",
            12 => "spectrum",
            _ => "other",
        };
        let complex = if self.complex { ", complex" } else { "" };
        format!("{name} (type {}{complex})", self.kind)
    }

    fn unit(&self, si: bool) -> Option<String> {
        let by_type = || if si { units::si_unit(self.data_type).map(str::to_owned) } else { None };
        units::of_label(&self.label).or_else(by_type)
    }

    /// The column's name: the title where it is one, else made of quantity, node and direction. `si` says
    /// that the file's units are SI, which stands in for a missing unit label.
    pub(super) fn column_name(&self, si: bool) -> Option<String> {
        let unit = self.unit(si)?;
        let plain = self.title.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
        if plain && unit_of(&self.title) == Some(unit.as_str()) {
            return Some(self.title.clone());
        }
        let quantity = units::quantity(self.data_type);
        Some(format!("{quantity}_{}{}_{unit}", self.node, units::direction(self.direction)))
    }

    /// What it is, for messages.
    pub(super) fn description(&self) -> String {
        let label = if self.label.is_empty() { "no unit label" } else { self.label.as_str() };
        let direction = units::direction(self.direction).replace('_', " ");
        let quantity = units::quantity(self.data_type);
        format!("{quantity}, node {}{direction}, {}, {} values", self.node, shorten(label), self.values.len())
    }
}

/// The values as text: up to the line `-1`.
fn text_numbers(lines: &mut Lines<'_>, layout: &Layout, complex: bool) -> Result<Vec<f64>, UffProblem> {
    let widths: &[usize] = match (layout.double, layout.even, complex) {
        (false, ..) => &[13],
        (true, true, _) => &[20],
        (true, false, false) => &[13, 20],
        (true, false, true) => &[13, 20, 20],
    };
    let mut numbers = Vec::new();
    loop {
        let text = lines.next().ok_or(UffProblem::Ends { line: lines.line, what: "a function's values" })?;
        if is_delimiter(&text) {
            return Ok(numbers);
        }
        let found = || UffProblem::Field { line: lines.line, what: "line of values", found: shorten(&text) };
        numbers.extend(reals(&text, widths).ok_or_else(found)?);
    }
}

/// The values of a data set 58b, and the line `-1` after them.
fn binary_numbers(
    lines: &mut Lines<'_>,
    binary: Binary,
    layout: &Layout,
    complex: bool,
) -> Result<Vec<f64>, UffProblem> {
    let ends = |line| UffProblem::Ends { line, what: "a function's binary values" };
    let wide = if layout.double { 8 } else { 4 };
    let values = if complex { 2 } else { 1 };
    let mut layouts = vec![vec![wide]];
    if !layout.even {
        // Abscissas are single precision by the format's definition; some write them double.
        layouts = vec![[vec![wide], vec![wide; values]].concat(), [vec![4], vec![wide; values]].concat()];
    }
    let count = usize::try_from(layout.count).unwrap_or(usize::MAX);
    let size = |widths: &Vec<usize>| {
        let numbers = if layout.even { values } else { 1 };
        count.saturating_mul(numbers * widths.iter().sum::<usize>())
    };
    // The number of bytes in the header is wrong in some programs' files; what follows decides.
    let fits = |size: usize| lines.clone().take(size).is_some_and(|_| lines.delimiter_follows(size));
    let widths = layouts.iter().find(|widths| size(widths) == binary.bytes && fits(size(widths)));
    let widths = widths.or_else(|| layouts.iter().find(|widths| fits(size(widths))));
    let Some(widths) = widths else {
        return Err(if fits(binary.bytes) {
            let per_value = layouts.first().map_or(1, |widths| widths.iter().sum::<usize>());
            let found = (binary.bytes / per_value) as u64;
            UffProblem::Count { line: lines.line, announced: layout.count, found }
        } else {
            ends(lines.line)
        });
    };
    let mut rest = lines.take(size(widths)).ok_or_else(|| ends(lines.line))?;
    let mut numbers = Vec::new();
    for width in widths.iter().cycle() {
        match rest.split_at_checked(*width) {
            Some((head, tail)) => {
                numbers.push(float(head, binary.little_endian));
                rest = tail;
            }
            None => break,
        }
    }
    while let Some(text) = lines.next() {
        if is_delimiter(&text) {
            return Ok(numbers);
        }
    }
    Err(ends(lines.line))
}

fn float(bytes: &[u8], little_endian: bool) -> f64 {
    let mut ordered = [0_u8; 8];
    for (index, place) in ordered.iter_mut().take(bytes.len()).enumerate() {
        let from = if little_endian { index } else { bytes.len() - 1 - index };
        *place = bytes.get(from).copied().unwrap_or(0);
    }
    if bytes.len() == 4 {
        let [a, b, c, d, ..] = ordered;
        f64::from(f32::from_le_bytes([a, b, c, d]))
    } else {
        f64::from_le_bytes(ordered)
    }
}
