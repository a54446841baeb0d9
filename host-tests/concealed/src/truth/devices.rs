//! Camera and encoder: from what happened to what is written down.

use serde::{Deserialize, Serialize};

use super::law::Sensor;
use crate::random::Random;

/// A device that reads one output.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Device {
    /// Readings per second.
    pub rate_hz: f64,
    /// Root mean square of its noise, in the output's unit.
    pub noise_rms: f64,
    /// Correlation of the noise from one reading to the next, 0 to below 1.
    pub noise_correlation: f64,
    /// Readings are multiples of this; 0 is no rounding.
    pub quantum: f64,
}

/// An output at equal steps from time 0 on, with the base beside it.
pub struct Seen<'a> {
    /// Seconds between samples.
    pub step_s: f64,
    /// The output.
    pub output: &'a [f64],
    /// The base.
    pub base: &'a [f64],
}

impl Device {
    /// Readings stamped at `stamps_s` through the laws of a sensor, without noise and rounding of the device.
    pub fn ideal(&self, seen: &Seen<'_>, laws: &[Sensor], stamps_s: &[f64]) -> Vec<f64> {
        let mut shown = seen.output.to_vec();
        let (mut delay_s, mut scale, mut exposure_s, mut rolling) = (0.0, 1.0, 0.0, 0.0);
        for law in laws {
            match *law {
                Sensor::Bent(a, b) => shown.iter_mut().for_each(|y| *y *= 1.0 + *y * (a + *y * b)),
                Sensor::Rectification(share) => {
                    shown.iter_mut().for_each(|y| *y = (1.0 - share) * *y + share * y.abs());
                }
                Sensor::Crosstalk(share) => {
                    shown.iter_mut().zip(seen.base).for_each(|(y, base)| *y += share * base);
                }
                Sensor::Play(play) => {
                    let mut pointer = 0.0_f64;
                    for y in &mut shown {
                        pointer = pointer.clamp(*y - 0.5 * play, *y + 0.5 * play);
                        *y = pointer;
                    }
                }
                Sensor::Delay(late_s) => delay_s += late_s,
                Sensor::Skew(skew) => scale /= 1.0 + skew,
                Sensor::Exposure(long_s) => exposure_s += long_s,
                Sensor::Rolling(per_metre) => rolling += per_metre,
                Sensor::Saturation(_) | Sensor::Quantisation(_) => {}
            }
        }
        let sums = running_integral(&shown, seen.step_s);
        let mean_until = |end_s: f64| {
            if exposure_s > 0.0 {
                let from = integral_at(&sums, &shown, seen.step_s, end_s - exposure_s);
                (integral_at(&sums, &shown, seen.step_s, end_s) - from) / exposure_s
            } else {
                value_at(&shown, seen.step_s, end_s)
            }
        };
        stamps_s
            .iter()
            .map(|stamp_s| {
                let end_s = stamp_s * scale - delay_s;
                let reading = mean_until(end_s);
                if rolling == 0.0 { reading } else { mean_until(end_s - rolling * reading) }
            })
            .collect()
    }

    /// What the device makes of ideal readings: noise, clipping and steps.
    pub fn recorded(&self, ideal: &[f64], laws: &[Sensor], random: &mut Random) -> Vec<f64> {
        let rho = self.noise_correlation;
        let mut noise = random.normal();
        ideal
            .iter()
            .map(|reading| {
                let read = reading + self.noise_rms * noise;
                noise = rho * noise + (1.0 - rho * rho).sqrt() * random.normal();
                let read = electronics(read, laws);
                if self.quantum > 0.0 { (read / self.quantum).round() * self.quantum } else { read }
            })
            .collect()
    }
}

/// Clipping and steps of a sensor's laws.
pub fn electronics(reading: f64, laws: &[Sensor]) -> f64 {
    laws.iter().fold(reading, |reading, law| match *law {
        Sensor::Saturation(limit) => reading.clamp(-limit, limit),
        Sensor::Quantisation(step) if step > 0.0 => (reading / step).round() * step,
        _ => reading,
    })
}

/// Cubic through the four samples around a time; the first sample before time 0.
fn value_at(samples: &[f64], step_s: f64, time_s: f64) -> f64 {
    let place = (time_s / step_s).clamp(0.0, samples.len().saturating_sub(1) as f64);
    let index = (place.floor() as usize).min(samples.len().saturating_sub(2));
    let s = place - index as f64;
    let at = |k: usize| samples.get(k).copied().unwrap_or(0.0);
    let (now, next) = (at(index), at(index + 1));
    let before = if index == 0 { now } else { at(index - 1) };
    let after = samples.get(index + 2).copied().unwrap_or(next);
    let slope_here = 0.5 * (next - before);
    let slope_there = 0.5 * (after - now);
    let way = next - now;
    let (c2, c3) = (3.0 * way - 2.0 * slope_here - slope_there, slope_here + slope_there - 2.0 * way);
    now + s * (slope_here + s * (c2 + s * c3))
}

/// Trapezoidal integral from the first sample to every one.
fn running_integral(samples: &[f64], step_s: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let mut before = None;
    samples
        .iter()
        .map(|&sample| {
            sum += before.map_or(0.0, |before| 0.5 * step_s * (before + sample));
            before = Some(sample);
            sum
        })
        .collect()
}

/// The same between samples; before time 0 the output stands still.
fn integral_at(sums: &[f64], samples: &[f64], step_s: f64, time_s: f64) -> f64 {
    let first = samples.first().copied().unwrap_or(0.0);
    if time_s <= 0.0 {
        return sums.first().copied().unwrap_or(0.0) + first * time_s;
    }
    let place = (time_s / step_s).min(samples.len().saturating_sub(1) as f64);
    let index = (place.floor() as usize).min(samples.len().saturating_sub(1));
    let past_s = time_s - index as f64 * step_s;
    let here = samples.get(index).copied().unwrap_or(first);
    let there = value_at(samples, step_s, time_s);
    sums.get(index).copied().unwrap_or(0.0) + 0.5 * past_s * (here + there)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const DEVICE: Device = Device { rate_hz: 100.0, noise_rms: 0.0, noise_correlation: 0.0, quantum: 0.0 };

    fn sine() -> Vec<f64> {
        (0..8001).map(|k| (TAU * 3.0 * f64::from(k) * 5e-4).sin()).collect()
    }

    fn read(laws: &[Sensor], stamps_s: &[f64]) -> Vec<f64> {
        let output = sine();
        let base = vec![2.0; output.len()];
        DEVICE.ideal(&Seen { step_s: 5e-4, output: &output, base: &base }, laws, stamps_s)
    }

    #[test]
    fn timing_laws_read_the_right_instant() {
        let stamps = [0.5, 1.2345, 3.0];
        let wanted = |at: fn(f64) -> f64| stamps.map(|t| (TAU * 3.0 * at(t)).sin());
        for (law, truth) in
            [(Sensor::Delay(0.0123), wanted(|t| t - 0.0123)), (Sensor::Skew(1e-3), wanted(|t| t / 1.001))]
        {
            for (read, wanted) in read(&[law], &stamps).iter().zip(truth) {
                assert!((read - wanted).abs() < 1e-7, "{law:?}: {read} {wanted}");
            }
        }
    }

    #[test]
    fn a_long_exposure_weakens_and_delays_as_a_trailing_mean_does() {
        let exposure = 0.04;
        for (stamp, read) in
            [0.5, 1.71, 3.3].iter().zip(read(&[Sensor::Exposure(exposure)], &[0.5, 1.71, 3.3]))
        {
            let x = TAU * 3.0 * exposure / 2.0;
            let wanted = x.sin() / x * (TAU * 3.0 * (stamp - 0.5 * exposure)).sin();
            assert!((read - wanted).abs() < 1e-4, "{read} {wanted}");
        }
    }

    #[test]
    fn the_lens_the_leak_and_the_sign_act_before_the_clock() {
        let t = 1.06;
        let y = (TAU * 3.0 * t).sin();
        assert!((read(&[Sensor::Bent(0.1, -0.2)], &[t])[0] - y * (1.0 + y * (0.1 - 0.2 * y))).abs() < 1e-7);
        assert!((read(&[Sensor::Crosstalk(0.5)], &[t])[0] - y - 1.0).abs() < 1e-7);
        assert!((read(&[Sensor::Rectification(0.25)], &[t])[0] - 0.75 * y - 0.25 * y.abs()).abs() < 1e-7);
    }

    #[test]
    fn noise_has_its_size_and_colour_and_readings_their_steps() {
        let device = Device { noise_rms: 2.0, noise_correlation: 0.6, ..DEVICE };
        let noise = device.recorded(&vec![0.0; 50_000], &[], &mut Random::new(3, 3));
        let power = |lag: usize| {
            noise.iter().zip(&noise[lag..]).map(|(a, b)| a * b).sum::<f64>() / noise.len() as f64
        };
        assert!((power(0) / 4.0 - 1.0).abs() < 0.05, "{}", power(0));
        assert!((power(1) / power(0) - 0.6).abs() < 0.03, "{}", power(1) / power(0));
        let device = Device { quantum: 0.5, ..device };
        let laws = [Sensor::Saturation(1.5)];
        for reading in device.recorded(&vec![0.3; 100], &laws, &mut Random::new(4, 4)) {
            assert!((reading / 0.5).fract() == 0.0 && reading.abs() <= 1.5);
        }
    }
}
