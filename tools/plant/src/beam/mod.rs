//! From width and thickness along the beam to the matrices of the paper's eq. 12 (eqs. 13, 14, 17 to 20).
//!
//! # Stiffness: the weak form
//! Eq. 20 reads `k_ij = E ∫ phi_j (I phi_i'')'' dx`. Integrating by parts twice,
//! `∫ phi_j (I phi_i'')'' = [phi_j (I phi_i'')' − phi_j' I phi_i'']_0^l + ∫ I phi_i'' phi_j'' dx`.
//! At the clamp `phi_j = phi_j' = 0` (eq. 7). At the tip `phi_i'' = phi_i''' = 0` (eq. 8), so both
//! `I phi_i''` and `(I phi_i'')' = I' phi_i'' + I phi_i'''` vanish, tapered or not. What remains is
//! `k_ij = E ∫ I phi_i'' phi_j'' dx`: symmetric by its form, and defined where `I` has corners and eq. 20
//! has no second derivative to offer.
//!
//! # Errata of the paper that matter here
//! Eq. 4 has `[I w_xxx]_xx` where it means `[I w_xx]_xx` (compare eqs. 2 and 20).

mod basis;
mod quadrature;
mod tables;

use nalgebra::{DMatrix, DVector};

pub use basis::BasisFunction;

use crate::error::PlantError;
use crate::model::BeamParameters;

/// Basis functions for a model that keeps `modes` modes.
///
/// The functions know nothing of the taper, so convergence is algebraic. With this many, the kept frequencies
/// of beams that taper up to two to one are within 1e-4 of finite elements, and the first two within 5e-6
/// (tests/frequencies.rs).
pub fn basis_functions(modes: usize) -> usize {
    24 + 4 * modes
}

/// The Galerkin matrices of the beam alone, in the basis of [`BasisFunction`]s.
#[derive(Debug, Clone, PartialEq)]
pub struct Galerkin {
    /// `m_ij` in kg, eq. 19: symmetric, positive definite, n by n (one more than asked for if the clamp
    /// turns).
    pub mass_kg: DMatrix<f64>,
    /// `k_ij` in N/m, eq. 20 in its weak form: symmetric, positive definite, n by n.
    pub stiffness_n_m: DMatrix<f64>,
    /// `h_i` in kg, eq. 18: coupling of base and beam.
    pub coupling_kg: DVector<f64>,
    /// `phi_i(l)`, dimensionless: what the tip sees of each basis function.
    pub tip: DVector<f64>,
    /// Mass of the beam in kg: the integral in eq. 17, so that `J` is this plus the base's mass.
    pub beam_mass_kg: f64,
}

/// A function that the deflection is made of.
enum Shape {
    /// Clamped at the base.
    Bends(BasisFunction),
    /// `x / l`: the straight beam turned about a clamp that gives way. The bending moment there comes from
    /// the others, the slope from this one.
    Turns { length_m: f64 },
}

impl Shape {
    fn value(&self, x_m: f64) -> f64 {
        match self {
            Self::Bends(function) => function.value(x_m),
            Self::Turns { length_m } => x_m / length_m,
        }
    }

    fn curvature_per_m2(&self, x_m: f64) -> f64 {
        match self {
            Self::Bends(function) => function.curvature_per_m2(x_m),
            Self::Turns { .. } => 0.0,
        }
    }
}

/// Area in m² and second moment of area in m⁴.
fn section_at(beam: &BeamParameters, x_m: f64) -> (f64, f64) {
    if let Some(section) = &beam.fittings.section {
        return (section.area_m2.at(x_m), section.second_moment_m4.at(x_m));
    }
    let thickness_m = beam.thickness_m.at(x_m);
    let area_m2 = beam.width_m.at(x_m) * thickness_m;
    (area_m2, area_m2 * thickness_m * thickness_m / 12.0)
}

fn section_corners_m(beam: &BeamParameters) -> Vec<f64> {
    let profiles = match &beam.fittings.section {
        Some(section) => [&section.area_m2, &section.second_moment_m4],
        None => [&beam.width_m, &beam.thickness_m],
    };
    profiles.into_iter().flat_map(crate::profile::Profile::corners_m).collect()
}

/// Integrates eqs. 17 to 20 with `basis_functions` functions (at least 1).
///
/// The section is rectangular, `A = width · thickness`, `I = width · thickness³ / 12`, or given by tables. A
/// tip mass adds `m φ_i(l) φ_j(l)` and `m φ_i(l)`; a clamp that turns adds one function, `x / l`, and its
/// spring. The integrals are exact to rounding; the only approximation is the number of functions.
///
/// # Errors
/// [`PlantError::Degenerate`] when the parameters do not give finite matrices.
pub fn galerkin(beam: &BeamParameters, basis_functions: usize) -> Result<Galerkin, PlantError> {
    let n = basis_functions.max(1);
    let turns = beam.fittings.clamp_stiffness_n_m_rad;
    let mut functions: Vec<Shape> =
        (0..n).map(|index| Shape::Bends(BasisFunction::new(index, beam.length_m))).collect();
    if turns.is_some() {
        functions.push(Shape::Turns { length_m: beam.length_m });
    }
    let n = functions.len();
    let tables = tables::tables(beam.length_m, section_corners_m(beam), &functions, turns.is_some());
    let (mut masses, mut stiffnesses) = (tables.values.clone(), tables.curvatures_per_m2.clone());
    let mut coupling_kg = DVector::zeros(n);
    let mut beam_mass_kg = 0.0;
    for (column, &(x_m, weight_m)) in tables.nodes.iter().enumerate() {
        let (area_m2, inertia_m4) = section_at(beam, x_m);
        let mass = weight_m * beam.density_kg_m3 * area_m2;
        beam_mass_kg += mass;
        coupling_kg.axpy(mass, &tables.values.column(column), 1.0);
        masses.column_mut(column).scale_mut(mass);
        stiffnesses.column_mut(column).scale_mut(weight_m * beam.young_pa * inertia_m4);
    }
    let mut result = Galerkin {
        mass_kg: symmetric(&masses * tables.values.transpose()),
        stiffness_n_m: symmetric(&stiffnesses * tables.curvatures_per_m2.transpose()),
        coupling_kg,
        tip: DVector::from_iterator(n, functions.iter().map(|f| f.value(beam.length_m))),
        beam_mass_kg,
    };
    let tip_mass_kg = beam.fittings.tip_mass_kg;
    let tip = result.tip.clone();
    result.beam_mass_kg += tip_mass_kg;
    result.coupling_kg.axpy(tip_mass_kg, &tip, 1.0);
    result.mass_kg.ger(tip_mass_kg, &tip, &tip, 1.0);
    if let Some(stiffness_n_m_rad) = turns {
        // Only the last function has a slope at the clamp: 1/l.
        result.stiffness_n_m[(n - 1, n - 1)] += stiffness_n_m_rad / (beam.length_m * beam.length_m);
    }
    let finite = result.mass_kg.iter().chain(result.stiffness_n_m.iter()).all(|entry| entry.is_finite());
    if finite { Ok(result) } else { Err(PlantError::Degenerate) }
}

/// A product that is symmetric but for rounding, made so exactly.
fn symmetric(mut product: DMatrix<f64>) -> DMatrix<f64> {
    product.fill_upper_triangle_with_lower_triangle();
    product
}
