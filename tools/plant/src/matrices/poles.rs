//! Poles, those that rounding cannot tell apart taken together.

use nalgebra::{Complex, DMatrix, Schur};

use super::MatricesProblem;

/// Poles this close, relative to their size, are taken together: rounding parts a double pole by the square
/// root of its precision.
const TOGETHER: f64 = 1e-6;

/// A pole at zero is this small beside the fastest, and a pair of them has so small a mean.
const ZERO: f64 = 1e-11;

/// Poles in one place.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cluster {
    /// Where, 1/s: their mean; exactly real, or exactly zero, where they are.
    pub(super) centre: Complex<f64>,
    /// How many.
    pub(super) count: usize,
    /// Distance of the nearest other pole, 1/s; of one that is alone, its distance from zero, or 1.
    pub(super) gap: f64,
}

/// All poles, of conjugate pairs the one above the real axis.
///
/// # Errors
/// [`MatricesProblem::Inexact`] when the eigenvalues are not found.
pub(super) fn clusters(a: &DMatrix<f64>) -> Result<Vec<Cluster>, MatricesProblem> {
    let poles = eigenvalues(a)?;
    let fastest = poles.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
    let (zero, others): (Vec<_>, Vec<_>) = poles.iter().copied().partition(at_zero(&poles, fastest));
    let mut groups: Vec<Vec<Complex<f64>>> = Vec::new();
    for pole in others {
        let is_near =
            |member: &Complex<f64>| (pole - member).norm() <= TOGETHER * pole.norm().max(member.norm());
        let (mut near, far): (Vec<_>, Vec<_>) =
            groups.into_iter().partition(|group: &Vec<_>| group.iter().any(is_near));
        groups = far;
        let mut joined: Vec<Complex<f64>> = near.drain(..).flatten().collect();
        joined.push(pole);
        groups.push(joined);
    }
    let mut found: Vec<(Complex<f64>, usize)> = groups.iter().map(|group| centre_of(group)).collect();
    if !zero.is_empty() {
        found.push((Complex::from(0.0), zero.len()));
    }
    let centres = found.clone();
    let gap = |index: usize, centre: Complex<f64>| {
        let others = centres.iter().enumerate().filter(|(other, _)| *other != index);
        let nearest = others.map(|(_, (other, _))| (other - centre).norm()).fold(f64::INFINITY, f64::min);
        let alone = if centre.norm() > 0.0 { centre.norm() } else { 1.0 };
        if nearest.is_finite() { nearest } else { alone }
    };
    let found = found.into_iter().enumerate();
    let upper = found.filter(|(_, (centre, _))| centre.im >= 0.0);
    let upper = upper.map(|(index, (centre, count))| Cluster { centre, count, gap: gap(index, centre) });
    Ok(upper.collect())
}

fn eigenvalues(a: &DMatrix<f64>) -> Result<Vec<Complex<f64>>, MatricesProblem> {
    if a.is_empty() {
        return Ok(Vec::new());
    }
    let schur = Schur::try_new(a.clone(), f64::EPSILON, 10_000).ok_or(MatricesProblem::Inexact)?;
    let poles: Vec<_> = schur.complex_eigenvalues().iter().copied().collect();
    if poles.iter().all(|pole| pole.is_finite()) { Ok(poles) } else { Err(MatricesProblem::Inexact) }
}

/// Tells poles at zero: each by itself, or several that rounding has parted around it.
fn at_zero(poles: &[Complex<f64>], fastest: f64) -> impl Fn(&Complex<f64>) -> bool {
    let near: Vec<_> = poles.iter().filter(|pole| pole.norm() <= TOGETHER * fastest).collect();
    let mean = near.iter().copied().sum::<Complex<f64>>() / near.len().max(1) as f64;
    let parted = near.len() > 1 && mean.norm() <= ZERO * fastest;
    move |pole| pole.norm() <= if parted { TOGETHER * fastest } else { ZERO * fastest }
}

fn centre_of(group: &[Complex<f64>]) -> (Complex<f64>, usize) {
    let mean = group.iter().sum::<Complex<f64>>() / group.len().max(1) as f64;
    let is_real = mean.im.abs() <= TOGETHER * mean.norm();
    (if is_real { Complex::from(mean.re) } else { mean }, group.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn double_poles_are_found_together_and_slow_poles_beside_zero_apart() {
        let of =
            |rows: usize, entries: &[f64]| clusters(&DMatrix::from_row_slice(rows, rows, entries)).unwrap();
        assert_eq!(
            of(2, &[0.0, 1.0, 0.0, 0.0]),
            [Cluster { centre: Complex::from(0.0), count: 2, gap: 1.0 }]
        );
        let critical = of(2, &[0.0, 1.0, -9.0, -6.0]);
        assert_eq!((critical.len(), critical[0].count), (1, 2), "{critical:?}");
        assert!((critical[0].centre - Complex::from(-3.0)).norm() < 1e-6);
        let sliding = of(3, &[0.0, 1.0, 0.0, 0.0, -1e-5, 0.0, 0.0, 0.0, -1e3]);
        assert_eq!(sliding.len(), 3, "{sliding:?}");
        assert!(sliding.iter().any(|cluster| cluster.centre == Complex::from(0.0)));
    }
}
