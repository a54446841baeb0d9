//! What an input does between its samples.
//!
//! A simulation needs to know, and no recording says. Three guesses, each right for its kind of signal:
//! straight lines for one with steps or kinks, where anything smoother overshoots; a cubic spline for one
//! that changes slowly; and for one with fast changes whose band ends below half the sampling rate the only
//! signal of that band through the samples (Shannon's), of which a spline misses some per cent and straight
//! lines a third.

use std::f64::consts::{PI, TAU};

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use stillbeam_identify::InputInterpolation;
use stillbeam_identify::interpolation::PiecewiseCubic;
use stillbeam_plant::{Hold, Model};

/// A slow input has at most this share of its power's changes above a quarter of the sampling rate.
const SLOW: f64 = 1e-3;
/// Where the band of a fast input has to end, as a share of the sampling rate.
const BAND: f64 = 0.4;
/// What it may have beyond, of the power of its second differences. A step has 0.39 there, a kink 0.2.
const BEYOND_BAND: f64 = 0.01;
/// Stamps are even when every interval is within this share of the usual one.
const EVEN: f64 = 0.01;
/// Samples on either side that a value between two of them is made of, and the Kaiser window's beta for them:
/// what is below 0.44 of the sampling rate passes and what mirrors it above is suppressed, by 80 dB
/// (Oppenheim and Schafer, Discrete-Time Signal Processing, 7.6).
const REACH: usize = 24;
const KAISER_BETA: f64 = 7.86;

/// The kind of signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BetweenSamples {
    /// Straight lines.
    Lines,
    /// A cubic spline.
    Spline,
    /// The signal of the samples' band.
    BandLimited,
    /// The same until the next sample, as a digital controller puts it out. No samples tell: a model says so,
    /// or it is tried.
    Held,
}

/// Parts of an interval for a signal that is held: it changes within one part on either side of a sample,
/// which weakens a sine by a hundredth of what holding it does.
pub(crate) const HELD_PARTS: usize = 4;

impl BetweenSamples {
    /// As the model says of its force; `None` where it says nothing, or where a motion or a controller
    /// drives.
    pub(crate) fn stated(model: &Model) -> Option<Self> {
        let drives = !model.input_is_motion() && model.setup().controller.is_none();
        match model.input().filter(|_| drives)?.hold? {
            Hold::ZeroOrder => Some(Self::Held),
            Hold::FirstOrder => Some(Self::Lines),
        }
    }

    /// Judged by the samples.
    pub(crate) fn of(time_s: &[f64], samples: &[f64]) -> Self {
        if is_slow(samples) {
            Self::Spline
        } else if share_beyond_band(samples) < BEYOND_BAND {
            if is_even(time_s) { Self::BandLimited } else { Self::Spline }
        } else {
            Self::Lines
        }
    }

    /// Every interval cut into `refinement` parts, the last sample included. The values make up for straight
    /// lines being drawn between them, which weaken a sine by (omega h)²/12.
    pub(crate) fn refined(self, time_s: &[f64], samples: &[f64], refinement: usize) -> Vec<f64> {
        match self {
            _ if refinement <= 1 => samples.to_vec(),
            Self::Lines => lines(samples, refinement),
            Self::Held => held(samples, refinement),
            Self::Spline => spline(time_s, samples, refinement),
            Self::BandLimited => made_up(&band_limited(samples, refinement)),
        }
    }
}

/// Neighbouring differences are small against the signal's own changes.
fn is_slow(samples: &[f64]) -> bool {
    let second: f64 = samples.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).powi(2)).sum();
    let fourth: f64 =
        samples.windows(5).map(|w| (w[4] - 4.0 * w[3] + 6.0 * w[2] - 4.0 * w[1] + w[0]).powi(2)).sum();
    // For a sine at a quarter of the sampling rate this ratio is 4, for 1/12 of it 0.07; white noise has
    // 11.7.
    second == 0.0 || fourth < 0.3 * second || second < SLOW * centred_power(samples)
}

fn centred_power(samples: &[f64]) -> f64 {
    let mean = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
    samples.iter().map(|value| (value - mean).powi(2)).sum()
}

/// Of the power of the second differences, what lies above [`BAND`].
fn share_beyond_band(samples: &[f64]) -> f64 {
    let second: Vec<f64> = samples.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]).collect();
    let count = second.len() as f64;
    // Tapered, or the record's ends would be steps.
    let hann = |k: usize| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / count).cos();
    let mut spectrum: Vec<Complex<f64>> =
        second.iter().enumerate().map(|(k, value)| Complex::new(hann(k) * value, 0.0)).collect();
    if spectrum.is_empty() {
        return 1.0;
    }
    FftPlanner::new().plan_fft_forward(spectrum.len()).process(&mut spectrum);
    spectrum.truncate(spectrum.len() / 2 + 1);
    let first = (BAND * count).ceil() as usize;
    let power = |part: &[Complex<f64>]| part.iter().map(Complex::norm_sqr).sum::<f64>();
    let all = power(&spectrum);
    if all > 0.0 { power(spectrum.get(first..).unwrap_or_default()) / all } else { 0.0 }
}

fn is_even(time_s: &[f64]) -> bool {
    let (Some(first), Some(last)) = (time_s.first(), time_s.last()) else { return true };
    let usual_s = (last - first) / time_s.len().saturating_sub(1).max(1) as f64;
    time_s.windows(2).all(|pair| (pair[1] - pair[0] - usual_s).abs() <= EVEN * usual_s)
}

fn lines(samples: &[f64], refinement: usize) -> Vec<f64> {
    let mut fine = Vec::with_capacity(samples.len() * refinement);
    for pair in samples.windows(2) {
        let part = (pair[1] - pair[0]) / refinement as f64;
        fine.extend((0..refinement).map(|k| pair[0] + k as f64 * part));
    }
    fine.extend(samples.last());
    fine
}

/// Half way between two values where they change, so that nothing comes late or early.
fn held(samples: &[f64], refinement: usize) -> Vec<f64> {
    let mut fine = Vec::with_capacity(samples.len() * refinement);
    let mut before = samples.first().copied().unwrap_or(0.0);
    for value in &samples[..samples.len().saturating_sub(1)] {
        fine.push(0.5 * (before + value));
        fine.extend((1..refinement).map(|_| *value));
        before = *value;
    }
    fine.extend(samples.last().map(|last| 0.5 * (before + last)));
    fine
}

fn spline(time_s: &[f64], samples: &[f64], refinement: usize) -> Vec<f64> {
    let mut fine_s = Vec::with_capacity(time_s.len() * refinement);
    for pair in time_s.windows(2) {
        let part_s = (pair[1] - pair[0]) / refinement as f64;
        fine_s.extend((0..refinement).map(|part| pair[0] + part as f64 * part_s));
    }
    fine_s.extend(time_s.last());
    let duration_s = time_s.last().copied().unwrap_or(0.0) - time_s.first().copied().unwrap_or(0.0);
    let step_s = duration_s / fine_s.len().saturating_sub(1).max(1) as f64;
    let spline = PiecewiseCubic::new(time_s, samples, InputInterpolation::Cubic);
    let made_up = |[value, _, second]: [f64; 3]| value - step_s * step_s / 12.0 * second;
    spline.sample(fine_s).into_iter().map(made_up).collect()
}

/// Evenly sampled; beyond its ends the signal is taken to go on point-symmetrically.
fn band_limited(samples: &[f64], refinement: usize) -> Vec<f64> {
    let Some(last) = samples.len().checked_sub(1) else { return Vec::new() };
    let at = |k: isize| {
        let inside = k.clamp(0, last as isize);
        let mirrored = (2 * inside - k).clamp(0, last as isize);
        if k == inside {
            samples[inside as usize]
        } else {
            2.0 * samples[inside as usize] - samples[mirrored as usize]
        }
    };
    let weights: Vec<Vec<f64>> =
        (0..refinement).map(|part| kernel(part as f64 / refinement as f64)).collect();
    let mut fine = Vec::with_capacity(samples.len() * refinement);
    for k in 0..last {
        let near: Vec<f64> = (0..2 * REACH).map(|j| at((k + j) as isize + 1 - REACH as isize)).collect();
        fine.extend(
            weights
                .iter()
                .map(|weights| near.iter().zip(weights).map(|(value, weight)| value * weight).sum::<f64>()),
        );
    }
    fine.push(samples[last]);
    fine
}

/// Weights of the samples from `REACH − 1` before to `REACH` after, for a place so many intervals after a
/// sample. They sum to one.
fn kernel(place: f64) -> Vec<f64> {
    let raw: Vec<f64> = (0..2 * REACH)
        .map(|j| {
            let distance = place + REACH as f64 - 1.0 - j as f64;
            let sinc = if distance == 0.0 { 1.0 } else { (PI * distance).sin() / (PI * distance) };
            let edge = (1.0 - (distance / REACH as f64).powi(2)).max(0.0).sqrt();
            sinc * bessel_i0(KAISER_BETA * edge) / bessel_i0(KAISER_BETA)
        })
        .collect();
    let sum: f64 = raw.iter().sum();
    raw.into_iter().map(|weight| weight / sum).collect()
}

/// The modified Bessel function of the first kind and order zero, by its series.
fn bessel_i0(x: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..60 {
        term *= (0.5 * x / f64::from(k)).powi(2);
        sum += term;
    }
    sum
}

/// `value − h²/12·second derivative`, by the second difference; at the ends as they are.
fn made_up(fine: &[f64]) -> Vec<f64> {
    let mut values = fine.to_vec();
    for (value, w) in values.iter_mut().skip(1).zip(fine.windows(3)) {
        *value -= (w[2] - 2.0 * w[1] + w[0]) / 12.0;
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(count: usize, value: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..count).map(|k| value(k as f64)).collect()
    }

    fn kind(samples: &[f64]) -> BetweenSamples {
        BetweenSamples::of(&sampled(samples.len(), |k| 0.01 * k), samples)
    }

    /// Lines of equal size up to a share of the sampling rate, with phases that keep the crest low.
    fn multisine(k: f64, share: f64) -> f64 {
        let lines = (1000.0 * share) as usize;
        (1..=lines)
            .map(|line| {
                let line = line as f64;
                (TAU * (line * k / 1000.0 - line * line / (2.0 * lines as f64))).cos()
            })
            .sum()
    }

    #[test]
    fn slow_signals_are_splines_fast_ones_with_an_end_to_their_band_are_band_limited_and_steps_and_noise_neither()
     {
        let staircase = |k: f64| (TAU * (k / 9.0).floor() * 9.0 / 300.0).sin();
        let square = |k: f64| if ((k / 37.0) as u32).is_multiple_of(2) { 1.0 } else { -1.0 };
        let noise = |k: f64| ((k * k * 0.618_034).fract() - 0.5) * 2.0;
        for (what, expected, samples) in [
            ("a slow sine", BetweenSamples::Spline, sampled(3000, |k| (0.05 * k).sin())),
            ("a band up to a third", BetweenSamples::BandLimited, sampled(3000, |k| multisine(k, 0.33))),
            ("a band up to nearly half", BetweenSamples::Lines, sampled(3000, |k| multisine(k, 0.48))),
            ("steps", BetweenSamples::Lines, sampled(3000, square)),
            ("a staircase", BetweenSamples::Lines, sampled(3000, staircase)),
            ("noise", BetweenSamples::Lines, sampled(3000, noise)),
        ] {
            assert_eq!(kind(&samples), expected, "{what}: {}", share_beyond_band(&samples));
        }
        let mut uneven = sampled(3000, |k| 0.01 * k);
        uneven[100] += 0.001;
        let fast = sampled(3000, |k| multisine(k, 0.33));
        assert_eq!(BetweenSamples::of(&uneven, &fast), BetweenSamples::Spline);
    }

    #[test]
    fn between_its_samples_a_band_limited_signal_is_found_to_a_thousandth() {
        let samples = sampled(1500, |k| multisine(k, 0.38));
        let fine = band_limited(&samples, 5);
        assert_eq!(fine.len(), 1499 * 5 + 1);
        let size = (centred_power(&samples) / samples.len() as f64).sqrt();
        for (index, value) in fine.iter().enumerate().skip(5 * REACH).take(5 * (1500 - 2 * REACH)) {
            let truth = multisine(index as f64 / 5.0, 0.38);
            assert!((value - truth).abs() < 1e-3 * size, "{index}: {value} for {truth}");
        }
        assert!(
            band_limited(&[3.0; 200], 4).iter().all(|value| (value - 3.0).abs() < 1e-12),
            "a constant stays one"
        );
        let ramp = sampled(200, |k| 2.0 * k - 7.0);
        for (index, value) in band_limited(&ramp, 4).iter().enumerate() {
            assert!((value - (0.5 * index as f64 - 7.0)).abs() < 1e-2, "{index}: {value}");
        }
    }

    #[test]
    fn straight_lines_between_the_values_keep_a_sines_size() {
        let omega = TAU * 0.3;
        let samples = sampled(400, |k| (omega * k).sin());
        let (refinement, time_s) = (8, sampled(400, |k| k));
        let fine = BetweenSamples::BandLimited.refined(&time_s, &samples, refinement);
        // What a resonance at that frequency sees of the straight lines: the product with the sine,
        // integrated piece by piece.
        let h = 1.0 / refinement as f64;
        let seen: f64 = fine
            .windows(2)
            .enumerate()
            .skip(400)
            .take(2400)
            .map(|(k, pair)| {
                let (a, b) = (pair[0], pair[1]);
                (0..20)
                    .map(|part| {
                        let x = (f64::from(part) + 0.5) / 20.0;
                        (a + (b - a) * x) * (omega * (k as f64 + x) * h).sin() * h / 20.0
                    })
                    .sum::<f64>()
            })
            .sum();
        let expected = 0.5 * 2400.0 * h;
        assert!((seen / expected - 1.0).abs() < 2e-3, "{}", seen / expected);
    }
}
