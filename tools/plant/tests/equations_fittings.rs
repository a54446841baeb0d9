//! Two things the paper leaves out, a mass at the tip and a clamp that turns: against closed forms and finite
//! elements.

use crate::support;

use stillbeam_plant::modes::{clamped_modes, coupled_modes};
use stillbeam_plant::{BeamOnBase, Profile};

use support::beam;
use support::finite_elements::{self, Root};
use support::paper_basis::roots;

const WIDTH_M: f64 = 0.025;
const THICKNESS_M: f64 = 0.00115;
const BEAM_KG: f64 = 8190.0 * WIDTH_M * THICKNESS_M * 0.9;
/// `E I / l` in N·m/rad.
const BENDING_N_M: f64 = 190e9 * WIDTH_M * THICKNESS_M * THICKNESS_M * THICKNESS_M / 12.0 / 0.9;

fn uniform() -> BeamOnBase {
    beam(Profile::Uniform(WIDTH_M), Profile::Uniform(THICKNESS_M), 2)
}

fn tapered() -> BeamOnBase {
    let corners = |root, tip| Profile::Corners(vec![[0.0, root], [0.9, tip]]);
    beam(corners(0.030, 0.015), corners(0.0014, 0.0010), 2)
}

fn omega_rad_s(root: f64) -> f64 {
    (190e9_f64 / 8190.0 / 12.0).sqrt() * THICKNESS_M * (root / 0.9).powi(2)
}

/// Finite elements of a model's beam with its tip mass; the clamp is the root's.
fn exact_omegas(model: &BeamOnBase, root: &Root) -> Vec<f64> {
    let beam = finite_elements::Beam {
        length_m: model.beam.length_m,
        density_kg_m3: model.beam.density_kg_m3,
        young_pa: model.beam.young_pa,
        width_m: &|x| model.beam.width_m.at(x),
        thickness_m: &|x| model.beam.thickness_m.at(x),
    };
    let (mut mass, stiffness) = finite_elements::matrices(&beam, 60, root);
    let tip = mass.nrows() - 2;
    mass[(tip, tip)] += model.beam.fittings.tip_mass_kg;
    finite_elements::modes(mass, &stiffness).0
}

fn assert_close(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!((found / expected - 1.0).abs() < tolerance, "{what}: found {found}, expected {expected}");
}

/// `1 + cos z cosh z + a z (cos z sinh z − sin z cosh z)`, with `a` the tip's mass over the beam's, or the
/// compliance of the clamp over that of the beam, `E I / (k l)`: both have the same equation.
fn frequency_equation(z: f64, a: f64) -> f64 {
    1.0 + z.cos() * z.cosh() + a * z * (z.cos() * z.sinh() - z.sin() * z.cosh())
}

#[test]
fn a_mass_at_the_tip_of_a_uniform_beam_has_the_textbook_frequencies() {
    for ratio in [0.0, 0.01, 0.1, 1.0] {
        let mut model = uniform();
        model.beam.fittings.tip_mass_kg = ratio * BEAM_KG;
        let elements = exact_omegas(&model, &Root::Held);
        let found = clamped_modes(&model).unwrap();
        for (mode, root) in roots(2, |z| frequency_equation(z, ratio)).into_iter().enumerate() {
            assert_close("elements", elements[mode], omega_rad_s(root), 1e-6);
            assert_close(&format!("{ratio} {mode}"), found[mode].omega_rad_s, omega_rad_s(root), 1e-4);
        }
    }
}

#[test]
fn a_uniform_beam_in_a_clamp_that_turns_has_the_textbook_frequencies() {
    for compliance in [0.001, 0.02, 0.2, 2.0] {
        let mut model = uniform();
        model.beam.fittings.clamp_stiffness_n_m_rad = Some(BENDING_N_M / compliance);
        let elements = exact_omegas(&model, &Root::Turning(BENDING_N_M / compliance));
        let found = clamped_modes(&model).unwrap();
        for (mode, root) in roots(2, |z| frequency_equation(z, compliance)).into_iter().enumerate() {
            assert_close("elements", elements[mode], omega_rad_s(root), 1e-6);
            assert_close(&format!("{compliance} {mode}"), found[mode].omega_rad_s, omega_rad_s(root), 1e-4);
        }
    }
}

#[test]
fn tapered_beams_with_both_agree_with_finite_elements_on_held_and_free_bases() {
    for (tip_mass_kg, compliance) in [(0.02, 0.05), (0.1, 0.01), (0.005, 0.5)] {
        let stiffness = BENDING_N_M / compliance;
        let mut model = tapered();
        model.beam.fittings.tip_mass_kg = tip_mass_kg;
        model.beam.fittings.clamp_stiffness_n_m_rad = Some(stiffness);
        let what = format!("{tip_mass_kg} kg, {stiffness} N m/rad");
        let held = exact_omegas(&model, &Root::Turning(stiffness));
        for (mode, expected) in clamped_modes(&model).unwrap().iter().zip(held) {
            assert_close(&what, mode.omega_rad_s, expected, 1e-4);
        }
        for base_kg in [0.25, 2.5] {
            model.base_mass_kg = base_kg;
            let free = exact_omegas(&model, &Root::SlidingAndTurning(base_kg, stiffness));
            let coupled = coupled_modes(&model).unwrap();
            for (found, expected) in coupled.omega_rad_s[1..].iter().zip(&free[1..]) {
                assert_close(&format!("{what}, base {base_kg} kg"), *found, *expected, 1e-4);
            }
        }
    }
}

#[test]
fn three_per_cent_of_either_makes_a_uniform_strip_as_far_apart_as_table_1_says() {
    // The exponential sweeps have ratios of 6.293 to 6.304, a uniform strip 6.267. So a camera's target of
    // six grams, or a clamp of 22 N m/rad, explains them as well as a taper does. The effect grows with the
    // square of either.
    let ratio = |model: &BeamOnBase| {
        let modes = clamped_modes(model).unwrap();
        modes[1].omega_rad_s / modes[0].omega_rad_s
    };
    let plain = ratio(&uniform());
    assert!((plain - 6.2669).abs() < 1e-4, "{plain}");
    for (share, expected) in [(0.01, 6.2709), (0.03, 6.2992)] {
        let (mut loaded, mut turning) = (uniform(), uniform());
        loaded.beam.fittings.tip_mass_kg = share * BEAM_KG;
        turning.beam.fittings.clamp_stiffness_n_m_rad = Some(BENDING_N_M / share);
        for model in [loaded, turning] {
            assert!((ratio(&model) - expected).abs() < 3e-4, "{}", ratio(&model));
        }
    }
}
