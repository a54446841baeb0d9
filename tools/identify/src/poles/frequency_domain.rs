//! The least-squares complex frequency method (Guillaume, Verboven, Vanlanduit, Van der Auweraer and
//! Peeters 2003).
//!
//! H(f) = N(z) / D(z) with z = exp(−i 2π f Δt), Δt = 1 / (2 f_max), N and D polynomials with real
//! coefficients. Multiplied by D the equations are linear, N is eliminated, and D is found with its highest
//! coefficient held at 1: that pushes the roots which mean nothing out of the stable region. The roots are
//! the poles. With several responses (outputs, or records of the same structure) the denominator is common.

use nalgebra::{DMatrix, DVector};
use rustfft::num_complex::Complex64;

use super::ContinuousPole;
use super::polynomial::roots;
use crate::frf::FrfEstimate;

/// Sums over the lines from which the equations of every order are made.
pub(super) struct Moments {
    interval_s: f64,
    responses: Vec<ResponseMoments>,
    max_order: usize,
}

/// Toeplitz rows of X^H X, X^H Y (both signs of the shift) and Y^H Y.
struct ResponseMoments {
    plain: Vec<f64>,
    mixed_up: Vec<f64>,
    mixed_down: Vec<f64>,
    squared: Vec<f64>,
}

impl Moments {
    /// Sums for orders up to `max_order`; `None` without lines.
    pub(super) fn new(responses: &[FrfEstimate], max_order: usize) -> Option<Self> {
        let highest_hz =
            responses.iter().filter_map(|frf| frf.frequency_hz.last().copied()).fold(0.0_f64, f64::max);
        if highest_hz <= 0.0 || !highest_hz.is_finite() {
            return None;
        }
        let interval_s = 0.5 / highest_hz;
        let sums = responses.iter().map(|frf| response_moments(frf, interval_s, max_order));
        Some(Self { interval_s, responses: sums.collect(), max_order })
    }

    /// Poles of one order, stable and unstable, by frequency.
    pub(super) fn poles(&self, order: usize) -> Vec<ContinuousPole> {
        let found = self.roots(order).into_iter();
        let mut poles: Vec<ContinuousPole> =
            found.filter_map(|root| ContinuousPole::of_z(root, self.interval_s)).collect();
        poles.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
        poles
    }

    /// Rates of the stable poles of one order that do not oscillate, 1/s.
    pub(super) fn real_rates_per_s(&self, order: usize) -> Vec<f64> {
        let found = self.roots(order).into_iter();
        found.filter_map(|root| ContinuousPole::real_rate_of_z(root, self.interval_s)).collect()
    }

    /// Poles z of one order.
    fn roots(&self, order: usize) -> Vec<Complex64> {
        if order == 0 || order > self.max_order {
            return Vec::new();
        }
        let size = order + 1;
        let mut reduced = DMatrix::<f64>::zeros(size, size);
        for sums in &self.responses {
            let toeplitz = |row: &[f64]| DMatrix::from_fn(size, size, |i, j| row[i.abs_diff(j)]);
            let plain = toeplitz(&sums.plain);
            let squared = toeplitz(&sums.squared);
            let mixed = DMatrix::from_fn(size, size, |i, j| {
                if j >= i { -sums.mixed_up[j - i] } else { -sums.mixed_down[i - j] }
            });
            let Some(eliminated) = solve_symmetric_many(plain, &mixed) else { return Vec::new() };
            reduced += squared - mixed.transpose() * eliminated;
        }
        let square = reduced.view((0, 0), (order, order)).into_owned();
        let right = DVector::from_fn(order, |row, _| -reduced[(row, order)]);
        let Some(denominator) = solve_symmetric(square, right) else { return Vec::new() };
        // The polynomial's variable is 1 / z.
        let found = roots(denominator.as_slice()).into_iter().filter(|root| root.norm() > 0.0);
        found.map(|root| root.inv()).collect()
    }
}

/// Poles of one order from responses of one structure. Lines are weighted by one over their standard error
/// where the responses have variances, evenly otherwise.
///
/// Leakage of short records is not noise and is not averaged away: with damping below 1 % and sweeps shorter
/// than the decay the damping can be off by half, at any signal-to-noise ratio.
pub fn complex_frequency(responses: &[FrfEstimate], order: usize) -> Vec<ContinuousPole> {
    Moments::new(responses, order).map(|moments| moments.poles(order)).unwrap_or_default()
}

fn response_moments(frf: &FrfEstimate, interval_s: f64, max_order: usize) -> ResponseMoments {
    let zero = || vec![0.0; max_order + 1];
    let mut sums = ResponseMoments { plain: zero(), mixed_up: zero(), mixed_down: zero(), squared: zero() };
    let floor = frf.variance.as_ref().map(|variance| smallest(variance));
    for (k, (f, h)) in frf.frequency_hz.iter().zip(&frf.response).enumerate() {
        let weight = match (&frf.variance, floor) {
            (Some(variance), Some(floor)) => 1.0 / variance[k].max(floor),
            _ => 1.0,
        };
        let turn = Complex64::from_polar(1.0, -std::f64::consts::TAU * f * interval_s);
        let mut z = Complex64::new(1.0, 0.0);
        for shift in 0..=max_order {
            sums.plain[shift] += weight * z.re;
            sums.mixed_up[shift] += weight * (h * z).re;
            sums.mixed_down[shift] += weight * (h * z.conj()).re;
            sums.squared[shift] += weight * h.norm_sqr() * z.re;
            z *= turn;
        }
    }
    sums
}

/// Variances far below the median come from windows that fitted the noise by chance.
fn smallest(variance: &[f64]) -> f64 {
    let mut sorted = variance.to_vec();
    sorted.sort_by(f64::total_cmp);
    (1e-3 * sorted.get(sorted.len() / 2).copied().unwrap_or(1.0)).max(f64::MIN_POSITIVE)
}

/// Solves a symmetric system, by Cholesky or, where rounding made it indefinite, by LU.
pub(super) fn solve_symmetric(matrix: DMatrix<f64>, right: DVector<f64>) -> Option<DVector<f64>> {
    let solved = match matrix.clone().cholesky() {
        Some(cholesky) => cholesky.solve(&right),
        None => matrix.lu().solve(&right)?,
    };
    solved.iter().all(|value| value.is_finite()).then_some(solved)
}

fn solve_symmetric_many(matrix: DMatrix<f64>, right: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let solved = match matrix.clone().cholesky() {
        Some(cholesky) => cholesky.solve(right),
        None => matrix.lu().solve(right)?,
    };
    solved.iter().all(|value| value.is_finite()).then_some(solved)
}
