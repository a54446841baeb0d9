//! The paper's eqs. 24 to 27: eigenproblem, steady-state response and receptance.

use crate::support;

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};

use support::finite_elements::{self, Root};
use support::paper_beam;

type Matrix = DMatrix<f64>;

/// Mass and stiffness of the shipped beam on its base, by finite elements: eq. 12 with other coordinates.
fn matrices() -> (Matrix, Matrix) {
    let model = paper_beam();
    let beam = finite_elements::Beam {
        length_m: model.beam.length_m,
        density_kg_m3: model.beam.density_kg_m3,
        young_pa: model.beam.young_pa,
        width_m: &|x| model.beam.width_m.at(x),
        thickness_m: &|x| model.beam.thickness_m.at(x),
    };
    finite_elements::matrices(&beam, 8, &Root::Sliding(model.base_mass_kg))
}

const ALPHAS: [f64; 2] = [0.08, 1e-4];

/// Element (m, n) of `(K − omega² M + j omega C)⁻¹`: what eq. 27 is a sum for.
fn direct(mass: &Matrix, stiffness: &Matrix, omega: f64, m: usize, n: usize) -> Complex<f64> {
    let size = mass.nrows();
    let dynamic = DMatrix::from_fn(size, size, |i, j| {
        let damping = ALPHAS[0] * mass[(i, j)] + ALPHAS[1] * stiffness[(i, j)];
        Complex::new(stiffness[(i, j)] - omega * omega * mass[(i, j)], omega * damping)
    });
    let force = DVector::from_fn(size, |i, _| Complex::new(f64::from(u8::from(i == n)), 0.0));
    dynamic.lu().solve(&force).expect("damped, so regular")[m]
}

/// One term of eq. 27 as printed: modal stiffness in front, frequency ratio behind.
fn printed_term(
    mode: (f64, &DVector<f64>),
    stiffness: &Matrix,
    omega: f64,
    m: usize,
    n: usize,
) -> Complex<f64> {
    let (omega_r, shape) = mode;
    let modal_stiffness = shape.dot(&(stiffness * shape));
    let zeta = 0.5 * (ALPHAS[0] / omega_r + ALPHAS[1] * omega_r);
    let ratio = omega / omega_r;
    let gain = shape[m] * shape[n] / modal_stiffness;
    Complex::new(gain, 0.0) / Complex::new(1.0 - ratio * ratio, 2.0 * zeta * ratio)
}

/// The same term with the modal mass, which a rigid translation has too.
fn corrected_term(mode: (f64, &DVector<f64>), mass: &Matrix, omega: f64, m: usize, n: usize) -> Complex<f64> {
    let (omega_r, shape) = mode;
    let modal_mass = shape.dot(&(mass * shape));
    // 2 zeta_r omega_r, eq. 22, which for the rigid translation is alpha1.
    let damping = ALPHAS[0] + ALPHAS[1] * omega_r * omega_r;
    let gain = shape[m] * shape[n] / modal_mass;
    Complex::new(gain, 0.0) / Complex::new(omega_r * omega_r - omega * omega, damping * omega)
}

#[test]
fn equation_27_is_the_inverse_of_the_dynamic_stiffness_once_the_rigid_translation_is_in_it() {
    let (mass, stiffness) = matrices();
    let (omegas, shapes) = finite_elements::modes(mass.clone(), &stiffness);
    let shapes: Vec<DVector<f64>> = shapes.column_iter().map(|column| column.into_owned()).collect();
    // Rounding leaves the translation some 1e-4 rad/s.
    let mut omegas = omegas;
    omegas[0] = 0.0;
    let tip = mass.nrows() - 2;
    for hz in [0.3, 1.0, 1.128, 3.0, 6.95, 8.0] {
        let omega = TAU * hz;
        for (m, n) in [(0, 0), (tip, 0), (tip, tip), (3, 1)] {
            let exact = direct(&mass, &stiffness, omega, m, n);
            let modes = || omegas.iter().copied().zip(&shapes);
            let corrected: Complex<f64> = modes().map(|mode| corrected_term(mode, &mass, omega, m, n)).sum();
            assert!((corrected - exact).norm() < 1e-6 * exact.norm(), "{hz} Hz {m} {n}: {corrected} {exact}");
            // As printed the first of the N modes of eq. 12 divides by K_1 = 0 ...
            let printed: Complex<f64> = modes().map(|mode| printed_term(mode, &stiffness, omega, m, n)).sum();
            assert!(!printed.norm().is_finite() || (printed - exact).norm() > 0.5 * exact.norm());
            // ... and without it the sum misses how the whole of it moves: 1 / (J omega (j alpha1 − omega)).
            let flexible: Complex<f64> =
                modes().skip(1).map(|mode| printed_term(mode, &stiffness, omega, m, n)).sum();
            let total_kg = 1.0 / shapes[0][0].powi(2);
            let missing = (exact - flexible) * Complex::new(-omega * omega, ALPHAS[0] * omega) * total_kg;
            let size = exact.norm() * omega * omega * total_kg;
            assert!((missing - Complex::new(1.0, 0.0)).norm() < 1e-6 * size.max(1.0), "{hz} Hz: {missing}");
        }
    }
}

#[test]
fn equation_26_is_the_steady_state_of_equation_25() {
    // q(t) = q e^(j omega t) must satisfy M q'' + C q' + K q = u e^(j omega t).
    let (mass, stiffness) = matrices();
    let (mut omegas, shapes) = finite_elements::modes(mass.clone(), &stiffness);
    omegas[0] = 0.0;
    let omega = TAU * 2.3;
    let size = mass.nrows();
    let q = DVector::from_fn(size, |m, _| -> Complex<f64> {
        (0..size)
            .map(|r| {
                let shape = shapes.column(r).into_owned();
                corrected_term((omegas[r], &shape), &mass, omega, m, 0)
            })
            .sum()
    });
    let complex = |matrix: &Matrix| matrix.map(|entry| Complex::new(entry, 0.0));
    let damping = ALPHAS[0] * &mass + ALPHAS[1] * &stiffness;
    let force = complex(&stiffness) * &q - complex(&mass) * &q * Complex::new(omega * omega, 0.0)
        + complex(&damping) * &q * Complex::new(0.0, omega);
    assert!((force[0] - Complex::new(1.0, 0.0)).norm() < 1e-5, "{}", force[0]);
    let others = force.iter().skip(1).map(|entry| entry.norm()).fold(0.0, f64::max);
    assert!(others < 1e-4, "{others}");
}

#[test]
fn receptance_is_reciprocal() {
    let (mass, stiffness) = matrices();
    for hz in [0.5, 1.128, 4.0, 6.95] {
        for (m, n) in [(0, 3), (5, 14), (0, mass.nrows() - 2)] {
            let there = direct(&mass, &stiffness, TAU * hz, m, n);
            let back = direct(&mass, &stiffness, TAU * hz, n, m);
            assert!((there - back).norm() < 1e-9 * there.norm(), "{hz} {m} {n}");
        }
    }
}

#[test]
fn the_roots_of_equation_24_make_it_singular_and_their_shapes_are_orthogonal() {
    let (mass, stiffness) = matrices();
    let (omegas, shapes) = finite_elements::modes(mass.clone(), &stiffness);
    for (r, omega) in omegas.iter().enumerate().take(4).skip(1) {
        let shape = shapes.column(r);
        let left = &stiffness * shape - &mass * shape * omega.powi(2);
        assert!(left.norm() < 1e-8 * (&stiffness * shape).norm(), "{r}");
        for s in 0..r {
            assert!(shape.dot(&(&mass * shapes.column(s))).abs() < 1e-8);
            let elastic = shape.dot(&(&stiffness * shapes.column(s)));
            assert!(elastic.abs() < 1e-6 * omega.powi(2), "{r} {s}: {elastic}");
        }
    }
}

#[test]
fn a_closed_undamped_structure_keeps_its_energy() {
    // Free vibration of all modes together, from the eigenvectors: ½ q'ᵀ M q' + ½ qᵀ K q at any time.
    let (mass, stiffness) = matrices();
    let (omegas, shapes) = finite_elements::modes(mass.clone(), &stiffness);
    let amplitudes = [3e-3, -1e-3, 4e-4];
    let energy = |t: f64| {
        let mut q = DVector::zeros(mass.nrows());
        let mut speed = DVector::zeros(mass.nrows());
        for (mode, amplitude) in (1..).zip(amplitudes) {
            q += shapes.column(mode) * (amplitude * (omegas[mode] * t).cos());
            speed -= shapes.column(mode) * (amplitude * omegas[mode] * (omegas[mode] * t).sin());
        }
        0.5 * speed.dot(&(&mass * &speed)) + 0.5 * q.dot(&(&stiffness * &q))
    };
    let start = energy(0.0);
    for t in [0.1, 0.37, 1.0, 60.0] {
        assert!((energy(t) / start - 1.0).abs() < 1e-8, "{t}");
    }
}
