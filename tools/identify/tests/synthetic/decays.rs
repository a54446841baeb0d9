//! Free decays whose truth is known: of close modes, linear ones under noise, and ones that go with
//! amplitude.

use std::f64::consts::TAU;

use stillbeam_recording::Recording;

use super::kinds::{between, ratio_between};
use super::{Mode, Noise, ring_down};

/// Two modes `apart` (a share) from each other, over four time constants of the slower one, under 1 % noise.
pub fn close_pair(seed: u64, apart: f64) -> (Recording, [Mode; 2]) {
    let mut noise = Noise(seed.wrapping_mul(31).wrapping_add(7));
    let first_hz = ratio_between(&mut noise, 2.0, 60.0);
    let mode = |frequency_hz: f64, noise: &mut Noise, size: f64| Mode {
        frequency_hz,
        damping_ratio: between(noise, 0.003, 0.008),
        participation: size,
    };
    let first = mode(first_hz, &mut noise, 1.0);
    let share = between(&mut noise, 0.4, 1.0);
    let second = mode(first_hz * (1.0 + apart), &mut noise, share);
    let slowest_s =
        [first, second].iter().map(|m| 1.0 / (TAU * m.frequency_hz * m.damping_ratio)).fold(0.0, f64::max);
    let rate_hz = first_hz * between(&mut noise, 15.0, 35.0);
    let rows = (4.0 * slowest_s * rate_hz) as usize;
    let e: Vec<f64> = (0..rows).map(|_| 0.01 * noise.normal()).collect();
    (ring_down(&[first, second], rate_hz, rows, 0.0, |k| e[k]), [first, second])
}

/// A record of 2 to 8 time constants with `noise_share` of the first deflection as noise, and its frequency
/// (Hz). The amplitude a obeys a' = -(c + drag a + dry / a) a and the phase omega (1 - softening a²), all in
/// units of the first deflection and of the decay.
pub struct Course {
    pub drag: f64,
    pub dry: f64,
    pub softening: f64,
}

/// Nothing goes with amplitude.
pub const LINEAR: Course = Course { drag: 0.0, dry: 0.0, softening: 0.0 };

/// A decay of one mode with a course of its own, and its frequency at rest, Hz.
pub fn decay_of(course: &Course, seed: u64) -> (Recording, f64) {
    let mut noise = Noise(seed.wrapping_mul(131).wrapping_add(3));
    let frequency_hz = ratio_between(&mut noise, 2.0, 80.0);
    let damping_ratio = ratio_between(&mut noise, 0.002, 0.02);
    let level = ratio_between(&mut noise, 0.003, 0.02);
    let constants = between(&mut noise, 2.0, 8.0);
    let rate_hz = frequency_hz * between(&mut noise, 12.0, 30.0);
    let decay_per_s = TAU * frequency_hz * damping_ratio;
    let rows = (constants / decay_per_s * rate_hz) as usize;
    let (mut amplitude, mut phase) = (1.0_f64, TAU * noise.even());
    let fine = 8;
    let step_s = 1.0 / (rate_hz * f64::from(fine));
    let mut values = Vec::with_capacity(rows);
    for _ in 0..rows {
        values.push(amplitude * phase.cos() + level * noise.normal());
        for _ in 0..fine {
            phase += TAU * frequency_hz * (1.0 - course.softening * amplitude * amplitude) * step_s;
            let rate = decay_per_s * (amplitude + course.drag * amplitude * amplitude + course.dry);
            amplitude = (amplitude - rate * step_s).max(0.0);
        }
    }
    let time_s = (0..rows).map(|k| k as f64 / rate_hz).collect();
    (Recording::new("decay", time_s).with_column("tip_m", values), frequency_hz)
}
