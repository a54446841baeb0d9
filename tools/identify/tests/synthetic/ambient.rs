//! Records under noise whose truth is known.

use std::f64::consts::TAU;

use stillbeam_recording::Recording;

use super::Noise;
use super::kinds::{between, ratio_between};

/// A mode of a record, and its share of every output.
pub struct Truth {
    pub frequency_hz: f64,
    pub damping_ratio: f64,
    pub shape: [f64; 3],
}

/// Three outputs of three modes under white noise, with 1 % of sensor noise, `periods` of the lowest mode
/// long.
pub fn ambient(seed: u64, periods: f64) -> (Recording, Vec<Truth>) {
    let mut noise = Noise(seed.wrapping_mul(613).wrapping_add(5));
    let lowest_hz = ratio_between(&mut noise, 1.0, 30.0);
    let ratios = [1.0, between(&mut noise, 1.4, 2.0), between(&mut noise, 2.4, 3.6)];
    let truth: Vec<Truth> = ratios
        .iter()
        .map(|ratio| Truth {
            frequency_hz: lowest_hz * ratio,
            damping_ratio: ratio_between(&mut noise, 0.004, 0.03),
            shape: std::array::from_fn(|_| between(&mut noise, -1.0, 1.0)),
        })
        .collect();
    let rate_hz = 20.0 * lowest_hz;
    let rows = (periods * 20.0) as usize;
    let mut outputs = vec![vec![0.0; rows]; 3];
    for mode in &truth {
        let (w, step_s) = (TAU * mode.frequency_hz, 1.0 / rate_hz);
        let turn = w * (1.0 - mode.damping_ratio.powi(2)).sqrt() * step_s;
        let fall = (-mode.damping_ratio * w * step_s).exp();
        let (mut re, mut im) = (0.0_f64, 0.0_f64);
        let loudness = (2.0 * mode.damping_ratio * w * step_s).sqrt();
        // It was shaken before the recorder ran.
        for row in 0..rows + 4000 {
            let turned = fall * (re * turn.sin() + im * turn.cos());
            re = fall * (re * turn.cos() - im * turn.sin()) + loudness * noise.normal();
            im = turned;
            if row >= 4000 {
                outputs.iter_mut().zip(mode.shape).for_each(|(y, share)| y[row - 4000] += share * im);
            }
        }
    }
    let mut record = Recording::new("ambient", (0..rows).map(|k| k as f64 / rate_hz).collect());
    for (index, mut samples) in outputs.into_iter().enumerate() {
        samples.iter_mut().for_each(|y| *y += 0.01 * noise.normal());
        record = record.with_column(format!("acc{index}_m_s2"), samples);
    }
    (record, truth)
}
