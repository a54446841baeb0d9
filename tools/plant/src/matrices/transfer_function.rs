//! Transfer functions as matrices: the controllable form of every denominator, side by side.

use nalgebra::{DMatrix, DVector};

use super::{MOST_STATES, Matrices};
use crate::model::{InvalidParameter, MatricesProblem, Problem};

/// One numerator per output, and one denominator for all or one per output; the highest power first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Polynomials {
    pub(crate) numerators: Vec<Vec<f64>>,
    pub(crate) denominators: Vec<Vec<f64>>,
}

/// The system of one input whose outputs have these transfer functions.
///
/// # Errors
/// [`InvalidParameter`] at `numerator` or `denominator`.
pub(crate) fn of_polynomials(polynomials: &Polynomials) -> Result<Matrices, InvalidParameter> {
    let refused = |key: &str, problem| Err(InvalidParameter::new(key, Problem::Matrices(Box::new(problem))));
    let Polynomials { numerators, denominators } = polynomials;
    let (outputs, count) = (numerators.len(), denominators.len());
    if outputs == 0 || (count != 1 && count != outputs) {
        let problem = MatricesProblem::PolynomialCount { numerators: outputs, denominators: count };
        return refused("denominator", problem);
    }
    // Outputs with the same denominator share its states.
    let mut blocks: Vec<&[f64]> = Vec::new();
    let mut block_of = Vec::with_capacity(outputs);
    for denominator in denominators.iter().cycle().take(outputs) {
        let denominator = trimmed(denominator);
        if denominator.is_empty() {
            return refused("denominator", MatricesProblem::EmptyPolynomial);
        }
        let known = blocks.iter().position(|block| *block == denominator);
        block_of.push(known.unwrap_or(blocks.len()));
        if known.is_none() {
            blocks.push(denominator);
        }
    }
    let order = |block: &[f64]| block.len() - 1;
    let size: usize = blocks.iter().map(|block| order(block)).sum();
    if size > MOST_STATES {
        return refused("denominator", MatricesProblem::StateCount { found: size, most: MOST_STATES });
    }
    let mut system = Matrices {
        a: DMatrix::zeros(size, size),
        b: DVector::zeros(size),
        c: DMatrix::zeros(outputs, size),
        d: DVector::zeros(outputs),
    };
    let mut starts = Vec::with_capacity(blocks.len());
    let mut start = 0;
    for block in &blocks {
        starts.push(start);
        controllable(block, start, &mut system);
        start += order(block);
    }
    for (output, (numerator, &block)) in numerators.iter().zip(&block_of).enumerate() {
        let numerator = trimmed(numerator);
        let (denominator, start) = (blocks[block], starts[block]);
        if numerator.is_empty() {
            return refused("numerator", MatricesProblem::EmptyPolynomial);
        }
        if numerator.len() > denominator.len() {
            let (numerator, denominator) = (numerator.len() - 1, order(denominator));
            return refused("numerator", MatricesProblem::Improper { numerator, denominator });
        }
        let missing = denominator.len() - numerator.len();
        let mut full = vec![0.0; missing];
        full.extend(numerator.iter().map(|coefficient| coefficient / denominator[0]));
        system.d[output] = full[0];
        for power in 0..order(denominator) {
            let share = full[power + 1] - full[0] * denominator[power + 1] / denominator[0];
            system.c[(output, start + power)] = share;
        }
    }
    Ok(system)
}

/// States that are the derivatives of one signal, the highest first.
fn controllable(denominator: &[f64], start: usize, system: &mut Matrices) {
    let order = denominator.len() - 1;
    for power in 0..order {
        system.a[(start, start + power)] = -denominator[power + 1] / denominator[0];
        if power > 0 {
            system.a[(start + power, start + power - 1)] = 1.0;
        }
    }
    if order > 0 {
        system.b[start] = 1.0;
    }
}

/// Without leading zeros.
fn trimmed(polynomial: &[f64]) -> &[f64] {
    let start = polynomial.iter().position(|coefficient| *coefficient != 0.0);
    start.and_then(|start| polynomial.get(start..)).unwrap_or(&[])
}
