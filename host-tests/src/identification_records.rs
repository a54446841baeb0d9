//! Simulated records whose truth is known, for comparing ways to identify: a base swept in position, a tip
//! seen by a camera, noise on the tip.
//!
//! The modal equations are integrated by Runge-Kutta steps of a millisecond with the analytic acceleration of
//! the sweep; nothing is shared with the code that identifies.

use std::f64::consts::TAU;

/// A mode: natural frequency, damping ratio, participation in the tip's deflection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueMode {
    /// Undamped natural frequency, Hz.
    pub frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Tip deflection per modal coordinate, which is forced by minus the base's acceleration.
    pub participation: f64,
}

/// The beam of the paper: its first two modes with the damping its shapers were designed for.
pub const BEAM: [TrueMode; 2] = [
    TrueMode { frequency_hz: 1.1, damping_ratio: 0.0074, participation: 1.566 },
    TrueMode { frequency_hz: 6.9, damping_ratio: 0.0033, participation: -0.868 },
];

/// How the frequency moves between 0.1 and 8 Hz.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Course {
    /// By as many hertz in every second.
    Linear,
    /// By as many octaves in every second.
    Exponential,
    /// The same from 8 Hz down.
    ExponentialDown,
}

/// Noise of the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CameraNoise {
    /// Root mean square, m.
    Rms(f64),
    /// Below the deflection's root mean square by this many decibels.
    SignalToNoiseDb(f64),
}

/// One experiment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepCase {
    /// Short name, fit for files.
    pub name: &'static str,
    /// For tables.
    pub title: &'static str,
    /// Course of the frequency.
    pub course: Course,
    /// Length, s.
    pub duration_s: f64,
    /// Noise.
    pub noise: CameraNoise,
}

/// From 0.1 to 8 Hz: log2 of 80.
const OCTAVES: f64 = 6.321_928_094_887_363;

/// The paper's four sweeps (Table 1: 1 Hz/s, then 3, −5 and 7 octaves per minute) with 50 µm of noise, and
/// sweeps of 80 s with 45 and 25 dB.
pub const CASES: [SweepCase; 8] = [
    case("paper_linear", "paper: linear, 7.9 s", Course::Linear, 7.9, CameraNoise::Rms(50e-6)),
    case("paper_3", "paper: 3 oct/min", Course::Exponential, OCTAVES * 20.0, CameraNoise::Rms(50e-6)),
    case("paper_5", "paper: −5 oct/min", Course::ExponentialDown, OCTAVES * 12.0, CameraNoise::Rms(50e-6)),
    case("paper_7", "paper: 7 oct/min", Course::Exponential, OCTAVES * 60.0 / 7.0, CameraNoise::Rms(50e-6)),
    case("linear_45", "linear 80 s, 45 dB", Course::Linear, 80.0, CameraNoise::SignalToNoiseDb(45.0)),
    case("linear_25", "linear 80 s, 25 dB", Course::Linear, 80.0, CameraNoise::SignalToNoiseDb(25.0)),
    case("exp_45", "exp. 80 s, 45 dB", Course::Exponential, 80.0, CameraNoise::SignalToNoiseDb(45.0)),
    case("exp_25", "exp. 80 s, 25 dB", Course::Exponential, 80.0, CameraNoise::SignalToNoiseDb(25.0)),
];

const fn case(
    name: &'static str,
    title: &'static str,
    course: Course,
    duration_s: f64,
    noise: CameraNoise,
) -> SweepCase {
    SweepCase { name, title, course, duration_s, noise }
}

/// Frames per second.
const FRAME_RATE_HZ: f64 = 100.0;
/// Amplitude of the base, m.
const AMPLITUDE_M: f64 = 1e-3;
const LOW_HZ: f64 = 0.1;
const HIGH_HZ: f64 = 8.0;

/// A record: time, base and tip, all at the camera's frames.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepRecord {
    /// Stamps, s.
    pub time_s: Vec<f64>,
    /// Position of the base, m.
    pub base_position_m: Vec<f64>,
    /// Deflection of the tip as seen, m.
    pub tip_deflection_m: Vec<f64>,
}

impl SweepCase {
    /// Position and acceleration of the base, m and m/s².
    fn base(&self, t: f64) -> [f64; 2] {
        let (phase, speed, rate) = match self.course {
            Course::Linear => {
                let rate = (HIGH_HZ - LOW_HZ) / self.duration_s;
                (LOW_HZ * t + 0.5 * rate * t * t, LOW_HZ + rate * t, rate)
            }
            Course::Exponential | Course::ExponentialDown => {
                let down = self.course == Course::ExponentialDown;
                let (from, to) = if down { (HIGH_HZ, LOW_HZ) } else { (LOW_HZ, HIGH_HZ) };
                let k = (to / from).ln() / self.duration_s;
                let now = from * (k * t).exp();
                ((now - from) / k, now, now * k)
            }
        };
        let (sine, cosine) = (TAU * phase).sin_cos();
        let omega = TAU * speed;
        [AMPLITUDE_M * sine, AMPLITUDE_M * (TAU * rate * cosine - omega * omega * sine)]
    }

    /// Simulates the case once, with one seed of noise.
    pub fn record(&self, modes: &[TrueMode], seed: u64) -> SweepRecord {
        let frames = (self.duration_s * FRAME_RATE_HZ + 1e-6) as usize;
        let time_s: Vec<f64> = (0..=frames).map(|k| k as f64 / FRAME_RATE_HZ).collect();
        let mut tip = vec![0.0; time_s.len()];
        for mode in modes {
            for (tip, q) in tip.iter_mut().zip(self.response(*mode, frames)) {
                *tip += mode.participation * q;
            }
        }
        let rms = (tip.iter().map(|value| value * value).sum::<f64>() / tip.len() as f64).sqrt();
        let noise_m = match self.noise {
            CameraNoise::Rms(rms_m) => rms_m,
            CameraNoise::SignalToNoiseDb(db) => rms * 10_f64.powf(-db / 20.0),
        };
        let mut noise = Noise(seed);
        SweepRecord {
            base_position_m: time_s.iter().map(|t| self.base(*t)[0]).collect(),
            tip_deflection_m: tip.iter().map(|value| value + noise_m * noise.normal()).collect(),
            time_s,
        }
    }

    /// Modal coordinate at every frame, from rest.
    fn response(&self, mode: TrueMode, frames: usize) -> Vec<f64> {
        const STEPS: usize = 10;
        let omega = TAU * mode.frequency_hz;
        let h = 1.0 / (FRAME_RATE_HZ * STEPS as f64);
        let rate = |t: f64, q: [f64; 2]| {
            [q[1], -self.base(t)[1] - 2.0 * mode.damping_ratio * omega * q[1] - omega * omega * q[0]]
        };
        let step = |q: [f64; 2], d: [f64; 2], h: f64| [q[0] + h * d[0], q[1] + h * d[1]];
        let mut q = [0.0; 2];
        let mut found = vec![0.0];
        for k in 0..frames * STEPS {
            let t = k as f64 * h;
            let k1 = rate(t, q);
            let k2 = rate(t + 0.5 * h, step(q, k1, 0.5 * h));
            let k3 = rate(t + 0.5 * h, step(q, k2, 0.5 * h));
            let k4 = rate(t + h, step(q, k3, h));
            for i in 0..2 {
                q[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
            if (k + 1) % STEPS == 0 {
                found.push(q[0]);
            }
        }
        found
    }
}

/// A small seeded generator (splitmix64) with normal numbers by Box and Muller.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn acceleration_is_the_second_derivative_of_position() {
        for case in CASES {
            for t in [0.5, 2.0, 5.0, 7.0] {
                let h = 1e-4;
                let second = (case.base(t + h)[0] - 2.0 * case.base(t)[0] + case.base(t - h)[0]) / (h * h);
                assert!((second - case.base(t)[1]).abs() < 2e-5 * (1.0 + second.abs()), "{} {t}", case.name);
            }
        }
    }

    #[test]
    fn the_noise_is_as_far_below_the_signal_as_the_case_says() {
        let case = CASES[5];
        let clean = SweepCase { noise: CameraNoise::Rms(0.0), ..case }.record(&BEAM, 1).tip_deflection_m;
        let noisy = case.record(&BEAM, 1).tip_deflection_m;
        let power = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>();
        let signal = power(&mut clean.iter().copied());
        let noise = power(&mut clean.iter().zip(&noisy).map(|(a, b)| a - b));
        assert!((10.0 * (signal / noise).log10() - 25.0).abs() < 0.2);
    }
}
