//! The paper's eqs. 1 to 8: energies, equations of motion and boundary conditions. docs/errata.md lists the
//! verdicts.

use crate::support;

use nalgebra::DVector;
use stillbeam_plant::Profile;

use support::finite_elements::{self, Root};
use support::polynomial::Polynomial;

const LENGTH_M: f64 = 0.9;
const YOUNG_PA: f64 = 190e9;
const DENSITY_KG_M3: f64 = 8190.0;

/// A section 25 mm wide and 1.15 mm thick: `A` and `I`.
const AREA_M2: f64 = 0.025 * 0.00115;
const INERTIA_M4: f64 = 0.025 * 0.00115 * 0.00115 * 0.00115 / 12.0;

/// Shapes that satisfy eqs. 7 and 8, `x^k` completed so that `w'' = w''' = 0` at the tip.
fn admissible_shapes() -> Vec<Polynomial> {
    let l = LENGTH_M;
    // w'' = (l − x)² and w'' = (l − x)³, integrated twice from a clamp.
    vec![
        Polynomial(vec![0.0, 0.0, l * l / 2.0, -2.0 * l / 6.0, 1.0 / 12.0]),
        Polynomial(vec![0.0, 0.0, l.powi(3) / 2.0, -3.0 * l * l / 6.0, 3.0 * l / 12.0, -1.0 / 20.0]),
    ]
}

/// `I(x)` of a strip that thins by a fifth and widens by half: a polynomial, so that eq. 4 can be read
/// literally.
fn tapered_inertia() -> Polynomial {
    let width = Polynomial(vec![0.02, 0.01 / LENGTH_M]);
    let thickness = Polynomial(vec![0.0013, -0.00026 / LENGTH_M]);
    let cube = thickness.times(&thickness).times(&thickness);
    Polynomial(width.times(&cube).0.iter().map(|c| c / 12.0).collect())
}

#[test]
fn equation_4_follows_from_the_energy_of_equation_2_with_two_derivatives_inside_not_three() {
    // Hamilton's principle asks that the work of the elastic forces over any admissible change v be that of
    // eq. 2: ∫ v (I w_xx)_xx dx = ∫ I w_xx v_xx dx.
    let inertia = tapered_inertia();
    for w in admissible_shapes() {
        for v in admissible_shapes() {
            let wanted = inertia.times(&w.derivative(2)).times(&v.derivative(2)).integral(LENGTH_M);
            let corrected = inertia.times(&w.derivative(2)).derivative(2).times(&v).integral(LENGTH_M);
            let printed = inertia.times(&w.derivative(3)).derivative(2).times(&v).integral(LENGTH_M);
            assert!((corrected / wanted - 1.0).abs() < 1e-12, "{corrected} {wanted}");
            assert!((printed / wanted - 1.0).abs() > 1.0, "{printed} {wanted}");
        }
    }
}

#[test]
fn equation_4_gives_the_static_sag_of_an_accelerated_beam_only_with_two_derivatives_inside() {
    // A base under the steady acceleration a: the textbook's cantilever under a uniform load −rho A a.
    let (a, l) = (3.0, LENGTH_M);
    let scale = -DENSITY_KG_M3 * AREA_M2 * a / (24.0 * YOUNG_PA * INERTIA_M4);
    let sag = Polynomial(vec![0.0, 0.0, 6.0 * l * l * scale, -4.0 * l * scale, scale]);
    let load = DENSITY_KG_M3 * AREA_M2 * a;
    for x in [0.0, 0.2, 0.9] {
        let corrected = load + YOUNG_PA * INERTIA_M4 * sag.derivative(4).at(x);
        let printed = load + YOUNG_PA * INERTIA_M4 * sag.derivative(5).at(x);
        assert!(corrected.abs() < 1e-12 * load, "{corrected}");
        // Nothing is left to carry the load.
        assert_eq!(printed, load);
    }
}

#[test]
fn the_terms_of_equation_4_have_the_same_unit_only_with_two_derivatives_inside() {
    // The same beam with lengths in millimetres: E I in N mm² is 1e6 times that in N m², w and x are 1e3
    // times.
    let metres = admissible_shapes().remove(1);
    let powers = (0..).zip(&metres.0);
    let millimetres = Polynomial(powers.map(|(power, c)| 1e3 * c * 1e-3_f64.powi(power)).collect());
    let elastic_m = |order: usize| YOUNG_PA * INERTIA_M4 * metres.derivative(order).at(0.3);
    let elastic_mm = |order: usize| 1e6 * YOUNG_PA * INERTIA_M4 * millimetres.derivative(order).at(300.0);
    // The inertial term, a force per length, is a thousandth in N/mm of what it is in N/m.
    assert!((elastic_mm(4) / elastic_m(4) / 1e-3 - 1.0).abs() < 1e-12);
    assert!((elastic_mm(5) / elastic_m(5) / 1e-6 - 1.0).abs() < 1e-12);
}

#[test]
fn equation_8_is_the_natural_condition_of_a_tapered_tip_too() {
    // What Hamilton's principle leaves at the tip is I w_xx = 0 and (I w_xx)_x = 0. With I(l) > 0 that is eq.
    // 8: a shape with w_xx = w_xxx = 0 has both, one with w_xxx alone different from zero has not.
    let inertia = tapered_inertia();
    let l = LENGTH_M;
    let shear = |w: &Polynomial| inertia.times(&w.derivative(2)).derivative(1).at(l);
    for w in admissible_shapes() {
        assert!(inertia.times(&w.derivative(2)).at(l).abs() < 1e-24);
        assert!(shear(&w).abs() < 1e-23);
    }
    // w'' = l − x: no moment at the tip, but a shear force.
    let loaded = Polynomial(vec![0.0, 0.0, l / 2.0, -1.0 / 6.0]);
    assert!(shear(&loaded).abs() > 1e-13);
}

#[test]
fn equation_5_says_that_free_vibration_moves_no_momentum() {
    // Finite elements know nothing of eq. 5: in each of their flexible modes base and beam together stand
    // still.
    let (width_m, thickness_m) = (|_| 0.025, |x: f64| 0.0013 - 0.0003 * x / LENGTH_M);
    let beam = finite_elements::Beam {
        length_m: LENGTH_M,
        density_kg_m3: DENSITY_KG_M3,
        young_pa: YOUNG_PA,
        width_m: &width_m,
        thickness_m: &thickness_m,
    };
    for base_kg in [0.1, 2.5] {
        let (mass, stiffness) = finite_elements::matrices(&beam, 40, &Root::Sliding(base_kg));
        let (_, shapes) = finite_elements::modes(mass.clone(), &stiffness);
        // The first freedom is the root's deflection, the slopes between the others; the root's own slope is
        // left out.
        let translation =
            DVector::from_fn(mass.nrows(), |row, _| if row % 2 == 1 || row == 0 { 1.0 } else { 0.0 });
        let total_kg = translation.dot(&(&mass * &translation));
        let beam_kg = DENSITY_KG_M3 * 0.025 * 0.00115 * LENGTH_M;
        assert!((total_kg - base_kg - beam_kg).abs() < 1e-12, "{total_kg}");
        for mode in 1..4 {
            let momentum = translation.dot(&(&mass * shapes.column(mode)));
            assert!(momentum.abs() < 1e-6 * total_kg.sqrt(), "{mode}: {momentum}");
        }
    }
}

#[test]
fn the_energies_of_equations_1_and_2_are_the_matrices_energies() {
    // ½ q'ᵀ M q' and ½ qᵀ K q of the Galerkin matrices against the integrals of eqs. 1 and 2, taken by finite
    // elements of the same deflection: the stiffness and mass of the first clamped shape.
    let model = support::beam(
        Profile::Corners(vec![[0.0, 0.02], [0.9, 0.03]]),
        Profile::Corners(vec![[0.0, 0.0013], [0.9, 0.00104]]),
        2,
    );
    let matrices = stillbeam_plant::beam::galerkin(&model.beam, 6).unwrap();
    let function = stillbeam_plant::beam::BasisFunction::new(1, LENGTH_M);
    let section = |x: f64| (model.beam.width_m.at(x), model.beam.thickness_m.at(x));
    let twice_kinetic = support::paper_basis::integral(LENGTH_M, 200, |x| {
        let (b, t) = section(x);
        DENSITY_KG_M3 * b * t * function.value(x).powi(2)
    });
    let twice_potential = support::paper_basis::integral(LENGTH_M, 200, |x| {
        let (b, t) = section(x);
        YOUNG_PA * b * t.powi(3) / 12.0 * function.curvature_per_m2(x).powi(2)
    });
    assert!((matrices.mass_kg[(1, 1)] / twice_kinetic - 1.0).abs() < 1e-12);
    assert!((matrices.stiffness_n_m[(1, 1)] / twice_potential - 1.0).abs() < 1e-12);
}
