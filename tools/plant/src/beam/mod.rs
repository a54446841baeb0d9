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

use nalgebra::{DMatrix, DVector};

pub use basis::BasisFunction;

use crate::error::PlantError;
use crate::model::BeamParameters;

/// Basis functions for a model that keeps `modes` modes.
///
/// The functions know nothing of the taper, so convergence is algebraic. With this many, the kept frequencies of
/// beams that taper up to two to one are within 1e-4 of finite elements, and the first two within 5e-6
/// (tests/frequencies.rs).
pub fn basis_functions(modes: usize) -> usize {
    24 + 4 * modes
}

/// The Galerkin matrices of the beam alone, in the basis of [`BasisFunction`]s.
#[derive(Debug, Clone, PartialEq)]
pub struct Galerkin {
    /// `m_ij` in kg, eq. 19: symmetric, positive definite, n by n.
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

/// Integrates eqs. 17 to 20 with `basis_functions` functions (at least 1).
///
/// The section is rectangular: `A = width · thickness`, `I = width · thickness³ / 12`. The integrals are exact
/// to rounding; the only approximation is the number of functions.
///
/// # Errors
/// [`PlantError::Degenerate`] when the parameters do not give finite matrices.
pub fn galerkin(beam: &BeamParameters, basis_functions: usize) -> Result<Galerkin, PlantError> {
    let n = basis_functions.max(1);
    let functions: Vec<BasisFunction> =
        (0..n).map(|index| BasisFunction::new(index, beam.length_m)).collect();
    let mut corners_m = beam.width_m.corners_m();
    corners_m.extend(beam.thickness_m.corners_m());
    let mut result = Galerkin {
        mass_kg: DMatrix::zeros(n, n),
        stiffness_n_m: DMatrix::zeros(n, n),
        coupling_kg: DVector::zeros(n),
        tip: DVector::from_iterator(n, functions.iter().map(|f| f.value(beam.length_m))),
        beam_mass_kg: 0.0,
    };
    // One wave of the highest product of two functions per panel.
    let longest_panel_m = beam.length_m / n as f64;
    for (x_m, weight_m) in quadrature::nodes(beam.length_m, &corners_m, longest_panel_m) {
        let (width_m, thickness_m) = (beam.width_m.at(x_m), beam.thickness_m.at(x_m));
        let area_m2 = width_m * thickness_m;
        let inertia_m4 = area_m2 * thickness_m * thickness_m / 12.0;
        let mass = weight_m * beam.density_kg_m3 * area_m2;
        let stiffness = weight_m * beam.young_pa * inertia_m4;
        let values = DVector::from_iterator(n, functions.iter().map(|f| f.value(x_m)));
        let curvatures = DVector::from_iterator(n, functions.iter().map(|f| f.curvature_per_m2(x_m)));
        result.beam_mass_kg += mass;
        result.coupling_kg.axpy(mass, &values, 1.0);
        result.mass_kg.ger(mass, &values, &values, 1.0);
        result.stiffness_n_m.ger(stiffness, &curvatures, &curvatures, 1.0);
    }
    let finite = result.mass_kg.iter().chain(result.stiffness_n_m.iter()).all(|entry| entry.is_finite());
    if finite { Ok(result) } else { Err(PlantError::Degenerate) }
}
