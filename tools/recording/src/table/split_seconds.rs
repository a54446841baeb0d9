//! Times in two columns: whole seconds, and what is left of them (`secs` and `nsecs`, `sec` and `usec`).

use super::assemble::Table;
use crate::unit_label::{of_label, seconds};

/// The two columns of such a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SplitSeconds {
    pub(super) whole: usize,
    pub(super) fraction: usize,
    /// Seconds per unit of the fraction.
    pub(super) scale: f64,
}

impl SplitSeconds {
    /// Seconds after the first whole second.
    pub(super) fn joined(&self, table: &Table) -> Vec<f64> {
        let of = |at: usize| table.columns.get(at).map(Vec::as_slice).unwrap_or_default();
        let first = of(self.whole).first().copied().unwrap_or(0.0);
        of(self.whole)
            .iter()
            .zip(of(self.fraction))
            .map(|(whole, part)| whole - first + part * self.scale)
            .collect()
    }
}

/// The pair of columns that is such a time: by their names, which differ in the unit alone, and by what they
/// hold.
pub(super) fn find(table: &Table) -> Option<SplitSeconds> {
    let named: Vec<(usize, String, f64)> = table
        .headings
        .iter()
        .enumerate()
        .filter_map(|(at, heading)| {
            let (stem, scale) = stem_and_scale(&heading.source)?;
            Some((at, stem, scale))
        })
        .collect();
    let whole_seconds = named.iter().filter(|(_, _, scale)| *scale == 1.0);
    whole_seconds.filter(|(at, ..)| values(table, *at).all(|value| value.fract() == 0.0)).find_map(
        |(whole, stem, _)| {
            let part = named.iter().find(|(at, other, scale)| {
                *scale < 1.0
                    && other == stem
                    && values(table, *at).all(|value| (0.0..1.0).contains(&(value * scale)))
            })?;
            let has_rows = !table.is_empty_column(*whole) && !table.is_empty_column(part.0);
            has_rows.then_some(SplitSeconds { whole: *whole, fraction: part.0, scale: part.2 })
        },
    )
}

fn values(table: &Table, at: usize) -> impl Iterator<Item = f64> {
    table.columns.get(at).into_iter().flatten().copied()
}

/// What stands before the unit of time at the end of a name, and that unit in seconds.
fn stem_and_scale(source: &str) -> Option<(String, f64)> {
    let source = source.trim_start_matches(['#', '%', ' ']).trim_end_matches([']', ')']);
    let at = source.rfind(|c: char| !c.is_alphanumeric()).map_or(0, |at| at + 1);
    let (stem, word) = (source.get(..at)?, source.get(at..)?);
    let scale = of_label(word).as_deref().and_then(seconds).filter(|scale| *scale <= 1.0)?;
    Some((stem.to_lowercase(), scale))
}
