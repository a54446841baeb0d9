//! The last step of every fit: a noise model, and the fit again through it.

use nalgebra::DMatrix;

use crate::error::IdentifyError;
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

    /// The fit itself, or the refusal of one whose parameters cannot be told apart: without standard errors
    /// nothing in it can be judged.
    pub(crate) fn or_refused(
        self,
        recording: String,
        column: &str,
        modes: usize,
    ) -> Result<Self, IdentifyError> {
        match self.covariance {
            Some(_) => Ok(self),
            None => Err(IdentifyError::NotDetermined { recording, column: column.to_owned(), modes }),
        }
    }

    pub(crate) fn residual_rms(&self) -> f64 {
        let power: f64 = self.residuals.iter().map(|e| e * e).sum();
        (power / self.residuals.len().max(1) as f64).sqrt()
    }
}

/// Standard errors by which the fits with and without a noise model may differ while the residuals may be
/// noise.
const SAME: f64 = 4.0;

/// Refits through the noise model, where there is one.
///
/// With independent noise both fits are right, and differ by less than their errors. Where they do not, the
/// residuals hold something of the plant; weighing it as noise would be wrong, and the plain fit stands, with
/// the errors that correlated residuals give it (the idea of J. Hausman, Econometrica 46 (1978) 1251).
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decay_model::DecayModel;
    use crate::forced_model::pole_parameters;
    use crate::modal_response::Pole;

    /// A decay fitted with modes at these frequencies, which stay where they are.
    fn fitted(frequencies_hz: &[f64]) -> Result<Refined, IdentifyError> {
        let time_s: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let output: Vec<f64> =
            (0..400).map(|k| (-0.005 * f64::from(k)).exp() * (0.3 * f64::from(k)).cos()).collect();
        let model = DecayModel { time_s: &time_s, output: &output, modes: frequencies_hz.len(), powers: 0 };
        let starts = frequencies_hz.iter().map(|hz| Pole { frequency_hz: *hz, damping_ratio: 0.02 });
        let fixed = starts.flat_map(|start| pole_parameters(start, 0.1)).map(|parameter| Parameter {
            lower: parameter.start,
            upper: parameter.start,
            ..parameter
        });
        let range: Vec<Parameter> = fixed.collect();
        let minimum = fit(&model, &range).unwrap();
        refine(&model, &minimum, &range, None).or_refused("decay".to_owned(), "tip_m", frequencies_hz.len())
    }

    #[test]
    fn a_fit_of_one_mode_twice_is_refused_and_of_two_modes_is_not() {
        assert!(fitted(&[4.7, 9.0]).unwrap().stderr(0).is_finite());
        let refusal = fitted(&[4.7, 4.7]).map(|_| ()).unwrap_err();
        assert!(matches!(refusal, IdentifyError::NotDetermined { modes: 2, .. }), "{refusal}");
        assert!(refusal.to_string().contains("ask for fewer modes"), "{refusal}");
    }
}
