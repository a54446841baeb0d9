//! A column of a tall matrix that is zero outside one run of rows.
//!
//! The free response of one of several recordings has nothing in the rows of the others, and a mode that has
//! decayed to rounding has nothing in the rest of its record: what is known to be zero is not computed with.

use std::ops::Range;

use crate::tall::{add_scaled, dot};

/// The rows `start..start + values.len()`; all others are zero.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Column {
    /// First row that is kept.
    pub(crate) start: usize,
    /// The rows from there on.
    pub(crate) values: Vec<f64>,
}

impl From<Vec<f64>> for Column {
    fn from(values: Vec<f64>) -> Self {
        Self { start: 0, values }
    }
}

impl Column {
    pub(crate) fn rows(&self) -> Range<usize> {
        self.start..self.start + self.values.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The part of a dense vector, or of as much of one as there is, in this column's rows.
    fn part<'v>(&self, vector: &'v [f64]) -> &'v [f64] {
        let end = self.rows().end.min(vector.len());
        &vector[self.start.min(end)..end]
    }

    /// Inner product with a dense vector.
    pub(crate) fn dot_dense(&self, vector: &[f64]) -> f64 {
        dot(&self.values, self.part(vector))
    }

    /// Inner product.
    pub(crate) fn dot(&self, other: &Self) -> f64 {
        let shared = self.shared(other);
        if shared.is_empty() { 0.0 } else { dot(self.slice(&shared), other.slice(&shared)) }
    }

    /// `target += factor * self`.
    pub(crate) fn add_to(&self, target: &mut [f64], factor: f64) {
        let end = self.rows().end.min(target.len());
        add_scaled(&mut target[self.start.min(end)..end], factor, &self.values);
    }

    /// `self += factor * other`, grown to the rows of both.
    pub(crate) fn add(&mut self, factor: f64, other: &Self) {
        if other.is_empty() {
            return;
        }
        self.grow(other.rows());
        let from = other.start - self.start;
        add_scaled(&mut self.values[from..from + other.values.len()], factor, &other.values);
    }

    /// All rows of a matrix of that height.
    #[cfg(test)]
    pub(crate) fn to_dense(&self, height: usize) -> Vec<f64> {
        let mut dense = vec![0.0; height];
        self.add_to(&mut dense, 1.0);
        dense
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.values.iter().all(|value| value.is_finite())
    }

    fn shared(&self, other: &Self) -> Range<usize> {
        self.start.max(other.start)..self.rows().end.min(other.rows().end)
    }

    fn slice(&self, rows: &Range<usize>) -> &[f64] {
        &self.values[rows.start - self.start..rows.end - self.start]
    }

    fn grow(&mut self, rows: Range<usize>) {
        if self.is_empty() {
            *self = Self { start: rows.start, values: vec![0.0; rows.len()] };
            return;
        }
        if rows.start < self.start {
            let missing = self.start - rows.start;
            self.values.splice(0..0, std::iter::repeat_n(0.0, missing));
            self.start = rows.start;
        }
        if rows.end > self.rows().end {
            self.values.resize(rows.end - self.start, 0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_with_gaps_behave_as_dense_ones() {
        let a = Column { start: 2, values: vec![1.0, 2.0, 3.0] };
        let b = Column { start: 4, values: vec![5.0, 7.0] };
        let apart = Column { start: 7, values: vec![1.0] };
        assert_eq!(a.dot(&b), 15.0);
        assert_eq!(a.dot(&apart), 0.0);
        assert_eq!(a.dot_dense(&[1.0; 8]), 6.0);
        let mut sum = b.clone();
        sum.add(2.0, &a);
        assert_eq!(sum, Column { start: 2, values: vec![2.0, 4.0, 11.0, 7.0] });
        sum.add(1.0, &apart);
        assert_eq!(sum.to_dense(9), [0.0, 0.0, 2.0, 4.0, 11.0, 7.0, 0.0, 1.0, 0.0]);
        let mut empty = Column::default();
        empty.add(3.0, &b);
        assert_eq!(empty, Column { start: 4, values: vec![15.0, 21.0] });
    }
}
