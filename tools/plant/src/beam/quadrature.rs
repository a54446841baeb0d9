//! Gauss-Legendre integration over the beam, corner to corner.

use std::f64::consts::PI;

/// Points per panel: exact for polynomials up to degree 23, and to rounding for one wave per panel.
const POINTS: usize = 12;

/// Positions and weights of a sum that stands for `∫_0^l f(x) dx`.
///
/// Panels end at every corner inside the beam, where the integrand's derivative may jump, and none is longer
/// than `longest_panel_m`.
pub(super) fn nodes(length_m: f64, corners_m: &[f64], longest_panel_m: f64) -> Vec<(f64, f64)> {
    let mut ends: Vec<f64> =
        corners_m.iter().copied().filter(|&x| x > 0.0 && x < length_m).chain([0.0, length_m]).collect();
    ends.sort_unstable_by(f64::total_cmp);
    ends.dedup();
    let rule = rule();
    let mut nodes = Vec::new();
    for (&from, &to) in ends.iter().zip(ends.iter().skip(1)) {
        let panels = ((to - from) / longest_panel_m).ceil().max(1.0);
        let half = 0.5 * (to - from) / panels;
        for panel in 0..panels as usize {
            let middle = from + half * (2 * panel + 1) as f64;
            nodes.extend(rule.iter().map(|(point, weight)| (middle + half * point, half * weight)));
        }
    }
    nodes
}

/// The rule on −1..1: roots of the Legendre polynomial by Newton's method.
fn rule() -> [(f64, f64); POINTS] {
    std::array::from_fn(|index| {
        let mut x = (PI * (index as f64 + 0.75) / (POINTS as f64 + 0.5)).cos();
        let mut slope = 0.0;
        for _ in 0..8 {
            let (mut previous, mut value) = (1.0, x);
            for degree in 2..=POINTS {
                let n = degree as f64;
                let next = ((2.0 * n - 1.0) * x * value - (n - 1.0) * previous) / n;
                previous = value;
                value = next;
            }
            slope = POINTS as f64 * (x * value - previous) / (x * x - 1.0);
            x -= value / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrates_polynomials_exactly_across_corners() {
        for degree in 0..24 {
            let nodes = nodes(2.0, &[0.3, 1.1], 0.7);
            let sum: f64 = nodes.iter().map(|(x, w)| w * x.powi(degree)).sum();
            let exact = 2f64.powi(degree + 1) / f64::from(degree + 1);
            assert!((sum / exact - 1.0).abs() < 1e-13, "degree {degree}: {sum} {exact}");
        }
    }
}
