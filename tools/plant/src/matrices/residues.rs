//! Residues by Cauchy's integral: no eigenvectors, which poles that coincide do not have.

use std::f64::consts::TAU;

use nalgebra::{Complex, DVector};

use super::hessenberg::Turned;
use super::poles::Cluster;

/// Points of the circle. Poles outside are three radii away and those within at its centre, so that the
/// trapezoidal rule is wrong by 3^−40 of a residue.
const POINTS: usize = 40;

/// Poles in one place, and what the outputs have of them: `Σ_k terms[k] / (s − centre)^(k+1)`.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub(super) centre: Complex<f64>,
    pub(super) count: usize,
    /// As many as there are poles; every one has an entry per output.
    pub(super) terms: Vec<DVector<Complex<f64>>>,
}

/// The part of the response that belongs to a cluster; `None` where the circle meets a pole.
pub(super) fn part(system: &Turned, cluster: &Cluster) -> Option<Part> {
    let radius = cluster.gap / 3.0;
    let mut centre = cluster.centre;
    if cluster.count > 1 && centre.norm() > 0.0 {
        // The mean of poles that rounding has parted is known far better than each of them.
        let mut shift = Complex::from(0.0);
        for arm in circle(radius) {
            shift += arm * arm * system.trace(cluster.centre + arm)?;
        }
        let shift = shift / (POINTS * cluster.count) as f64;
        centre += if centre.im == 0.0 { Complex::from(shift.re) } else { shift };
    }
    let mut terms: Vec<DVector<Complex<f64>>> = Vec::new();
    for arm in circle(radius) {
        let response = system.response(cluster.centre + arm)?;
        let offset = cluster.centre + arm - centre;
        let mut weight = arm / POINTS as f64;
        for power in 0..cluster.count {
            let added = &response * weight;
            match terms.get_mut(power) {
                Some(term) => *term += added,
                None => terms.push(added),
            }
            weight *= offset;
        }
    }
    if centre.im == 0.0 {
        terms.iter_mut().flat_map(|term| term.iter_mut()).for_each(|entry| entry.im = 0.0);
    }
    Some(Part { centre, count: cluster.count, terms })
}

/// Arms from the centre of a circle to its points, none on the real axis.
fn circle(radius: f64) -> impl Iterator<Item = Complex<f64>> {
    (0..POINTS).map(move |point| Complex::from_polar(radius, TAU * (point as f64 + 0.5) / POINTS as f64))
}

impl Part {
    /// Its response at `s`, both poles of a pair.
    pub(super) fn response(&self, s: Complex<f64>) -> DVector<Complex<f64>> {
        let outputs = self.terms.first().map_or(0, DVector::len);
        let mut sum = DVector::from_element(outputs, Complex::from(0.0));
        for (power, term) in (1..).zip(&self.terms) {
            sum += term / (s - self.centre).powi(power);
            if self.centre.im > 0.0 {
                sum += term.map(|entry| entry.conj()) / (s - self.centre.conj()).powi(power);
            }
        }
        sum
    }

    /// How much of an output it is, as a steady response: `|residue / pole|`; poles at zero against `rate`,
    /// 1/s.
    pub(super) fn share(&self, output: usize, rate: f64) -> f64 {
        let size = if self.centre.norm() > 0.0 { self.centre.norm() } else { rate };
        let terms = (1..).zip(&self.terms);
        terms.map(|(power, term)| term[output].norm() / size.powi(power)).fold(0.0, f64::max)
    }
}
