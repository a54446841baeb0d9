//! An independent beam: Hermite-cubic finite elements, sharing nothing with the crate but the profile's
//! numbers.

use nalgebra::{Cholesky, DMatrix, SymmetricEigen};

/// A rectangular beam with straight-line width and thickness between corners.
pub struct Beam<'a> {
    pub length_m: f64,
    pub density_kg_m3: f64,
    pub young_pa: f64,
    pub width_m: &'a dyn Fn(f64) -> f64,
    pub thickness_m: &'a dyn Fn(f64) -> f64,
}

/// What holds the clamped end.
pub enum Root {
    /// It does not move.
    Held,
    /// It cannot turn, but slides, carrying this mass in kg.
    Sliding(f64),
    /// It does not move, and turns against this stiffness in N·m/rad.
    Turning(f64),
    /// It slides, carrying this mass in kg, and turns against this stiffness in N·m/rad.
    SlidingAndTurning(f64, f64),
}

/// Five-point Gauss-Legendre rule on 0..1.
pub const RULE: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// Natural frequencies in rad/s, ascending. With a sliding root the first is the rigid translation, about 0.
pub fn frequencies_rad_s(beam: &Beam<'_>, elements: usize, root: &Root) -> Vec<f64> {
    let (mass, stiffness) = matrices(beam, elements, root);
    modes(mass, &stiffness).0
}

/// Mass and stiffness matrices. Freedoms are deflection and slope of every node from the root on, those that
/// the root holds left out; the last but one is the tip's deflection.
pub fn matrices(beam: &Beam<'_>, elements: usize, root: &Root) -> (DMatrix<f64>, DMatrix<f64>) {
    let size = 2 * (elements + 1);
    let mut mass: DMatrix<f64> = DMatrix::zeros(size, size);
    let mut stiffness: DMatrix<f64> = DMatrix::zeros(size, size);
    let h = beam.length_m / elements as f64;
    for element in 0..elements {
        for (s, weight) in RULE {
            let x = h * (element as f64 + s);
            let (b, t) = ((beam.width_m)(x), (beam.thickness_m)(x));
            let m = weight * h * beam.density_kg_m3 * b * t;
            let k = weight * h * beam.young_pa * b * t.powi(3) / 12.0;
            let n = [
                1.0 - 3.0 * s * s + 2.0 * s.powi(3),
                h * (s - 2.0 * s * s + s.powi(3)),
                3.0 * s * s - 2.0 * s.powi(3),
                h * (s.powi(3) - s * s),
            ];
            let d = [
                (-6.0 + 12.0 * s) / (h * h),
                (-4.0 + 6.0 * s) / h,
                (6.0 - 12.0 * s) / (h * h),
                (6.0 * s - 2.0) / h,
            ];
            for i in 0..4 {
                for j in 0..4 {
                    mass[(2 * element + i, 2 * element + j)] += m * n[i] * n[j];
                    stiffness[(2 * element + i, 2 * element + j)] += k * d[i] * d[j];
                }
            }
        }
    }
    match root {
        Root::Held => {
            (mass.remove_rows(0, 2).remove_columns(0, 2), stiffness.remove_rows(0, 2).remove_columns(0, 2))
        }
        Root::Turning(stiffness_n_m_rad) => {
            stiffness[(1, 1)] += stiffness_n_m_rad;
            (mass.remove_row(0).remove_column(0), stiffness.remove_row(0).remove_column(0))
        }
        Root::SlidingAndTurning(base_kg, stiffness_n_m_rad) => {
            mass[(0, 0)] += base_kg;
            stiffness[(1, 1)] += stiffness_n_m_rad;
            (mass, stiffness)
        }
        Root::Sliding(base_kg) => {
            mass[(0, 0)] += base_kg;
            (mass.remove_row(1).remove_column(1), stiffness.remove_row(1).remove_column(1))
        }
    }
}

/// Natural frequencies in rad/s, ascending, and shapes with `vᵀ M v = 1` as columns.
pub fn modes(mass: DMatrix<f64>, stiffness: &DMatrix<f64>) -> (Vec<f64>, DMatrix<f64>) {
    let size = mass.nrows();
    let lower = Cholesky::new(mass).expect("positive definite").unpack();
    let half = lower.solve_lower_triangular(stiffness).expect("regular");
    let reduced = lower.solve_lower_triangular(&half.transpose()).expect("regular");
    let eigen = SymmetricEigen::new(0.5 * (&reduced + reduced.transpose()));
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_by(|a, b| f64::total_cmp(&eigen.eigenvalues[*a], &eigen.eigenvalues[*b]));
    let omegas = order.iter().map(|index| eigen.eigenvalues[*index].max(0.0).sqrt()).collect();
    let columns: Vec<_> = order.iter().map(|index| eigen.eigenvectors.column(*index)).collect();
    let shapes = lower.transpose().solve_upper_triangular(&DMatrix::from_columns(&columns)).expect("regular");
    (omegas, shapes)
}
