//! Fits of models that are linear in most of their parameters: variable projection.
//!
//! For every trial of the few non-linear parameters the linear ones are solved for, so that the search only
//! sees the non-linear ones. The Jacobian is Kaufman's: the model's tangents with the span of the linear
//! columns taken out; only its inner products are ever formed.
//! L. Kaufman, BIT 15 (1975) 49; G. Golub, V. Pereyra, Inverse Problems 19 (2003) R1.

use nalgebra::{DMatrix, DVector};

use crate::column::Column;
use crate::levenberg_marquardt::{LeastSquares, Minimum, Parameter, minimise, minimise_to};
use crate::robust_covariance::covariance;
use crate::tall::{Orthonormal, gram};

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
    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Column>;
    /// Whether a block's columns depend on a parameter.
    fn depends(&self, block: usize, parameter: usize) -> bool;
    /// Derivatives of the sum of a block's columns times the coefficients, with respect to every parameter
    /// that the block depends on, by parameter. The columns are those that [`Separable::block`] gave.
    fn tangents(
        &self,
        block: usize,
        parameters: &[f64],
        _columns: &[Column],
        coefficients: &[f64],
    ) -> Vec<(usize, Column)> {
        let depends = (0..parameters.len()).filter(|&parameter| self.depends(block, parameter));
        depends
            .map(|parameter| {
                let mut tangent = Column::default();
                for side in [1.0, -1.0] {
                    let mut moved = parameters.to_vec();
                    moved[parameter] += side * DIFFERENCE;
                    for (column, coefficient) in self.block(block, &moved).iter().zip(coefficients) {
                        tangent.add(side * coefficient / (2.0 * DIFFERENCE), column);
                    }
                }
                (parameter, tangent)
            })
            .collect()
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
    /// Columns by block.
    pub(crate) blocks: Vec<Vec<Column>>,
    /// Linear coefficients, all blocks in order.
    pub(crate) coefficients: Vec<f64>,
    /// Target minus model.
    pub(crate) residuals: Vec<f64>,
}

struct Projection<'m, M>(&'m M);

impl<M: Separable> Projection<'_, M> {
    /// Derivatives of the model with respect to all parameters, the coefficients held (minus the target's).
    fn tangents(&self, parameters: &[f64], point: &Projected) -> Vec<Column> {
        let mut tangents = vec![Column::default(); parameters.len()];
        let mut coefficients = point.coefficients.as_slice();
        for (block, columns) in point.blocks.iter().enumerate() {
            let (own, rest) = coefficients.split_at(columns.len());
            coefficients = rest;
            for (parameter, tangent) in self.0.tangents(block, parameters, columns, own) {
                if tangents[parameter].is_empty() {
                    tangents[parameter] = tangent;
                } else {
                    tangents[parameter].add(1.0, &tangent);
                }
            }
        }
        for (parameter, tangent) in tangents.iter_mut().enumerate() {
            if self.0.target_depends(parameter) {
                for side in [1.0, -1.0] {
                    let mut moved = parameters.to_vec();
                    moved[parameter] += side * DIFFERENCE;
                    tangent.add(-side / (2.0 * DIFFERENCE), &self.0.target(&moved).into());
                }
            }
        }
        tangents
    }
}

impl<M: Separable> LeastSquares for Projection<'_, M> {
    type Point = Projected;

    fn at(&self, parameters: &[f64]) -> Option<Projected> {
        let blocks: Vec<Vec<Column>> =
            (0..self.0.blocks()).map(|block| self.0.block(block, parameters)).collect();
        let columns: Vec<&Column> = blocks.iter().flatten().collect();
        if !columns.iter().all(|column| column.is_finite()) {
            return None;
        }
        // Short columns first keep the basis short.
        let mut order: Vec<usize> = (0..columns.len()).collect();
        order.sort_by_key(|&index| columns[index].values.len());
        let mut basis = Orthonormal::default();
        order.iter().for_each(|&index| basis.push(columns[index].clone()));
        let mut residuals = self.0.target(parameters);
        let components = basis.remove_from(&mut residuals);
        let mut coefficients = vec![0.0; columns.len()];
        for (&index, coefficient) in order.iter().zip(basis.coefficients(&components)) {
            coefficients[index] = coefficient;
        }
        Some(Projected { basis, blocks, coefficients, residuals })
    }

    fn residuals<'p>(&self, point: &'p Projected) -> &'p [f64] {
        &point.residuals
    }

    /// With Q the basis and T the tangents, J = -(T - Q Q'T): J'J = T'T - (Q'T)'(Q'T), and since Q'r = 0, J'r
    /// = -T'r.
    fn curvature(&self, parameters: &[f64], point: &Projected) -> (DMatrix<f64>, DVector<f64>) {
        let tangents = self.tangents(parameters, point);
        let inside: Vec<Vec<f64>> = tangents.iter().map(|tangent| point.basis.components(tangent)).collect();
        let gradient = tangents.iter().map(|tangent| -tangent.dot_dense(&point.residuals));
        let gradient = DVector::from_iterator(tangents.len(), gradient);
        let mut curvature = gram(&tangents);
        for (i, left) in inside.iter().enumerate() {
            for (j, right) in inside.iter().enumerate() {
                curvature[(i, j)] -= crate::tall::dot(left, right);
            }
            curvature[(i, i)] = curvature[(i, i)].max(0.0);
        }
        (curvature, gradient)
    }
}

/// The span of a fit: its columns and its tangents, to which the residuals of the minimum are orthogonal.
pub(crate) fn span<M: Separable>(model: &M, minimum: &Minimum<Projected>) -> Orthonormal {
    let mut span = minimum.point.basis.clone();
    for tangent in Projection(model).tangents(&minimum.parameters, &minimum.point) {
        span.push(tangent);
    }
    span
}

/// What the model leaves at given parameters, the linear coefficients solved for; `None` where it cannot be
/// evaluated.
pub(crate) fn sum_of_squares_at<M: Separable>(model: &M, parameters: &[f64]) -> Option<f64> {
    let point = Projection(model).at(parameters)?;
    Some(crate::tall::dot(&point.residuals, &point.residuals))
}

/// The linear coefficients at given parameters; `None` where the model cannot be evaluated.
pub(crate) fn coefficients_at<M: Separable>(model: &M, parameters: &[f64]) -> Option<Vec<f64>> {
    Some(Projection(model).at(parameters)?.coefficients)
}

/// Fits the model; `None` when it cannot be evaluated at the start.
pub(crate) fn fit<M: Separable>(model: &M, parameters: &[Parameter]) -> Option<Minimum<Projected>> {
    minimise(&Projection(model), parameters)
}

/// Share of the sum of squares below which a step ends a fit that only has to be compared with others.
const ROUGH: f64 = 1e-5;

/// Fits the model as well as choosing among models needs; `None` when it cannot be evaluated at the start.
pub(crate) fn fit_roughly<M: Separable>(model: &M, parameters: &[Parameter]) -> Option<Minimum<Projected>> {
    minimise_to(&Projection(model), parameters, ROUGH)
}

/// Robust covariance of the non-linear parameters and then all coefficients.
///
/// `None` when the parameters cannot be told apart.
pub(crate) fn fit_covariance<M: Separable>(model: &M, minimum: &Minimum<Projected>) -> Option<DMatrix<f64>> {
    let mut jacobian = Projection(model).tangents(&minimum.parameters, &minimum.point);
    jacobian.extend(minimum.point.blocks.iter().flatten().cloned());
    covariance(&jacobian, &minimum.point.residuals)
}
