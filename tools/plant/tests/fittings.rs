//! Tip mass, soft clamp and sections from tables, against the characteristic equations of uniform beams.

use crate::support;

use stillbeam_plant::modes::{clamped_modes, coupled_modes};
use stillbeam_plant::{Input, Model, Physics, Profile, SectionTables, StateSpace};

use support::beam;

const WIDTH_M: f64 = 0.025;
const THICKNESS_M: f64 = 0.0012;

fn uniform(modes: usize) -> stillbeam_plant::BeamOnBase {
    beam(Profile::Uniform(WIDTH_M), Profile::Uniform(THICKNESS_M), modes)
}

/// Bending stiffness in N·m², mass in kg, and `sqrt(E I / (rho A l⁴))` in rad/s of the uniform beam.
fn constants() -> (f64, f64, f64) {
    let stiffness = 190e9 * WIDTH_M * THICKNESS_M.powi(3) / 12.0;
    let mass = 8190.0 * WIDTH_M * THICKNESS_M * 0.9;
    (stiffness, mass, (stiffness / (mass * 0.9_f64.powi(3))).sqrt())
}

/// Roots of `1 + cos b cosh b + ratio b (cos b sinh b − sin b cosh b) = 0`: a tip mass of `ratio` beam
/// masses, and as well a clamp whose rotational stiffness is `E I / (l ratio)`.
fn roots(ratio: f64, count: usize) -> Vec<f64> {
    let value = |b: f64| 1.0 / b.cosh() + b.cos() + ratio * b * (b.cos() * b.tanh() - b.sin());
    let mut found = Vec::new();
    let mut from = 1e-3;
    while found.len() < count {
        let to = from + 1e-3;
        if value(from) * value(to) <= 0.0 {
            let (mut low, mut high) = (from, to);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if value(low) * value(middle) <= 0.0 { high = middle } else { low = middle }
            }
            found.push(0.5 * (low + high));
        }
        from = to;
    }
    found
}

#[test]
fn a_tip_mass_lowers_the_frequencies_as_its_characteristic_equation_says() {
    let (_, mass, scale) = constants();
    for ratio in [0.0, 0.01, 0.1, 1.0, 5.0] {
        let mut model = uniform(3);
        model.beam.fittings.tip_mass_kg = ratio * mass;
        let modes = clamped_modes(&model).unwrap();
        for (mode, b) in modes.iter().zip(roots(ratio, 3)) {
            let error = mode.omega_rad_s / (b * b * scale) - 1.0;
            assert!(error.abs() < 1e-4, "{ratio}: {} {}: {error:e}", mode.omega_rad_s, b * b * scale);
        }
        // What accelerates with the base is the whole beam and its tip mass.
        let coupling: f64 = clamped_modes(&{
            let mut all = model;
            all.beam.modes = 8;
            all.beam.damping = stillbeam_plant::BeamDamping::Ratios(vec![0.0; 8]);
            all
        })
        .unwrap()
        .iter()
        .map(|mode| mode.coupling * mode.coupling)
        .sum();
        let total = (1.0 + ratio) * mass;
        assert!(coupling < total && coupling > 0.93 * total, "{ratio}: {coupling} of {total}");
    }
}

#[test]
fn a_soft_clamp_lowers_the_frequencies_as_its_characteristic_equation_says() {
    let (stiffness, _, scale) = constants();
    for ratio in [0.001, 0.02, 0.3, 3.0] {
        let mut model = uniform(3);
        model.beam.fittings.clamp_stiffness_n_m_rad = Some(stiffness / (0.9 * ratio));
        for (mode, b) in clamped_modes(&model).unwrap().iter().zip(roots(ratio, 3)) {
            let error = mode.omega_rad_s / (b * b * scale) - 1.0;
            assert!(error.abs() < 1e-4, "{ratio}: {} {}: {error:e}", mode.omega_rad_s, b * b * scale);
        }
    }
    let mut rigid = uniform(2);
    let expected = clamped_modes(&rigid).unwrap();
    rigid.beam.fittings.clamp_stiffness_n_m_rad = Some(1e9);
    for (stiff, held) in clamped_modes(&rigid).unwrap().iter().zip(&expected) {
        assert!((stiff.omega_rad_s / held.omega_rad_s - 1.0).abs() < 1e-5);
        assert!((stiff.tip_participation() / held.tip_participation() - 1.0).abs() < 1e-4);
    }
    // The base is free and feels the tip mass: the rigid translation carries everything.
    let mut free = uniform(1);
    free.beam.fittings.tip_mass_kg = 0.3;
    let rigid = coupled_modes(&free).unwrap().base[0];
    assert!((rigid.powi(-2) - (2.5 + constants().1 + 0.3)).abs() < 1e-9);
}

#[test]
fn tables_of_area_and_second_moment_are_the_rectangle_they_describe() {
    let rectangle = uniform(3);
    let mut tables = rectangle.clone();
    tables.beam.fittings.section = Some(SectionTables {
        area_m2: Profile::Uniform(WIDTH_M * THICKNESS_M),
        second_moment_m4: Profile::Corners(vec![
            [0.0, WIDTH_M * THICKNESS_M.powi(3) / 12.0],
            [0.9, WIDTH_M * THICKNESS_M.powi(3) / 12.0],
        ]),
    });
    for (a, b) in clamped_modes(&rectangle).unwrap().iter().zip(clamped_modes(&tables).unwrap()) {
        assert!((a.omega_rad_s / b.omega_rad_s - 1.0).abs() < 1e-12);
    }
}

#[test]
fn linear_laws_are_the_parameters_they_stand_for() {
    let mut by_law = uniform(2);
    by_law.input = Some(Input::new("force_N"));
    let mut by_parameter = by_law.clone();
    by_parameter.beam.fittings.tip_mass_kg = 0.02;
    by_parameter.beam.fittings.clamp_stiffness_n_m_rad = Some(1.0 / 0.004);
    by_law.setup.physics = vec![
        Physics::new("tip_mass", "beam").with("mass", 0.02),
        Physics::new("clamp_compliance", "beam").with("compliance", 0.004),
    ];
    let spaces = [by_law, by_parameter].map(|model| StateSpace::new(&Model::BeamOnBase(model)).unwrap());
    assert!((spaces[0].a() - spaces[1].a()).norm() < 1e-9 * spaces[0].a().norm());
}
