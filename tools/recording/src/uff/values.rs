//! The values of a data set 58, as text or binary.

use super::error::UffProblem;
use super::fortran::{real, reals};
use super::lines::{Lines, is_delimiter};
use crate::recording::shorten;

/// How the values of a data set 58b are stored.
#[derive(Debug, Clone, Copy)]
pub(super) struct Binary {
    pub(super) little_endian: bool,
    pub(super) bytes: usize,
}

/// Records 6 and 7: how many values, of what width, at which abscissas.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    pub(super) double: bool,
    pub(super) complex: bool,
    pub(super) even: bool,
    pub(super) count: u64,
    pub(super) start: f64,
    pub(super) step: f64,
}

impl Layout {
    /// Numbers per value, the abscissa among them where it is written.
    pub(super) fn numbers_per_value(&self) -> usize {
        usize::from(self.complex) + 1 + usize::from(!self.even)
    }
}

/// Numbers in file order, and whether the file ended before their end.
pub(super) struct Numbers {
    pub(super) numbers: Vec<f64>,
    pub(super) cut: bool,
}

/// The values as text: up to the line `-1`, or to the end of a file that lacks it.
pub(super) fn text_numbers(lines: &mut Lines<'_>, layout: &Layout) -> Result<Numbers, UffProblem> {
    let widths: &[usize] = match (layout.double, layout.even, layout.complex) {
        (false, ..) => &[13],
        (true, true, _) => &[20],
        (true, false, false) => &[13, 20],
        (true, false, true) => &[13, 20, 20],
    };
    let all = usize::try_from(layout.count).unwrap_or(usize::MAX).saturating_mul(layout.numbers_per_value());
    let mut numbers = Vec::new();
    while let Some(text) = lines.next() {
        if is_delimiter(&text) {
            // A file that was cut may end in a number that begins like the end of a data set.
            let cut = lines.ended_open() && numbers.len() < all;
            return Ok(Numbers { numbers, cut });
        }
        match reals(&text, widths) {
            Some(more) if lines.at_end() && numbers.len() + more.len() < all => {
                // The last number of a cut file may lack digits.
                numbers.extend(more.iter().take(more.len().saturating_sub(1)));
            }
            Some(more) => numbers.extend(more),
            None if lines.at_end() => {
                let words = text.split_ascii_whitespace();
                let whole = text.split_ascii_whitespace().count().saturating_sub(1);
                numbers.extend(words.take(whole).map_while(real));
            }
            None => {
                let found = shorten(&text);
                return Err(UffProblem::Field { line: lines.line, what: "line of values", found });
            }
        }
    }
    Ok(Numbers { numbers, cut: true })
}

/// The values of a data set 58b, and the line `-1` after them.
pub(super) fn binary_numbers(
    lines: &mut Lines<'_>,
    binary: Binary,
    layout: &Layout,
) -> Result<Numbers, UffProblem> {
    let wide = if layout.double { 8 } else { 4 };
    let values = usize::from(layout.complex) + 1;
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
    if let Some(widths) = widths {
        let bytes = lines.take(size(widths)).unwrap_or(&[]);
        let numbers = floats(bytes, widths, binary.little_endian);
        while let Some(text) = lines.next() {
            if is_delimiter(&text) {
                break;
            }
        }
        return Ok(Numbers { numbers, cut: false });
    }
    if fits(binary.bytes) {
        let per_value = layouts.first().map_or(1, |widths| widths.iter().sum::<usize>());
        let found = (binary.bytes / per_value) as u64;
        return Err(UffProblem::Count { line: lines.line, announced: layout.count, found });
    }
    // Without its last line, or cut before: the bytes that are there, if they cannot be those of something
    // else.
    let widths = layouts.iter().find(|widths| size(widths) == binary.bytes).or(layouts.first());
    let line = lines.line;
    match widths {
        Some(widths) if !lines.clone().any_delimiter() => {
            let bytes = lines.rest();
            let bytes = bytes.get(..size(widths)).unwrap_or(bytes);
            Ok(Numbers { numbers: floats(bytes, widths, binary.little_endian), cut: true })
        }
        _ => Err(UffProblem::Ends { line, what: "a function's binary values" }),
    }
}

fn floats(mut bytes: &[u8], widths: &[usize], little_endian: bool) -> Vec<f64> {
    let mut numbers = Vec::new();
    for width in widths.iter().cycle() {
        match bytes.split_at_checked(*width) {
            Some((head, tail)) => {
                numbers.push(float(head, little_endian));
                bytes = tail;
            }
            None => break,
        }
    }
    numbers
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
