//! Models given as matrices: a refit finds their modes, and says nothing where they are right.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_diagnose::{Diagnosis, Options, Verdict, diagnose};
use stillbeam_plant::Model;
use stillbeam_recording::Recording;

const STEP_S: f64 = 0.004;
const NOISE_M: f64 = 1e-4;

/// Two modes and a sensor's lag, in states that mean nothing; the frequencies times a factor.
fn matrices(factor: f64) -> (DMatrix<f64>, DVector<f64>, DMatrix<f64>) {
    let mut a = DMatrix::zeros(5, 5);
    for (mode, (frequency_hz, zeta)) in [(4.2, 0.012), (26.0, 0.006)].into_iter().enumerate() {
        let (q, omega) = (2 * mode, TAU * frequency_hz * factor);
        a[(q, q + 1)] = 1.0;
        a[(q + 1, q)] = -omega * omega;
        a[(q + 1, q + 1)] = -2.0 * zeta * omega;
    }
    a[(4, 4)] = -3.0;
    let b = DVector::from_vec(vec![0.0, 1.0, 0.0, 1.0, 1.0]);
    let c = DMatrix::from_row_slice(1, 5, &[1.1, 0.0, 0.9, 0.0, 0.01]);
    let turn = DMatrix::from_fn(
        5,
        5,
        |row, column| if row == column { 1.0 } else { 0.1 * (row + 2 * column) as f64 },
    );
    let back = turn.clone().try_inverse().unwrap();
    (&back * a * &turn, back * b, c * turn)
}

fn model(factor: f64) -> Model {
    let (a, b, c) = matrices(factor);
    let rows = |matrix: &DMatrix<f64>| {
        let rows = matrix.row_iter().map(|row| format!("{:?}", row.iter().collect::<Vec<_>>()));
        rows.collect::<Vec<_>>().join(", ")
    };
    let text = format!(
        "schema = 1\nkind = \"state_space\"\nA = [{}]\nB = {:?}\nC = [{}]\n\
         [input]\ncolumn = \"force_N\"\nhold = \"zero\"\n[[output]]\ncolumn = \"y_m\"\n",
        rows(&a),
        b.as_slice(),
        rows(&c)
    );
    Model::from_toml("plant.toml", &text).unwrap()
}

fn normal(random: &mut Xoshiro256PlusPlus) -> f64 {
    StandardNormal.sample(random)
}

/// A force in steps of ten samples and what the matrices do under it, by their exponential, with noise of
/// about 1 %.
fn recorded(seed: u64, size: f64) -> Recording {
    let (a, b, c) = matrices(1.0);
    let mut joined = DMatrix::zeros(6, 6);
    joined.view_mut((0, 0), (5, 5)).copy_from(&(a * STEP_S));
    joined.view_mut((0, 5), (5, 1)).copy_from(&(b * STEP_S));
    let step = joined.exp();
    let random = &mut Xoshiro256PlusPlus::seed_from_u64(seed);
    let steps: Vec<f64> = (0..400).map(|_| size * normal(random)).collect();
    let force: Vec<f64> = (0..4000).map(|k| steps[k / 10]).collect();
    let mut state = DVector::zeros(6);
    let mut read = Vec::new();
    for u in &force {
        state[5] = *u;
        read.push((&c * state.rows(0, 5))[0]);
        state = &step * state;
    }
    read.iter_mut().for_each(|y| *y += NOISE_M * normal(random));
    let time_s = (0..force.len()).map(|k| STEP_S * k as f64).collect();
    Recording::new(format!("run {seed}"), time_s).with_column("force_N", force).with_column("y_m", read)
}

fn asked(given: &Model, seeds: std::ops::Range<u64>) -> Diagnosis {
    let runs: Vec<Recording> = seeds.map(|seed| recorded(seed, 0.5 + seed as f64)).collect();
    let (held_out, train) = runs.split_last().unwrap();
    diagnose(given, train, std::slice::from_ref(held_out), &Options::default(), &mut |_| {}).unwrap()
}

#[test]
fn modes_three_per_cent_off_are_found_and_nothing_is_said_to_be_missing() {
    let right = asked(&model(1.0), 1..4);
    assert_eq!(right.verdict, Verdict::Adequate, "{}", right.sentence);
    assert!(right.parameter_changes.is_empty(), "{:?}", right.parameter_changes);
    let wrong = asked(&model(1.03), 1..4);
    assert_eq!(wrong.verdict, Verdict::Adequate, "{}", wrong.sentence);
    for (path, expected_hz) in [("mode.1.frequency_hz", 4.2), ("mode.2.frequency_hz", 26.0)] {
        let found = wrong.parameter_changes.iter().find(|change| change.path == path);
        let found = found.unwrap_or_else(|| panic!("{path} did not move: {:?}", wrong.parameter_changes));
        let off = (found.to / expected_hz - 1.0).abs();
        assert!(off < 1e-3, "{path}: off by {off:e}");
    }
}
