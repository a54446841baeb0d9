//! Natural frequencies against closed forms and against finite elements.

use crate::support;

use std::f64::consts::TAU;

use stillbeam_plant::beam::{BasisFunction, basis_functions};
use stillbeam_plant::modes::{ClampedMode, clamped_modes, coupled_modes};
use stillbeam_plant::{BeamOnBase, Profile};

use support::finite_elements::{self, Root, frequencies_rad_s};
use support::{beam, paper_beam};

fn tapered(corners: &[(f64, f64)]) -> Profile {
    Profile::Corners(corners.iter().map(|&(x, value)| [x, value]).collect())
}

/// Tapers of every sort: mild, two to one, thickening, a waist with a corner off the elements' nodes.
fn tapers() -> Vec<(&'static str, BeamOnBase)> {
    let mut paper = paper_beam();
    paper.beam.modes = 2;
    vec![
        ("paper", paper),
        (
            "two to one",
            beam(tapered(&[(0.0, 0.030), (0.9, 0.015)]), tapered(&[(0.0, 0.0016), (0.9, 0.0008)]), 2),
        ),
        ("thickening", beam(Profile::Uniform(0.02), tapered(&[(0.0, 0.0009), (0.9, 0.0016)]), 2)),
        (
            "waist",
            beam(
                tapered(&[(0.0, 0.03), (0.45, 0.02), (0.9, 0.03)]),
                tapered(&[(0.0, 0.0012), (0.3, 0.0010), (0.9, 0.0013)]),
                2,
            ),
        ),
    ]
}

fn finite_element_frequencies(model: &BeamOnBase, root: &Root) -> Vec<f64> {
    let beam = finite_elements::Beam {
        length_m: model.beam.length_m,
        density_kg_m3: model.beam.density_kg_m3,
        young_pa: model.beam.young_pa,
        width_m: &|x| model.beam.width_m.at(x),
        thickness_m: &|x| model.beam.thickness_m.at(x),
    };
    frequencies_rad_s(&beam, 60, root)
}

fn assert_close(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!((found / expected - 1.0).abs() < tolerance, "{what}: found {found}, expected {expected}");
}

/// `(beta l)²` of a uniform beam's circular frequency.
fn beta_l(model: &BeamOnBase, omega_rad_s: f64) -> f64 {
    let thickness_m = model.beam.thickness_m.at(0.0);
    let speed = (model.beam.young_pa / model.beam.density_kg_m3 / 12.0).sqrt() * thickness_m;
    (omega_rad_s / speed).sqrt() * model.beam.length_m
}

#[test]
fn uniform_clamped_beam_has_the_textbook_roots_and_participations() {
    for thickness_m in [0.0005, 0.00115, 0.01] {
        let model = beam(Profile::Uniform(0.025), Profile::Uniform(thickness_m), 3);
        let modes = clamped_modes(&model).unwrap();
        let roots = [1.875_104_068_7, 4.694_091_133_0, 7.854_757_438_2];
        // Gamma = 2 sigma_r (±2) / (beta l): Blevins' tables.
        let participations = [1.565_98, -0.867_89, 0.508_84];
        for ((mode, root), participation) in modes.iter().zip(roots).zip(participations) {
            assert_close("beta l", beta_l(&model, mode.omega_rad_s), root, 1e-9);
            let found = mode.tip_participation();
            assert!((found - participation).abs() < 2e-5, "{found}");
        }
    }
}

#[test]
fn a_corner_on_a_straight_line_changes_nothing() {
    let plain = beam(Profile::Uniform(0.02), Profile::Uniform(0.001), 3);
    let cornered = beam(
        tapered(&[(0.0, 0.02), (0.137, 0.02), (0.9, 0.02)]),
        tapered(&[(0.0, 0.001), (0.61, 0.001), (0.9, 0.001)]),
        3,
    );
    let (plain, cornered) = (clamped_modes(&plain).unwrap(), clamped_modes(&cornered).unwrap());
    for (a, b) in plain.iter().zip(&cornered) {
        assert_close("omega", b.omega_rad_s, a.omega_rad_s, 1e-10);
    }
}

#[test]
fn tapered_clamped_beams_agree_with_finite_elements() {
    for (name, model) in tapers() {
        let expected = finite_element_frequencies(&model, &Root::Held);
        let modes = clamped_modes(&model).unwrap();
        for (mode, expected) in modes.iter().zip(expected) {
            // The finite elements themselves are good to about 1e-7.
            assert_close(name, mode.omega_rad_s, expected, 5e-6);
        }
    }
}

#[test]
fn free_base_agrees_with_finite_elements_for_every_base_mass() {
    for (name, mut model) in tapers() {
        for base_kg in [1e-6, 0.05, 2.5, 100.0] {
            model.base_mass_kg = base_kg;
            let expected = finite_element_frequencies(&model, &Root::Sliding(base_kg));
            let coupled = coupled_modes(&model).unwrap();
            assert_eq!(coupled.omega_rad_s.len(), 3);
            assert_eq!(coupled.omega_rad_s[0], 0.0);
            for index in [1, 2] {
                let what = format!("{name}, base {base_kg} kg, mode {index}");
                // A sliding root does not suit the clamped basis, so light bases converge more slowly.
                let found = coupled.omega_rad_s[index];
                assert_close(&what, found, expected[index], 1e-4);
            }
        }
    }
}

#[test]
fn a_heavy_base_is_a_held_base() {
    for (name, mut model) in tapers() {
        model.base_mass_kg = 1e7;
        let clamped = clamped_modes(&model).unwrap();
        let coupled = coupled_modes(&model).unwrap();
        for (clamped, coupled) in clamped.iter().zip(&coupled.omega_rad_s[1..]) {
            assert_close(name, *coupled, clamped.omega_rad_s, 1e-6);
        }
    }
}

#[test]
fn a_massless_base_leaves_a_beam_that_slides_freely() {
    // tan(beta l) + tanh(beta l) = 0.
    let roots = [2.365_020_37, 5.497_803_92];
    let mut model = beam(Profile::Uniform(0.02), Profile::Uniform(0.001), 2);
    model.base_mass_kg = 1e-9;
    let coupled = coupled_modes(&model).unwrap();
    for (omega, root) in coupled.omega_rad_s[1..].iter().zip(roots) {
        assert_close("beta l", beta_l(&model, *omega), root, 1e-4);
    }
}

#[test]
fn the_number_of_basis_functions_is_enough() {
    for (name, mut model) in tapers() {
        for kept in [1, 2, 4, 8] {
            model.beam.modes = kept;
            model.beam.damping = stillbeam_plant::BeamDamping::Rayleigh([0.0, 0.0]);
            let modes = clamped_modes(&model).unwrap();
            let reference = finite_element_frequencies(&model, &Root::Held);
            assert_eq!(modes.len(), kept);
            for (mode, expected) in modes.iter().zip(&reference) {
                assert_close(name, mode.omega_rad_s, *expected, 1e-4);
            }
        }
    }
    assert_eq!(basis_functions(2), 32);
}

#[test]
fn frequencies_fall_towards_the_limit_as_functions_are_added() {
    // Rayleigh and Ritz: a larger space can only lower each frequency.
    for (name, model) in tapers() {
        let exact = finite_element_frequencies(&model, &Root::Held);
        let mut before = [f64::INFINITY; 2];
        for count in [2, 4, 8, 16, 32] {
            let matrices = stillbeam_plant::beam::galerkin(&model.beam, count).unwrap();
            let omegas = omegas_rad_s(&matrices.mass_kg, &matrices.stiffness_n_m);
            for index in 0..2 {
                assert!(omegas[index] <= before[index] * (1.0 + 1e-11), "{name} {count}");
                before[index] = omegas[index];
                let error = omegas[index] / exact[index] - 1.0;
                let bound = [0.1, 0.01, 1e-3, 5e-5, 5e-6][count.ilog2() as usize - 1];
                assert!(error.abs() < bound, "{name} {count} {index}: {error:e}");
            }
        }
    }
}

/// Frequencies of a matrix pair, ascending: from the eigenvalues of the unsymmetric `K⁻¹ M`.
fn omegas_rad_s(mass: &nalgebra::DMatrix<f64>, stiffness: &nalgebra::DMatrix<f64>) -> Vec<f64> {
    let flexibility = stiffness.clone().cholesky().unwrap().solve(mass);
    let mut omegas: Vec<f64> =
        flexibility.complex_eigenvalues().iter().map(|eigenvalue| 1.0 / eigenvalue.re.sqrt()).collect();
    omegas.sort_by(f64::total_cmp);
    omegas
}

#[test]
fn the_high_basis_functions_keep_their_digits() {
    // Written with raw hyperbolic functions the twelfth is noise at the tip.
    for index in 0..60 {
        let function = BasisFunction::new(index, 1.0);
        let sign = if index % 2 == 0 { 2.0 } else { -2.0 };
        assert!((function.value(1.0) - sign).abs() < 1e-11, "{index}");
        assert!(function.value(0.0).abs() < 1e-12);
        let curvature_scale = function.beta_l().powi(2);
        assert!(function.curvature_per_m2(1.0).abs() < 1e-11 * curvature_scale);
    }
}

#[test]
fn participations_of_all_modes_sum_to_one() {
    for (name, mut model) in tapers() {
        model.beam.modes = 8;
        model.beam.damping = stillbeam_plant::BeamDamping::Rayleigh([0.0, 0.0]);
        let modes = clamped_modes(&model).unwrap();
        let sum: f64 = modes.iter().map(ClampedMode::tip_participation).sum();
        // The tail alternates in sign, so the error is below the next term.
        let next = modes[7].tip_participation().abs();
        assert!((sum - 1.0).abs() < next, "{name}: {sum}");
    }
}

#[test]
fn the_shipped_beam_has_the_papers_frequencies() {
    let model = paper_beam();
    let modes = clamped_modes(&model).unwrap();
    assert_close("first", modes[0].omega_rad_s / TAU, 1.100, 1e-4);
    assert_close("second", modes[1].omega_rad_s / TAU, 6.900, 1e-4);
    let damping: Vec<f64> = modes.iter().map(|mode| mode.damping_ratio).collect();
    assert_eq!(damping, [0.0074, 0.0033]);
    // The numbers in the file's comment.
    let flexible = coupled_modes(&model).unwrap().flexible();
    assert!((flexible[0].0 - 1.128).abs() < 5e-4, "{flexible:?}");
    assert!((flexible[1].0 - 6.952).abs() < 5e-4, "{flexible:?}");
    assert!((modes[0].tip_participation() - 1.548).abs() < 5e-4);
    assert!((modes[1].tip_participation() + 0.839).abs() < 5e-4);
    let beam = stillbeam_plant::beam::galerkin(&model.beam, 4).unwrap();
    assert!((beam.beam_mass_kg - 0.209).abs() < 5e-3, "{}", beam.beam_mass_kg);
}

#[test]
fn rayleigh_damping_gives_the_ratios_of_equation_22() {
    let mut model = paper_beam();
    let (alpha1, alpha2) = (0.08, 1e-4);
    model.beam.damping = stillbeam_plant::BeamDamping::Rayleigh([alpha1, alpha2]);
    for mode in clamped_modes(&model).unwrap() {
        let expected = 0.5 * (alpha1 / mode.omega_rad_s + alpha2 * mode.omega_rad_s);
        assert_close("zeta", mode.damping_ratio, expected, 1e-12);
    }
}

#[test]
fn a_free_base_keeps_the_beams_own_damping_and_adds_its_friction() {
    let mut model = paper_beam();
    // Beam: on a heavy base the coupled ratios are the clamped ones.
    model.base_mass_kg = 1e6;
    let flexible = coupled_modes(&model).unwrap().flexible();
    for ((_, found), expected) in flexible.iter().zip([0.0074, 0.0033]) {
        assert_close("zeta", *found, expected, 1e-5);
    }
    // On a light one the work per cycle tells: stiffness-proportional damping alpha2 gives
    // zeta = alpha2 omega / 2 at the coupled frequency, whatever the shape (C = alpha2 K).
    model.base_mass_kg = 0.3;
    model.beam.damping = stillbeam_plant::BeamDamping::Rayleigh([0.0, 1e-3]);
    let coupled = coupled_modes(&model).unwrap();
    for ((_, found), omega) in coupled.flexible().iter().zip(&coupled.omega_rad_s[1..]) {
        assert_close("zeta", *found, 0.5e-3 * omega, 1e-9);
    }
    // Base: friction acts on all that moves, c / J on the rigid translation.
    model.beam.damping = stillbeam_plant::BeamDamping::Rayleigh([0.0, 0.0]);
    model.base_viscous_n_s_m = 2.0;
    let coupled = coupled_modes(&model).unwrap();
    let total_kg = 1.0 / coupled.base[0].powi(2);
    assert_close("rigid", coupled.damping_per_s[(0, 0)], 2.0 / total_kg, 1e-12);
    for row in 0..3 {
        for column in 0..3 {
            let expected = 2.0 * coupled.base[row] * coupled.base[column];
            let found = coupled.damping_per_s[(row, column)];
            assert!((found - expected).abs() < 1e-12 * total_kg, "{row} {column}");
        }
    }
}

#[test]
fn under_a_force_the_tip_follows_the_base_as_it_does_when_the_base_is_moved() {
    // Two roads to tip / base at a frequency: the receptances of the coupled modes (eq. 27), and the clamped
    // modes under the base's acceleration. They share the beam and nothing of the coupling.
    let mut model = paper_beam();
    model.beam.modes = 8;
    model.beam.damping = stillbeam_plant::BeamDamping::Rayleigh([0.0, 0.0]);
    for base_kg in [0.1, 2.5, 50.0] {
        model.base_mass_kg = base_kg;
        let (clamped, coupled) = (clamped_modes(&model).unwrap(), coupled_modes(&model).unwrap());
        for frequency_hz in [0.1, 0.7, 2.0, 4.0, 9.0] {
            let square = (TAU * frequency_hz).powi(2);
            let receptance = |shape: &[f64]| -> f64 {
                let modes = shape.iter().zip(&coupled.base).zip(&coupled.omega_rad_s);
                modes.map(|((shape, base), omega)| shape * base / (omega * omega - square)).sum()
            };
            let found = receptance(&coupled.tip_deflection) / receptance(&coupled.base);
            let modes = clamped.iter();
            let expected: f64 = modes
                .map(|mode| mode.tip_participation() * square / (mode.omega_rad_s.powi(2) - square))
                .sum();
            let what = format!("{base_kg} kg, {frequency_hz} Hz");
            // Eight modes each; what the rest would add differs.
            assert_close(&what, found, expected, 1e-3);
        }
    }
}
