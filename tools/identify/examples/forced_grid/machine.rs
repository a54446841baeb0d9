//! Random machines and their records, made without the code under test.
//!
//! Every mode is advanced by the exact transition of its equation for a force that is a straight line between
//! points eight times as dense as the record.

use std::f64::consts::TAU;

use stillbeam_recording::Recording;

use crate::chance::Chance;

/// A mode of a machine.
#[derive(Debug, Clone, Copy)]
pub struct TrueMode {
    pub frequency_hz: f64,
    pub damping_ratio: f64,
    /// Output per modal coordinate.
    pub participation: f64,
    /// How far it stands above the noise: its part of the output over the noise, as a ratio of energies,
    /// root.
    pub clear: f64,
}

/// How a machine is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drive {
    Sweep,
    Multisine,
    Random,
    Hammer,
    /// A sweep of a machine whose mode with the largest response loses 2 % of its frequency at its largest
    /// amplitude.
    SofteningSweep,
    /// The same machine under a multisine.
    SofteningMultisine,
}

pub const DRIVES: [Drive; 6] = [
    Drive::Sweep,
    Drive::Multisine,
    Drive::Random,
    Drive::Hammer,
    Drive::SofteningSweep,
    Drive::SofteningMultisine,
];

impl Drive {
    /// Whether the machine is not linear.
    pub fn softens(self) -> bool {
        matches!(self, Self::SofteningSweep | Self::SofteningMultisine)
    }
}

/// Points of the force per sample.
const DENSE: usize = 8;
/// The modes lie in this band, Hz; the force reaches a little further on both sides.
const BAND_HZ: [f64; 2] = [2.0, 32.0];

/// A record with its truth.
pub struct Case {
    pub recording: Recording,
    pub modes: Vec<TrueMode>,
    pub drive: Drive,
    pub noise_pct: f64,
}

/// The record of a seed: 1 to 10 modes, 0.1 to 5 % damping, noise of 0.1 to 5 % of the output.
pub fn case(seed: u64, drive: Drive) -> Case {
    let mut chance = Chance::new(seed);
    let count = 1 + (chance.uniform() * 10.0) as usize;
    let mut modes = random_modes(count, &mut chance);
    let noise_pct = chance.between_logs(0.1, 5.0);
    let (rate_hz, duration_s) = (128.0, 48.0);
    let samples = (rate_hz * duration_s) as usize;
    let interval_s = 1.0 / (rate_hz * DENSE as f64);
    let force = force(drive, samples * DENSE, interval_s, &mut chance);
    let mut parts: Vec<Vec<f64>> = modes.iter().map(|mode| acceleration(mode, &force, interval_s)).collect();
    if drive.softens() {
        let largest =
            (0..modes.len()).max_by(|a, b| rms(&parts[*a]).total_cmp(&rms(&parts[*b]))).unwrap_or(0);
        parts[largest] = softening(&modes[largest], &force, interval_s);
    }
    let clean: Vec<f64> = (0..samples).map(|k| parts.iter().map(|part| part[k]).sum()).collect();
    let noise = 0.01 * noise_pct * rms(&clean);
    for (mode, part) in modes.iter_mut().zip(&parts) {
        mode.clear = rms(part) * (samples as f64).sqrt() / noise;
    }
    let output: Vec<f64> = clean.iter().map(|y| y + noise * chance.normal()).collect();
    let time_s = (0..samples).map(|k| k as f64 / rate_hz).collect();
    let mut input: Vec<f64> = force.iter().copied().step_by(DENSE).collect();
    if drive == Drive::Hammer {
        // A hammer's load cell is as noisy between the hits as in them.
        let size = chance.between_logs(0.001, 0.01) * input.iter().fold(0.0_f64, |top, u| top.max(*u));
        input.iter_mut().for_each(|u| *u += size * chance.normal());
    }
    let recording =
        Recording::new("machine", time_s).with_column("force_N", input).with_column("tip_m_s2", output);
    Case { recording, modes, drive, noise_pct }
}

/// Modes at least three half-power bands, and 3 %, apart.
fn random_modes(count: usize, chance: &mut Chance) -> Vec<TrueMode> {
    let mut modes: Vec<TrueMode> = Vec::new();
    for _ in 0..100 * count {
        let frequency_hz = chance.between_logs(BAND_HZ[0], BAND_HZ[1]);
        let damping_ratio = chance.between_logs(0.001, 0.05);
        let apart = |other: &TrueMode| {
            let away = (other.frequency_hz / frequency_hz).ln().abs();
            away > (3.0 * (other.damping_ratio + damping_ratio)).max(0.03)
        };
        if modes.len() < count && modes.iter().all(apart) {
            let sign = if chance.uniform() < 0.5 { -1.0 } else { 1.0 };
            let participation = sign * chance.between_logs(0.3, 3.0);
            modes.push(TrueMode { frequency_hz, damping_ratio, participation, clear: 0.0 });
        }
    }
    modes
}

fn force(drive: Drive, points: usize, interval_s: f64, chance: &mut Chance) -> Vec<f64> {
    let duration_s = points as f64 * interval_s;
    let [low, high] = [0.7 * BAND_HZ[0], 1.25 * BAND_HZ[1]];
    let time = |k: usize| k as f64 * interval_s;
    match drive {
        Drive::Sweep | Drive::SofteningSweep => {
            let rate = (high / low).ln() / duration_s;
            (0..points).map(|k| (TAU * low * ((rate * time(k)).exp() - 1.0) / rate).sin()).collect()
        }
        Drive::Multisine | Drive::SofteningMultisine | Drive::Random => {
            // Three periods, or none within the record.
            let spacing_hz = if drive != Drive::Random { 3.0 / duration_s } else { 0.73 / duration_s };
            let lines = (low / spacing_hz) as usize..=(high / spacing_hz) as usize;
            let waves: Vec<[f64; 2]> =
                lines.map(|line| [line as f64 * spacing_hz, TAU * chance.uniform()]).collect();
            let size = 1.0 / (waves.len() as f64).sqrt();
            let at =
                |t: f64| waves.iter().map(|[hz, phase]| (TAU * hz * t + phase).sin()).sum::<f64>() * size;
            // At rest before the first sample.
            let begin = |t: f64| (2.0 * t).min(1.0);
            (0..points).map(|k| at(time(k)) * begin(time(k))).collect()
        }
        Drive::Hammer => {
            let hits: Vec<[f64; 3]> = (0..4)
                .map(|hit| {
                    let at_s = (0.02 + 0.25 * f64::from(hit) + 0.03 * chance.uniform()) * duration_s;
                    [at_s, chance.between_logs(0.03, 0.05), chance.between_logs(50.0, 200.0)]
                })
                .collect();
            let pulse = |t: f64, [at_s, width_s, size]: [f64; 3]| match (t - at_s) / width_s {
                share @ 0.0..1.0 => size * (0.5 - 0.5 * (TAU * share).cos()),
                _ => 0.0,
            };
            (0..points).map(|k| hits.iter().map(|hit| pulse(time(k), *hit)).sum()).collect()
        }
    }
}

/// A mode's part of the acceleration, at the samples of the record.
fn acceleration(mode: &TrueMode, force: &[f64], h: f64) -> Vec<f64> {
    let w = TAU * mode.frequency_hz;
    let (a, wd) = (mode.damping_ratio * w, w * (1.0 - mode.damping_ratio.powi(2)).sqrt());
    let (mut q, mut v) = (0.0_f64, 0.0_f64);
    let (e, c, s) = ((-a * h).exp(), (wd * h).cos(), (wd * h).sin());
    let mut out = Vec::with_capacity(force.len() / DENSE);
    for (k, &here) in force.iter().enumerate() {
        if k % DENSE == 0 {
            out.push(mode.participation * (here - 2.0 * a * v - w * w * q));
        }
        let slope = (force.get(k + 1).copied().unwrap_or(here) - here) / h;
        // The particular solution of a force here + slope t is p + r t.
        let r = slope / (w * w);
        let p = (here - 2.0 * a * r) / (w * w);
        let (q0, v0) = (q - p, v - r);
        let b = (v0 + a * q0) / wd;
        q = e * (q0 * c + b * s) + p + r * h;
        v = e * ((b * wd - a * q0) * c - (q0 * wd + a * b) * s) + r;
    }
    out
}

/// The same of a mode whose stiffness falls with the square of its coordinate, by Runge-Kutta steps.
fn softening(mode: &TrueMode, force: &[f64], h: f64) -> Vec<f64> {
    let w = TAU * mode.frequency_hz;
    let linear = acceleration(mode, force, h);
    let top = linear.iter().fold(0.0_f64, |top, a| top.max(a.abs())) / mode.participation.abs() / (w * w);
    // 2 % of the frequency are 4 % of the stiffness, of which a sine feels three quarters.
    let fall = 0.04 / 0.75 / (top * top);
    let rate = |q: f64, v: f64, u: f64| {
        [v, u - 2.0 * mode.damping_ratio * w * v - w * w * q * (1.0 - (fall * q * q).min(0.2))]
    };
    let (mut q, mut v) = (0.0, 0.0);
    let mut out = Vec::with_capacity(force.len() / DENSE);
    for (k, &here) in force.iter().enumerate() {
        if k % DENSE == 0 {
            out.push(mode.participation * rate(q, v, here)[1]);
        }
        let next = force.get(k + 1).copied().unwrap_or(here);
        let half = 0.5 * (here + next);
        let [a, b] = rate(q, v, here);
        let [c, d] = rate(q + 0.5 * h * a, v + 0.5 * h * b, half);
        let [e, f] = rate(q + 0.5 * h * c, v + 0.5 * h * d, half);
        let [i, j] = rate(q + h * e, v + h * f, next);
        q += h / 6.0 * (a + 2.0 * c + 2.0 * e + i);
        v += h / 6.0 * (b + 2.0 * d + 2.0 * f + j);
    }
    out
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|y| y * y).sum::<f64>() / values.len().max(1) as f64).sqrt()
}
