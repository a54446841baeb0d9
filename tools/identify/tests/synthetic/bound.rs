//! How sharp any unbiased estimate can be: the Cramér-Rao bound of a force sweep on a free base with
//! friction.
//!
//! In white noise of variance s² it is s² (J'J)⁻¹, J the slopes of the noise-free record by all that is not
//! known: both modes and the real pole, the shares of each, an initial state and the offset. The slopes are
//! differences of responses that are integrated here, with the true parameters; nothing of the code under
//! test takes part.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use super::free_base::{ForceSweep, FreeBase};
use super::{Mode, modal_response};

/// Standard errors of f1, zeta1, f2, zeta2 and the time constant, as shares of them, at a noise so many
/// decibels below the deflection's rms.
pub fn force_sweep(base: &FreeBase, record: &ForceSweep, noise_db: f64) -> [f64; 5] {
    let truth = base.truth();
    let poles = |index: usize, change: f64| -> [f64; 5] {
        let [[f1, zeta1], [f2, zeta2]] = [truth.modes[0], truth.modes[1]];
        let mut poles = [f1, zeta1, f2, zeta2, truth.rate_per_s];
        poles[index] *= 1.0 + change;
        poles
    };
    let linear = columns(record, poles(0, 0.0));
    let width = linear.len();
    let height = record.time_s.len();
    let matrix = DMatrix::from_fn(height, width, |row, column| linear[column][row]);
    let deflection = DVector::from_vec(record.deflection_m.clone());
    let svd = matrix.clone().svd(true, true);
    let shares = svd.solve(&deflection, 1e-14).unwrap();
    let left = (&matrix * &shares - &deflection).norm() / deflection.norm();
    assert!(left < 1e-6, "the columns do not span the record: {left}");

    let step = 1e-4;
    let response = |index: usize, change: f64| -> DVector<f64> {
        let moved = columns(record, poles(index, change));
        (0..height)
            .map(|row| (0..width).map(|c| moved[c][row] * shares[c]).sum::<f64>())
            .collect::<Vec<_>>()
            .into()
    };
    let mut slopes: Vec<DVector<f64>> =
        (0..5).map(|index| (response(index, step) - response(index, -step)) / (2.0 * step)).collect();
    slopes.extend(linear.into_iter().map(DVector::from_vec));
    let sizes: Vec<f64> = slopes.iter().map(|slope| slope.norm()).collect();
    let unit: Vec<DVector<f64>> = slopes.iter().zip(&sizes).map(|(slope, size)| slope / *size).collect();
    let information = DMatrix::from_fn(unit.len(), unit.len(), |i, j| unit[i].dot(&unit[j]));
    let inverse = information.cholesky().unwrap().inverse();
    let noise_m = record.noise_m(noise_db);
    std::array::from_fn(|index| noise_m * inverse[(index, index)].sqrt() / sizes[index])
}

/// What enters linearly: of each mode its response to the force, the rate of that and two free decays; of the
/// real pole its response and its free decay; the offset.
fn columns(record: &ForceSweep, [f1, zeta1, f2, zeta2, rate_per_s]: [f64; 5]) -> Vec<Vec<f64>> {
    let times_s = &record.time_s;
    let mut columns = Vec::new();
    for (frequency_hz, damping_ratio) in [(f1, zeta1), (f2, zeta2)] {
        let mode = Mode { frequency_hz, damping_ratio, participation: 1.0 };
        columns.push(modal_response(mode, |t| record.sweep.position(t) / super::AMPLITUDE_M, times_s));
        // The force begins at zero, so that the rate of the response is the response to the rate.
        columns.push(modal_response(mode, |t| record.sweep.speed(t) / super::AMPLITUDE_M, times_s));
        let w = TAU * frequency_hz;
        let damped = w * (1.0 - damping_ratio * damping_ratio).sqrt();
        let decay = |t: &f64| (-damping_ratio * w * t).exp();
        columns.push(times_s.iter().map(|t| decay(t) * (damped * t).cos()).collect());
        columns.push(times_s.iter().map(|t| decay(t) * (damped * t).sin()).collect());
    }
    columns.push(first_order(rate_per_s, |t| record.sweep.position(t) / super::AMPLITUDE_M, times_s));
    columns.push(times_s.iter().map(|t| (-rate_per_s * t).exp()).collect());
    columns.push(vec![1.0; times_s.len()]);
    columns
}

/// z of z' = force - rate z, from nothing.
fn first_order(rate_per_s: f64, force: impl Fn(f64) -> f64, times_s: &[f64]) -> Vec<f64> {
    let (mut z, mut t) = (0.0, times_s[0]);
    times_s
        .iter()
        .map(|&end| {
            let steps = ((end - t) / 1e-3).ceil() as usize;
            let h = (end - t) / steps.max(1) as f64;
            for k in 0..steps {
                let now = t + k as f64 * h;
                let slope = |z: f64, at: f64| force(now + at) - rate_per_s * z;
                let k1 = slope(z, 0.0);
                let k2 = slope(z + h / 2.0 * k1, h / 2.0);
                let k3 = slope(z + h / 2.0 * k2, h / 2.0);
                let k4 = slope(z + h * k3, h);
                z += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            }
            t = end;
            z
        })
        .collect()
}
