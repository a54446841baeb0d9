//! A system turned so that `(s − A) x = b` is solved in the order of n² for every `s`.

use nalgebra::linalg::{Hessenberg, balancing::balance_parlett_reinsch};
use nalgebra::{Complex, DMatrix, DVector};

use super::Matrices;

/// The same system in other states: balanced, and `A` zero below its first subdiagonal.
pub(super) struct Turned {
    pub(super) a: DMatrix<f64>,
    b: DVector<f64>,
    c: DMatrix<f64>,
}

impl Turned {
    pub(super) fn new(system: &Matrices) -> Self {
        let mut a = system.a.clone();
        let scale = balance_parlett_reinsch(&mut a);
        let b = system.b.component_div(&scale);
        let c = &system.c * DMatrix::from_diagonal(&scale);
        if a.nrows() < 2 {
            return Self { a, b, c };
        }
        let (turn, a) = Hessenberg::new(a).unpack();
        Self { a, b: turn.transpose() * b, c: c * turn }
    }

    /// `C (s − A)⁻¹ b`; `None` at a pole.
    pub(super) fn response(&self, s: Complex<f64>) -> Option<DVector<Complex<f64>>> {
        let state = self.solved(s, self.b.map(Complex::from))?;
        Some(self.c.map(Complex::from) * state)
    }

    /// Trace of `(s − A)⁻¹`: the sum of `1 / (s − pole)` over all poles.
    pub(super) fn trace(&self, s: Complex<f64>) -> Option<Complex<f64>> {
        let size = self.a.nrows();
        let mut sum = Complex::from(0.0);
        for index in 0..size {
            let mut unit = DVector::from_element(size, Complex::from(0.0));
            unit[index] = Complex::from(1.0);
            sum += self.solved(s, unit)?[index];
        }
        Some(sum)
    }

    /// Gaussian elimination with row exchanges, two rows at a time.
    fn solved(&self, s: Complex<f64>, mut right: DVector<Complex<f64>>) -> Option<DVector<Complex<f64>>> {
        let size = self.a.nrows();
        let mut rows = self.a.map(|entry| Complex::from(-entry));
        for index in 0..size {
            rows[(index, index)] += s;
        }
        for pivot in 0..size.saturating_sub(1) {
            if rows[(pivot + 1, pivot)].norm_sqr() > rows[(pivot, pivot)].norm_sqr() {
                rows.swap_rows(pivot, pivot + 1);
                right.swap_rows(pivot, pivot + 1);
            }
            let factor = rows[(pivot + 1, pivot)] / rows[(pivot, pivot)];
            for column in pivot..size {
                let taken = factor * rows[(pivot, column)];
                rows[(pivot + 1, column)] -= taken;
            }
            let taken = factor * right[pivot];
            right[pivot + 1] -= taken;
        }
        for row in (0..size).rev() {
            let known: Complex<f64> = (row + 1..size).map(|column| rows[(row, column)] * right[column]).sum();
            right[row] = (right[row] - known) / rows[(row, row)];
        }
        right.iter().all(|entry| entry.is_finite()).then_some(right)
    }
}
