//! Keys and values that stand beside the rows, not above them: some oscilloscopes write them into the first
//! columns.

use super::cells::{Separator, Value, split, value};
use super::lines::{Lines, on_their_lines};

/// Lines that are looked at, and lines at their end in which nothing stands beside the rows any more.
const LOOKED_AT: usize = 120;
const BARE: usize = 30;

/// The rows without what stands beside the first of them, on the same lines; `None` where nothing does.
pub(super) fn without(text: &str) -> Option<String> {
    let separators = [b',', b';', b'\t'];
    let (separator, cut) =
        separators.into_iter().find_map(|separator| Some((separator, columns(text, separator)?)))?;
    let row = |line: &str| line.splitn(cut + 1, char::from(separator)).nth(cut).unwrap_or("").to_owned();
    Some(on_their_lines(text, row))
}

/// So many columns at the left hold something beside the first rows and nothing later, while the others hold
/// numbers all the way.
fn columns(text: &str, separator: u8) -> Option<usize> {
    let mut cells = Vec::new();
    let mut filled = Vec::new();
    let mut width = 0;
    let mut numeric_from = 0;
    for row in Lines::new(text).take(LOOKED_AT) {
        split(row.text, Separator::Byte(separator), &mut cells);
        if width == 0 {
            width = cells.len();
        }
        if cells.len() != width || width < 3 {
            return None;
        }
        let last_other = cells.iter().rposition(|cell| !cell.is_empty() && value(cell, false) == Value::Text);
        numeric_from = numeric_from.max(last_other.map_or(0, |at| at + 1));
        filled.push(cells.iter().map(|cell| !cell.is_empty()).collect::<Vec<bool>>());
    }
    let bare = filled.split_off(filled.len().checked_sub(BARE)?);
    let is_bare = |at: usize| bare.iter().all(|row| row.get(at) == Some(&false));
    let cut = (0..width).take_while(|at| is_bare(*at)).count();
    let was_filled = filled.iter().any(|row| row.iter().take(cut).any(|filled| *filled));
    let goes_on = filled.iter().chain(&bare).all(|row| row.get(cut) == Some(&true));
    (cut > 0 && cut < width && numeric_from <= cut && was_filled && goes_on).then_some(cut)
}
