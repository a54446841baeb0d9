//! The last step of every fit: a noise model, and the fit again through it.

use nalgebra::DMatrix;

use crate::levenberg_marquardt::{Minimum, Parameter};
use crate::result::NoiseModel;
use crate::separable::{Projected, Separable, fit, fit_covariance};
use crate::whitening::{Whitened, Whitener};

/// A fit with the covariance of its parameters and what it assumed of the noise.
pub(crate) struct Refined {
    /// The non-linear parameters, then the coefficients.
    pub(crate) parameters: Vec<f64>,
    pub(crate) coefficients: Vec<f64>,
    /// Recorded minus fitted output, unfiltered.
    pub(crate) residuals: Vec<f64>,
    pub(crate) covariance: Option<DMatrix<f64>>,
    pub(crate) noise: NoiseModel,
}

impl Refined {
    /// Standard error by index: parameters first, then coefficients.
    pub(crate) fn stderr(&self, index: usize) -> f64 {
        let variance = |c: &DMatrix<f64>| c[(index, index)].max(0.0).sqrt();
        self.covariance.as_ref().map_or(f64::INFINITY, variance)
    }

    /// Standard error of a coefficient.
    pub(crate) fn coefficient_stderr(&self, index: usize) -> f64 {
        self.stderr(self.parameters.len() + index)
    }

    pub(crate) fn residual_rms(&self) -> f64 {
        let power: f64 = self.residuals.iter().map(|e| e * e).sum();
        (power / self.residuals.len().max(1) as f64).sqrt()
    }
}

/// Standard errors by which the fits with and without a noise model may differ while the residuals may be noise.
const SAME: f64 = 4.0;

/// Refits through the noise model, where there is one.
///
/// With independent noise both fits are right, and differ by less than their errors. Where they do not, the residuals
/// hold something of the plant; weighing it as noise would be wrong, and the plain fit stands, with the
/// errors that correlated residuals give it (the idea of J. Hausman, Econometrica 46 (1978) 1251).
pub(crate) fn refine<M: Separable>(
    model: &M,
    plain: &Minimum<Projected>,
    range: &[Parameter],
    whitener: Option<Whitener>,
) -> Refined {
    let covariance = fit_covariance(model, plain);
    let as_found = |covariance, noise| Refined {
        parameters: plain.parameters.clone(),
        coefficients: plain.point.coefficients.clone(),
        residuals: plain.point.residuals.clone(),
        covariance,
        noise,
    };
    let Some(whitener) = whitener else {
        return as_found(covariance, NoiseModel::White);
    };
    let order = whitener.order();
    let filtered = Whitened { model, whitener: &whitener };
    let from_plain: Vec<Parameter> =
        range.iter().zip(&plain.parameters).map(|(p, found)| Parameter { start: *found, ..*p }).collect();
    let Some(found) = fit(&filtered, &from_plain) else {
        return as_found(covariance, NoiseModel::NotNoise { order, apart: f64::INFINITY });
    };
    let sharper = fit_covariance(&filtered, &found);
    let apart = distance(plain, &found, covariance.as_ref());
    if apart > SAME || sharper.is_none() {
        return as_found(covariance, NoiseModel::NotNoise { order, apart });
    }
    let residuals = recorded_minus_fitted(model, &found);
    Refined {
        residuals,
        covariance: sharper,
        noise: NoiseModel::Autoregressive { order },
        coefficients: found.point.coefficients,
        parameters: found.parameters,
    }
}

/// The largest difference of a parameter, in the plain fit's standard errors.
fn distance(
    plain: &Minimum<Projected>,
    found: &Minimum<Projected>,
    covariance: Option<&DMatrix<f64>>,
) -> f64 {
    let Some(covariance) = covariance else { return 0.0 };
    let pairs = plain.parameters.iter().zip(&found.parameters).enumerate();
    let distances = pairs.map(|(k, (a, b))| (a - b).abs() / covariance[(k, k)].max(f64::MIN_POSITIVE).sqrt());
    distances.fold(0.0, f64::max)
}

/// Residuals without the filter.
fn recorded_minus_fitted<M: Separable>(model: &M, found: &Minimum<Projected>) -> Vec<f64> {
    let mut residuals = model.target(&found.parameters);
    let columns = (0..model.blocks()).flat_map(|block| model.block(block, &found.parameters));
    for (column, coefficient) in columns.zip(&found.point.coefficients) {
        column.add_to(&mut residuals, -coefficient);
    }
    residuals
}
