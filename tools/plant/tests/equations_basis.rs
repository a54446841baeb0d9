//! The paper's eqs. 10 and 11: the basis functions and the frequency equation of a uniform beam on a free
//! base.

use crate::support;

use stillbeam_plant::Profile;
use stillbeam_plant::modes::coupled_modes;

use support::beam;
use support::finite_elements::{self, Root, frequencies_rad_s};
use support::paper_basis::{PaperShape, corrected_eq_11, integral, printed_eq_11, printed_shape, roots};

const LENGTH_M: f64 = 0.9;
const WIDTH_M: f64 = 0.025;
const THICKNESS_M: f64 = 0.00115;
const BEAM_KG: f64 = 8190.0 * WIDTH_M * THICKNESS_M * LENGTH_M;

/// `(lambda l)²` to rad/s for the uniform strip.
fn omega_rad_s(lambda_l: f64) -> f64 {
    (190e9_f64 / 8190.0 / 12.0).sqrt() * THICKNESS_M * (lambda_l / LENGTH_M).powi(2)
}

fn finite_element_omegas(base_kg: f64) -> Vec<f64> {
    let beam = finite_elements::Beam {
        length_m: LENGTH_M,
        density_kg_m3: 8190.0,
        young_pa: 190e9,
        width_m: &|_| WIDTH_M,
        thickness_m: &|_| THICKNESS_M,
    };
    frequencies_rad_s(&beam, 60, &Root::Sliding(base_kg))
}

#[test]
fn equation_10_meets_the_boundary_conditions_7_and_8_for_every_lambda() {
    for lambda_l in [0.7, 1.3, 1.875, 2.5, 4.0, 5.1, 7.0, 8.3] {
        let shape = PaperShape::new(lambda_l, LENGTH_M);
        let size = shape.derivative(0, LENGTH_M).abs().max(1.0);
        let lambda = shape.lambda_per_m;
        assert!(shape.derivative(0, 0.0).abs() < 1e-12 * size);
        assert!(shape.derivative(1, 0.0).abs() < 1e-12 * size * lambda);
        let grown = lambda_l.exp() * size * 1e-13;
        assert!(shape.derivative(2, LENGTH_M).abs() < grown * lambda.powi(2), "{lambda_l}");
        assert!(shape.derivative(3, LENGTH_M).abs() < grown * lambda.powi(3), "{lambda_l}");
        for x in [0.1, 0.5, 0.9] {
            let (found, printed) = (shape.derivative(0, x), printed_shape(lambda_l, LENGTH_M, x));
            assert!((found - printed).abs() < 1e-10 * size, "{found} {printed}");
        }
    }
}

#[test]
fn the_corrected_equation_11_lets_the_beam_push_its_base_as_newton_says_and_the_printed_one_does_not() {
    // m y'' + ∫ rho A (y'' + w_tt) dx = 0, eq. 5 without force, for the shape base + phi(x).
    let imbalance = |lambda_l: f64, base_kg: f64| {
        let shape = PaperShape::new(lambda_l, LENGTH_M);
        let carried =
            integral(LENGTH_M, 100, |x| BEAM_KG / LENGTH_M * (shape.base() + shape.derivative(0, x)));
        let size =
            integral(LENGTH_M, 100, |x| BEAM_KG / LENGTH_M * (shape.base() + shape.derivative(0, x)).abs());
        (base_kg * shape.base() + carried).abs() / size
    };
    for base_kg in [0.05, 0.5, 2.5, 50.0] {
        let ratio = BEAM_KG / base_kg;
        for lambda_l in roots(3, |z| corrected_eq_11(z, ratio)) {
            assert!(imbalance(lambda_l, base_kg) < 1e-8, "{base_kg} {lambda_l}");
        }
        for lambda_l in roots(3, |z| printed_eq_11(z, ratio, LENGTH_M)) {
            assert!(imbalance(lambda_l, base_kg) > 1e-3, "{base_kg} {lambda_l}");
        }
    }
}

#[test]
fn the_corrected_equation_11_gives_the_finite_elements_frequencies() {
    for base_kg in [0.01, 0.25, 2.5, 25.0] {
        let ratio = BEAM_KG / base_kg;
        let exact = finite_element_omegas(base_kg);
        for (lambda_l, exact) in roots(3, |z| corrected_eq_11(z, ratio)).into_iter().zip(&exact[1..]) {
            assert!((omega_rad_s(lambda_l) / exact - 1.0).abs() < 1e-5, "{base_kg} {lambda_l}");
        }
    }
    // The paper's base mass, lengths in metres: the base's effect is small, so the printed form looks right,
    // and is wrong by more than Table 1 resolves.
    let exact = finite_element_omegas(2.5);
    let printed = roots(2, |z| printed_eq_11(z, BEAM_KG / 2.5, LENGTH_M));
    let errors: Vec<f64> = printed.iter().zip(&exact[1..]).map(|(z, w)| omega_rad_s(*z) / w - 1.0).collect();
    assert!((errors[0] - 0.0049).abs() < 1e-4 && (errors[1] + 0.0008).abs() < 1e-4, "{errors:?}");
}

#[test]
fn equation_11_has_the_right_limits_only_when_corrected() {
    // A base without mass: the root slides freely, tan + tanh = 0.
    let sliding = [2.365_020_37, 5.497_803_92];
    for (found, wanted) in roots(2, |z| corrected_eq_11(z, 1e9)).iter().zip(sliding) {
        assert!((found - wanted).abs() < 1e-6, "{found}");
    }
    // As printed the bracket is sin (cosh + cos), which is zero at multiples of pi whatever the beam.
    for (found, multiple) in roots(2, |z| printed_eq_11(z, 1e9, LENGTH_M)).iter().zip([1.0, 2.0]) {
        assert!((found - multiple * std::f64::consts::PI).abs() < 1e-6, "{found}");
    }
    // A base that cannot be moved: the clamped beam. Both have that one.
    let clamped = [1.875_104_07, 4.694_091_13, 7.854_757_44];
    for (found, wanted) in roots(3, |z| corrected_eq_11(z, 1e-9)).iter().zip(clamped) {
        assert!((found - wanted).abs() < 1e-6, "{found}");
    }
}

#[test]
fn the_roots_of_the_printed_equation_11_depend_on_the_unit_of_length() {
    let in_unit = |length: f64| roots(1, |z| printed_eq_11(z, 0.1, length))[0];
    assert!((in_unit(0.9) - in_unit(900.0)).abs() > 0.1);
}

#[test]
fn the_crates_basis_of_clamped_functions_gives_the_same_coupled_modes() {
    // The crate uses the held base's functions (eq. 10 in the limit of a heavy base) and lets eq. 13 do the
    // coupling.
    for base_kg in [0.25, 2.5] {
        let mut model = beam(Profile::Uniform(WIDTH_M), Profile::Uniform(THICKNESS_M), 2);
        model.base_mass_kg = base_kg;
        let coupled = coupled_modes(&model).unwrap();
        for (found, lambda_l) in
            coupled.omega_rad_s[1..].iter().zip(roots(2, |z| corrected_eq_11(z, BEAM_KG / base_kg)))
        {
            assert!((found / omega_rad_s(lambda_l) - 1.0).abs() < 1e-6, "{base_kg}: {found}");
        }
    }
}
