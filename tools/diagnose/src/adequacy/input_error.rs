//! What errors of a recorded input leave over, and how much of it goes with what was recorded.
//!
//! With `u + e` recorded in place of `u`, a simulation is off by `G e`, which the recorded input and the simulated output go with,
//! because `e` is in both. By the inequality of Cauchy and Schwarz a regression of `n - G e` on one column that contains a part `c` of
//! `e` explains at most the share `|G e|²/|n - G e|² · |c|²/|column|²`.

use stillbeam_identify::tall::dot;

use super::series::{INPUT_LAGS, Series};

/// Errors of an input as large as those of the recording, drawn at random: they have its size and colour.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InputError<'s> {
    /// At the samples of the output, in the input's unit.
    pub(crate) input: &'s [f64],
    /// What they do to the output, in its unit.
    pub(crate) output: &'s [f64],
    /// Their mean square in the output, where the noise floor does not have it already.
    pub(crate) unseen_power: f64,
}

/// Shares of a residual that errors of the input may explain.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Explained {
    /// By the simulated output.
    pub(crate) of_output: f64,
    /// By the input.
    pub(crate) of_input: f64,
}

impl InputError<'_> {
    /// After whitening, as the tests are made.
    pub(crate) fn explains(
        &self,
        series: &Series<'_>,
        white: &[f64],
        whiten: &dyn Fn(&[f64]) -> Vec<f64>,
    ) -> Explained {
        let power = |signal: &[f64]| {
            let mean = signal.iter().sum::<f64>() / signal.len().max(1) as f64;
            dot(signal, signal) - mean * mean * signal.len() as f64
        };
        let share = |part: f64, whole: f64| if whole > 0.0 { (part / whole).min(1.0) } else { 0.0 };
        let error = power(&whiten(self.output));
        let of_residual = share(error, power(white));
        let of_output = share(error, power(&whiten(series.simulated)));
        let input = series.input.as_deref().map_or(0.0, |input| power(&whiten(input)));
        let of_input = share(INPUT_LAGS as f64 * power(&whiten(self.input)), input);
        Explained { of_output: of_residual * of_output, of_input: of_residual * of_input }
    }
}
