//! The noise floor of an output: what no model may explain.
//!
//! In this order: recordings that repeat each other; stretches in which nothing moves; the quiet quarter of
//! every frequency. The last needs only one recording: a sweep or a transient visits every frequency for a
//! part of the time, so the lower quartile of the residual's power over the windows of a record is the
//! noise's, with its colour. A sensor is as noisy in one run as in another: of several recordings those count
//! that are as quiet as the quietest. Where the excitation is stationary it is an upper bound, and says so.
//! Readings in steps that stand still say nothing of a noise below a step: it is seen where they move.

use std::ops::Range;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use serde::Serialize;

use crate::record::Record;

/// Where a noise floor comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NoiseSource {
    /// The difference of recordings with the same input.
    Repeats,
    /// Stretches in which the output should not move.
    QuietStretches,
    /// The lower quartile over time of the residual's power at every frequency.
    QuietQuarter,
    /// The model states it.
    Stated,
}

/// The noise of one output.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NoiseFloor {
    /// Root mean square, in the output's unit.
    pub(crate) rms: f64,
    pub(crate) source: NoiseSource,
    /// The number of samples that it was seen in.
    pub(crate) samples: f64,
}

/// Residuals of one output, recording by recording, with what is needed to see where they are quiet.
pub(crate) struct OutputResidual<'r> {
    pub(crate) record: &'r Record,
    pub(crate) output: usize,
    /// In the output's unit.
    pub(crate) residual: Vec<f64>,
    /// The simulated output.
    pub(crate) simulated: &'r [f64],
}

/// The noise floor of one output from all its recordings; `None` when there are none.
pub(crate) fn noise_floor(parts: &[OutputResidual<'_>]) -> Option<NoiseFloor> {
    let of =
        |source: NoiseSource, (power, samples): (f64, f64)| NoiseFloor { rms: power.sqrt(), source, samples };
    let seen_twice = from_repeats(parts).map(|seen| of(NoiseSource::Repeats, seen));
    let at_rest = || from_quiet_stretches(parts).map(|seen| of(NoiseSource::QuietStretches, seen));
    let everywhere = || {
        let powers: Vec<Quiet> = parts.iter().map(quiet_quarter_of).collect();
        quietest(&powers).map(|seen| of(NoiseSource::QuietQuarter, seen))
    };
    seen_twice.or_else(at_rest).or_else(everywhere)
}

/// A recording whose quiet quarter has this many times the power of the quietest recording's is not quiet:
/// something there is not explained all the time. Estimates from recordings of half a minute differ less,
/// coloured noise included.
const AS_QUIET: f64 = 2.5;

/// The stationary power of the recordings that are as quiet as the quietest, each counted with its length.
/// Where some are long enough for a quiet quarter, those that are not do not count. With the number of
/// samples.
fn quietest(powers: &[Quiet]) -> Option<(f64, f64)> {
    let any_long = powers.iter().any(|quiet| quiet.has_windows);
    let counted = || powers.iter().filter(|quiet| quiet.samples > 0.0 && quiet.has_windows == any_long);
    let least = counted().map(|quiet| quiet.power).reduce(f64::min)?;
    let (sum, samples) = counted()
        .filter(|quiet| quiet.power <= AS_QUIET * least)
        .fold((0.0, 0.0), |(sum, samples), quiet| {
            (sum + quiet.power * quiet.samples, samples + quiet.samples)
        });
    (samples > 0.0).then(|| (sum / samples, samples))
}

/// Two recordings repeat each other when their inputs differ by less than this share of the input.
const SAME_INPUT: f64 = 2e-3;

/// Mean square of the noise, and the number of samples it was seen in.
fn from_repeats(parts: &[OutputResidual<'_>]) -> Option<(f64, f64)> {
    let (mut sum, mut count) = (0.0, 0.0);
    for (index, a) in parts.iter().enumerate() {
        for b in &parts[index + 1..] {
            let (Some(u), Some(v)) = (&a.record.input, &b.record.input) else { continue };
            let (x, y) = (&a.record.outputs[a.output], &b.record.outputs[b.output]);
            if u.len() != v.len() || x.at != y.at || difference_share(u, v) > SAME_INPUT {
                continue;
            }
            let difference: Vec<f64> = x.samples.iter().zip(&y.samples).map(|(x, y)| x - y).collect();
            // Starts may differ by an offset.
            sum += 0.5 * centred_power(&difference);
            count += difference.len() as f64 - 1.0;
        }
    }
    (count > 0.0 && sum > 0.0).then(|| (sum / count, count))
}

fn difference_share(u: &[f64], v: &[f64]) -> f64 {
    let difference: Vec<f64> = u.iter().zip(v).map(|(u, v)| u - v).collect();
    (centred_power(&difference) / centred_power(u).max(f64::MIN_POSITIVE)).sqrt()
}

fn centred_power(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    values.iter().map(|value| (value - mean).powi(2)).sum()
}

/// An output stands still while its simulation stays within this share of its largest departure.
const STILL: f64 = 1e-3;
/// Seconds and samples that a quiet stretch must have, and samples that all of them must have together.
const STRETCH_S: f64 = 1.0;
const STRETCH_SAMPLES: usize = 50;
const ALL_SAMPLES: f64 = 300.0;

/// Mean square of the noise, and the number of samples it was seen in.
fn from_quiet_stretches(parts: &[OutputResidual<'_>]) -> Option<(f64, f64)> {
    let (mut sum, mut count) = (0.0, 0.0);
    for part in parts {
        let rate_hz = part.record.rate_hz(part.output);
        let least = STRETCH_SAMPLES.max((STRETCH_S * rate_hz) as usize);
        let input_moves = moving(part);
        let start = part.simulated.first().copied().unwrap_or(0.0);
        let largest = part.simulated.iter().map(|value| (value - start).abs()).fold(0.0, f64::max);
        let mut from = 0;
        let mut close = |from: usize, to: usize| {
            let samples = &part.record.outputs[part.output].samples;
            if to.saturating_sub(from) >= least && shows_noise(part, &samples[from..to], from..to) {
                sum += centred_power(&samples[from..to]);
                count += (to - from) as f64 - 1.0;
            }
        };
        for (k, (moves, value)) in input_moves.iter().zip(part.simulated).enumerate() {
            if *moves || (value - part.simulated[from.min(k)]).abs() >= STILL * largest {
                close(from, k);
                from = k + 1;
            }
        }
        close(from, part.simulated.len());
    }
    (count >= ALL_SAMPLES && sum > 0.0).then(|| (sum / count, count))
}

/// Whether the input moves, where the output has samples; a free decay never stands still.
fn moving(part: &OutputResidual<'_>) -> Vec<bool> {
    let signal = &part.record.outputs[part.output];
    let Some(input) = &part.record.input else {
        return vec![true; signal.at.len()];
    };
    let largest = input.iter().map(|value| (value - input[0]).abs()).fold(0.0, f64::max);
    signal.at.iter().map(|&k| k > 0 && (input[k] - input[k - 1]).abs() > 1e-6 * largest).collect()
}

/// Seconds of one window of the time-frequency map.
const WINDOW_S: f64 = 4.0;
/// The lower quartile of an exponentially distributed power is this share of its mean.
const QUARTILE_SHARE: f64 = 0.287_682_072_451_780_9;

/// What is stationary in one series.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Quiet {
    /// Mean square.
    power: f64,
    samples: f64,
    /// Whether the series was long enough to tell its quiet quarter; otherwise its whole power is meant.
    has_windows: bool,
}

/// Noise of this share of a step makes readings flip between steps all the time.
const FLIPS: f64 = 0.5;
/// Within so many steps of motion every part of a step was read.
const STEPS_OF_MOTION: f64 = 4.0;

/// Whether a stretch of an output shows its noise: readings in steps do where they flip or move.
fn shows_noise(part: &OutputResidual<'_>, values: &[f64], range: Range<usize>) -> bool {
    let Some(step) = part.record.outputs[part.output].step else { return true };
    let rms = (centred_power(values) / values.len().max(1) as f64).sqrt();
    let moved = &part.simulated[range];
    let most = moved.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = moved.iter().copied().fold(f64::INFINITY, f64::min);
    rms > FLIPS * step.value || most - least > STEPS_OF_MOTION * step.value
}

/// The stationary part of what is left of an output.
fn quiet_quarter_of(part: &OutputResidual<'_>) -> Quiet {
    let shows = |range: Range<usize>| shows_noise(part, &part.residual[range.clone()], range);
    quiet_quarter(&part.residual, part.record.rate_hz(part.output), &shows)
}

/// The stationary part of a series, from the windows that count.
fn quiet_quarter(series: &[f64], rate_hz: f64, counts: &dyn Fn(Range<usize>) -> bool) -> Quiet {
    let samples = series.len() as f64;
    let mean_square = series.iter().map(|value| value * value).sum::<f64>() / series.len().max(1) as f64;
    let length = ((WINDOW_S * rate_hz) as usize).next_power_of_two().min(1 << 14);
    let windows = spectra(series, length).into_iter().enumerate();
    let windows: Vec<Vec<f64>> = windows
        .filter(|(place, _)| counts(place * (length / 2)..place * (length / 2) + length))
        .map(|(_, window)| window)
        .collect();
    if windows.len() < 8 {
        return Quiet { power: mean_square, samples, has_windows: false };
    }
    let power: f64 = (0..=length / 2)
        .map(|bin| {
            let mut values: Vec<f64> = windows.iter().map(|window| window[bin]).collect();
            let quartile = values.len() / 4;
            let value = *values.select_nth_unstable_by(quartile, f64::total_cmp).1;
            let twice = if bin == 0 || 2 * bin == length { 1.0 } else { 2.0 };
            twice * value / QUARTILE_SHARE
        })
        .sum();
    Quiet { power: power.min(mean_square), samples, has_windows: true }
}

/// Power in every bin from 0 to half the sampling rate, of windows that overlap by half; a series' mean
/// square is the two-sided sum over bins.
pub(crate) fn spectra(series: &[f64], length: usize) -> Vec<Vec<f64>> {
    spectra_under(series, length, HANN)
}

/// Power of the sine that Hann's taper is.
const HANN: i32 = 2;

/// As [`spectra`], with the sine to this even power as the taper. Far from a line it leaks as the power of
/// the distance in bins that is one more: what is faint beside something loud needs more than Hann's.
pub(crate) fn spectra_under(series: &[f64], length: usize, sine_power: i32) -> Vec<Vec<f64>> {
    if length < 4 || series.len() < length {
        return Vec::new();
    }
    let taper: Vec<f64> = (0..length)
        .map(|k| (std::f64::consts::PI * (k as f64 + 0.5) / length as f64).sin().powi(sine_power))
        .collect();
    let gain = taper.iter().map(|value| value * value).sum::<f64>() * length as f64;
    let transform = FftPlanner::new().plan_fft_forward(length);
    (0..=series.len() - length)
        .step_by(length / 2)
        .map(|start| {
            let mut buffer: Vec<Complex<f64>> = series[start..start + length]
                .iter()
                .zip(&taper)
                .map(|(v, t)| Complex::new(v * t, 0.0))
                .collect();
            transform.process(&mut buffer);
            buffer[..=length / 2].iter().map(|value| value.norm_sqr() / gain).collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    #[test]
    fn a_sweeping_residual_does_not_raise_the_floor() {
        for (seed, rho) in [(1, 0.0), (2, 0.9)] {
            let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
            let mut last = 0.0;
            let noise: Vec<f64> = (0..8000)
                .map(|_| {
                    let innovation: f64 = StandardNormal.sample(&mut random);
                    last = rho * last + innovation;
                    last
                })
                .collect();
            let power = noise.iter().map(|value| value * value).sum::<f64>() / 8000.0;
            let swept: Vec<f64> = noise
                .iter()
                .enumerate()
                .map(|(k, value)| {
                    let t = k as f64 / 100.0;
                    value + 4.0 * (0.5 * t * t * 0.6).sin()
                })
                .collect();
            let ratio = quiet_quarter(&swept, 100.0, &|_| true).power / power;
            assert!((0.85..1.3).contains(&ratio), "rho {rho}: {ratio}");
        }
    }

    #[test]
    fn a_recording_that_is_not_explained_does_not_raise_the_floor() {
        let quiet = |power: f64| Quiet { power, samples: 2500.0, has_windows: true };
        let (power, samples) = quietest(&[quiet(1.0), quiet(1.2), quiet(400.0)]).unwrap();
        assert!((power - 1.1).abs() < 1e-12 && samples == 5000.0, "{power} in {samples}");
        let short = Quiet { has_windows: false, ..quiet(0.01) };
        let (power, _) = quietest(&[quiet(1.0), short]).unwrap();
        assert!((power - 1.0).abs() < 1e-12, "a short one that is explained by chance: {power}");
        assert_eq!(quietest(&[short]), Some((0.01, 2500.0)));
        assert_eq!(quietest(&[]), None);
    }

    #[test]
    fn recordings_of_the_same_noise_are_all_as_quiet_as_each_other() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
        for rho in [0.0, 0.95] {
            let powers: Vec<f64> = (0..40)
                .map(|_| {
                    let mut last = 0.0;
                    let noise: Vec<f64> = (0..2500)
                        .map(|_| {
                            let innovation: f64 = StandardNormal.sample(&mut random);
                            last = rho * last + innovation;
                            last
                        })
                        .collect();
                    quiet_quarter(&noise, 100.0, &|_| true).power
                })
                .collect();
            // Five recordings as a lab makes them.
            for five in powers.chunks(5) {
                let least = five.iter().copied().fold(f64::INFINITY, f64::min);
                let most = five.iter().copied().fold(0.0, f64::max);
                assert!(most < AS_QUIET * least, "rho {rho}: {least} to {most}");
            }
        }
    }
}
