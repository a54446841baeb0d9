//! Whether what a model leaves over is noise.
//!
//! Four questions, none of which takes white noise for granted:
//! * is its power that of the noise floor, judged by the number of samples that are really independent;
//! * does it, once its colour is taken out, still move with the simulated output, window by window: in phase
//!   or in
//!   quadrature, at twice or three times its frequency;
//! * is it, once its colour is taken out, correlated with the input of the last few periods;
//! * is there a line in its spectrum, a tone that keeps its frequency and its phase.
//!
//! Whiteness itself is reported and decides nothing: the noise of a sensor may be coloured. Nor does what is
//! beyond chance and has next to no power: of enough samples every model is wrong.

mod coherence;
pub(crate) mod hidden;
mod input_error;
mod regression;
mod series;

use stillbeam_recording::Role;

use crate::options::Options;
use crate::statistics::distributions::two_sided_normal;
use crate::statistics::spectral_line::Line;

pub(crate) use input_error::{ErrorDraw, InputError};
pub(crate) use series::{Resonance, Series, adequacy};

/// What a test found in a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Found {
    /// Chance of as much.
    pub(crate) p: f64,
    /// Its power beyond chance as a share of the noise's.
    pub(crate) share: f64,
    /// Share of the series, its colour taken out, that it is, beyond chance.
    pub(crate) share_of_white: f64,
}

impl Found {
    pub(crate) const NOTHING: Self = Self { p: 1.0, share: 0.0, share_of_white: 0.0 };

    /// Without a share that has another reason.
    fn beyond(self, share: f64) -> Self {
        if self.share > share { Self { share: self.share - share, ..self } } else { Self::NOTHING }
    }

    /// Whether it is neither chance nor next to nothing.
    fn is_there(self, sought: Sought) -> bool {
        self.p < 0.5 * sought.significance && self.share >= sought.least_share
    }
}

/// What tests look for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sought {
    /// Probability of a false alarm.
    pub(crate) significance: f64,
    /// Share of the noise's power below which nothing is a finding.
    pub(crate) least_share: f64,
}

impl Sought {
    /// The probability of a false alarm is shared between so many series.
    fn of(options: &Options, series: usize) -> Self {
        Self {
            significance: options.significance / series.max(1) as f64,
            least_share: options.least_excess_share,
        }
    }
}

/// The tests of one series.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Adequacy {
    /// Mean square over that of the noise floor.
    pub(crate) power_ratio: f64,
    /// How many standard errors that is above one.
    pub(crate) power_z: f64,
    /// Standard error of the power ratio.
    pub(crate) power_stderr: f64,
    /// What goes in step with the simulated output.
    pub(crate) structure: Found,
    /// What goes with the input.
    pub(crate) cross_correlation: Found,
    /// The line of its spectrum that stands out most.
    pub(crate) line: Option<Line>,
    /// Chance of as much correlation with itself.
    pub(crate) whiteness_p: f64,
    /// Power of a floor that is a bound only, over that of the noise that the residual shows by itself.
    pub(crate) bound_ratio: f64,
}

impl Adequacy {
    /// Whether nothing but noise is left.
    pub(crate) fn holds(&self, sought: Sought) -> bool {
        self.power_holds(sought)
            && !self.structure.is_there(sought)
            && !self.cross_correlation.is_there(sought)
            && !self.has_a_line(sought)
    }

    /// Whether a tone is left.
    pub(crate) fn has_a_line(&self, sought: Sought) -> bool {
        self.line.is_some_and(|line| {
            Found { p: line.p, share: line.share, share_of_white: line.share }.is_there(sought)
        })
    }

    /// The floor is itself an estimate: a tenth of power is left to it. Nor is a sensor as quiet in every
    /// recording: what is as white as its noise, and not much louder, is noise.
    pub(crate) fn power_holds(&self, sought: Sought) -> bool {
        let is_louder_noise = self.power_ratio < LOUDER_NOISE && self.whiteness_p > sought.significance;
        self.power_ratio < 1.1
            || self.power_z < 0.0
            || is_louder_noise
            || two_sided_normal(self.power_z) > sought.significance
    }
}

/// A sensor's noise has at most so many times the power in one recording that it has where it was measured.
const LOUDER_NOISE: f64 = 2.0;

/// Share of the noise's power that may be more than noise, at 95 % certainty: of all series together, each by
/// its floor.
pub(crate) fn excess_power_bound(tests: &[(Role, Adequacy)]) -> f64 {
    let count = tests.len().max(1) as f64;
    let mean = tests.iter().map(|(_, test)| test.power_ratio - 1.0).sum::<f64>() / count;
    let variance = tests.iter().map(|(_, test)| test.power_stderr.powi(2)).sum::<f64>() / (count * count);
    (mean + ONE_SIDED_95 * variance.sqrt()).max(0.0)
}

/// Standard errors above which a normal quantity is once in twenty times.
const ONE_SIDED_95: f64 = 1.645;

/// Whether nothing but noise is left on any recording; the probability of a false alarm is shared between
/// tests.
pub(crate) fn is_adequate(tests: &[(Role, Adequacy)], options: &Options) -> bool {
    let sought = Sought::of(options, tests.len());
    tests.iter().all(|(_, test)| test.holds(sought))
}

/// What a model leaves over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rest {
    /// Nothing but noise.
    Noise,
    /// More than noise, and nothing of it goes with the motion: a force from outside that is another one in
    /// every recording. A law of the machine would show in step with what the machine does.
    Foreign,
    /// More than noise, in step with the motion: something of the machine is missing.
    Structured,
}

/// A rest of which this share goes with the motion on any recording is the machine's own, ...
const GOES_WITH_THE_MOTION: f64 = 0.1;

impl Rest {
    /// From the tests of all outputs of all recordings.
    ///
    /// What a machine does it does in every recording: a rest is foreign where no recording shows much that
    /// goes with motion or command, and half of them nothing beyond chance. A random force may go with the
    /// motion for a while by accident. (What laws in no catalogue leave, play of a sensor, a rolling shutter,
    /// friction under load, was found at a third to a half of the rest on the recording that shows them best,
    /// random forces at 0.06 and less; a spring that changes at some moment at 0.05, but beyond chance in
    /// seven of ten series.)
    pub(crate) fn of(tests: &[(Role, Adequacy)], options: &Options) -> Self {
        if is_adequate(tests, options) {
            return Self::Noise;
        }
        let beyond_chance = tests
            .iter()
            .filter(|(_, test)| test.structure.p.min(test.cross_correlation.p) < 0.5 * options.significance);
        let little = tests.iter().all(|(_, test)| test.structure.share_of_white < GOES_WITH_THE_MOTION);
        if little && 2 * beyond_chance.count() <= tests.len() { Self::Foreign } else { Self::Structured }
    }
}

/// Whether more than noise is left on any recording, by its power.
pub(crate) fn is_loud(tests: &[(Role, Adequacy)], options: &Options) -> bool {
    let sought = Sought::of(options, tests.len());
    !tests.iter().all(|(_, test)| test.power_holds(sought))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    const SOUGHT: Sought = Sought { significance: 1e-3, least_share: 0.05 };

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
            noise_is_bound: false,
            slowest_hz: 1.0,
            resonances: &[],
            input_error: None,
        })
    }

    #[test]
    fn noise_of_any_colour_is_adequate() {
        let mut refused = 0;
        for seed in 0..40 {
            for rho in [0.0, 0.8, 0.95] {
                refused += u32::from(!series(seed, rho, |_, _| 0.0).holds(SOUGHT));
            }
        }
        assert!(refused <= 2, "{refused} of 120 refused");
    }

    /// A force that was driven harder is noisier, and its machine colours that; the floor was seen over all.
    #[test]
    fn more_power_than_the_floor_has_is_noise_where_the_input_was_noisier() {
        let coloured = |seed: u64, rms: f64| -> Vec<f64> {
            let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
            let mut last = 0.0;
            let mut next = || {
                let innovation: f64 = StandardNormal.sample(&mut random);
                last = 0.8 * last + 0.6 * rms * innovation;
                last
            };
            (0..6000).map(|_| next()).collect()
        };
        let still = vec![0.0; 6000];
        let holds = |in_floor: f64| {
            let draw = |seed: u64| ErrorDraw {
                input: still.clone(),
                simulated: still.clone(),
                residual: coloured(seed, 0.9_f64.sqrt()),
            };
            let input_error = InputError { draws: (10..18).map(draw).collect(), in_floor };
            adequacy(&Series {
                residual: &coloured(3, 1.4_f64.sqrt()),
                simulated: &still,
                input: None,
                rate_hz: 100.0,
                noise_rms: 1.0,
                noise_samples: 1e6,
                noise_is_bound: false,
                slowest_hz: 1.0,
                resonances: &[],
                input_error: Some(input_error),
            })
            .power_holds(SOUGHT)
        };
        assert!(holds(0.5), "a noisier input than on the average");
        assert!(!holds(0.9), "as noisy as everywhere");
    }

    #[test]
    fn a_floor_that_was_seen_in_few_samples_may_be_too_low() {
        // A little colour, so that more of it is not taken for a louder sensor.
        let over = |floor: (f64, f64)| series_over(floor, 4, 0.3, |_, _| 0.0).power_holds(SOUGHT);
        assert!(over((0.93, 300.0)), "three hundred samples are 8 % sure of a power");
        assert!(!over((0.93, 6000.0)));
        assert!(!over((0.7, 300.0)), "and no more than that");
    }

    #[test]
    fn noise_that_is_louder_in_one_recording_is_noise_and_a_shaken_machine_is_not() {
        let loud = |rho: f64, floor: f64| {
            let held = (0..20).filter(|seed| series_over((floor, 1e6), *seed, rho, |_, _| 0.0).holds(SOUGHT));
            held.count()
        };
        assert!(loud(0.0, 0.85) >= 19, "{}", loud(0.0, 0.85));
        assert_eq!(loud(0.0, 0.6), 0, "three times the power is no other day's noise");
        assert_eq!(loud(0.95, 0.75), 0, "a machine colours what shakes it");
    }

    #[test]
    fn a_tenth_of_the_noise_in_step_with_the_output_is_seen() {
        for rho in [0.0, 0.8] {
            let cubic = series(5, rho, |y, _| 0.35 * y * y * y);
            assert!(!cubic.holds(SOUGHT), "{cubic:?}");
            let even = series(6, rho, |y, _| 0.3 * y * y);
            assert!(!even.holds(SOUGHT), "{even:?}");
        }
    }

    #[test]
    fn a_steady_tone_is_no_noise_and_foreign() {
        let tone = |seed: u64| series(seed, 0.0, |_, t| 0.4 * (std::f64::consts::TAU * 7.3 * t).sin());
        let rest: Vec<Adequacy> = (0..5).map(tone).collect();
        assert!(rest.iter().all(|test| test.power_holds(SOUGHT) && !test.holds(SOUGHT)), "{rest:?}");
        assert_eq!(rest_of(&rest), Rest::Foreign, "{rest:?}");
    }

    #[test]
    fn what_has_next_to_no_power_is_no_finding_however_certain() {
        let tone = series(3, 0.0, |_, t| 0.2 * (std::f64::consts::TAU * 7.3 * t).sin());
        assert!(tone.line.is_some_and(|line| line.p < 1e-6) && tone.holds(SOUGHT), "{tone:?}");
        let even = series(3, 0.0, |y, _| 0.17 * y * y);
        assert!(even.structure.p < 1e-6 && even.holds(SOUGHT), "{even:?}");
        let strict = Sought { least_share: 0.0, ..SOUGHT };
        assert!(!tone.holds(strict) && !even.holds(strict));
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
        assert!(little.iter().all(|test| test.structure.share_of_white < GOES_WITH_THE_MOTION), "{little:?}");
        assert_eq!(rest_of(&little), Rest::Structured, "little, but beyond chance in every recording");
        assert_eq!(rest_of(&[&foreign[..4], &little[..1]].concat()), Rest::Foreign);
        let noise: Vec<Adequacy> = (0..5).map(|seed| series(seed, 0.8, |_, _| 0.0)).collect();
        assert_eq!(rest_of(&noise), Rest::Noise);
    }
}
