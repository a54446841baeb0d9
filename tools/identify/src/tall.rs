//! Long columns and few of them: inner products and an orthonormal basis that grows column by column.

use nalgebra::DMatrix;

/// Inner product, summed in eight lanes so that the compiler may vectorise it.
pub(crate) fn dot(left: &[f64], right: &[f64]) -> f64 {
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
pub(crate) fn add_scaled(target: &mut [f64], factor: f64, column: &[f64]) {
    for (value, c) in target.iter_mut().zip(column) {
        *value += factor * c;
    }
}

/// Rows of a block: a few dozen columns of them fit the second-level cache.
const BLOCK_ROWS: usize = 1024;

/// Inner products of all pairs of columns, row by row of the lower triangle.
pub(crate) fn gram(columns: &[Vec<f64>]) -> DMatrix<f64> {
    let rows = columns.first().map_or(0, Vec::len);
    let mut products = DMatrix::zeros(columns.len(), columns.len());
    for start in (0..rows).step_by(BLOCK_ROWS) {
        let block = start..(start + BLOCK_ROWS).min(rows);
        for (i, left) in columns.iter().enumerate() {
            for (j, right) in columns.iter().enumerate().take(i + 1) {
                products[(i, j)] += dot(&left[block.clone()], &right[block.clone()]);
            }
        }
    }
    products.fill_upper_triangle_with_lower_triangle();
    products
}

/// Below this share of its length a column counts as a combination of the columns before it.
const DEPENDENT: f64 = 1e-10;

/// An orthonormal basis of the columns pushed so far, with the triangular factor that relates the two.
#[derive(Debug, Clone, Default)]
pub(crate) struct Orthonormal {
    /// The basis; a dependent column leaves an empty one.
    directions: Vec<Vec<f64>>,
    /// For every pushed column: its components along all directions up to its own.
    triangle: Vec<Vec<f64>>,
}

impl Orthonormal {
    /// Adds a column by Gram-Schmidt, repeated where cancellation made the first pass inexact.
    pub(crate) fn push(&mut self, mut column: Vec<f64>) {
        let length = dot(&column, &column).sqrt();
        let mut components = vec![0.0; self.directions.len() + 1];
        let mut before = length;
        let mut after = length;
        for _ in 0..3 {
            for (direction, component) in self.directions.iter().zip(&mut components) {
                if !direction.is_empty() {
                    let along = dot(direction, &column);
                    add_scaled(&mut column, -along, direction);
                    *component += along;
                }
            }
            after = dot(&column, &column).sqrt();
            if after > 0.5 * before {
                break;
            }
            before = after;
        }
        if after > DEPENDENT * length && after.is_finite() {
            column.iter_mut().for_each(|value| *value /= after);
            components[self.directions.len()] = after;
            self.directions.push(column);
        } else {
            self.directions.push(Vec::new());
        }
        self.triangle.push(components);
    }

    /// Takes the part inside the span out of `vector`; returns the components.
    pub(crate) fn remove_from(&self, vector: &mut [f64]) -> Vec<f64> {
        let mut components = Vec::with_capacity(self.directions.len());
        for direction in &self.directions {
            let along = dot(direction, vector);
            add_scaled(vector, -along, direction);
            components.push(along);
        }
        components
    }

    /// Takes the part inside the span out of many vectors at once, in blocks of rows that stay in the cache.
    pub(crate) fn remove_from_all(&self, vectors: &mut [Vec<f64>]) {
        let rows = vectors.first().map_or(0, Vec::len);
        let blocks = || (0..rows).step_by(BLOCK_ROWS).map(|start| start..(start + BLOCK_ROWS).min(rows));
        let directions: Vec<&Vec<f64>> = self.directions.iter().filter(|d| !d.is_empty()).collect();
        let mut components = vec![vec![0.0; directions.len()]; vectors.len()];
        for block in blocks() {
            for (vector, components) in vectors.iter().zip(&mut components) {
                for (direction, component) in directions.iter().zip(components) {
                    *component += dot(&direction[block.clone()], &vector[block.clone()]);
                }
            }
        }
        for block in blocks() {
            for (vector, components) in vectors.iter_mut().zip(&components) {
                for (direction, component) in directions.iter().zip(components) {
                    add_scaled(&mut vector[block.clone()], -component, &direction[block.clone()]);
                }
            }
        }
    }

    /// Coefficients of the pushed columns from the components; 0 for dependent columns.
    pub(crate) fn coefficients(&self, components: &[f64]) -> Vec<f64> {
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
