//! From a system that is sampled with a zero-order hold to the continuous one that it samples: the logarithm
//! of its step.

use nalgebra::{Complex, DMatrix, Schur};

use super::{Matrices, MatricesProblem};
use crate::linear::exponential;

/// A pole this small beside 1 is a delay.
const AT_ONCE: f64 = 1e-9;
/// A pole whose imaginary part is this small beside it is real.
const REAL: f64 = 1e-9;
/// The exponential of the logarithm must give back the step as well as this.
const EXACT: f64 = 1e-10;
/// Square roots are taken until the step is this near to one.
const NEAR_ONE: f64 = 0.1;
/// Square roots that are taken at most; 2^40 samples are beyond any machine's time constants.
const MOST_ROOTS: u32 = 40;

/// The continuous system that gives these matrices when it is sampled every `sample_s` seconds, its input
/// held between.
///
/// # Errors
/// [`MatricesProblem`] where no continuous system does: a pole at zero or on the negative real axis.
pub(crate) fn continuous(discrete: &Matrices, sample_s: f64) -> Result<Matrices, MatricesProblem> {
    let size = discrete.a.nrows();
    // The input, which stays, as one more state.
    let mut step = DMatrix::identity(size + 1, size + 1);
    step.view_mut((0, 0), (size, size)).copy_from(&discrete.a);
    step.view_mut((0, size), (size, 1)).copy_from(&discrete.b);
    let rate = logarithm(&step)?;
    let given_back = exponential(rate.clone()).ok_or(MatricesProblem::NoLogarithm)?;
    if (given_back - &step).amax() > EXACT * step.amax() {
        return Err(MatricesProblem::NoLogarithm);
    }
    let rate = rate / sample_s;
    Ok(Matrices {
        a: rate.view((0, 0), (size, size)).into_owned(),
        b: rate.view((0, size), (size, 1)).column(0).into_owned(),
        ..discrete.clone()
    })
}

/// The principal logarithm, by square roots of the triangular form and a series.
fn logarithm(step: &DMatrix<f64>) -> Result<DMatrix<f64>, MatricesProblem> {
    let size = step.nrows();
    let schur = Schur::try_new(step.map(Complex::from), f64::EPSILON, 10_000);
    let (turn, mut triangle) = schur.ok_or(MatricesProblem::NoLogarithm)?.unpack();
    for pole in triangle.diagonal().iter() {
        if pole.norm() <= AT_ONCE {
            return Err(MatricesProblem::DelayPole);
        }
        if pole.re < 0.0 && pole.im.abs() <= REAL * pole.norm() {
            return Err(MatricesProblem::NegativePole { pole: pole.re });
        }
    }
    triangle = triangle.upper_triangle();
    let one = DMatrix::<Complex<f64>>::identity(size, size);
    let mut roots = 0;
    while (&triangle - &one).norm() > NEAR_ONE {
        if roots == MOST_ROOTS {
            return Err(MatricesProblem::NoLogarithm);
        }
        triangle = root_of_triangle(&triangle).ok_or(MatricesProblem::NoLogarithm)?;
        roots += 1;
    }
    // log T = 2 artanh Z, whose series converges by |Z|² ≤ 0.003 per term.
    let denominator = (&triangle + &one).lu();
    let z = denominator.solve(&(&triangle - &one)).ok_or(MatricesProblem::NoLogarithm)?;
    let square = &z * &z;
    let (mut power, mut sum) = (z.clone(), z);
    for order in [3.0, 5.0, 7.0, 9.0, 11.0, 13.0] {
        power = &power * &square;
        sum += power.map(|entry| entry / order);
    }
    let factor = 2.0 * f64::from(roots).exp2();
    let logarithm = &turn * sum.map(|entry| entry * factor) * turn.adjoint();
    Ok(logarithm.map(|entry| entry.re))
}

/// The principal square root of an upper triangle, diagonal by diagonal.
fn root_of_triangle(triangle: &DMatrix<Complex<f64>>) -> Option<DMatrix<Complex<f64>>> {
    let size = triangle.nrows();
    let mut root = DMatrix::from_element(size, size, Complex::from(0.0));
    for column in 0..size {
        root[(column, column)] = triangle[(column, column)].sqrt();
        for row in (0..column).rev() {
            let known: Complex<f64> =
                (row + 1..column).map(|between| root[(row, between)] * root[(between, column)]).sum();
            let sum = root[(row, row)] + root[(column, column)];
            root[(row, column)] = (triangle[(row, column)] - known) / sum;
        }
    }
    root.iter().all(|entry| entry.is_finite()).then_some(root)
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;

    /// A slow lag, a fast mode and a free body, sampled and found again.
    #[test]
    fn what_was_sampled_is_found_again() {
        let a = DMatrix::from_row_slice(
            5,
            5,
            &[
                0.0, 1.0, 0.0, 0.0, 0.0, //
                -2500.0, -2.0, 0.0, 0.0, 0.3, //
                0.0, 0.0, 0.0, 1.0, 0.0, //
                0.0, 0.0, 0.0, 0.0, 0.0, //
                0.0, 0.0, 0.5, 0.0, -0.1,
            ],
        );
        let b = DVector::from_vec(vec![0.0, 1.0, 0.0, 0.5, 2.0]);
        let system = Matrices { c: DMatrix::identity(5, 5), d: DVector::zeros(5), a, b };
        let mut rate = DMatrix::zeros(6, 6);
        rate.view_mut((0, 0), (5, 5)).copy_from(&system.a);
        rate.view_mut((0, 5), (5, 1)).copy_from(&system.b);
        let step = exponential(rate * 0.02).unwrap();
        let sampled = Matrices {
            a: step.view((0, 0), (5, 5)).into_owned(),
            b: step.view((0, 5), (5, 1)).column(0).into_owned(),
            ..system.clone()
        };
        let found = continuous(&sampled, 0.02).unwrap();
        assert!((found.a - &system.a).amax() < 1e-9 * system.a.amax());
        assert!((found.b - &system.b).amax() < 1e-9);
    }

    #[test]
    fn what_nothing_continuous_samples_is_refused() {
        let of = |entries: &[f64]| {
            let size = if entries.len() == 1 { 1 } else { 2 };
            let a = DMatrix::from_row_slice(size, size, entries);
            let system = Matrices {
                b: DVector::from_element(size, 1.0),
                c: DMatrix::from_element(1, size, 1.0),
                d: DVector::zeros(1),
                a,
            };
            continuous(&system, 0.1).unwrap_err()
        };
        assert_eq!(of(&[-0.5]), MatricesProblem::NegativePole { pole: -0.5 });
        assert_eq!(of(&[0.0, 1.0, 0.0, 0.5]), MatricesProblem::DelayPole);
    }
}
