//! The transition of a state over a step, kept as the diagonal blocks that it consists of.
//!
//! In modal coordinates every mode moves for itself: two rows that know nothing of the others. The cost of a
//! step then grows with the number of modes and not with its square.

use std::ops::Range;

use crate::linear::dot;

/// A square matrix without what is zero beside its diagonal blocks.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Blocks {
    ranges: Vec<Range<usize>>,
    /// Block after block, each row by row.
    entries: Vec<f64>,
}

impl Blocks {
    /// From all entries, row by row.
    pub(crate) fn new(size: usize, entries: &[f64]) -> Self {
        let mut ranges = Vec::new();
        let mut start = 0;
        // The last row or column that something before it reaches.
        let mut reach = 0;
        for index in 0..size {
            let touches =
                |other: &usize| entries[index * size + other] != 0.0 || entries[other * size + index] != 0.0;
            reach = (index..size).rev().find(touches).unwrap_or(index).max(reach).max(index);
            if reach == index {
                ranges.push(start..index + 1);
                start = index + 1;
            }
        }
        let kept = ranges.iter().flat_map(|range| {
            let rows = range.clone().map(move |row| row * size + range.start..row * size + range.end);
            rows.flat_map(|row| entries[row].iter().copied())
        });
        Self { entries: kept.collect(), ranges }
    }

    /// Appends the product with `state` to `into`. A block in which nothing moves costs nothing.
    #[inline]
    pub(crate) fn times(&self, state: &[f64], into: &mut Vec<f64>) {
        let mut start = 0;
        for range in &self.ranges {
            let part = &state[range.clone()];
            let size = part.len();
            let entries = &self.entries[start..start + size * size];
            start += size * size;
            if let ([a, b, c, d], [x, y]) = (entries, part) {
                into.extend([a * x + b * y, c * x + d * y]);
            } else if part.iter().all(|value| *value == 0.0) {
                into.extend(part);
            } else {
                into.extend(entries.chunks_exact(size).map(|row| dot(row, part)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn product(size: usize, entries: &[f64], state: &[f64]) -> Vec<f64> {
        entries.chunks_exact(size).map(|row| dot(row, state)).collect()
    }

    #[test]
    fn blocks_do_what_the_whole_matrix_does_to_the_last_bit() {
        // Coupled through a corner far from the diagonal, a block of one, two of two.
        let size = 8;
        let mut entries = vec![0.0; size * size];
        let places =
            [(0, 0), (0, 1), (1, 0), (1, 1), (2, 2), (3, 3), (3, 5), (5, 3), (4, 4), (5, 5), (6, 7), (7, 6)];
        for (number, (row, column)) in (1..).zip(places) {
            entries[row * size + column] = 0.3 + f64::from(number);
        }
        let blocks = Blocks::new(size, &entries);
        assert_eq!(blocks.ranges, [0..2, 2..3, 3..6, 6..8]);
        for start in 0..size {
            let state: Vec<f64> =
                (0..size).map(|k| if k >= start { 1.0 + 0.7 * k as f64 } else { 0.0 }).collect();
            let mut found = Vec::new();
            blocks.times(&state, &mut found);
            let expected = product(size, &entries, &state);
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn one_coupling_across_all_makes_one_block() {
        let mut entries = vec![0.0; 25];
        (0..5).for_each(|k| entries[6 * k] = 1.0);
        assert_eq!(Blocks::new(5, &entries).ranges.len(), 5);
        entries[4] = 1e-300;
        assert_eq!(Blocks::new(5, &entries).ranges.len(), 1);
    }
}
