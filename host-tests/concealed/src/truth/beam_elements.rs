//! The beam as Hermite finite elements: clamped modes of a strip whose section varies along it.

use nalgebra::{Cholesky, DMatrix, SymmetricEigen};

/// Elements along the beam; of a uniform strip three frequencies are then good to 1e-5 and the fifth to 1e-4
/// (see the test).
const ELEMENTS: usize = 40;
/// Gauss-Legendre points and weights on 0..1, exact to degree 9: section times squared shape has at most
/// that.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_5, 0.239_314_335_249_683_2),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_2),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// A rectangular strip clamped at one end.
#[derive(Debug, Clone, PartialEq)]
pub struct Strip {
    /// From clamp to tip, metres.
    pub length_m: f64,
    /// Density, kg/m³.
    pub density_kg_m3: f64,
    /// Young's modulus, Pa.
    pub young_pa: f64,
    /// Width at the clamp and at the tip, metres; a straight line between.
    pub width_m: [f64; 2],
    /// Thickness at the clamp and at the tip, metres; a straight line between.
    pub thickness_m: [f64; 2],
    /// Point mass at the tip, kg.
    pub tip_mass_kg: f64,
    /// Rotational compliance of the clamp, rad/(N·m); 0 is rigid.
    pub clamp_compliance: f64,
}

/// The lowest modes of a strip whose base is held, normalised to unit modal mass.
#[derive(Debug, Clone, PartialEq)]
pub struct StripModes {
    /// Angular frequencies, rad/s, rising.
    pub omega_rad_s: Vec<f64>,
    /// Deflection of the tip per modal coordinate, 1/√kg.
    pub tip: Vec<f64>,
    /// ∫ρA φ dx with the tip mass, √kg: what a motion of the base excites.
    pub base: Vec<f64>,
    /// Mass of strip and tip mass, kg.
    pub mass_kg: f64,
}

impl Strip {
    fn section(&self, share: f64) -> (f64, f64) {
        let at = |ends: [f64; 2]| ends[0] + (ends[1] - ends[0]) * share;
        let (width, thickness) = (at(self.width_m), at(self.thickness_m));
        (width * thickness, width * thickness.powi(3) / 12.0)
    }

    /// The lowest `count` modes; `None` if a size is not positive.
    pub fn modes(&self, count: usize) -> Option<StripModes> {
        let freedoms = 2 * (ELEMENTS + 1);
        let mut mass = DMatrix::<f64>::zeros(freedoms, freedoms);
        let mut stiffness = DMatrix::<f64>::zeros(freedoms, freedoms);
        let size = self.length_m / ELEMENTS as f64;
        let mut total_mass = self.tip_mass_kg;
        for element in 0..ELEMENTS {
            for (place, weight) in GAUSS {
                let (area, inertia) = self.section((element as f64 + place) / ELEMENTS as f64);
                let (shape, curvature) = hermite(place, size);
                let per_length = self.density_kg_m3 * area * weight * size;
                total_mass += per_length;
                for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
                    let (row, column) = (2 * element + i, 2 * element + j);
                    mass[(row, column)] += per_length * shape[i] * shape[j];
                    stiffness[(row, column)] +=
                        self.young_pa * inertia * weight * size * curvature[i] * curvature[j];
                }
            }
        }
        let tip = freedoms - 2;
        mass[(tip, tip)] += self.tip_mass_kg;
        // Translation of every node: the shape of a rigid motion of the base.
        let rigid = DMatrix::from_fn(freedoms, 1, |row, _| if row % 2 == 0 { 1.0 } else { 0.0 });
        let excited = &mass * rigid;
        // The clamp holds the deflection and, unless it is soft, the slope.
        let first = if self.clamp_compliance > 0.0 {
            stiffness[(1, 1)] += 1.0 / self.clamp_compliance;
            1
        } else {
            2
        };
        let free = freedoms - first;
        let lower = Cholesky::new(mass.view((first, first), (free, free)).into_owned())?.l().try_inverse()?;
        let reduced = &lower * stiffness.view((first, first), (free, free)) * lower.transpose();
        let solved = SymmetricEigen::new(0.5 * (&reduced + reduced.transpose()));
        let mut order: Vec<usize> = (0..free).collect();
        order.sort_by(|&a, &b| solved.eigenvalues[a].total_cmp(&solved.eigenvalues[b]));
        let shapes = lower.transpose() * &solved.eigenvectors;
        let mut modes =
            StripModes { omega_rad_s: Vec::new(), tip: Vec::new(), base: Vec::new(), mass_kg: total_mass };
        for &index in order.iter().take(count) {
            let base: f64 = (0..free).map(|row| shapes[(row, index)] * excited[(row + first, 0)]).sum();
            // The sign is free; the tip counts positive in the first mode's direction of the base.
            let sign = base.signum();
            modes.omega_rad_s.push(solved.eigenvalues[index].max(0.0).sqrt());
            modes.tip.push(sign * shapes[(tip - first, index)]);
            modes.base.push(sign * base);
        }
        (modes.omega_rad_s.len() == count && modes.omega_rad_s.iter().all(|omega| *omega > 0.0))
            .then_some(modes)
    }
}

/// The four cubic shapes of an element of a size at a share of its length, and their second derivatives.
fn hermite(s: f64, size: f64) -> ([f64; 4], [f64; 4]) {
    let (s2, s3) = (s * s, s * s * s);
    let shape =
        [1.0 - 3.0 * s2 + 2.0 * s3, size * (s - 2.0 * s2 + s3), 3.0 * s2 - 2.0 * s3, size * (s3 - s2)];
    let curvature = [
        (-6.0 + 12.0 * s) / (size * size),
        (-4.0 + 6.0 * s) / size,
        (6.0 - 12.0 * s) / (size * size),
        (-2.0 + 6.0 * s) / size,
    ];
    (shape, curvature)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uniform() -> Strip {
        Strip {
            length_m: 0.8,
            density_kg_m3: 7800.0,
            young_pa: 2e11,
            width_m: [0.03; 2],
            thickness_m: [0.001; 2],
            tip_mass_kg: 0.0,
            clamp_compliance: 0.0,
        }
    }

    /// Roots of 1 + cos z cosh z and 2 (sinh z + sin z)/(cosh z + cos z)-type constants of a clamped-free
    /// strip.
    #[test]
    fn a_uniform_strip_has_its_textbook_frequencies_and_participations() {
        let strip = uniform();
        let modes = strip.modes(5).unwrap();
        let mass = 7800.0 * 0.03 * 0.001 * 0.8;
        let scale = (2e11 * 0.03 * 0.001_f64.powi(3) / 12.0 / (mass * 0.8_f64.powi(3))).sqrt();
        let roots = [1.875_104_069, 4.694_091_133, 7.854_757_438, 10.995_540_735, 14.137_168_391];
        // ∫φ/l over the root mean square of φ is 2σ/z with σ the usual constant.
        let sigmas = [0.734_095_514, 1.018_467_319, 0.999_224_497, 1.000_033_553, 0.999_998_550];
        for k in 0..5 {
            let omega = roots[k] * roots[k] * scale;
            let tolerance = if k < 3 { 1e-5 } else { 1e-4 };
            assert!((modes.omega_rad_s[k] / omega - 1.0).abs() < tolerance, "mode {k}");
            assert!((modes.tip[k].abs() - 2.0 / mass.sqrt()).abs() < 1e-4 * 2.0 / mass.sqrt());
            let participation = 2.0 * sigmas[k] / roots[k] * mass.sqrt();
            assert!((modes.base[k] / participation - 1.0).abs() < 1e-4, "mode {k}");
        }
        assert!((modes.mass_kg - mass).abs() < 1e-12);
    }

    #[test]
    fn participations_of_all_modes_add_up_to_the_mass() {
        let strip = Strip { width_m: [0.02, 0.03], thickness_m: [0.0013, 0.0010], ..uniform() };
        let modes = strip.modes(40).unwrap();
        let sum: f64 = modes.base.iter().map(|gamma| gamma * gamma).sum();
        assert!((sum / modes.mass_kg - 1.0).abs() < 0.02, "{sum} of {}", modes.mass_kg);
    }

    /// A heavy tip mass makes the strip a spring of 3EI/l³; a soft clamp makes it a rod on a hinge.
    #[test]
    fn limits_of_a_heavy_tip_and_a_soft_clamp() {
        let heavy = Strip { tip_mass_kg: 100.0, ..uniform() }.modes(1).unwrap();
        let ei = 2e11 * 0.03 * 0.001_f64.powi(3) / 12.0;
        let spring = (3.0 * ei / 0.8_f64.powi(3) / 100.0).sqrt();
        assert!((heavy.omega_rad_s[0] / spring - 1.0).abs() < 1e-3);
        let compliance = 1e4;
        let soft = Strip { clamp_compliance: compliance, ..uniform() }.modes(1).unwrap();
        let mass = 7800.0 * 0.03 * 0.001 * 0.8;
        let hinge = (1.0 / compliance / (mass * 0.64 / 3.0)).sqrt();
        assert!((soft.omega_rad_s[0] / hinge - 1.0).abs() < 1e-3);
    }
}
