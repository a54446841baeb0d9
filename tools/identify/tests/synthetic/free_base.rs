//! A beam on a base that a force pushes along a guide with viscous friction, in its clamped modes:
//! m y'' + c y' + sum m_r q_r'' = F, q_r'' + 2 zeta_r omega_r q_r' + omega_r² q_r = -y'', deflection = sum of
//! participation_r q_r, with m all that moves and m_r the modes' effective masses.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, Matrix3, Vector3};
use stillbeam_recording::Recording;

use super::{Mode, Noise, Sweep};

#[derive(Debug, Clone)]
pub struct FreeBase {
    pub moved_kg: f64,
    pub viscous_n_s_m: f64,
    /// Clamped modes.
    pub modes: [Mode; 2],
    pub effective_kg: [f64; 2],
}

/// Frequency (Hz) and damping ratio of the vibrations, lowest first, and the rate of the real pole, 1/s.
pub struct Truth {
    pub modes: Vec<[f64; 2]>,
    pub rate_per_s: f64,
}

impl FreeBase {
    /// The paper's beam on a base of 2.5 kg.
    pub fn paper(viscous_n_s_m: f64) -> Self {
        Self {
            moved_kg: 2.71,
            viscous_n_s_m,
            modes: [
                Mode { frequency_hz: 1.1, damping_ratio: 0.0074, participation: 1.548 },
                Mode { frequency_hz: 6.9, damping_ratio: 0.0033, participation: -0.839 },
            ],
            effective_kg: [0.130, 0.040],
        }
    }

    /// d/dt of v, q_1, q_1', q_2, q_2'; v the base's velocity.
    fn rates(&self, force_n: f64, x: [f64; 5]) -> [f64; 5] {
        let [first, second] = self.modes.map(|mode| (TAU * mode.frequency_hz, mode.damping_ratio));
        let pull = |(w, zeta): (f64, f64), q: f64, dq: f64| -2.0 * zeta * w * dq - w * w * q;
        let [m1, m2] = self.effective_kg;
        let matrix = Matrix3::new(self.moved_kg, m1, m2, 1.0, 1.0, 0.0, 1.0, 0.0, 1.0);
        let right = Vector3::new(
            force_n - self.viscous_n_s_m * x[0],
            pull(first, x[1], x[2]),
            pull(second, x[3], x[4]),
        );
        let solved = matrix.lu().solve(&right).unwrap();
        [solved[0], x[2], solved[1], x[4], solved[2]]
    }

    pub fn truth(&self) -> Truth {
        let columns: Vec<[f64; 5]> = (0..5)
            .map(|column| self.rates(0.0, std::array::from_fn(|row| if row == column { 1.0 } else { 0.0 })))
            .collect();
        let poles = DMatrix::from_fn(5, 5, |row, column| columns[column][row]).complex_eigenvalues();
        let upper = poles.iter().filter(|pole| pole.im > 1e-9);
        let mut modes: Vec<[f64; 2]> = upper.map(|s| [s.norm() / TAU, -s.re / s.norm()]).collect();
        modes.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let real = poles.iter().find(|pole| pole.im.abs() <= 1e-9).unwrap();
        Truth { modes, rate_per_s: -real.re }
    }

    /// Base position and deflection at the times, from rest.
    pub fn response(&self, force_n: impl Fn(f64) -> f64, times_s: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (mut x, mut y, mut t) = ([0.0; 5], 0.0, times_s[0]);
        let add = |x: [f64; 5], d: [f64; 5], h: f64| std::array::from_fn::<f64, 5, _>(|i| x[i] + h * d[i]);
        let [first, second] = self.modes.map(|mode| mode.participation);
        times_s
            .iter()
            .map(|&end| {
                let steps = ((end - t) / 1e-3).ceil() as usize;
                let h = (end - t) / steps.max(1) as f64;
                for k in 0..steps {
                    let now = t + k as f64 * h;
                    let (f0, f1, f2) = (force_n(now), force_n(now + h / 2.0), force_n(now + h));
                    let k1 = self.rates(f0, x);
                    let k2 = self.rates(f1, add(x, k1, h / 2.0));
                    let k3 = self.rates(f1, add(x, k2, h / 2.0));
                    let k4 = self.rates(f2, add(x, k3, h));
                    y += h * (x[0] + h / 6.0 * (k1[0] + k2[0] + k3[0]));
                    for i in 0..5 {
                        x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
                    }
                }
                t = end;
                (y, first * x[1] + second * x[3])
            })
            .unzip()
    }
}

/// A force sweep of 1 N seen by a 100 Hz camera, noise so many decibels below the deflection's rms.
pub struct ForceSweep {
    pub sweep: Sweep,
    pub time_s: Vec<f64>,
    pub force_n: Vec<f64>,
    pub deflection_m: Vec<f64>,
}

impl ForceSweep {
    pub fn new(base: &FreeBase, sweep: Sweep) -> Self {
        let force = |t: f64| sweep.position(t) / super::AMPLITUDE_M;
        let time_s: Vec<f64> = (0..=8000).map(|k| 0.01 * f64::from(k)).collect();
        let (_, deflection_m) = base.response(force, &time_s);
        Self { sweep, force_n: time_s.iter().map(|t| force(*t)).collect(), time_s, deflection_m }
    }

    /// Standard deviation of the noise, m.
    pub fn noise_m(&self, noise_db: f64) -> f64 {
        let power = self.deflection_m.iter().map(|w| w * w).sum::<f64>() / self.deflection_m.len() as f64;
        power.sqrt() * 10_f64.powf(-noise_db / 20.0)
    }

    pub fn recording(&self, noise_db: f64, seed: u64) -> Recording {
        let rms_m = self.noise_m(noise_db);
        let mut noise = Noise(seed);
        let seen = self.deflection_m.iter().map(|w| w + rms_m * noise.normal()).collect();
        Recording::new("force sweep", self.time_s.clone())
            .with_column("force_N", self.force_n.clone())
            .with_column("tip_deflection_m", seen)
    }
}
