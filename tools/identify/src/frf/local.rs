//! The local polynomial and the local rational method (Schoukens, Vandersteen, Barbe and Pintelon 2009;
//! McKelvey and Guérin 2012).
//!
//! The spectra of a whole record without a window obey Y(k) = G(k) U(k) + T(k) + V(k): the transient T, which
//! is what a window would smear, is as smooth a function of frequency as the response G itself. Within 2 n +
//! 1 lines around each one both are written as polynomials of the line number r (order R), or as rational
//! functions with one common denominator, and found by least squares; the residual is the noise.

use nalgebra::{DMatrix, DVector};
use rustfft::num_complex::Complex64;

use super::least_squares::{Solution, solve};
use super::{FrfEstimate, FrfEstimator, UniformRecord};

/// Choices of the local methods.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LocalOptions {
    /// Order R of the polynomials.
    pub order: usize,
    /// Lines on either side of the one estimated.
    pub half_width: usize,
}

impl Default for LocalOptions {
    /// Order 2 within 13 lines.
    fn default() -> Self {
        Self { order: 2, half_width: 6 }
    }
}

/// The response by the local polynomial method, at every line of the record's spectrum within the band.
///
/// Biased low at resonances whose half-power band is no wider than a few lines: for those see
/// [`local_rational`]. `None` with too few lines for the order.
pub fn local_polynomial(
    record: &UniformRecord,
    band_hz: [f64; 2],
    options: LocalOptions,
) -> Option<FrfEstimate> {
    estimate(record, band_hz, options, FrfEstimator::LocalPolynomial)
}

/// The response by the local rational method: exact for a resonance alone in its window, however sharp.
///
/// The least-squares equations are weighted by the denominator, which biases heavily disturbed lines.
/// `None` with too few lines for the order.
pub fn local_rational(
    record: &UniformRecord,
    band_hz: [f64; 2],
    options: LocalOptions,
) -> Option<FrfEstimate> {
    estimate(record, band_hz, options, FrfEstimator::LocalRational)
}

fn estimate(
    record: &UniformRecord,
    band_hz: [f64; 2],
    options: LocalOptions,
    estimator: FrfEstimator,
) -> Option<FrfEstimate> {
    let (u, y, line_hz) = record.spectra();
    let rational = estimator == FrfEstimator::LocalRational;
    let first = ((band_hz[0] / line_hz).ceil() as usize).max(1);
    let last = ((band_hz[1] / line_hz).floor() as usize).min(u.len().checked_sub(2)?);
    let mut frf = FrfEstimate {
        estimator,
        frequency_hz: Vec::new(),
        response: Vec::new(),
        variance: Some(Vec::new()),
        coherence: None,
    };
    let mut variance = Vec::new();
    let even = vec![1.0; 2 * options.half_width + 1];
    for k in first..=last {
        let window = Window::around(k, options, u.len())?;
        let Some(solution) = window.solve(&u, &y, rational, &even) else { continue };
        frf.frequency_hz.push(k as f64 * line_hz);
        frf.response.push(solution.x[0]);
        variance.push(solution.cofactor[(0, 0)].re * solution.power);
    }
    // Lines without a solution would leave holes in an even grid: no input there, no response.
    let whole = frf.frequency_hz.len() == (last + 1).saturating_sub(first) && !variance.is_empty();
    frf.variance = Some(variance);
    whole.then_some(frf)
}

/// Lines used for the estimate at one line.
struct Window {
    centre: usize,
    first: usize,
    last: usize,
    order: usize,
    /// Whether the output holds a transient beside the response.
    transient: bool,
    /// Line numbers are counted in half widths, so that their powers stay of one size.
    unit: f64,
}

impl Window {
    /// The window around a line, moved inwards at the ends of the spectrum.
    fn around(centre: usize, options: LocalOptions, lines: usize) -> Option<Self> {
        let n = options.half_width;
        // Line 0 holds the mean and the last one has no phase.
        let first = centre.saturating_sub(n).max(1).min(lines.checked_sub(2 * n + 2)?);
        let last = (first.max(1) + 2 * n).min(lines - 1);
        let unit = n.max(1) as f64;
        Some(Self { centre, first: first.max(1), last, order: options.order, transient: true, unit })
    }

    /// Where a line stands in the window, in half widths from the centre.
    fn place(&self, line: usize) -> f64 {
        (line as f64 - self.centre as f64) / self.unit
    }

    /// Polynomials beside the denominator.
    fn numerators(&self) -> usize {
        1 + usize::from(self.transient)
    }

    /// Unknowns: response (order + 1), transient (order + 1) where there is one, and of the rational form the
    /// denominator's
    /// coefficients after its leading 1.
    fn solve(&self, u: &[Complex64], y: &[Complex64], rational: bool, weights: &[f64]) -> Option<Solution> {
        let rows = self.last + 1 - self.first;
        let terms = self.order + 1;
        let numerators = self.numerators() * terms;
        let columns = if rational { numerators + terms - 1 } else { numerators };
        let mut a = DMatrix::zeros(rows, columns);
        let mut b = DVector::zeros(rows);
        for (row, (line, weight)) in (self.first..=self.last).zip(weights).enumerate() {
            let r = self.place(line);
            let mut power = *weight;
            for s in 0..terms {
                a[(row, s)] = u[line] * power;
                if self.transient {
                    a[(row, terms + s)] = Complex64::from(power);
                }
                if rational && s > 0 {
                    a[(row, numerators + s - 1)] = -y[line] * power;
                }
                power *= r;
            }
            b[row] = y[line] * *weight;
        }
        solve(a, b)
    }
}

/// The local denominator 1 + d_1 r + ... at a line, in lines r from it, and the covariance of its
/// coefficients.
pub(crate) struct LocalDenominator {
    pub(crate) coefficients: Vec<Complex64>,
    pub(crate) covariance: DMatrix<Complex64>,
}

/// Rounds of reweighting after which the local rational form has settled or never will.
const ROUNDS: usize = 8;

/// Fits the local rational form around one line, the equations reweighted by the denominator found before
/// (Sanathanan and Koerner 1963) until what is minimised is the error of the output itself. A measured
/// response has no transient.
pub(crate) fn rational_at(
    u: &[Complex64],
    y: &[Complex64],
    line: usize,
    options: LocalOptions,
    transient: bool,
) -> Option<LocalDenominator> {
    let window = Window { transient, ..Window::around(line, options, u.len())? };
    let mut weights = vec![1.0; window.last + 1 - window.first];
    let start = window.numerators() * (options.order + 1);
    let mut solution = window.solve(u, y, true, &weights)?;
    for _ in 0..ROUNDS {
        for (row, weight) in weights.iter_mut().enumerate() {
            let r = window.place(window.first + row);
            let denominator = (0..options.order)
                .rev()
                .fold(Complex64::new(0.0, 0.0), |sum, s| (sum + solution.x[start + s]) * r)
                + 1.0;
            *weight = 1.0 / denominator.norm().max(1e-6);
        }
        solution = window.solve(u, y, true, &weights)?;
    }
    let unit = |s: usize| window.unit.powi(s as i32 + 1);
    let coefficients = (0..options.order).map(|s| solution.x[start + s] / unit(s)).collect();
    let covariance = DMatrix::from_fn(options.order, options.order, |i, j| {
        solution.cofactor[(start + i, start + j)] * solution.power / (unit(i) * unit(j))
    });
    Some(LocalDenominator { coefficients, covariance })
}
