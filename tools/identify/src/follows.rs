//! Whether an output holds the motion of the input itself.
//!
//! A laser beside the machine sees the base move and the tip bend; a strain gauge sees the tip bend. The
//! model of the one leaves, of a record of the other, motion that no mode explains.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;
use stillbeam_recording::Recording;

use crate::forced_record::present;

/// Share of the input's energy, from the lowest frequencies on, in which the two are compared: below the
/// modes.
const LOWEST: f64 = 0.03;
/// Share of its largest line that a line of the input has at least: below are drifts and noise.
const LINE: f64 = 0.01;
/// How much of the input such an output shows there, and how much of its own motion that explains.
const ONE_TO_ONE: std::ops::Range<f64> = 0.7..1.4;
const EXPLAINED: f64 = 0.9;

/// Whether the slow motion of an output is that of the input, one to one.
pub fn follows_input(recording: &Recording, input: &str, output: &str) -> bool {
    let (Ok(input), Ok(output)) = (present(recording, input), present(recording, output)) else {
        return false;
    };
    // Where values are missing the rows of the two differ.
    input.values.len() == output.values.len() && is_one_to_one(&input.values, &output.values)
}

fn is_one_to_one(input: &[f64], output: &[f64]) -> bool {
    let (u, y) = (lines(input), lines(output));
    let all: f64 = u.iter().map(Complex64::norm_sqr).sum();
    let largest = u.iter().map(Complex64::norm_sqr).fold(0.0, f64::max);
    let (mut uu, mut uy, mut yy) = (0.0, 0.0, 0.0);
    for (u, y) in u.iter().zip(&y).filter(|(u, _)| u.norm_sqr() > LINE * largest) {
        uu += u.norm_sqr();
        uy += (y * u.conj()).re;
        yy += y.norm_sqr();
        if uu > LOWEST * all {
            break;
        }
    }
    uu > 0.0 && yy > 0.0 && ONE_TO_ONE.contains(&(uy / uu)) && uy * uy > EXPLAINED * uu * yy
}

/// The lines of a signal without its mean, from the lowest on.
fn lines(values: &[f64]) -> Vec<Complex64> {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    let mut lines: Vec<Complex64> = values.iter().map(|value| Complex64::new(value - mean, 0.0)).collect();
    if !lines.is_empty() {
        FftPlanner::new().plan_fft_forward(lines.len()).process(&mut lines);
    }
    lines.truncate(values.len() / 2);
    lines.split_off(1.min(lines.len()))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const RATE_HZ: f64 = 500.0;

    /// How a mode bends under a base that moves like this, by steps far shorter than its period.
    fn bends(base: &dyn Fn(f64) -> f64, seconds: f64, hz: f64, damping: f64) -> (Vec<f64>, Vec<f64>) {
        const FINE: u32 = 40;
        let (step, omega) = (1.0 / (RATE_HZ * f64::from(FINE)), TAU * hz);
        let (mut place, mut speed) = (base(0.0), 0.0);
        let (mut inputs, mut bent) = (Vec::new(), Vec::new());
        for k in 0..(seconds / step) as u32 {
            let input = base(f64::from(k) * step);
            if k.is_multiple_of(FINE) {
                inputs.push(input);
                bent.push(place - input);
            }
            speed += step * (omega * omega * (input - place) - 2.0 * damping * omega * speed);
            place += step * speed;
        }
        (inputs, bent)
    }

    #[test]
    fn absolute_positions_are_told_from_deflections() {
        let s_curve = |t: f64| {
            let x = ((t - 0.3) / 0.25).clamp(0.0, 1.0);
            0.1 * (10.0 * x.powi(3) - 15.0 * x.powi(4) + 6.0 * x.powi(5))
        };
        let sweep = |t: f64| 1e-3 * (TAU * (4.0 * t + t * t)).sin();
        let slow_sweep = |t: f64| 1e-3 * (TAU * (2.0 * t + 0.8 * t * t)).sin();
        let back = |t: f64| s_curve(t) - s_curve(t - 2.0);
        let motions: [&dyn Fn(f64) -> f64; 4] = [&s_curve, &sweep, &slow_sweep, &back];
        for (number, motion) in motions.into_iter().enumerate() {
            for (hz, damping) in [(12.0, 0.01), (19.0, 0.003), (27.0, 0.05)] {
                let (base, bent) = bends(motion, 20.0, hz, damping);
                let size = base.iter().fold(0.0_f64, |top, value| top.max(value.abs()));
                for gain in [1.0, 0.4] {
                    let noisy = |k: usize| 0.002 * size * (f64::from(k as u32 * 7919 % 1009) / 504.5 - 1.0);
                    let tip: Vec<f64> = base
                        .iter()
                        .zip(&bent)
                        .enumerate()
                        .map(|(k, (u, b))| u + gain * b + noisy(k))
                        .collect();
                    let bent: Vec<f64> = bent.iter().enumerate().map(|(k, b)| gain * b + noisy(k)).collect();
                    assert!(is_one_to_one(&base, &tip), "motion {number}, {hz} Hz, {gain}");
                    assert!(!is_one_to_one(&base, &bent), "motion {number}, {hz} Hz, {gain}");
                }
            }
        }
        assert!(!is_one_to_one(&[], &[]) && !is_one_to_one(&[1.0; 50], &[1.0; 50]));
    }
}
