//! Standard errors of fitted parameters under coloured noise.

use nalgebra::DMatrix;
use stillbeam_identify::tall::add_scaled;

use crate::fit::{Fitted, gram};
use crate::stacking::{Segment, Stack};
use crate::statistics::autoregression::Autoregression;
use crate::statistics::long_run_variance::variance_of_weighted_sum;

/// What is needed to judge any linear functional of the residuals.
#[derive(Debug, Clone)]
pub(crate) struct Scatter {
    residuals: Vec<f64>,
    segments: Vec<Segment>,
    colours: Vec<Autoregression>,
    windows: Vec<usize>,
}

impl Scatter {
    /// From residuals that are taken to be noise; `slowest_hz` sets the width of the windows: two seconds or two
    /// periods, whichever is longer.
    pub(crate) fn new(stack: &Stack<'_>, residuals: Vec<f64>, slowest_hz: Option<f64>) -> Self {
        let segments = stack.segments();
        let colours = segments
            .iter()
            .map(|segment| Autoregression::fit(&[&residuals[segment.range.clone()]]))
            .collect();
        let seconds = slowest_hz.filter(|hz| *hz > 0.0).map_or(2.0, |hz| (2.0 / hz).max(2.0));
        let windows = segments
            .iter()
            .map(|segment| ((seconds * segment.rate_hz) as usize).clamp(1, (segment.range.len() / 8).max(1)))
            .collect();
        Self { residuals, segments, colours, windows }
    }

    /// Variance of the sum of `weights[t] * noise[t]` over the long vector.
    pub(crate) fn variance_of_sum(&self, weights: &[f64]) -> f64 {
        self.segments
            .iter()
            .zip(&self.colours)
            .zip(&self.windows)
            .map(|((segment, colour), window)| {
                let range = segment.range.clone();
                variance_of_weighted_sum(&weights[range.clone()], &self.residuals[range], colour, *window)
            })
            .sum()
    }
}

/// Standard errors of the free parameters, in their own units; infinite where two cannot be told apart.
pub(crate) fn standard_errors(stack: &Stack<'_>, fitted: &Fitted, slowest_hz: Option<f64>) -> Vec<f64> {
    let columns = fitted.sensitivities(stack);
    let scatter = Scatter::new(stack, fitted.residuals(), slowest_hz);
    let slopes = fitted.free.iter().zip(&fitted.values).map(|(p, value)| p.slope(p.to_search(*value)));
    match influences(&columns) {
        None => vec![f64::INFINITY; fitted.free.len()],
        Some(influences) => influences
            .iter()
            .zip(slopes)
            .map(|(influence, slope)| scatter.variance_of_sum(influence).sqrt() * slope.abs())
            .collect(),
    }
}

/// How much each residual moves each parameter: the rows of the pseudo-inverse, one vector per parameter.
fn influences(columns: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let products = gram(columns);
    let lengths: Vec<f64> = products.diagonal().iter().map(|square| square.sqrt()).collect();
    if lengths.iter().any(|length| !(length.is_normal() && length.is_finite())) {
        return None;
    }
    let n = columns.len();
    let scaled = DMatrix::from_fn(n, n, |i, j| products[(i, j)] / (lengths[i] * lengths[j]));
    let inverse = scaled.cholesky()?.inverse();
    let rows = columns.first().map_or(0, Vec::len);
    Some(
        (0..n)
            .map(|i| {
                let mut influence = vec![0.0; rows];
                for (j, column) in columns.iter().enumerate() {
                    add_scaled(&mut influence, inverse[(i, j)] / (lengths[i] * lengths[j]), column);
                }
                influence
            })
            .collect(),
    )
}
