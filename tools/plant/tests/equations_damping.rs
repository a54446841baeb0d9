//! The paper's eqs. 21 to 23, Rayleigh damping, and what its Table 1 makes of it.

use crate::support;

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix};
use stillbeam_plant::beam::galerkin;

use support::paper_beam;

/// Eqs. 13 and 14 of the shipped beam with `count` functions.
fn paper_matrices(count: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let model = paper_beam();
    let beam = galerkin(&model.beam, count).unwrap();
    let mut mass = beam.mass_kg.clone().insert_row(0, 0.0).insert_column(0, 0.0);
    mass[(0, 0)] = model.base_mass_kg + beam.beam_mass_kg;
    for (index, h) in beam.coupling_kg.iter().enumerate() {
        mass[(0, index + 1)] = *h;
        mass[(index + 1, 0)] = *h;
    }
    (mass, beam.stiffness_n_m.insert_row(0, 0.0).insert_column(0, 0.0))
}

/// Eigenvalues of eq. 23 with eq. 21 for damping, by rising size.
fn poles(mass: &DMatrix<f64>, stiffness: &DMatrix<f64>, [alpha1, alpha2]: [f64; 2]) -> Vec<Complex<f64>> {
    let size = mass.nrows();
    let damping = alpha1 * mass + alpha2 * stiffness;
    let inverse = mass.clone().try_inverse().expect("a mass matrix is regular");
    let mut system = DMatrix::zeros(2 * size, 2 * size);
    system.view_mut((0, size), (size, size)).copy_from(&DMatrix::identity(size, size));
    system.view_mut((size, 0), (size, size)).copy_from(&(-&inverse * stiffness));
    system.view_mut((size, size), (size, size)).copy_from(&(-&inverse * damping));
    let mut poles: Vec<Complex<f64>> = system.complex_eigenvalues().iter().copied().collect();
    poles.sort_by(|a, b| f64::total_cmp(&a.norm(), &b.norm()));
    poles
}

/// Eq. 22 for two modes, solved for `[alpha1 (1/s), alpha2 (s)]`.
fn coefficients(modes: [(f64, f64); 2]) -> [f64; 2] {
    let [(f1, zeta1), (f2, zeta2)] = modes;
    let (w1, w2) = (TAU * f1, TAU * f2);
    let difference = w2 * w2 - w1 * w1;
    [2.0 * w1 * w2 * (zeta1 * w2 - zeta2 * w1) / difference, 2.0 * (zeta2 * w2 - zeta1 * w1) / difference]
}

fn equation_22(omega: f64, [alpha1, alpha2]: [f64; 2]) -> f64 {
    0.5 * (alpha1 / omega + alpha2 * omega)
}

#[test]
fn equation_22_gives_the_damping_of_every_mode_of_equation_23() {
    let (mass, stiffness) = paper_matrices(3);
    let alphas = [0.08, 1e-4];
    let poles = poles(&mass, &stiffness, alphas);
    // 0 and −alpha1 are the rigid translation; then come pairs.
    for pair in poles[2..].chunks_exact(2) {
        let omega = pair[0].norm();
        let zeta = -pair[0].re / omega;
        assert!((zeta / equation_22(omega, alphas) - 1.0).abs() < 1e-6, "{pair:?}");
    }
}

#[test]
fn equation_21_to_the_letter_brakes_the_base_against_nothing() {
    // alpha1 M holds alpha1 J y': a base that was pushed and let go would lose its momentum to no force. Only
    // damping of the beam's motion relative to its base leaves it.
    let (mass, stiffness) = paper_matrices(3);
    let poles = poles(&mass, &stiffness, [0.08, 1e-4]);
    assert!(poles[0].norm() < 1e-6 && (poles[1] + 0.08).norm() < 1e-6, "{:?}", &poles[..2]);
    let mut model = paper_beam();
    model.beam.damping = stillbeam_plant::BeamDamping::Rayleigh([0.08, 1e-4]);
    let coupled = stillbeam_plant::modes::coupled_modes(&model).unwrap();
    assert_eq!(coupled.damping_per_s.row(0).amax(), 0.0, "the crate's base coasts on");
}

#[test]
fn two_rows_of_table_1_make_rayleigh_damping_that_drives_the_vibration() {
    let linear = coefficients([(1.0063, 0.0011), (7.0017, 0.0089)]);
    let three = coefficients([(1.0951, 0.0071), (6.8917, 0.0059)]);
    let five_down = coefficients([(1.0988, 0.0059), (6.9146, 0.0033)]);
    let seven = coefficients([(1.0976, 0.0083), (6.9196, 0.0012)]);
    let decrement = coefficients([(1.1, 0.0074), (6.9, 0.0074)]);
    for usable in [three, five_down, decrement] {
        assert!(usable[0] > 0.0 && usable[1] > 0.0, "{usable:?}");
    }
    // Linear sweep: alpha1 < 0, so a base that moves is pushed on, ever faster.
    assert!(linear[0] < 0.0 && linear[1] > 0.0, "{linear:?}");
    let (mass, stiffness) = paper_matrices(4);
    let fastest =
        |alphas| poles(&mass, &stiffness, alphas).iter().map(|pole| pole.re).fold(f64::MIN, f64::max);
    assert!(fastest(linear) > 1e-3, "{}", fastest(linear));
    // 7 octaves per minute: alpha2 < 0, so every mode above a certain frequency grows, the fourth one
    // already.
    assert!(seven[0] > 0.0 && seven[1] < 0.0, "{seven:?}");
    let limit_hz = (-seven[0] / seven[1]).sqrt() / TAU;
    assert!((limit_hz - 23.0).abs() < 0.05, "{limit_hz}");
    assert!(equation_22(TAU * 37.8, seven) < 0.0);
    assert!(fastest(seven) > 1e-3, "{}", fastest(seven));
    assert!(fastest(three) < 1e-6 && fastest(decrement) < 1e-6);
}
