//! Fits of models that are linear in most of their parameters: variable projection.
//!
//! For every trial of the few non-linear parameters the linear ones are solved for, so that the search only
//! sees the non-linear ones. The Jacobian is Kaufman's: the model's tangents with the span of the linear
//! columns taken out. L. Kaufman, BIT 15 (1975) 49; G. Golub, V. Pereyra, Inverse Problems 19 (2003) R1.

use nalgebra::DMatrix;

use crate::levenberg_marquardt::{LeastSquares, Minimum, Parameter, minimise};
use crate::robust_covariance::covariance;
use crate::tall::{Orthonormal, add_scaled};

/// Step of the central differences, in the coordinates of the search.
const DIFFERENCE: f64 = 1e-6;

/// A model `target = sum of coefficient * column`, whose columns come in blocks (one per mode, say) and
/// depend on non-linear parameters.
pub(crate) trait Separable {
    /// What the columns are fitted to.
    fn target(&self, parameters: &[f64]) -> Vec<f64>;
    /// How many blocks there are.
    fn blocks(&self) -> usize;
    /// The columns of one block; all blocks' columns in order are the model's columns.
    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Vec<f64>>;
    /// Whether a block's columns depend on a parameter.
    fn depends(&self, block: usize, parameter: usize) -> bool;
    /// Derivatives of a block's columns with respect to a parameter it depends on, where they are had for
    /// less than by differences.
    fn block_derivatives(
        &self,
        _block: usize,
        _parameter: usize,
        _parameters: &[f64],
    ) -> Option<Vec<Vec<f64>>> {
        None
    }
    /// Whether the target depends on a parameter.
    fn target_depends(&self, _parameter: usize) -> bool {
        false
    }
}

/// An evaluated trial.
#[derive(Debug, Clone)]
pub(crate) struct Projected {
    basis: Orthonormal,
    /// Sizes of the blocks.
    sizes: Vec<usize>,
    /// Linear coefficients, all blocks in order.
    pub(crate) coefficients: Vec<f64>,
    /// Target minus model.
    pub(crate) residuals: Vec<f64>,
}

struct Projection<'m, M>(&'m M);

impl<M: Separable> Projection<'_, M> {
    /// Derivative of the model with respect to one parameter, the coefficients held (minus the target's).
    fn tangent(&self, index: usize, parameters: &[f64], point: &Projected) -> Vec<f64> {
        let mut tangent = vec![0.0; point.residuals.len()];
        if !self.0.target_depends(index)
            && let Some(exact) = self.exact_tangent(index, parameters, point)
        {
            return exact;
        }
        for side in [1.0, -1.0] {
            let mut moved = parameters.to_vec();
            moved[index] += side * DIFFERENCE;
            let factor = side / (2.0 * DIFFERENCE);
            let mut coefficients = point.coefficients.as_slice();
            for (block, &size) in point.sizes.iter().enumerate() {
                let (own, rest) = coefficients.split_at(size);
                coefficients = rest;
                if self.0.depends(block, index) {
                    for (column, coefficient) in self.0.block(block, &moved).iter().zip(own) {
                        add_scaled(&mut tangent, factor * coefficient, column);
                    }
                }
            }
            if self.0.target_depends(index) {
                add_scaled(&mut tangent, -factor, &self.0.target(&moved));
            }
        }
        tangent
    }
}

impl<M: Separable> Projection<'_, M> {
    /// The tangent by the model's own derivatives, if it has them for every block that depends.
    fn exact_tangent(&self, index: usize, parameters: &[f64], point: &Projected) -> Option<Vec<f64>> {
        let mut tangent = vec![0.0; point.residuals.len()];
        let mut coefficients = point.coefficients.as_slice();
        for (block, &size) in point.sizes.iter().enumerate() {
            let (own, rest) = coefficients.split_at(size);
            coefficients = rest;
            if self.0.depends(block, index) {
                let derivatives = self.0.block_derivatives(block, index, parameters)?;
                for (column, coefficient) in derivatives.iter().zip(own) {
                    add_scaled(&mut tangent, *coefficient, column);
                }
            }
        }
        Some(tangent)
    }
}

impl<M: Separable> LeastSquares for Projection<'_, M> {
    type Point = Projected;

    fn at(&self, parameters: &[f64]) -> Option<Projected> {
        let mut basis = Orthonormal::default();
        let mut sizes = Vec::with_capacity(self.0.blocks());
        for block in 0..self.0.blocks() {
            let columns = self.0.block(block, parameters);
            sizes.push(columns.len());
            for column in columns {
                if !column.iter().all(|value| value.is_finite()) {
                    return None;
                }
                basis.push(column);
            }
        }
        let mut residuals = self.0.target(parameters);
        let components = basis.remove_from(&mut residuals);
        let coefficients = basis.coefficients(&components);
        Some(Projected { basis, sizes, coefficients, residuals })
    }

    fn residuals<'p>(&self, point: &'p Projected) -> &'p [f64] {
        &point.residuals
    }

    fn jacobian(&self, parameters: &[f64], point: &Projected) -> Vec<Vec<f64>> {
        let mut tangents: Vec<Vec<f64>> =
            (0..parameters.len()).map(|index| self.tangent(index, parameters, point)).collect();
        point.basis.remove_from_all(&mut tangents);
        tangents.iter_mut().flatten().for_each(|value| *value = -*value);
        tangents
    }
}

/// Fits the model; `None` when it cannot be evaluated at the start.
pub(crate) fn fit<M: Separable>(model: &M, parameters: &[Parameter]) -> Option<Minimum<Projected>> {
    minimise(&Projection(model), parameters)
}

/// Robust covariance of the non-linear parameters and then all coefficients.
///
/// `None` when the parameters cannot be told apart.
pub(crate) fn fit_covariance<M: Separable>(model: &M, minimum: &Minimum<Projected>) -> Option<DMatrix<f64>> {
    let projection = Projection(model);
    let at = &minimum.parameters;
    let tangents = (0..at.len()).map(|index| projection.tangent(index, at, &minimum.point));
    let columns = (0..model.blocks()).flat_map(|block| model.block(block, at));
    let jacobian: Vec<Vec<f64>> = tangents.chain(columns).collect();
    covariance(&jacobian, &minimum.point.residuals)
}
