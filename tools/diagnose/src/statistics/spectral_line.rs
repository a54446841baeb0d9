//! Whether a series has a line in its spectrum: a tone that keeps its frequency and its phase.
//!
//! A steady tone has the same power in every window and, once an autoregressive model of the series is taken
//! out of it, is gone: such a model foretells a tone better than anything else. Its spectrum shows it: one
//! ordinate stands out of its neighbours, where noise of a smooth colour has ordinates that are scattered
//! about them like the sum of two squares.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// The ordinates on either side that the noise below is read from.
const NEIGHBOURS: usize = 16;
/// Ordinates next to one that a tone between two frequencies spills into.
const SPILLED_INTO: usize = 3;
/// Fewer samples have too few ordinates.
const FEWEST: usize = 8 * (NEIGHBOURS + SPILLED_INTO);

/// The strongest line of a spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line {
    pub(crate) frequency_hz: f64,
    /// Chance that any ordinate of noise stands out as much.
    pub(crate) p: f64,
    /// Share of the power of the series, its slope taken out, that stands out of the noise beside it.
    pub(crate) share: f64,
}

/// The line that stands out most; `None` where the series is too short for one, or nothing.
///
/// An ordinate of the periodogram over the mean of `m` others of the same noise has Fisher's distribution
/// with 2 and `2m` degrees of freedom, whose tail is `(1 + r/m)^-m`.
pub(crate) fn strongest_line(series: &[f64], rate_hz: f64) -> Option<Line> {
    let n = series.len();
    if n < FEWEST {
        return None;
    }
    let power = periodogram(&flattened(series));
    let range = SPILLED_INTO..power.len() - SPILLED_INTO;
    let count = range.len() as f64;
    let of_one = |k: usize| -> Option<(f64, f64)> {
        let below = k.saturating_sub(SPILLED_INTO + NEIGHBOURS)..k.saturating_sub(SPILLED_INTO);
        let above = k + SPILLED_INTO + 1..(k + SPILLED_INTO + 1 + NEIGHBOURS).min(power.len());
        // The louder side counts: on the flank of a broad resonance the other one is no measure.
        let mean = |side: &[f64]| {
            (side.len() >= NEIGHBOURS / 2).then(|| side.iter().sum::<f64>() / side.len() as f64)
        };
        let (below, above) = (&power[below], &power[above]);
        let sides = [below, above].map(|side| mean(side).map(|mean| (mean, side.len() as f64)));
        let (mean, m) = sides.into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0))?;
        (mean > 0.0).then(|| ((1.0 + power[k] / mean / m).powf(-m), mean))
    };
    let ordinates = range.filter_map(|k| Some((k, of_one(k)?)));
    let (k, (p, mean)) = ordinates.min_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    let line = power[k - SPILLED_INTO..=k + SPILLED_INTO].iter().map(|power| (power - mean).max(0.0));
    let share = line.sum::<f64>() / power.iter().sum::<f64>();
    Some(Line { frequency_hz: k as f64 * rate_hz / n as f64, p: (count * p).min(1.0), share })
}

/// The series without its level, and without the slope of its spectrum: what of each sample the one before it
/// foretells taken out. That is a smooth filter, which leaves a line a line.
fn flattened(series: &[f64]) -> Vec<f64> {
    let known = || series.iter().filter(|value| value.is_finite());
    let mean = known().sum::<f64>() / known().count().max(1) as f64;
    // What is missing is nothing.
    let level = |value: f64| if value.is_finite() { value - mean } else { 0.0 };
    let values: Vec<f64> = series.iter().map(|value| level(*value)).collect();
    let square: f64 = values.iter().map(|value| value * value).sum();
    let next: f64 = values.windows(2).map(|pair| pair[0] * pair[1]).sum();
    let share = if square > 0.0 { next / square } else { 0.0 };
    std::iter::once(values[0]).chain(values.windows(2).map(|pair| pair[1] - share * pair[0])).collect()
}

/// Squares of the spectrum from zero to half the sampling rate.
fn periodogram(series: &[f64]) -> Vec<f64> {
    let mut buffer: Vec<Complex<f64>> = series.iter().map(|value| Complex::new(*value, 0.0)).collect();
    FftPlanner::new().plan_fft_forward(buffer.len()).process(&mut buffer);
    buffer[..=series.len() / 2].iter().map(Complex::norm_sqr).collect()
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    use super::*;

    const RATE_HZ: f64 = 100.0;

    /// Noise of standard deviation one whose neighbours are correlated.
    fn noise(seed: u64, samples: usize, correlation: f64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let (mut last, scale) = (0.0, (1.0 - correlation * correlation).sqrt());
        (0..samples)
            .map(|_| {
                let innovation: f64 = StandardNormal.sample(&mut random);
                last = correlation * last + scale * innovation;
                last
            })
            .collect()
    }

    fn with_tone(mut series: Vec<f64>, frequency_hz: f64, amplitude: f64) -> Vec<f64> {
        for (k, value) in series.iter_mut().enumerate() {
            *value += amplitude * (std::f64::consts::TAU * frequency_hz * k as f64 / RATE_HZ + 0.3).sin();
        }
        series
    }

    #[test]
    fn noise_of_any_colour_has_no_line() {
        for correlation in [0.0, 0.5, 0.8, 0.95] {
            for samples in [1000, 3000, 3500] {
                let found =
                    |seed| strongest_line(&noise(seed, samples, correlation), RATE_HZ).unwrap().p < 0.01;
                let false_alarms = (0..200).filter(|seed| found(*seed)).count();
                assert!(false_alarms <= 8, "{false_alarms} of 200 at {correlation}, {samples} samples");
            }
        }
    }

    #[test]
    fn a_tone_of_half_the_noise_is_seen_and_its_frequency_is_known() {
        for (correlation, frequency_hz) in [(0.0, 3.2), (0.0, 11.017), (0.8, 7.35)] {
            for seed in 0..20 {
                let series = with_tone(noise(seed, 3000, correlation), frequency_hz, 0.5_f64.sqrt());
                let line = strongest_line(&series, RATE_HZ).unwrap();
                assert!(line.p < 1e-6, "{line:?}");
                assert!((line.frequency_hz - frequency_hz).abs() < 0.6 * RATE_HZ / 3000.0, "{line:?}");
            }
        }
    }

    #[test]
    fn a_broad_resonance_a_drift_and_nothing_are_no_lines() {
        for seed in 0..50 {
            let (mut last, mut before) = (0.0, 0.0);
            // 3 % of critical damping at 6.9 Hz: some twenty ordinates wide.
            let ringing: Vec<f64> = noise(seed, 3000, 0.0)
                .into_iter()
                .map(|push| {
                    let now = 1.803 * last - 0.974 * before + push;
                    (before, last) = (last, now);
                    now
                })
                .collect();
            assert!(strongest_line(&ringing, RATE_HZ).unwrap().p > 1e-5, "seed {seed}");
            let drifting: Vec<f64> =
                noise(seed, 3000, 0.0).iter().zip(0..).map(|(e, k)| e + 2e-3 * f64::from(k)).collect();
            assert!(strongest_line(&drifting, RATE_HZ).unwrap().p > 1e-5, "seed {seed}");
        }
        assert_eq!(strongest_line(&[0.0; 3000], RATE_HZ), None);
        assert_eq!(strongest_line(&[1.0; 100], RATE_HZ), None);
    }

    #[test]
    fn samples_that_are_missing_hide_no_tone() {
        let mut series = with_tone(noise(1, 3000, 0.0), 5.0, 0.5);
        (0..3000).step_by(7).for_each(|k| series[k] = f64::NAN);
        assert!(strongest_line(&series, RATE_HZ).unwrap().p < 1e-6);
    }
}
