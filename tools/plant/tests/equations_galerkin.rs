//! The paper's eqs. 9 and 12 to 20: from the beam equation to matrices, and how fast their frequencies
//! converge.

use crate::support;

use nalgebra::DMatrix;
use stillbeam_plant::beam::{BasisFunction, Galerkin, galerkin};
use stillbeam_plant::{BeamOnBase, Profile};

use support::finite_elements::{self, Root};
use support::paper_basis::{PaperShape, corrected_eq_11, integral, roots};
use support::{beam, paper_beam};

fn corners(corners: &[(f64, f64)]) -> Profile {
    Profile::Corners(corners.iter().map(|&(x, value)| [x, value]).collect())
}

fn two_to_one() -> BeamOnBase {
    beam(corners(&[(0.0, 0.030), (0.9, 0.015)]), corners(&[(0.0, 0.0016), (0.9, 0.0008)]), 2)
}

fn exact_omegas(model: &BeamOnBase, root: &Root) -> Vec<f64> {
    let beam = finite_elements::Beam {
        length_m: model.beam.length_m,
        density_kg_m3: model.beam.density_kg_m3,
        young_pa: model.beam.young_pa,
        width_m: &|x| model.beam.width_m.at(x),
        thickness_m: &|x| model.beam.thickness_m.at(x),
    };
    finite_elements::frequencies_rad_s(&beam, 100, root)
}

/// Eqs. 13 and 14 from the matrices of the beam alone.
fn with_base(beam: &Galerkin, base_kg: f64) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut mass = beam.mass_kg.clone().insert_row(0, 0.0).insert_column(0, 0.0);
    mass[(0, 0)] = base_kg + beam.beam_mass_kg;
    for (index, h) in beam.coupling_kg.iter().enumerate() {
        mass[(0, index + 1)] = *h;
        mass[(index + 1, 0)] = *h;
    }
    (mass, beam.stiffness_n_m.clone().insert_row(0, 0.0).insert_column(0, 0.0))
}

/// Square roots of the eigenvalues of `M⁻¹ K`, ascending; symmetric or not.
fn omegas(mass: &DMatrix<f64>, stiffness: &DMatrix<f64>) -> Vec<f64> {
    let system = mass.clone().lu().solve(stiffness).expect("a mass matrix is regular");
    let mut found: Vec<f64> =
        system.complex_eigenvalues().iter().map(|value| value.re.max(0.0).sqrt()).collect();
    found.sort_by(f64::total_cmp);
    found
}

/// Eqs. 17 to 20, weak form, in the paper's own functions (eqs. 10 and 11) for a beam of any section.
fn paper_galerkin(model: &BeamOnBase, count: usize) -> Galerkin {
    let beam = &model.beam;
    let length_m = beam.length_m;
    let along = |f: &dyn Fn(f64) -> f64| integral(length_m, 120, f);
    let mass_per_m = |x: f64| beam.density_kg_m3 * beam.width_m.at(x) * beam.thickness_m.at(x);
    let rigidity = |x: f64| beam.young_pa * beam.width_m.at(x) * beam.thickness_m.at(x).powi(3) / 12.0;
    let beam_mass_kg = along(&mass_per_m);
    let lambdas = roots(count, |z| corrected_eq_11(z, beam_mass_kg / model.base_mass_kg));
    let shapes: Vec<PaperShape> = lambdas.iter().map(|z| PaperShape::new(*z, length_m)).collect();
    let entry = |i: usize, j: usize, order: usize, weight: &dyn Fn(f64) -> f64| {
        along(&|x| weight(x) * shapes[i].derivative(order, x) * shapes[j].derivative(order, x))
    };
    Galerkin {
        mass_kg: DMatrix::from_fn(count, count, |i, j| entry(i, j, 0, &mass_per_m)),
        stiffness_n_m: DMatrix::from_fn(count, count, |i, j| entry(i, j, 2, &rigidity)),
        coupling_kg: nalgebra::DVector::from_fn(count, |i, _| {
            along(&|x| mass_per_m(x) * shapes[i].derivative(0, x))
        }),
        tip: nalgebra::DVector::from_fn(count, |i, _| shapes[i].derivative(0, length_m)),
        beam_mass_kg,
    }
}

#[test]
fn with_the_papers_functions_a_uniform_beam_on_its_base_is_exact_from_the_first_one_on() {
    let model = beam(Profile::Uniform(0.025), Profile::Uniform(0.00115), 2);
    let exact = exact_omegas(&model, &Root::Sliding(model.base_mass_kg));
    for count in 1..=3 {
        let (mass, stiffness) = with_base(&paper_galerkin(&model, count), model.base_mass_kg);
        let found = omegas(&mass, &stiffness);
        assert!(found[0] < 1e-3, "the rigid translation: {found:?}");
        for mode in 1..=count {
            assert!((found[mode] / exact[mode] - 1.0).abs() < 1e-6, "{count} {mode}");
        }
    }
}

#[test]
fn equation_14_as_printed_is_not_symmetric_and_has_wrong_frequencies_from_three_functions_on() {
    // The last entry of the printed third row is k_nn where it must be k_n2.
    let model = two_to_one();
    let exact = exact_omegas(&model, &Root::Sliding(model.base_mass_kg));
    for count in [2, 3, 4] {
        let (mass, stiffness) = with_base(&galerkin(&model.beam, count).unwrap(), model.base_mass_kg);
        let mut printed = stiffness.clone();
        printed[(2, count)] = stiffness[(count, count)];
        if count == 2 {
            assert_eq!(printed, stiffness, "with two functions both are the same");
            continue;
        }
        assert!((&stiffness - stiffness.transpose()).amax() < 1e-12 * stiffness.amax());
        assert!((&printed - printed.transpose()).amax() > 0.1 * stiffness.amax());
        let (corrected, printed) = (omegas(&mass, &stiffness), omegas(&mass, &printed));
        let error = |found: &[f64]| (found[2] / exact[2] - 1.0).abs();
        assert!(error(&corrected) < 0.02, "{count}: {}", error(&corrected));
        assert!(error(&printed) > 5.0 * error(&corrected), "{count}: {}", error(&printed));
    }
}

#[test]
fn equation_17_to_19_make_a_rigid_translation_weigh_what_base_and_beam_weigh() {
    let model = paper_beam();
    let beam = galerkin(&model.beam, 8).unwrap();
    let (mass, stiffness) = with_base(&beam, model.base_mass_kg);
    let weighed = integral(0.9, 50, |x| 8190.0 * model.beam.width_m.at(x) * model.beam.thickness_m.at(x));
    assert!((mass[(0, 0)] - 2.5 - weighed).abs() < 1e-12);
    assert!(mass.clone().cholesky().is_some(), "kinetic energy is positive");
    assert_eq!(stiffness.row(0).amax(), 0.0);
    // h_i is what a unit acceleration of the base does to function i.
    let function = BasisFunction::new(2, 0.9);
    let h = integral(0.9, 200, |x| {
        8190.0 * model.beam.width_m.at(x) * model.beam.thickness_m.at(x) * function.value(x)
    });
    assert!((beam.coupling_kg[2] / h - 1.0).abs() < 1e-10);
}

/// Eq. 20 letter by letter for a width that is linear between corners and a uniform thickness: between
/// corners `(I phi'')'' = 2 I' phi''' + I phi''''`.
fn equation_20(width: &Profile, i: &PaperShape, j: &PaperShape) -> f64 {
    let per_width = 190e9 * 0.00115_f64.powi(3) / 12.0;
    let slope = |x: f64| (width.at(x + 1e-9) - width.at(x - 1e-9)) / 2e-9;
    integral(0.9, 120, |x| {
        per_width
            * j.derivative(0, x)
            * (2.0 * slope(x) * i.derivative(3, x) + width.at(x) * i.derivative(4, x))
    })
}

fn weak_form(width: &Profile, i: &PaperShape, j: &PaperShape) -> f64 {
    let per_width = 190e9 * 0.00115_f64.powi(3) / 12.0;
    integral(0.9, 120, |x| per_width * width.at(x) * i.derivative(2, x) * j.derivative(2, x))
}

#[test]
fn equation_20_is_the_weak_form_where_the_section_is_smooth_and_loses_the_corners() {
    let (i, j) = (PaperShape::new(1.95, 0.9), PaperShape::new(4.75, 0.9));
    let smooth = corners(&[(0.0, 0.02), (0.9, 0.03)]);
    for (i, j) in [(&i, &i), (&i, &j), (&j, &i), (&j, &j)] {
        let (strong, weak) = (equation_20(&smooth, i, j), weak_form(&smooth, i, j));
        assert!((strong / weak - 1.0).abs() < 1e-5, "{strong} {weak}");
    }
    // A corner in the width: its second derivative is an impulse that no point of the beam shows.
    let cornered = corners(&[(0.0, 0.02), (0.45, 0.035), (0.9, 0.02)]);
    let (strong, weak) = (equation_20(&cornered, &i, &j), weak_form(&cornered, &i, &j));
    assert!((strong / weak - 1.0).abs() > 0.01, "{strong} {weak}");
    // And without its symmetry.
    let swapped = equation_20(&cornered, &j, &i);
    assert!((strong / swapped - 1.0).abs() > 0.01, "{strong} {swapped}");
}

/// Rows of the table in docs/derivations/beam.md, "Convergence": functions, then relative error of the first
/// and the second frequency for: the shipped beam with its base held; a beam tapered two to one in width and
/// thickness, held; the same on a base of 0.05 kg, in clamped functions; the same in the paper's own
/// functions. NaN where there is none.
const CONVERGENCE: [(usize, [f64; 8]); 5] = [
    (1, [3.2e-4, f64::NAN, 5.2e-2, f64::NAN, 9.2e-2, f64::NAN, 6.1e-2, f64::NAN]),
    (2, [2.3e-6, 1.2e-3, 9.6e-4, 9.0e-2, 1.8e-3, 1.5e-1, 9.7e-4, 9.7e-2]),
    (4, [0.0, 2.7e-6, 1.0e-5, 1.0e-3, 2.0e-5, 1.6e-3, 1.6e-5, 1.3e-3]),
    (8, [0.0, 0.0, 0.0, 8.3e-6, 0.0, 1.3e-5, 0.0, 1.2e-5]),
    (32, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, f64::NAN, f64::NAN]),
];

/// What a hundred finite elements are good to; errors below are written as 0 above.
const FINITE_ELEMENTS: f64 = 1e-6;

#[test]
fn frequencies_converge_as_the_documentation_says() {
    let mut on_light_base = two_to_one();
    on_light_base.base_mass_kg = 0.05;
    let base_kg = on_light_base.base_mass_kg;
    let errors = |found: &[f64], exact: &[f64]| -> Vec<f64> {
        (0..2).map(|mode| found.get(mode).map_or(f64::NAN, |omega| omega / exact[mode] - 1.0)).collect()
    };
    for (count, expected) in CONVERGENCE {
        let mut found = Vec::new();
        for model in [paper_beam(), two_to_one()] {
            let beam = galerkin(&model.beam, count).unwrap();
            let held = omegas(&beam.mass_kg, &beam.stiffness_n_m);
            found.extend(errors(&held, &exact_omegas(&model, &Root::Held)));
        }
        let exact = exact_omegas(&on_light_base, &Root::Sliding(base_kg));
        let mut coupled = |beam: &Galerkin| {
            let (mass, stiffness) = with_base(beam, base_kg);
            found.extend(errors(&omegas(&mass, &stiffness)[1..], &exact[1..]));
        };
        coupled(&galerkin(&on_light_base.beam, count).unwrap());
        // The paper's functions, written with plain hyperbolic functions, lose their digits beyond the
        // eighth.
        if count <= 8 {
            coupled(&paper_galerkin(&on_light_base, count));
        }
        for (found, expected) in found.iter().zip(expected) {
            let agrees = match expected {
                0.0 => found.abs() < FINITE_ELEMENTS,
                expected => (found / expected - 1.0).abs() < 0.05 || (found.is_nan() && expected.is_nan()),
            };
            assert!(agrees, "{count} functions: {found:e}, documented {expected:e}");
        }
    }
}
