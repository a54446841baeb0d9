//! The noise of a recorded input, read off its own samples.
//!
//! What drives a machine ends at some frequency, and the noise of whoever measured it does not: in the
//! quietest band of the quiet quarter of time there is nothing but noise. Readings in steps are off by a
//! twelfth of a square step beside. A signal that fills its whole band all the time is no noise: what would
//! be more than a small share of it is not taken for any.

use crate::noise::spectra_under;
use crate::reading_step::ReadingStep;

/// Noise and steps of an input, in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct InputNoise {
    /// Root mean square of what is white.
    pub(crate) white_rms: f64,
    /// The step that readings come in; 0 where they are not rounded.
    pub(crate) step: f64,
    /// Where they are rounded, the reading at which the input stands most.
    pub(crate) standing: f64,
}

/// What has more than this share of the input is a part of it.
const MOST: f64 = 0.03;
/// Samples of one window, and windows from which the quiet quarter is told.
const WINDOW: usize = 512;
const WINDOWS: usize = 8;
/// Bands, of which the quietest counts.
const BANDS: usize = 16;
/// Power of the sine that windows are tapered with: the signal leaks less than 1e-8 of itself into the
/// quietest band.
const TAPER: i32 = 4;
/// The lower quartile of an exponentially distributed power is this share of its mean.
const QUARTILE_SHARE: f64 = 0.287_682_072_451_780_9;

impl InputNoise {
    /// Read off the samples of one recording.
    pub(crate) fn of(samples: &[f64]) -> Self {
        let count = samples.len().max(1) as f64;
        let mean = samples.iter().sum::<f64>() / count;
        let spread = (samples.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt();
        let small = |rms: f64| if rms <= MOST * spread { rms } else { 0.0 };
        let step = small(ReadingStep::of(samples).map_or(0.0, |step| step.value));
        let beside = (flat_power(samples) - step * step / 12.0).max(0.0);
        let standing = if step > 0.0 { most_read(samples, step) } else { 0.0 };
        Self { white_rms: small(beside.sqrt()), step, standing }
    }

    /// Errors of this kind beside these samples, drawn at random; the same ones every time for a number.
    ///
    /// Rounding is drawn by rounding the same signal at another size: it is as fast or slow as the signal
    /// moves over steps. What stands still is known: were it off by a share of a step all the time, a base
    /// that nothing holds would run away under that force.
    pub(crate) fn drawn(self, samples: &[f64], number: u64) -> Vec<f64> {
        let size = SIZES.0 + SIZES.1 * (PLACE * (number + 1) as f64).fract();
        let rounded_off = |value: f64| {
            if self.step > 0.0 {
                let other = size * (value - self.standing) / self.step;
                self.step * (other.round() - other)
            } else {
                0.0
            }
        };
        let noise = white(self.white_rms, samples.len(), number);
        noise.iter().zip(samples).map(|(noise, value)| noise + rounded_off(*value)).collect()
    }
}

/// The smallest other size and their range: multiples of a step are none any more, ...
const SIZES: (f64, f64) = (0.6, 0.3);
/// ... and every draw has another one.
const PLACE: f64 = 0.569_840_290_998_053_3;

/// The reading that is there most often.
fn most_read(samples: &[f64], step: f64) -> f64 {
    let mut readings = samples.to_vec();
    readings.sort_by(f64::total_cmp);
    let same = readings.chunk_by(|one, next| next - one < 0.5 * step);
    same.max_by_key(|readings| readings.len()).and_then(|readings| readings.first().copied()).unwrap_or(0.0)
}

/// White noise drawn at random; the same every time for a number.
pub(crate) fn white(rms: f64, count: usize, number: u64) -> Vec<f64> {
    let mut bits = 0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(2 * number + 1);
    let mut sign = || {
        // Xorshift (G. Marsaglia, 2003).
        bits ^= bits << 13;
        bits ^= bits >> 7;
        bits ^= bits << 17;
        if bits >> 63 == 0 { 1.0 } else { -1.0 }
    };
    (0..count).map(|_| rms * sign()).collect()
}

/// Mean square of white noise that would be as strong everywhere as the quietest band.
pub(crate) fn flat_power(samples: &[f64]) -> f64 {
    let length = WINDOW.min((samples.len() / WINDOWS).next_power_of_two() / 2).max(16);
    let windows = spectra_under(samples, length, TAPER);
    if windows.len() < WINDOWS {
        return 0.0;
    }
    let quiet: Vec<f64> = (1..length / 2)
        .map(|bin| {
            let mut values: Vec<f64> = windows.iter().map(|window| window[bin]).collect();
            let quartile = values.len() / 4;
            *values.select_nth_unstable_by(quartile, f64::total_cmp).1 / QUARTILE_SHARE
        })
        .collect();
    let band = (quiet.len() / BANDS).max(4);
    let typical = |values: &[f64]| {
        let mut values = values.to_vec();
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let quietest = quiet.chunks_exact(band).map(typical).fold(f64::INFINITY, f64::min);
    if quietest.is_finite() { quietest * length as f64 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    fn recorded(noise: f64, step: f64, rate_hz: f64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        (0..(20.0 * rate_hz) as usize)
            .map(|k| {
                let t = k as f64 / rate_hz;
                let normal: f64 = StandardNormal.sample(&mut random);
                let seen = (0.6 * t * t).sin() + noise * normal;
                if step > 0.0 { (seen / step).round() * step } else { seen }
            })
            .collect()
    }

    fn power(values: &[f64]) -> f64 {
        values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64
    }

    #[test]
    fn noise_and_steps_are_read_off_a_sweep_at_any_rate() {
        for rate_hz in [100.0, 500.0, 2000.0] {
            for (noise, step) in [(3e-4, 0.0), (3e-4, 1e-3), (1e-3, 1e-3), (0.0, 2e-3)] {
                let samples = recorded(noise, step, rate_hz);
                let found = InputNoise::of(&samples);
                let drawn = power(&found.drawn(&samples, 0)).sqrt();
                let wanted = (noise * noise + step * step / 12.0).sqrt();
                assert!(
                    (0.6..1.6).contains(&(drawn / wanted)),
                    "{rate_hz} Hz: {noise} {step}: {drawn} {found:?}"
                );
            }
        }
    }

    #[test]
    fn an_input_that_stands_still_is_off_by_nothing_all_the_time() {
        let step = 0.01;
        let moved = |k: usize| if k < 1000 { 2.0 * (0.02 * k as f64).sin() } else { 0.0 };
        for place in [0.0, 0.004] {
            let samples: Vec<f64> = (0..4000).map(|k| (moved(k) / step).round() * step + place).collect();
            let noise = InputNoise { white_rms: 0.0, ..InputNoise::of(&samples) };
            assert!((noise.step - step).abs() < 1e-9, "{noise:?}");
            for number in 0..8 {
                let drawn = noise.drawn(&samples, number);
                assert!(drawn[1000..].iter().all(|error| error.abs() < 1e-9), "{place} {number}");
                let moving = power(&drawn[..1000]).sqrt();
                assert!((0.7..1.4).contains(&(moving / (step / 12.0_f64.sqrt()))), "{number}: {moving}");
            }
        }
    }

    #[test]
    fn a_signal_without_noise_has_none_and_a_random_one_is_no_noise() {
        let found = InputNoise::of(&recorded(0.0, 0.0, 200.0));
        assert!(found.white_rms < 1e-6 && found.step == 0.0, "{found:?}");
        let mut random = Xoshiro256PlusPlus::seed_from_u64(8);
        let all_over: Vec<f64> = (0..4000).map(|_| StandardNormal.sample(&mut random)).collect();
        assert_eq!(InputNoise::of(&all_over), InputNoise::default());
    }
}
