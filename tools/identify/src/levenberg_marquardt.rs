//! Levenberg-Marquardt for a few bounded parameters, on residual vectors of any length.
//!
//! Marquardt's scaling (damping in units of the curvature of each parameter), Nielsen's update of the
//! damping, steps projected into the box, and parameters that press against a bound left out of the step. K.
//! Madsen, H. B. Nielsen, O. Tingleff, *Methods for Non-Linear Least Squares Problems*, 2004, section 3.2.
//! Where parameters make up for each other the minimum lies at the end of a narrow valley, and straight steps
//! leave it soon; where a problem tells its second derivative along a step, the step bends with the valley:
//! M. Transtrum, J. Sethna, *Improvements to the Levenberg-Marquardt algorithm for nonlinear least-squares
//! minimization*, 2012, section 4.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use serde::{Deserialize, Serialize};

use crate::tall::dot;

/// One parameter of a fit, in the coordinates of the search (logarithms for positive quantities).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Where the search starts; moved into the box when it lies outside.
    pub start: f64,
    /// Lower bound.
    pub lower: f64,
    /// Upper bound.
    pub upper: f64,
    /// The largest change that one step may make.
    pub max_step: f64,
}

/// A sum of squares to be made small.
pub trait LeastSquares {
    /// What evaluating the residuals leaves behind for the Jacobian.
    type Point;

    /// Evaluates the residuals; `None` where the model cannot be evaluated.
    fn at(&self, parameters: &[f64]) -> Option<Self::Point>;

    /// The residuals of an evaluated point.
    fn residuals<'p>(&self, point: &'p Self::Point) -> &'p [f64];

    /// J'J and J'r, J being the derivatives of the residuals r with respect to the parameters.
    fn curvature(&self, parameters: &[f64], point: &Self::Point) -> (DMatrix<f64>, DVector<f64>);

    /// J'r_vv, r_vv being the second derivative of the residuals along `direction`; asked for only after
    /// [`Self::curvature`] of the same point. `None`, where it is not known or not worth its cost: steps are
    /// straight then.
    fn bend(&self, parameters: &[f64], point: &Self::Point, direction: &[f64]) -> Option<DVector<f64>> {
        let _ = (parameters, point, direction);
        None
    }
}

/// Why the search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// The residuals are orthogonal to every direction that is still free: a minimum.
    GradientSmall,
    /// The next step would change nothing.
    StepSmall,
    /// Neither the last step nor its prediction reduced the sum of squares noticeably.
    ReductionSmall,
    /// No step, however short, reduced the sum of squares.
    Stalled,
    /// The limit on the number of steps was reached; the result is not a minimum.
    IterationLimit,
}

impl StopReason {
    /// Whether the result is a minimum to numerical accuracy.
    pub fn converged(self) -> bool {
        !matches!(self, Self::IterationLimit)
    }
}

/// Where the search ended.
#[derive(Debug, Clone)]
pub struct Minimum<P> {
    /// Parameters, inside their bounds.
    pub parameters: Vec<f64>,
    /// The evaluated point.
    pub point: P,
    /// Sum of the squared residuals.
    pub sum_of_squares: f64,
    /// Why the search ended.
    pub stop_reason: StopReason,
    /// Accepted and refused steps together.
    pub steps: usize,
}

const STEP_LIMIT: usize = 120;
/// Cosine of the angle between the residuals and a column, below which they count as orthogonal.
const GRADIENT_TOLERANCE: f64 = 1e-9;
const STEP_TOLERANCE: f64 = 1e-12;
/// Share of the sum of squares that a last step may still have gained: for a hundred thousand residuals that
/// is a step of three hundredths of a standard error.
const REDUCTION_TOLERANCE: f64 = 1e-8;
const LARGEST_DAMPING: f64 = 1e14;
/// A step whose second order is larger than this share of its first is too long for both.
const MOST_BENT: f64 = 0.75;

/// Searches for a minimum from the parameters' starts.
///
/// Returns `None` when the model cannot be evaluated at the start.
pub fn minimise<L: LeastSquares>(problem: &L, parameters: &[Parameter]) -> Option<Minimum<L::Point>> {
    minimise_to(problem, parameters, REDUCTION_TOLERANCE)
}

/// The same, ended as soon as a step gains less than `reduction_tolerance` of the sum of squares: for many
/// fits of which only the best will be finished.
///
/// Returns `None` when the model cannot be evaluated at the start.
pub fn minimise_to<L: LeastSquares>(
    problem: &L,
    parameters: &[Parameter],
    reduction_tolerance: f64,
) -> Option<Minimum<L::Point>> {
    let clamp = |value: f64, p: &Parameter| value.max(p.lower).min(p.upper);
    let mut at: Vec<f64> = parameters.iter().map(|p| clamp(p.start, p)).collect();
    let mut point = problem.at(&at)?;
    let mut sum = square_sum(problem.residuals(&point));
    let mut damping = 1e-3;
    let mut steps = 0;

    let stop_reason = 'search: loop {
        if parameters.is_empty() {
            break StopReason::GradientSmall;
        }
        let (curvature, gradient) = problem.curvature(&at, &point);
        let local = Local { curvature, gradient };
        let free = local.free_parameters(&at, parameters);
        if local.is_stationary(&free, sum) {
            break StopReason::GradientSmall;
        }
        let mut growth = 2.0;
        loop {
            if steps >= STEP_LIMIT {
                break 'search StopReason::IterationLimit;
            }
            if damping > LARGEST_DAMPING {
                break 'search StopReason::Stalled;
            }
            steps += 1;
            let bend = |direction: &[f64]| problem.bend(&at, &point, direction);
            let Some(Step { straight, bent }) = local.step(&free, damping, parameters, &bend) else {
                damping *= growth;
                growth *= 2.0;
                continue;
            };
            let trial: Vec<f64> = at
                .iter()
                .zip(bent.as_ref().unwrap_or(&straight).iter())
                .zip(parameters)
                .map(|((value, step), p)| clamp(value + step, p))
                .collect();
            let taken = DVector::from_iterator(at.len(), trial.iter().zip(&at).map(|(t, a)| t - a));
            if taken.amax() < STEP_TOLERANCE {
                break 'search StopReason::StepSmall;
            }
            // What is straight in the parameters promises what the bent step is to keep.
            let predicted = local.predicted_reduction(if bent.is_some() { &straight } else { &taken });
            let evaluated = problem.at(&trial);
            let trial_sum =
                evaluated.as_ref().map_or(f64::INFINITY, |point| square_sum(problem.residuals(point)));
            let gain = (sum - trial_sum) / predicted;
            match evaluated {
                Some(evaluated) if predicted > 0.0 && gain > 1e-4 => {
                    let reduction = (sum - trial_sum) / sum;
                    (at, point, sum) = (trial, evaluated, trial_sum);
                    damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0);
                    let is_short = bent.is_some() && local.promise(&free) > reduction_tolerance * sum;
                    if reduction < reduction_tolerance && !is_short {
                        break 'search StopReason::ReductionSmall;
                    }
                    break;
                }
                // Rounding decides the sign of differences this small.
                _ if predicted.abs() < reduction_tolerance * sum => {
                    break 'search StopReason::ReductionSmall;
                }
                _ => {
                    damping *= growth;
                    growth *= 2.0;
                }
            }
        }
    };
    Some(Minimum { parameters: at, point, sum_of_squares: sum, stop_reason, steps })
}

/// A step in search coordinates.
struct Step {
    straight: DVector<f64>,
    /// With its second order, where that is known and small.
    bent: Option<DVector<f64>>,
}

/// The quadratic model of the sum of squares around one point.
struct Local {
    /// J'J.
    curvature: DMatrix<f64>,
    /// J'r.
    gradient: DVector<f64>,
}

impl Local {
    /// Indices of the parameters that are not held at a bound by the downhill direction.
    fn free_parameters(&self, at: &[f64], parameters: &[Parameter]) -> Vec<usize> {
        let blocked = |index: usize, p: &Parameter, value: f64| {
            let downhill = -self.gradient[index];
            (value <= p.lower && downhill < 0.0) || (value >= p.upper && downhill > 0.0)
        };
        (0..)
            .zip(parameters.iter().zip(at))
            .filter(|&(index, (p, &value))| self.curvature[(index, index)] > 0.0 && !blocked(index, p, value))
            .map(|(index, _)| index)
            .collect()
    }

    fn is_stationary(&self, free: &[usize], sum: f64) -> bool {
        free.iter().all(|&index| {
            let length = (self.curvature[(index, index)] * sum).sqrt();
            self.gradient[index].abs() <= GRADIENT_TOLERANCE * length
        })
    }

    /// Units of the free parameters, and the curvature in them with damping on its diagonal: damping and
    /// rounding treat all parameters alike.
    fn damped(&self, free: &[usize], damping: f64) -> Option<(DVector<f64>, Cholesky<f64, Dyn>)> {
        let scale = DVector::from_iterator(free.len(), free.iter().map(|&i| self.curvature[(i, i)].sqrt()));
        let mut system = DMatrix::from_fn(free.len(), free.len(), |i, j| {
            self.curvature[(free[i], free[j])] / (scale[i] * scale[j])
        });
        for i in 0..free.len() {
            system[(i, i)] += damping;
        }
        Some((scale, system.cholesky()?))
    }

    /// How much the sum of squares would fall by the step without damping.
    fn promise(&self, free: &[usize]) -> f64 {
        let Some((scale, system)) = self.damped(free, 0.0) else { return 0.0 };
        let gradient = DVector::from_iterator(free.len(), free.iter().map(|&index| self.gradient[index]));
        let gradient = gradient.component_div(&scale);
        gradient.dot(&system.solve(&gradient))
    }

    /// The damped Gauss-Newton step over the free parameters, shortened to the parameters' largest steps, and
    /// bent where `bend` tells how.
    fn step(
        &self,
        free: &[usize],
        damping: f64,
        parameters: &[Parameter],
        bend: &dyn Fn(&[f64]) -> Option<DVector<f64>>,
    ) -> Option<Step> {
        let (scale, system) = self.damped(free, damping)?;
        let down = |gradient: &DVector<f64>| {
            let gradient = DVector::from_iterator(free.len(), free.iter().map(|&index| gradient[index]));
            -system.solve(&gradient.component_div(&scale))
        };
        let of_all = |scaled: &DVector<f64>| {
            let mut step = DVector::zeros(parameters.len());
            free.iter().enumerate().for_each(|(i, &index)| step[index] = scaled[i] / scale[i]);
            step
        };
        let mut velocity = down(&self.gradient);
        let steps = of_all(&velocity);
        let longest = steps.iter().zip(parameters).fold(1.0_f64, |m, (s, p)| m.max(s.abs() / p.max_step));
        velocity /= longest;
        let straight = of_all(&velocity);
        if !straight.iter().all(|value| value.is_finite()) {
            return None;
        }
        let acceleration = bend(straight.as_slice()).map(|bend| down(&bend));
        let trusted = acceleration.filter(|bent| bent.norm() <= MOST_BENT * velocity.norm());
        let bent = trusted.map(|acceleration| of_all(&(velocity + 0.5 * acceleration)));
        Some(Step { straight, bent })
    }

    /// How much the quadratic model says a step lowers the sum of squares.
    fn predicted_reduction(&self, step: &DVector<f64>) -> f64 {
        -(2.0 * self.gradient.dot(step) + (&self.curvature * step).dot(step))
    }
}

fn square_sum(residuals: &[f64]) -> f64 {
    let sum = dot(residuals, residuals);
    if sum.is_finite() { sum } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley as a sum of squares.
    struct Valley;

    impl LeastSquares for Valley {
        type Point = Vec<f64>;
        fn at(&self, x: &[f64]) -> Option<Vec<f64>> {
            Some(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]])
        }
        fn residuals<'p>(&self, point: &'p Vec<f64>) -> &'p [f64] {
            point
        }
        fn curvature(&self, x: &[f64], r: &Vec<f64>) -> (DMatrix<f64>, DVector<f64>) {
            let jacobian = nalgebra::dmatrix![-20.0 * x[0], 10.0; -1.0, 0.0];
            (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&DVector::from_column_slice(r)))
        }
    }

    fn parameter(start: f64, lower: f64, upper: f64) -> Parameter {
        Parameter { start, lower, upper, max_step: 1.0 }
    }

    #[test]
    fn the_bottom_of_a_curved_valley_is_found() {
        let free = [parameter(-1.2, -5.0, 5.0), parameter(1.0, -5.0, 5.0)];
        let minimum = minimise(&Valley, &free).unwrap();
        assert!((minimum.parameters[0] - 1.0).abs() < 1e-8, "{minimum:?}");
        assert!((minimum.parameters[1] - 1.0).abs() < 1e-8, "{minimum:?}");
        assert!(minimum.stop_reason.converged());
    }

    /// The same, narrower, with or without its second derivatives.
    struct NarrowValley {
        bends: bool,
    }

    impl LeastSquares for NarrowValley {
        type Point = Vec<f64>;
        fn at(&self, x: &[f64]) -> Option<Vec<f64>> {
            Some(vec![3e2 * (x[1] - x[0] * x[0]), 1.0 - x[0]])
        }
        fn residuals<'p>(&self, point: &'p Vec<f64>) -> &'p [f64] {
            point
        }
        fn curvature(&self, x: &[f64], r: &Vec<f64>) -> (DMatrix<f64>, DVector<f64>) {
            let jacobian = nalgebra::dmatrix![-6e2 * x[0], 3e2; -1.0, 0.0];
            (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&DVector::from_column_slice(r)))
        }
        fn bend(&self, x: &[f64], _: &Vec<f64>, direction: &[f64]) -> Option<DVector<f64>> {
            let second = -6e2 * direction[0] * direction[0];
            self.bends.then(|| DVector::from_row_slice(&[-6e2 * x[0] * second, 3e2 * second]))
        }
    }

    #[test]
    fn steps_that_bend_reach_the_bottom_of_a_narrow_valley_in_which_straight_ones_get_nowhere() {
        let free = [parameter(-1.2, -5.0, 5.0), parameter(1.44, -5.0, 5.0)];
        let [bent, straight] = [true, false].map(|bends| minimise(&NarrowValley { bends }, &free).unwrap());
        assert!(bent.stop_reason.converged() && (bent.parameters[0] - 1.0).abs() < 1e-6, "{bent:?}");
        assert!(!straight.stop_reason.converged(), "{straight:?}");
    }

    #[test]
    fn a_step_that_gains_little_for_its_damping_is_no_end() {
        // From so far along the valley a damped step gains less than this tolerance.
        let free = [parameter(-1.2, -5.0, 5.0), parameter(1.44, -5.0, 5.0)];
        let minimum = minimise_to(&NarrowValley { bends: true }, &free, 1e-2).unwrap();
        assert!((minimum.parameters[0] - 1.0).abs() < 0.1, "{minimum:?}");
    }

    #[test]
    fn a_bound_across_the_valley_is_met_and_kept() {
        let boxed = [parameter(-1.2, -5.0, 0.5), parameter(1.0, -5.0, 5.0)];
        let minimum = minimise(&Valley, &boxed).unwrap();
        assert!((minimum.parameters[0] - 0.5).abs() < 1e-9, "{minimum:?}");
        assert!((minimum.parameters[1] - 0.25).abs() < 1e-7, "{minimum:?}");
        assert!(minimum.stop_reason.converged());
    }

    #[test]
    fn a_start_outside_the_box_is_moved_inside() {
        let boxed = [parameter(9.0, -2.0, 2.0), parameter(9.0, -2.0, 2.0)];
        let minimum = minimise(&Valley, &boxed).unwrap();
        assert!((minimum.parameters[0] - 1.0).abs() < 1e-7, "{minimum:?}");
    }
}
