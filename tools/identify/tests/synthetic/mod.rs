//! Simulated recordings, independent of the code under test: the modal equation is integrated with the
//! analytic acceleration of the sweep by Runge-Kutta steps of a fifth of a millisecond or less.

#![allow(dead_code, reason = "examples use their own part")]

pub mod ambient;
pub mod amplitude;
pub mod bound;
pub mod decays;
pub mod free_base;
pub mod kinds;

use std::f64::consts::TAU;

use stillbeam_recording::Recording;

#[derive(Debug, Clone, Copy)]
pub struct Mode {
    pub frequency_hz: f64,
    pub damping_ratio: f64,
    pub participation: f64,
}

#[derive(Debug, Clone, Copy)]
pub enum Sweep {
    Linear,
    Exponential,
}

pub const DURATION_S: f64 = 80.0;
pub const AMPLITUDE_M: f64 = 1e-3;

impl Sweep {
    /// Phase, its rate and the rate's rate, for 0.1 to 8 Hz in 80 s.
    fn phase(self, t: f64) -> [f64; 3] {
        let (low, high) = (0.1_f64, 8.0_f64);
        match self {
            Self::Linear => {
                let rate = (high - low) / DURATION_S;
                [TAU * (low * t + 0.5 * rate * t * t), TAU * (low + rate * t), TAU * rate]
            }
            Self::Exponential => {
                let k = (high / low).ln() / DURATION_S;
                let grown = low * (k * t).exp();
                [TAU * (grown - low) / k, TAU * grown, TAU * grown * k]
            }
        }
    }

    pub fn position(self, t: f64) -> f64 {
        AMPLITUDE_M * self.phase(t)[0].sin()
    }

    pub fn speed(self, t: f64) -> f64 {
        let [p, w, _] = self.phase(t);
        AMPLITUDE_M * w * p.cos()
    }

    pub fn acceleration(self, t: f64) -> f64 {
        let [p, w, a] = self.phase(t);
        AMPLITUDE_M * (a * p.cos() - w * w * p.sin())
    }
}

/// A small seeded generator (splitmix64) with normal numbers by Box and Muller.
pub struct Noise(pub u64);

impl Noise {
    /// An even number from 0 to below 1.
    pub fn even(&mut self) -> f64 {
        self.uniform()
    }

    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }
}

/// q of one mode at the times, from rest, forced by s.
pub fn modal_response(mode: Mode, s: impl Fn(f64) -> f64, times_s: &[f64]) -> Vec<f64> {
    let w = TAU * mode.frequency_hz;
    let rate = |s: f64, q: [f64; 2]| [q[1], s - 2.0 * mode.damping_ratio * w * q[1] - w * w * q[0]];
    let add = |q: [f64; 2], d: [f64; 2], h: f64| [q[0] + h * d[0], q[1] + h * d[1]];
    let (mut q, mut t) = ([0.0; 2], times_s[0]);
    times_s
        .iter()
        .map(|&end| {
            let steps = ((end - t) / 1e-3).ceil() as usize;
            let h = (end - t) / steps.max(1) as f64;
            for k in 0..steps {
                let now = t + k as f64 * h;
                let (s0, s1, s2) = (s(now), s(now + h / 2.0), s(now + h));
                let k1 = rate(s0, q);
                let k2 = rate(s1, add(q, k1, h / 2.0));
                let k3 = rate(s1, add(q, k2, h / 2.0));
                let k4 = rate(s2, add(q, k3, h));
                for i in 0..2 {
                    q[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
                }
            }
            t = end;
            q[0]
        })
        .collect()
}

/// A base sweep seen by a 100 Hz camera; the input is recorded `input_per_frame` times as often.
pub fn sweep_record(
    sweep: Sweep,
    modes: &[Mode],
    input_per_frame: usize,
    noise_m: f64,
    seed: u64,
) -> Recording {
    let (time_s, clean) = clean_sweep(sweep, modes, input_per_frame);
    noisy(sweep, &time_s, &clean, noise_m, seed)
}

/// Stamps of the input and the tip without noise, missing between camera frames.
pub fn clean_sweep(sweep: Sweep, modes: &[Mode], input_per_frame: usize) -> (Vec<f64>, Vec<f64>) {
    let rate = 100 * input_per_frame;
    let time_s: Vec<f64> = (0..=(DURATION_S as usize * rate)).map(|k| k as f64 / rate as f64).collect();
    let mut tip = vec![0.0; time_s.len()];
    for mode in modes {
        let q = modal_response(*mode, |t| -sweep.acceleration(t), &time_s);
        for (tip, q) in tip.iter_mut().zip(q) {
            *tip += mode.participation * q;
        }
    }
    for (k, value) in tip.iter_mut().enumerate() {
        if k % input_per_frame != 0 {
            *value = f64::NAN;
        }
    }
    (time_s, tip)
}

pub fn noisy(sweep: Sweep, time_s: &[f64], clean: &[f64], noise_m: f64, seed: u64) -> Recording {
    let mut noise = Noise(seed);
    let tip =
        clean.iter().map(|value| if value.is_nan() { *value } else { value + noise_m * noise.normal() });
    Recording::new("sweep", time_s.to_vec())
        .with_column("base_position_m", time_s.iter().map(|t| sweep.position(*t)).collect())
        .with_column("tip_deflection_m", tip.collect())
}

/// A free decay from t = 0, amplitudes in `participation`, different phases, plus noise by sample number.
pub fn ring_down(
    modes: &[Mode],
    rate_hz: f64,
    samples: usize,
    offset: f64,
    noise: impl Fn(usize) -> f64,
) -> Recording {
    let time_s: Vec<f64> = (0..samples).map(|k| k as f64 / rate_hz).collect();
    let tip = time_s.iter().enumerate().map(|(k, t)| {
        let sum: f64 = modes
            .iter()
            .zip(0..)
            .map(|(mode, index)| {
                let w = TAU * mode.frequency_hz;
                let damped = w * (1.0 - mode.damping_ratio.powi(2)).sqrt();
                let phase = 0.4 * f64::from(index);
                mode.participation * (-mode.damping_ratio * w * t).exp() * (damped * t + phase).cos()
            })
            .sum();
        sum + offset + noise(k)
    });
    let tip = tip.collect();
    Recording::new("decay", time_s).with_column("tip_deflection_m", tip)
}
