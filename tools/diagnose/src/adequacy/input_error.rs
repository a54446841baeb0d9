//! What errors of a recorded input leave over, and how much of it goes with what was recorded.
//!
//! With `u + e` recorded in place of `u`, a simulation is off by `G e`, which the recorded input and the
//! simulated output go with, because `e` is in both; and where `G e` rings longer than a test's window, any
//! motion of that frequency goes with it there. How much the tests then find is not reckoned but tried: the
//! same tests are made of residuals that consist of nothing but drawn errors and the sensor's own noise.

use crate::input_noise::{flat_power, white};

use super::series::{Series, Tests};

/// Standard deviations of the draws up to which what a test finds may be errors of the input.
const WITHIN: f64 = 3.0;

/// One draw of errors of an input, as large as those of the recording and of their colour, at the samples of
/// the output.
#[derive(Debug, Clone)]
pub(crate) struct ErrorDraw {
    /// In the input's unit.
    pub(crate) input: Vec<f64>,
    /// What they do to the output, in its unit.
    pub(crate) simulated: Vec<f64>,
    /// The same as far as no nuisance makes up for it.
    pub(crate) residual: Vec<f64>,
}

/// Errors of a recorded input in one series.
#[derive(Debug, Clone)]
pub(crate) struct InputError {
    pub(crate) draws: Vec<ErrorDraw>,
    /// How much of their power the noise floor has already, in the square of the output's unit.
    pub(crate) in_floor: f64,
}

/// Mean and standard deviation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Spread {
    pub(super) mean: f64,
    pub(super) deviation: f64,
}

impl Spread {
    fn of(values: &[f64]) -> Self {
        let count = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / count;
        let square = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        Self { mean, deviation: (square / (count - 1.0).max(1.0)).sqrt() }
    }

    fn most(self) -> f64 {
        self.mean + WITHIN * self.deviation
    }
}

/// Shares that the tests find where there are only errors of the input.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Explained {
    pub(super) structure: f64,
    pub(super) cross_correlation: f64,
    pub(super) line: f64,
}

impl InputError {
    /// What they have in the residual on the average, in the square of the output's unit.
    pub(crate) fn mean_power(&self) -> f64 {
        self.power().mean
    }

    /// Power that the noise floor lacks for this recording.
    pub(super) fn beyond_floor(&self) -> f64 {
        (self.mean_power() - self.in_floor).max(0.0)
    }

    /// Their mean square in the residual.
    pub(super) fn power(&self) -> Spread {
        let mean_square = |draw: &ErrorDraw| {
            draw.residual.iter().map(|value| value * value).sum::<f64>() / draw.residual.len().max(1) as f64
        };
        Spread::of(&self.draws.iter().map(mean_square).collect::<Vec<f64>>())
    }

    pub(super) fn explains(&self, series: &Series<'_>, noise_power: f64) -> Explained {
        let own_rms = flat_power(series.residual).sqrt();
        let found: Vec<Tests> = (1..)
            .zip(&self.draws)
            .map(|(number, draw)| draw.tests(series, (own_rms, noise_power), number))
            .collect();
        let most =
            |of: &dyn Fn(&Tests) -> f64| Spread::of(&found.iter().map(of).collect::<Vec<f64>>()).most();
        Explained {
            structure: most(&|tests| tests.structure.share),
            cross_correlation: most(&|tests| tests.cross_correlation.share),
            line: most(&|tests| tests.line.map_or(0.0, |line| line.share)),
        }
    }
}

impl ErrorDraw {
    /// What the tests find in this draw beside white noise of a sensor.
    fn tests(&self, series: &Series<'_>, (own_rms, noise_power): (f64, f64), number: u64) -> Tests {
        let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect::<Vec<f64>>();
        let noise = white(own_rms, series.residual.len(), number);
        let drawn = Series {
            residual: &sum(&self.residual, &noise),
            simulated: &sum(series.simulated, &self.simulated),
            input: series.input.as_ref().map(|input| sum(input, &self.input)),
            input_error: None,
            ..*series
        };
        Tests::of(&drawn, noise_power)
    }
}
