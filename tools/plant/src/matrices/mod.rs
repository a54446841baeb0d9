//! Matrices and transfer functions as modes: the same behaviour from input to outputs, in the form that files
//! of kind "modal" have.
//!
//! ```text
//! x' = A x + b u,  y = C x + d u      becomes      y_j = Σ poles residue_j / (s − pole) + d_j
//! ```
//!
//! Poles come from the balanced matrix, residues from contour integrals of `C (s − A)⁻¹ b` around each
//! pole (`residues`), so that poles that coincide need no eigenvectors. A pair of poles is a mode, a real
//! pole a lag, poles at zero are a free motion (`modal_form`). What comes out is compared with what went in
//! before it is used.

mod continuous;
mod hessenberg;
mod modal_form;
mod poles;
mod problem;
mod residues;
mod transfer_function;

use nalgebra::{Complex, DMatrix, DVector};

pub(crate) use continuous::continuous;
pub(crate) use modal_form::{IN_PHASE, IN_PHASE_OF_POLYNOMIALS, modal_form};
pub use problem::MatricesProblem;
pub(crate) use transfer_function::{Polynomials, of_polynomials};

/// States that a system may have.
pub(crate) const MOST_STATES: usize = 100;

/// A linear system of one input.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Matrices {
    /// `A`, n by n.
    pub(crate) a: DMatrix<f64>,
    /// The input's column of `B`, n.
    pub(crate) b: DVector<f64>,
    /// `C`, outputs by n.
    pub(crate) c: DMatrix<f64>,
    /// The input's column of `D`, one per output.
    pub(crate) d: DVector<f64>,
}

impl Matrices {
    /// What a steady input `e^(s t)` gives at the outputs, per unit, the feedthrough left out; `None` at a
    /// pole.
    fn response_without_feedthrough(&self, s: Complex<f64>) -> Option<DVector<Complex<f64>>> {
        let size = self.a.nrows();
        let shifted = DMatrix::from_diagonal_element(size, size, s) - self.a.map(Complex::from);
        let state = shifted.lu().solve(&self.b.map(Complex::from))?;
        Some(self.c.map(Complex::from) * state)
    }
}
