//! Standard errors of fitted parameters under coloured noise.

use std::ops::Range;

use nalgebra::{DMatrix, SymmetricEigen};
use stillbeam_identify::tall::{add_scaled, dot};

use crate::fit::{Fitted, gram};
use crate::parameters::{FreeParameter, free_parameters};
use crate::stacking::{Segment, Stack};
use crate::statistics::autoregression::Autoregression;
use crate::statistics::distributions::chi_squared_tail;
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
    /// From residuals that are taken to be noise; `slowest_hz` sets the width of the windows: two seconds or
    /// two periods, whichever is longer.
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

/// Standard errors of the free parameters, in their own units; infinite where two cannot be told apart, or
/// one does nothing.
pub(crate) fn standard_errors(stack: &Stack<'_>, fitted: &Fitted, slowest_hz: Option<f64>) -> Vec<f64> {
    errors_from(stack, fitted, fitted.sensitivities(stack), slowest_hz)
}

/// The same from derivatives to one side only: half the simulations, for what is not reported.
pub(crate) fn rough_standard_errors(stack: &Stack<'_>, fitted: &Fitted, slowest_hz: Option<f64>) -> Vec<f64> {
    errors_from(stack, fitted, fitted.rough_sensitivities(stack), slowest_hz)
}

fn errors_from(
    stack: &Stack<'_>,
    fitted: &Fitted,
    columns: Vec<Vec<f64>>,
    slowest_hz: Option<f64>,
) -> Vec<f64> {
    let scatter = Scatter::new(stack, fitted.residuals(), slowest_hz);
    let slopes = fitted.free.iter().zip(&fitted.values).map(|(p, value)| p.slope(p.to_search(*value)));
    match influences(&columns) {
        None => vec![f64::INFINITY; fitted.free.len()],
        Some(influences) => influences
            .iter()
            .zip(slopes)
            .map(|(influence, slope)| match influence {
                Some(influence) => scatter.variance_of_sum(influence).sqrt() * slope.abs(),
                None => f64::INFINITY,
            })
            .collect(),
    }
}

/// A part of the recordings that has this share of what is known of a parameter tells something of it.
const TELLS: f64 = 0.1;

/// How one parameter looks from one half recording to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Consistency {
    /// Chance of such different values if it were one.
    pub(crate) p: f64,
    /// Largest departure of a half that tells a tenth of what is known, as a share of the value.
    pub(crate) spread: f64,
    /// Squared disagreement over what chance makes of it.
    pub(crate) excess: f64,
}

/// Recordings that disagree about a parameter by more than chance in this share of cases say that the noise
/// is not all that moves it.
const BEYOND_CHANCE: f64 = 0.01;

impl Consistency {
    /// What a standard error reckoned from noise alone is to be multiplied by: where recordings disagree
    /// about a parameter, their mean is off by as much more as they scatter more than they should (R. Birge,
    /// Phys. Rev. 40 (1932) 207).
    fn widening(self) -> f64 {
        if self.p < BEYOND_CHANCE { self.excess.max(1.0).sqrt() } else { 1.0 }
    }
}

/// How well the free parameters of a fit are known.
pub(crate) struct Precision {
    /// Standard errors, everything that is not free being exactly as drawn, and noise all that is left.
    pub(crate) by_noise: Vec<f64>,
    /// The same with what recordings disagree about, and what the drawing's own errors add.
    pub(crate) all_told: Vec<f64>,
    /// Of those that were asked for.
    pub(crate) agreements: Vec<Option<Consistency>>,
}

/// How well all free parameters are known, and for those for which `asked` holds whether the recordings, and
/// the earlier and the later half of each, agree about them: physics is the same throughout, what only stands
/// in for something else is not.
///
/// A half's own value differs from the joint one by the sum of its residuals, weighted by how they move the
/// parameter, over the share of the information that it holds.
pub(crate) fn precision(
    stack: &Stack<'_>,
    fitted: &Fitted,
    slowest_hz: Option<f64>,
    asked: &dyn Fn(&FreeParameter) -> bool,
) -> Precision {
    let columns = fitted.sensitivities(stack);
    let residuals = fitted.residuals();
    let scatter = Scatter::new(stack, residuals.clone(), slowest_hz);
    let Some(influences) = influences(&columns) else {
        let unknown = vec![f64::INFINITY; fitted.free.len()];
        return Precision {
            by_noise: unknown.clone(),
            all_told: unknown,
            agreements: vec![None; fitted.free.len()],
        };
    };
    let parts = halves(stack);
    let mut errors = Vec::new();
    let mut agreements = Vec::new();
    for (index, influence) in influences.iter().enumerate() {
        let Some(influence) = influence else {
            errors.push(f64::INFINITY);
            agreements.push(None);
            continue;
        };
        let (parameter, value) = (&fitted.free[index], fitted.values[index]);
        let slope = parameter.slope(parameter.to_search(value)).abs();
        errors.push(scatter.variance_of_sum(influence).sqrt() * slope);
        let wanted = asked(parameter);
        agreements.push(wanted.then(|| {
            let (mut statistic, mut spread) = (0.0, 0.0_f64);
            for part in &parts {
                let mut own = vec![0.0; influence.len()];
                part.iter().for_each(|range| own[range.clone()].copy_from_slice(&influence[range.clone()]));
                let along = |signal: &[f64]| -> f64 {
                    part.iter().map(|range| dot(&own[range.clone()], &signal[range.clone()])).sum()
                };
                let shift = along(&residuals);
                let variance = scatter.variance_of_sum(&own);
                let share = along(&columns[index]);
                if variance > 0.0 {
                    statistic += shift * shift / variance;
                }
                if share > TELLS {
                    spread = spread.max((shift / share * slope / value).abs());
                }
            }
            let freedom = (parts.len() - 1) as f64;
            Consistency { p: chi_squared_tail(statistic, freedom), spread, excess: statistic / freedom }
        }));
    }
    let drawn = drawn_errors(stack, fitted, &influences);
    let all_told = (0..errors.len())
        .map(|index| {
            let widening = agreements[index].map_or(1.0, Consistency::widening);
            (widening * errors[index]).hypot(drawn[index])
        })
        .collect();
    Precision { by_noise: errors, all_told, agreements }
}

/// What the errors of the drawing add to the standard errors of the free parameters.
///
/// Recordings of motion alone do not tell masses from forces: a base that is moved, a body that is let go do
/// the same with all masses, springs, dampers and forces twice as large. What such recordings leave
/// undetermined stays as given, and what is found is right only as far as that is.
fn drawn_errors(stack: &Stack<'_>, fitted: &Fitted, influences: &[Option<Vec<f64>>]) -> Vec<f64> {
    let is_free = |path: &str| fitted.free.iter().any(|free| free.path == path);
    let mut held = free_parameters(&fitted.hypothesis);
    held.retain(|parameter| !is_free(&parameter.path) && parameter.given != 0.0);
    let values = held.iter().map(|parameter| parameter.given).collect();
    let with_held = Fitted { free: held.clone(), values, ..fitted.clone() };
    let columns = with_held.sensitivities(stack);
    let slopes = fitted.free.iter().zip(&fitted.values).map(|(p, value)| p.slope(p.to_search(*value)));
    influences
        .iter()
        .zip(slopes)
        .map(|(influence, slope)| {
            let Some(influence) = influence else { return 0.0 };
            let shifts = held.iter().zip(&columns).map(|(held, column)| {
                // Search coordinates are logarithms, or shares of what was given.
                dot(influence, column) * held.known_within().ln() / WITHIN
            });
            shifts.map(|shift| shift * shift).sum::<f64>().sqrt() * slope.abs()
        })
        .collect()
}

/// A drawing is within its bounds by so many standard errors.
const WITHIN: f64 = 3.0;

/// Rows of the earlier and of the later half of every recording.
fn halves(stack: &Stack<'_>) -> Vec<Vec<Range<usize>>> {
    let mut parts = vec![Vec::new(); 2 * stack.records.len()];
    for segment in stack.segments() {
        let middle = segment.range.start + segment.range.len() / 2;
        parts[2 * segment.record].push(segment.range.start..middle);
        parts[2 * segment.record + 1].push(middle..segment.range.end);
    }
    parts
}

/// Inverse of a matrix with ones on its diagonal. Directions that rounding alone fills are given the size of
/// rounding: what they mix is as good as undetermined, and the other parameters keep their errors.
fn inverse_of(matrix: DMatrix<f64>) -> Option<DMatrix<f64>> {
    const ROUNDING: f64 = 1e-13;
    let eigen = SymmetricEigen::try_new(matrix, f64::EPSILON, 10_000)?;
    let least = ROUNDING * eigen.eigenvalues.max();
    let inverted = eigen.eigenvalues.map(|value| 1.0 / value.max(least));
    Some(&eigen.eigenvectors * DMatrix::from_diagonal(&inverted) * eigen.eigenvectors.transpose())
}

/// How much each residual moves each parameter: the rows of the pseudo-inverse, one vector per parameter;
/// `None` for a parameter that moves no residual, of which nothing is known. Noise before a rounding is such
/// a one where there is too little of it to change a reading.
fn influences(columns: &[Vec<f64>]) -> Option<Vec<Option<Vec<f64>>>> {
    let products = gram(columns);
    let lengths: Vec<f64> = products.diagonal().iter().map(|square| square.sqrt()).collect();
    let telling: Vec<usize> = (0..columns.len()).filter(|&index| lengths[index] != 0.0).collect();
    if telling.iter().any(|&index| !lengths[index].is_normal()) {
        return None;
    }
    let mut influences = vec![None; columns.len()];
    if telling.is_empty() {
        return Some(influences);
    }
    let scaled = DMatrix::from_fn(telling.len(), telling.len(), |row, column| {
        let (i, j) = (telling[row], telling[column]);
        products[(i, j)] / (lengths[i] * lengths[j])
    });
    let inverse = inverse_of(scaled)?;
    let rows = columns.first().map_or(0, Vec::len);
    for (row, &i) in telling.iter().enumerate() {
        let mut influence = vec![0.0; rows];
        for (column, &j) in telling.iter().enumerate() {
            add_scaled(&mut influence, inverse[(row, column)] / (lengths[i] * lengths[j]), &columns[j]);
        }
        influences[i] = Some(influence);
    }
    Some(influences)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_that_does_nothing_is_unknown_and_leaves_the_others_known() {
        let columns = [vec![1.0, 0.0, 1.0], vec![0.0; 3], vec![0.0, 2.0, 0.0]];
        let known = influences(&columns).expect("two of them are known");
        let close = |got: &Option<Vec<f64>>, wanted: [f64; 3]| {
            let got = got.as_ref().expect("it moves residuals");
            got.iter().zip(wanted).all(|(got, wanted)| (got - wanted).abs() < 1e-12)
        };
        assert!(close(&known[0], [0.5, 0.0, 0.5]) && close(&known[2], [0.0, 0.5, 0.0]), "{known:?}");
        assert_eq!(known[1], None);
        assert_eq!(influences(&[vec![f64::NAN; 3]]), None);
        assert_eq!(influences(&[vec![0.0; 3]]), Some(vec![None]));
    }

    #[test]
    fn only_recordings_that_disagree_beyond_chance_widen_an_interval() {
        let agreement = |p: f64, excess: f64| Consistency { p, spread: 0.1, excess }.widening();
        assert!((agreement(0.2, 1.4) - 1.0).abs() < 1e-12);
        assert!((agreement(1e-4, 9.0) - 3.0).abs() < 1e-12);
    }
}
