//! Exact advance of a linear system over a stretch of time in which its input is a straight line.

use nalgebra::DMatrix;

use crate::blocks::Blocks;
use crate::error::PlantError;

/// `x' = A x + b u + c u'`.
#[derive(Debug, Clone)]
pub(crate) struct LinearSystem {
    /// `A`, n by n.
    pub(crate) a: DMatrix<f64>,
    /// `b`: effect of the input's value.
    pub(crate) value: Vec<f64>,
    /// `c`: effect of the input's slope.
    pub(crate) slope: Vec<f64>,
}

/// The same over one stretch: `x(t + d) = Φ x(t) + β u(t) + γ u'`, with `u'` constant on the stretch.
#[derive(Debug, Clone)]
pub(crate) struct Advance {
    size: usize,
    transition: Blocks,
    value: Vec<f64>,
    slope: Vec<f64>,
}

impl LinearSystem {
    /// The advance over `duration_s`, free of discretisation error: the exponential of the system together
    /// with its input, whose value grows at the rate of its slope and whose slope stays.
    pub(crate) fn advance_over(&self, duration_s: f64) -> Result<Advance, PlantError> {
        let size = self.a.nrows();
        let mut joined = DMatrix::zeros(size + 2, size + 2);
        joined.view_mut((0, 0), (size, size)).copy_from(&self.a);
        for row in 0..size {
            joined[(row, size)] = self.value[row];
            joined[(row, size + 1)] = self.slope[row];
        }
        joined[(size, size + 1)] = 1.0;
        let exponential = exponential(joined * duration_s).ok_or(PlantError::TooFast { duration_s })?;
        let column = |index| exponential.column(index).iter().take(size).copied().collect();
        Ok(Advance {
            size,
            transition: Blocks::new(
                size,
                &(0..size)
                    .flat_map(|row| (0..size).map(move |column| (row, column)))
                    .map(|place| exponential[place])
                    .collect::<Vec<f64>>(),
            ),
            value: column(size),
            slope: column(size + 1),
        })
    }
}

/// Matrix exponential by its series, after halving the matrix until the series is short and before squaring
/// the result as often. `None` when an entry is not finite or the halvings are more than any plant needs.
pub(crate) fn exponential(mut matrix: DMatrix<f64>) -> Option<DMatrix<f64>> {
    // Every squaring may double the rounding error; 2^40 is a million radians per step, squared.
    const MOST_HALVINGS: i32 = 40;
    // With a norm of at most 1/2 the remainder is 0.5^19 / 19!, far below rounding.
    const TERMS: i32 = 18;
    let size = matrix.nrows();
    let norm = matrix
        .row_iter()
        .map(|row| row.iter().map(|entry| entry.abs()).sum::<f64>())
        .fold(0.0, |most: f64, sum| if sum > most || sum.is_nan() { sum } else { most });
    let mut halvings = 0;
    while norm * 0.5_f64.powi(halvings) > 0.5 {
        halvings += 1;
        if halvings > MOST_HALVINGS {
            return None;
        }
    }
    matrix *= 0.5_f64.powi(halvings);
    // Horner's scheme: 1 + M (1 + M/2 (1 + M/3 (...))).
    let identity = DMatrix::identity(size, size);
    let mut result = identity.clone();
    for term in (1..=TERMS).rev() {
        result = &identity + &matrix * result / f64::from(term);
    }
    for _ in 0..halvings {
        result = &result * &result;
    }
    result.iter().all(|entry| entry.is_finite()).then_some(result)
}

impl Advance {
    /// Number of states.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Advances `state`; `scratch` is as long and holds nothing between calls.
    pub(crate) fn apply(&self, state: &mut Vec<f64>, scratch: &mut Vec<f64>, u: f64, slope: f64) {
        scratch.clear();
        self.transition.times(state, scratch);
        for ((entry, value), gamma) in scratch.iter_mut().zip(&self.value).zip(&self.slope) {
            // In the order of a dense row, so that blocks change nothing to the last bit.
            *entry = *entry + value * u + gamma * slope;
        }
        std::mem::swap(state, scratch);
    }
}

/// Scalar product of two slices of one length.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The closed form of one mode with a straight-line force, over seven decades of `omega t`.
    #[test]
    fn one_mode_is_advanced_as_in_closed_form() {
        for phase in [1e-4, 1e-2, 0.3, 0.49, 1.0, 3.0, 30.0, 1000.0] {
            for (omega, zeta) in [
                (7.0_f64, 0.0_f64),
                (7.0, 0.0033),
                (7.0, 0.7),
                // Balanced: nothing but the series itself makes it accurate.
                (1.0, 0.1),
                (1.0, 0.99),
            ] {
                let duration_s = phase / omega;
                let system = LinearSystem {
                    a: DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -omega * omega, -2.0 * zeta * omega]),
                    value: vec![0.0, 1.0],
                    slope: vec![0.0, 0.0],
                };
                let (u, slope) = (0.7, -0.3);
                let mut state = vec![0.2, -0.5];
                let (q0, v0) = (state[0], state[1]);
                let advance = system.advance_over(duration_s).unwrap();
                advance.apply(&mut state, &mut Vec::new(), u, slope);
                let particular = |t: f64| (u + slope * t - 2.0 * zeta * slope / omega) / (omega * omega);
                let (q, v) = (q0 - particular(0.0), v0 - slope / (omega * omega));
                let (decay, damped) = (zeta * omega, omega * (1.0 - zeta * zeta).sqrt());
                let (sine, cosine) = (damped * duration_s).sin_cos();
                let expected = (-decay * duration_s).exp() * (q * cosine + (v + decay * q) / damped * sine)
                    + particular(duration_s);
                let error = (state[0] - expected).abs();
                assert!(error < 1e-13 * phase.max(1.0), "{phase} {omega} {zeta}: {error:e}");
            }
        }
    }

    #[test]
    fn a_rigid_body_under_a_growing_force_moves_as_newton_says() {
        let system = LinearSystem {
            a: DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 0.0, 0.0]),
            value: vec![0.0, 2.0],
            slope: vec![0.0, 0.0],
        };
        let mut state = vec![1.0, -3.0];
        let advance = system.advance_over(0.5).unwrap();
        advance.apply(&mut state, &mut Vec::new(), 4.0, 6.0);
        let expected = 1.0 - 3.0 * 0.5 + 2.0 * (4.0 * 0.125 + 6.0 * 0.125 / 6.0);
        assert!((state[0] - expected).abs() < 1e-14);
    }

    #[test]
    fn what_cannot_be_followed_is_refused() {
        for entry in [f64::NAN, f64::INFINITY, 1e300, 1e13] {
            let system =
                LinearSystem { a: DMatrix::from_element(1, 1, -entry), value: vec![0.0], slope: vec![0.0] };
            assert!(matches!(system.advance_over(1.0), Err(PlantError::TooFast { .. })));
        }
    }
}
