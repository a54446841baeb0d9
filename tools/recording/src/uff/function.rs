//! One data set 58: its eleven header records and its values.

use super::error::UffProblem;
use super::fortran::{field, integer, real};
use super::lines::Lines;
use super::units;
use super::values::{Binary, Layout, Numbers, binary_numbers, text_numbers};
use crate::recording::shorten;
use crate::unit_label::of_label;

/// What an axis is: records 8 to 10.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    pub(super) data_type: i64,
    pub(super) label: String,
    pub(super) unit_label: String,
}

/// A degree of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Freedom {
    pub(super) node: i64,
    pub(super) direction: i64,
}

impl Freedom {
    /// Its part of a name, such as `_3_z`.
    pub(super) fn suffix(self) -> String {
        format!("_{}{}", self.node, units::direction(self.direction))
    }
}

/// A function as the file has it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Function {
    /// Line at which it begins.
    pub(super) line: u64,
    /// First identification line.
    pub(super) title: String,
    pub(super) kind: i64,
    pub(super) response: Freedom,
    pub(super) reference: Freedom,
    pub(super) abscissa: Axis,
    pub(super) ordinate: Axis,
    pub(super) denominator: Axis,
    pub(super) complex: bool,
    /// Abscissas in the file's unit.
    pub(super) places: Vec<f64>,
    /// Values, or their real parts.
    pub(super) values: Vec<f64>,
    /// Imaginary parts; empty where the values are real.
    pub(super) imaginary: Vec<f64>,
    /// How many values the header announced, where the file ended before them.
    pub(super) cut: Option<u64>,
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
        let layout = layout(record(7), line + 7)?;
        let int = |number: u64, from, width, what| {
            let text = field(record(number as usize), from, width);
            integer(text).ok_or_else(|| UffProblem::Field { line: line + number, what, found: shorten(text) })
        };
        // Nodes and directions are only used for the name, each after an entity's name.
        let freedom = |from| Freedom {
            node: integer(field(record(6), from, 10)).unwrap_or(0),
            direction: integer(field(record(6), from + 10, 4)).unwrap_or(0),
        };
        let mut function = Self {
            line,
            title: record(1).trim().to_owned(),
            kind: int(6, 0, 5, "function type")?,
            response: freedom(41),
            reference: freedom(66),
            abscissa: axis(record(8), int(8, 0, 10, "abscissa's data type")?),
            ordinate: axis(record(9), int(9, 0, 10, "ordinate's data type")?),
            denominator: axis(record(10), integer(field(record(10), 0, 10)).unwrap_or(0)),
            complex: layout.complex,
            places: Vec::new(),
            values: Vec::new(),
            imaginary: Vec::new(),
            cut: None,
        };
        let numbers = match binary {
            Some(binary) => binary_numbers(lines, binary, &layout)?,
            None => text_numbers(lines, &layout)?,
        };
        function.place(numbers, &layout, line + 12)?;
        Ok(function)
    }

    /// Splits the numbers into abscissas and values.
    fn place(&mut self, found: Numbers, layout: &Layout, line: u64) -> Result<(), UffProblem> {
        let per_value = layout.numbers_per_value();
        let (values, rest) = (found.numbers.chunks_exact(per_value), found.numbers.len() % per_value);
        for (k, numbers) in values.enumerate() {
            let (place, value) = match (layout.even, numbers) {
                (true, value) => (layout.start + k as f64 * layout.step, value),
                (false, [place, value @ ..]) => (*place, value),
                (false, []) => continue,
            };
            self.places.push(place);
            self.values.extend(value.first());
            self.imaginary.extend(value.get(1));
        }
        let count = self.values.len() as u64;
        if found.cut && count < layout.count && count > 0 {
            self.cut = Some(layout.count);
        } else if count != layout.count || rest != 0 {
            return Err(UffProblem::Count { line, announced: layout.count, found: count });
        }
        Ok(())
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
            9 => "power spectral density",
            12 => "spectrum",
            _ => "other",
        };
        let complex = if self.complex { ", complex" } else { "" };
        format!("{name} (type {}{complex})", self.kind)
    }

    /// What it is, for messages.
    pub(super) fn description(&self) -> String {
        let label = &self.ordinate.unit_label;
        let label = if label.is_empty() { "no unit label" } else { label.as_str() };
        let direction = units::direction(self.response.direction).replace('_', " ");
        let quantity = units::quantity(self.ordinate.data_type);
        let node = self.response.node;
        format!("{quantity}, node {node}{direction}, {}, {} values", shorten(label), self.values.len())
    }
}

impl Axis {
    /// The unit as column names have it. `si` says that the file's units are SI, which stands in for a
    /// missing label.
    pub(super) fn unit(&self, si: bool) -> Option<String> {
        let by_type = || if si { units::si_unit(self.data_type).map(str::to_owned) } else { None };
        of_label(&self.unit_label).or_else(by_type)
    }
}

/// Columns of an axis' name.
const NAME_WIDTH: usize = 20;

/// An axis: its name stands in columns 27 to 46 and its unit in 48 to 67.
///
/// A writer that counts bytes puts the unit some characters to the left where the name holds others than
/// ASCII: the column between the two fields is blank in the counting that was meant.
fn axis(record: &str, data_type: i64) -> Axis {
    let more: usize = record.chars().take(46).map(|character| character.len_utf8() - 1).sum();
    let blank = |column: usize| field(record, column, 1).trim().is_empty();
    let shift = (0..=more.min(NAME_WIDTH)).find(|shift| blank(46 - shift)).unwrap_or(0);
    Axis {
        data_type,
        label: field(record, 26, NAME_WIDTH - shift).trim().to_owned(),
        unit_label: field(record, 47 - shift, 20).trim().to_owned(),
    }
}

/// Record 7.
fn layout(record: &str, line: u64) -> Result<Layout, UffProblem> {
    let int = |from, what| {
        let text = field(record, from, 10);
        integer(text).ok_or_else(|| UffProblem::Field { line, what, found: shorten(text) })
    };
    let (double, complex) = match int(0, "ordinate data type")? {
        2 => (false, false),
        4 => (true, false),
        5 => (false, true),
        6 => (true, true),
        other => {
            let what = "ordinate data type (2, 4, 5 or 6)";
            return Err(UffProblem::Field { line, what, found: other.to_string() });
        }
    };
    let number = |from, what| {
        let text = field(record, from, 13);
        let found = || UffProblem::Field { line, what, found: shorten(text) };
        if text.trim().is_empty() { Ok(0.0) } else { real(text).ok_or_else(found) }
    };
    Ok(Layout {
        double,
        complex,
        even: int(20, "abscissa spacing")? == 1,
        count: u64::try_from(int(10, "number of values")?).unwrap_or(0),
        start: number(30, "abscissa's minimum")?,
        step: number(43, "abscissa's increment")?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_of_any_characters_has_a_name_and_a_unit() {
        for character in ['x', 'µ', '加', '🎚'] {
            for count in 0..90 {
                let record: String = std::iter::repeat_n(character, count).collect();
                let axis = axis(&record, 8);
                assert!(axis.label.chars().count() <= NAME_WIDTH && axis.unit_label.chars().count() <= 20);
            }
        }
    }
}
