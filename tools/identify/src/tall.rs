//! Long columns and few of them: inner products and an orthonormal basis that grows column by column.

use nalgebra::DMatrix;

use crate::column::Column;

/// Inner product, summed in eight lanes so that the compiler may vectorise it.
pub fn dot(left: &[f64], right: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    let mut left_chunks = left.chunks_exact(8);
    let mut right_chunks = right.chunks_exact(8);
    for (l, r) in left_chunks.by_ref().zip(right_chunks.by_ref()) {
        for ((lane, l), r) in lanes.iter_mut().zip(l).zip(r) {
            *lane += l * r;
        }
    }
    let rest = left_chunks.remainder().iter().zip(right_chunks.remainder());
    lanes.iter().sum::<f64>() + rest.map(|(l, r)| l * r).sum::<f64>()
}

/// `target += factor * column`.
pub fn add_scaled(target: &mut [f64], factor: f64, column: &[f64]) {
    for (value, c) in target.iter_mut().zip(column) {
        *value += factor * c;
    }
}

/// Inner products of all pairs of columns.
pub(crate) fn gram(columns: &[Column]) -> DMatrix<f64> {
    let mut products = DMatrix::zeros(columns.len(), columns.len());
    for (i, left) in columns.iter().enumerate() {
        for (j, right) in columns.iter().enumerate().take(i + 1) {
            products[(i, j)] = left.dot(right);
        }
    }
    products.fill_upper_triangle_with_lower_triangle();
    products
}

/// Below this share of its length a column counts as a combination of the columns before it.
const DEPENDENT: f64 = 1e-10;

/// An orthonormal basis of the columns pushed so far, with the triangular factor that relates the two.
///
/// Push columns with few rows first: a direction has the rows of all columns before it that it meets.
#[derive(Debug, Clone, Default)]
pub struct Orthonormal {
    /// The basis; a dependent column leaves an empty one.
    directions: Vec<Column>,
    /// For every pushed column: its components along all directions up to its own.
    triangle: Vec<Vec<f64>>,
}

impl Orthonormal {
    /// Adds a column by Gram-Schmidt, repeated where cancellation made the first pass inexact.
    pub fn push(&mut self, column: impl Into<Column>) {
        let mut column = column.into();
        let length = column.dot(&column).sqrt();
        let mut components = vec![0.0; self.directions.len() + 1];
        let mut before = length;
        let mut after = length;
        for _ in 0..3 {
            for (direction, component) in self.directions.iter().zip(&mut components) {
                let along = direction.dot(&column);
                if along != 0.0 {
                    column.add(-along, direction);
                    *component += along;
                }
            }
            after = column.dot(&column).sqrt();
            if after > 0.5 * before {
                break;
            }
            before = after;
        }
        if after > DEPENDENT * length && after.is_finite() {
            column.values.iter_mut().for_each(|value| *value /= after);
            components[self.directions.len()] = after;
            self.directions.push(column);
        } else {
            self.directions.push(Column::default());
        }
        self.triangle.push(components);
    }

    /// The components of a column along the basis.
    pub(crate) fn components(&self, column: &Column) -> Vec<f64> {
        self.directions.iter().map(|direction| direction.dot(column)).collect()
    }

    /// Takes the part inside the span out of `vector`; returns the components.
    pub fn remove_from(&self, vector: &mut [f64]) -> Vec<f64> {
        let mut components = Vec::with_capacity(self.directions.len());
        for direction in &self.directions {
            let along = direction.dot_dense(vector);
            direction.add_to(vector, -along);
            components.push(along);
        }
        components
    }

    /// Takes the part inside the span out of a column.
    pub(crate) fn remove_from_column(&self, column: &mut Column) {
        for direction in &self.directions {
            let along = direction.dot(column);
            if along != 0.0 {
                column.add(-along, direction);
            }
        }
    }

    /// The basis in a range of rows, zeros where a direction has none.
    pub(crate) fn dense_part(&self, rows: std::ops::Range<usize>) -> Vec<Vec<f64>> {
        let directions = self.directions.iter().filter(|direction| !direction.is_empty());
        directions
            .map(|direction| {
                let mut part = vec![0.0; rows.end.max(direction.rows().end)];
                direction.add_to(&mut part, 1.0);
                part.truncate(rows.end);
                part.split_off(rows.start.min(part.len()))
            })
            .collect()
    }

    /// Coefficients of the pushed columns from the components; 0 for dependent columns.
    pub fn coefficients(&self, components: &[f64]) -> Vec<f64> {
        let mut remaining = components.to_vec();
        let mut coefficients = vec![0.0; remaining.len()];
        for (index, column) in self.triangle.iter().enumerate().rev() {
            let pivot = column[index];
            if pivot == 0.0 {
                continue;
            }
            let value = remaining[index] / pivot;
            coefficients[index] = value;
            for (rest, component) in remaining.iter_mut().zip(column) {
                *rest -= value * component;
            }
        }
        coefficients
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_of_nearly_parallel_columns_come_back() {
        let n = 1000;
        let x: Vec<f64> = (0..n).map(|k| f64::from(k) / f64::from(n)).collect();
        let columns: Vec<Vec<f64>> = (0..5).map(|p| x.iter().map(|x| x.powi(p)).collect()).collect();
        let wanted = [1.0, -2.0, 3.0, -4.0, 5.0];
        let mut target = vec![0.0; x.len()];
        let mut basis = Orthonormal::default();
        for (column, factor) in columns.into_iter().zip(wanted) {
            add_scaled(&mut target, factor, &column);
            basis.push(column);
        }
        let components = basis.remove_from(&mut target);
        for (found, wanted) in basis.coefficients(&components).iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-10, "{found} for {wanted}");
        }
        assert!(dot(&target, &target).sqrt() < 1e-12);
    }

    #[test]
    fn a_repeated_column_gets_no_coefficient_and_does_no_harm() {
        let column: Vec<f64> = (0..50).map(|k| f64::from(k).sin()).collect();
        let mut basis = Orthonormal::default();
        basis.push(column.clone());
        basis.push(column.clone());
        let mut target = column;
        let components = basis.remove_from(&mut target);
        let coefficients = basis.coefficients(&components);
        assert!((coefficients[0] - 1.0).abs() < 1e-12 && coefficients[1] == 0.0);
    }
}
