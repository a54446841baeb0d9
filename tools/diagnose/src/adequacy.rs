//! Whether what a model leaves over is noise.
//!
//! Four questions, none of which takes white noise for granted:
//! * is its power that of the noise floor, judged by the number of samples that are really independent;
//! * does it, once its colour is taken out, still move with the simulated output, window by window: in phase or in
//!   quadrature, at twice or three times its frequency;
//! * is it, once its colour is taken out, correlated with the input of the last few periods;
//! * is there a line in its spectrum, a tone that keeps its frequency and its phase.
//!
//! Whiteness itself is reported and decides nothing: the noise of a sensor may be coloured.

use stillbeam_identify::tall::{Orthonormal, dot};
use stillbeam_recording::Role;

use crate::options::Options;
use crate::statistics::autoregression::Autoregression;
use crate::statistics::distributions::{chi_squared_tail, two_sided_normal};
use crate::statistics::spectral_line::{Line, strongest_line};

/// One output of one recording under a model.
pub(crate) struct Series<'s> {
    /// Recorded minus simulated, nuisances taken out, in the output's unit.
    pub(crate) residual: &'s [f64],
    /// The simulated output.
    pub(crate) simulated: &'s [f64],
    /// The input at the output's samples, if there is one.
    pub(crate) input: Option<Vec<f64>>,
    pub(crate) rate_hz: f64,
    /// Noise floor in the output's unit.
    pub(crate) noise_rms: f64,
    /// The number of samples that the floor was seen in.
    pub(crate) noise_samples: f64,
    /// Lowest frequency of the model, hertz.
    pub(crate) slowest_hz: f64,
}

/// The tests of one series.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Adequacy {
    /// Mean square over that of the noise floor.
    pub(crate) power_ratio: f64,
    /// How many standard errors that is above one.
    pub(crate) power_z: f64,
    /// Chance of as much structure in step with the simulated output.
    pub(crate) structure_p: f64,
    /// Share of what is left, its colour taken out, that goes with the simulated output.
    pub(crate) structure_share: f64,
    /// Chance of as much correlation with the input.
    pub(crate) cross_correlation_p: f64,
    /// The line of its spectrum that stands out most.
    pub(crate) line: Option<Line>,
    /// Chance of as much correlation with itself.
    pub(crate) whiteness_p: f64,
}

impl Adequacy {
    /// Whether nothing but noise is left, at a probability of false alarm.
    pub(crate) fn holds(&self, significance: f64) -> bool {
        self.power_holds(significance)
            && self.structure_p.min(self.cross_correlation_p) > 0.5 * significance
            && !self.has_a_line(significance)
    }

    /// Whether a tone is left.
    pub(crate) fn has_a_line(&self, significance: f64) -> bool {
        self.line.is_some_and(|line| line.p < 0.5 * significance)
    }

    /// The floor is itself an estimate: a tenth of power is left to it.
    pub(crate) fn power_holds(&self, significance: f64) -> bool {
        self.power_ratio < 1.1 || self.power_z < 0.0 || two_sided_normal(self.power_z) > significance
    }
}

/// Runs all tests on one series.
pub(crate) fn adequacy(series: &Series<'_>) -> Adequacy {
    let colour = Autoregression::fit(&[series.residual]);
    let count = series.residual.len();
    let power = dot(series.residual, series.residual) / count.max(1) as f64;
    let floor = series.noise_rms * series.noise_rms;
    let power_ratio = if floor > 0.0 { power / floor } else { f64::INFINITY };
    // The scatter of a mean square of Gaussian noise, and the floor's own, which has at most this series' certainty: recordings differ.
    let floor_count = (series.noise_samples as usize).clamp(1, count.max(1));
    let [own, floors] = [count, floor_count].map(|count| 2.0 / colour.effective_count(count));
    let scatter = (own + floors).sqrt();
    let white = colour.whiten(series.residual);
    let whitened = |signal: &[f64]| colour.whiten(signal);
    let (structure_p, structure_share) = structure(series, &white, &whitened);
    Adequacy {
        power_ratio,
        power_z: (power_ratio - 1.0) / scatter,
        structure_p,
        structure_share,
        cross_correlation_p: series
            .input
            .as_deref()
            .map_or(1.0, |input| cross_correlation(&white, &whitened(input), series)),
        line: strongest_line(series.residual, series.rate_hz),
        whiteness_p: whiteness(series.residual),
    }
}

/// Whether nothing but noise is left on any recording; the probability of a false alarm is shared between tests.
pub(crate) fn is_adequate(tests: &[(Role, Adequacy)], options: &Options) -> bool {
    let significance = options.significance / tests.len().max(1) as f64;
    tests.iter().all(|(_, test)| test.holds(significance))
}

/// What a model leaves over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rest {
    /// Nothing but noise.
    Noise,
    /// More than noise, and nothing of it goes with the motion: a force from outside that is another one in every recording. A law of the
    /// machine would show in step with what the machine does.
    Foreign,
    /// More than noise, in step with the motion: something of the machine is missing.
    Structured,
}

/// A rest of which this share goes with the motion on any recording is the machine's own, ...
const GOES_WITH_THE_MOTION: f64 = 0.1;

impl Rest {
    /// From the tests of all outputs of all recordings.
    ///
    /// What a machine does it does in every recording: a rest is foreign where no recording shows much that goes with motion or
    /// command, and half of them nothing beyond chance. A random force may go with the motion for a while by accident. (What laws in no
    /// catalogue leave, play of a sensor, a rolling shutter, friction under load, was found at a third to a half of the rest on the recording
    /// that shows them best, random forces at 0.06 and less; a spring that changes at some moment at 0.05, but beyond chance in seven of
    /// ten series.)
    pub(crate) fn of(tests: &[(Role, Adequacy)], options: &Options) -> Self {
        if is_adequate(tests, options) {
            return Self::Noise;
        }
        let beyond_chance = tests
            .iter()
            .filter(|(_, test)| test.structure_p.min(test.cross_correlation_p) < 0.5 * options.significance);
        let little = tests.iter().all(|(_, test)| test.structure_share < GOES_WITH_THE_MOTION);
        if little && 2 * beyond_chance.count() <= tests.len() { Self::Foreign } else { Self::Structured }
    }
}

/// Whether more than noise is left on any recording, by its power.
pub(crate) fn is_loud(tests: &[(Role, Adequacy)], options: &Options) -> bool {
    let significance = options.significance / tests.len().max(1) as f64;
    !tests.iter().all(|(_, test)| test.power_holds(significance))
}

/// Number of samples of one window: two seconds or four periods of the slowest mode, at most a tenth of the series.
fn window_length(series: &Series<'_>) -> usize {
    let seconds = if series.slowest_hz > 0.0 { (4.0 / series.slowest_hz).max(2.0) } else { 2.0 };
    ((seconds * series.rate_hz) as usize).clamp(40, (series.residual.len() / 8).max(40))
}

/// Window by window: share of the whitened residual that its regression on powers of the simulated output and its
/// speed explains, against what is left; pooled over windows. The chance of as much, and the share that is explained beyond chance.
fn structure(series: &Series<'_>, white: &[f64], whiten: &dyn Fn(&[f64]) -> Vec<f64>) -> (f64, f64) {
    let length = window_length(series);
    let columns: Vec<Vec<f64>> = state_columns(series.simulated).iter().map(|c| whiten(c)).collect();
    let (mut statistic, mut freedom) = (0.0, 0.0);
    let (mut whole, mut unexplained) = (0.0, 0.0);
    for start in (0..white.len()).step_by(length) {
        let end = (start + length).min(white.len());
        if end - start < 40 {
            continue;
        }
        let mut basis = Orthonormal::default();
        // A level of its own in every window: drifts are not structure.
        basis.push(vec![1.0; end - start]);
        let mut rest = white[start..end].to_vec();
        basis.remove_from(&mut rest);
        let before = dot(&rest, &rest);
        for column in &columns {
            basis.push(column[start..end].to_vec());
        }
        let mut rest = white[start..end].to_vec();
        let rank = basis.remove_from(&mut rest).iter().filter(|part| **part != 0.0).count() as f64 - 1.0;
        let after = dot(&rest, &rest);
        let left = (end - start) as f64 - rank - 1.0;
        if after > 0.0 && rank > 0.0 && left > 10.0 {
            // An F ratio of many degrees below: times its rank it is about chi-squared; its mean is corrected.
            statistic += (before - after) / (after / left) * (left - 2.0) / left;
            freedom += rank;
            whole += before;
            // As many columns of noise would explain their share.
            unexplained += after * (left + rank) / left;
        }
    }
    let p = if freedom == 0.0 { 1.0 } else { chi_squared_tail(statistic, freedom) };
    (p, if whole > 0.0 { (1.0 - unexplained / whole).max(0.0) } else { 0.0 })
}

/// The simulated output, its speed, and what makes twice and three times its frequency.
fn state_columns(simulated: &[f64]) -> Vec<Vec<f64>> {
    let mean = simulated.iter().sum::<f64>() / simulated.len().max(1) as f64;
    let y: Vec<f64> = simulated.iter().map(|value| value - mean).collect();
    let speed: Vec<f64> =
        (0..y.len()).map(|k| y[(k + 1).min(y.len() - 1)] - y[k.saturating_sub(1)]).collect();
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<f64>>();
    let square = product(&y, &y);
    vec![
        y.clone(),
        speed.clone(),
        square.clone(),
        product(&y, &speed),
        product(&square, &y),
        product(&square, &speed),
    ]
}

/// Regression of the whitened residual on the whitened input of the last quarter of a slow period, in twelve lags.
fn cross_correlation(white: &[f64], input: &[f64], series: &Series<'_>) -> f64 {
    const LAGS: usize = 12;
    let reach = if series.slowest_hz > 0.0 { 0.5 / series.slowest_hz } else { 0.5 };
    let step = ((reach * series.rate_hz) as usize / LAGS).max(1);
    let mean = input.iter().sum::<f64>() / input.len().max(1) as f64;
    let mut basis = Orthonormal::default();
    for lag in 0..LAGS {
        let shift = lag * step;
        let at = |k: usize| if k >= shift { input[k - shift] - mean } else { 0.0 };
        basis.push((0..white.len()).map(at).collect::<Vec<f64>>());
    }
    let mut rest = white.to_vec();
    let rank = basis.remove_from(&mut rest).iter().filter(|part| **part != 0.0).count() as f64;
    let (before, after) = (dot(white, white), dot(&rest, &rest));
    if after <= 0.0 || rank == 0.0 {
        return 1.0;
    }
    chi_squared_tail((before - after) / (after / (white.len() as f64 - rank)), rank)
}

/// Portmanteau test of G. Ljung and G. Box (Biometrika 65 (1978) 297) over twenty lags.
fn whiteness(residual: &[f64]) -> f64 {
    const LAGS: usize = 20;
    let n = residual.len() as f64;
    let power = dot(residual, residual);
    if residual.len() < 4 * LAGS || power <= 0.0 {
        return 1.0;
    }
    let statistic: f64 = (1..=LAGS)
        .map(|lag| {
            let rho = dot(&residual[lag..], &residual[..residual.len() - lag]) / power;
            rho * rho / (n - lag as f64)
        })
        .sum();
    chi_squared_tail(n * (n + 2.0) * statistic, LAGS as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    fn series(seed: u64, rho: f64, extra: impl Fn(f64, f64) -> f64) -> Adequacy {
        series_over((1.0, 1e6), seed, rho, extra)
    }

    /// Over a noise floor of this size, which was seen in so many samples.
    fn series_over(
        (noise_rms, noise_samples): (f64, f64),
        seed: u64,
        rho: f64,
        extra: impl Fn(f64, f64) -> f64,
    ) -> Adequacy {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut last = 0.0;
        let time: Vec<f64> = (0..6000).map(|k| f64::from(k) / 100.0).collect();
        let input: Vec<f64> = time.iter().map(|t| (0.4 * t * t).sin()).collect();
        let simulated: Vec<f64> = time.iter().map(|t| (1.0 + 0.02 * t) * (0.4 * t * t - 0.3).sin()).collect();
        let scale = (1.0 - rho * rho).sqrt();
        let residual: Vec<f64> = simulated
            .iter()
            .zip(&time)
            .map(|(y, t)| {
                let innovation: f64 = StandardNormal.sample(&mut random);
                last = rho * last + scale * innovation;
                last + extra(*y, *t)
            })
            .collect();
        adequacy(&Series {
            residual: &residual,
            simulated: &simulated,
            input: Some(input),
            rate_hz: 100.0,
            noise_rms,
            noise_samples,
            slowest_hz: 1.0,
        })
    }

    #[test]
    fn noise_of_any_colour_is_adequate() {
        let mut refused = 0;
        for seed in 0..40 {
            for rho in [0.0, 0.8, 0.95] {
                refused += u32::from(!series(seed, rho, |_, _| 0.0).holds(1e-3));
            }
        }
        assert!(refused <= 2, "{refused} of 120 refused");
    }

    #[test]
    fn a_floor_that_was_seen_in_few_samples_may_be_too_low() {
        let over = |floor: (f64, f64)| series_over(floor, 4, 0.0, |_, _| 0.0).power_holds(1e-3);
        assert!(over((0.93, 300.0)), "three hundred samples are 8 % sure of a power");
        assert!(!over((0.93, 6000.0)));
        assert!(!over((0.7, 300.0)), "and no more than that");
    }

    #[test]
    fn a_tenth_of_the_noise_in_step_with_the_output_is_seen() {
        for rho in [0.0, 0.8] {
            let cubic = series(5, rho, |y, _| 0.35 * y * y * y);
            assert!(!cubic.holds(1e-3), "{cubic:?}");
            let even = series(6, rho, |y, _| 0.3 * y * y);
            assert!(!even.holds(1e-3), "{even:?}");
        }
    }

    #[test]
    fn a_steady_tone_is_no_noise_and_foreign() {
        let tone = |seed: u64| series(seed, 0.0, |_, t| 0.3 * (std::f64::consts::TAU * 7.3 * t).sin());
        let rest: Vec<Adequacy> = (0..5).map(tone).collect();
        assert!(rest.iter().all(|test| test.power_holds(1e-3) && !test.holds(1e-3)), "{rest:?}");
        assert_eq!(rest_of(&rest), Rest::Foreign, "{rest:?}");
    }

    fn rest_of(series: &[Adequacy]) -> Rest {
        let tests: Vec<(Role, Adequacy)> = series.iter().map(|test| (Role::Train, test.clone())).collect();
        Rest::of(&tests, &Options::default())
    }

    #[test]
    fn a_random_force_is_foreign_and_what_goes_with_the_motion_of_most_recordings_is_not() {
        // A force that changes its sign at irregular times shakes a resonance.
        let shaken = |seed: u64| {
            let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
            let (mut last, mut before) = (0.0, 0.0);
            let shake: Vec<f64> = (0..6000)
                .map(|_| {
                    let push: f64 = StandardNormal.sample(&mut random);
                    let now = 1.99 * last - 0.994 * before + 0.1 * push;
                    (before, last) = (last, now);
                    now
                })
                .collect();
            move |t: f64| shake[((t * 100.0) as usize).min(5999)]
        };
        let foreign: Vec<Adequacy> = (0..5)
            .map(|seed| {
                let force = shaken(seed);
                series(seed, 0.0, move |_, t| force(t))
            })
            .collect();
        assert!(foreign.iter().all(|test| test.power_ratio > 2.0), "{foreign:?}");
        assert_eq!(rest_of(&foreign), Rest::Foreign, "{foreign:?}");

        let own: Vec<Adequacy> = (0..5).map(|seed| series(seed, 0.0, |y, _| 3.0 * y * y * y)).collect();
        assert_eq!(rest_of(&own), Rest::Structured);
        let by_accident = [&foreign[..4], &own[..1]].concat();
        assert_eq!(rest_of(&by_accident), Rest::Structured, "a share that is large on one recording");
        let little: Vec<Adequacy> = (0..5).map(|seed| series(seed, 0.0, |y, _| 0.12 * y * y * y)).collect();
        assert!(little.iter().all(|test| test.structure_share < GOES_WITH_THE_MOTION), "{little:?}");
        assert_eq!(rest_of(&little), Rest::Structured, "little, but beyond chance in every recording");
        assert_eq!(rest_of(&[&foreign[..4], &little[..1]].concat()), Rest::Foreign);
        let noise: Vec<Adequacy> = (0..5).map(|seed| series(seed, 0.8, |_, _| 0.0)).collect();
        assert_eq!(rest_of(&noise), Rest::Noise);
    }
}
