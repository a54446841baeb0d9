//! The tests of one series.

use stillbeam_identify::tall::{Orthonormal, dot};

use super::input_error::{InputError, Spread};
use super::{Adequacy, Found};
use crate::statistics::autoregression::Autoregression;
use crate::statistics::distributions::chi_squared_tail;
use crate::statistics::spectral_line::{Line, strongest_line};

/// Lags of the input that a residual is regressed on.
const INPUT_LAGS: usize = 12;

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
    /// What errors of the recorded input do, where there are any.
    pub(crate) input_error: Option<InputError>,
}

/// What the tests for structure find.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tests {
    pub(super) structure: Found,
    pub(super) cross_correlation: Found,
    pub(super) line: Option<Line>,
}

/// Chances above which nobody asks what else a finding may be.
const LIKELY: f64 = 0.05;

impl Tests {
    pub(super) fn of(series: &Series<'_>) -> Self {
        let colour = Autoregression::fit(&[series.residual]);
        let white = colour.whiten(series.residual);
        let whitened = |signal: &[f64]| colour.whiten(signal);
        let input = series.input.as_deref();
        let cross = input.map_or(Found::NOTHING, |input| cross_correlation(&white, &whitened(input), series));
        Self {
            structure: structure(series, &white, &whitened),
            cross_correlation: cross,
            line: strongest_line(series.residual, series.rate_hz),
        }
    }

    /// Without what errors of the input explain.
    fn beyond_input_errors(self, series: &Series<'_>) -> Self {
        let line_p = self.line.map_or(1.0, |line| line.p);
        let least = self.structure.p.min(self.cross_correlation.p).min(line_p);
        let Some(error) = series.input_error.as_ref().filter(|_| least < LIKELY) else { return self };
        let by_error = error.explains(series);
        Self {
            structure: self.structure.beyond(by_error.structure),
            cross_correlation: self.cross_correlation.beyond(by_error.cross_correlation),
            line: self.line.map(|line| Line { share: (line.share - by_error.line).max(0.0), ..line }),
        }
    }
}

/// Runs all tests on one series.
pub(crate) fn adequacy(series: &Series<'_>) -> Adequacy {
    let colour = Autoregression::fit(&[series.residual]);
    let count = series.residual.len();
    let power = dot(series.residual, series.residual) / count.max(1) as f64;
    let error = series.input_error.as_ref();
    let by_error = error.map_or_else(Spread::default, InputError::power);
    let unseen = if error.is_some_and(|error| error.is_in_floor) { 0.0 } else { by_error.mean };
    let floor = series.noise_rms * series.noise_rms + unseen;
    let power_ratio = if floor > 0.0 { power / floor } else { f64::INFINITY };
    // The scatter of a mean square of Gaussian noise, and the floor's own, which has at most this series'
    // certainty: recordings differ.
    let floor_count = (series.noise_samples as usize).clamp(1, count.max(1));
    let [own, floors] = [count, floor_count].map(|count| 2.0 / colour.effective_count(count));
    let rings = if floor > 0.0 { by_error.deviation / floor } else { 0.0 };
    let scatter = (own + floors + rings * rings).sqrt();
    let tests = Tests::of(series).beyond_input_errors(series);
    Adequacy {
        power_ratio,
        power_z: (power_ratio - 1.0) / scatter,
        power_stderr: scatter,
        structure: tests.structure,
        cross_correlation: tests.cross_correlation,
        line: tests.line,
        whiteness_p: whiteness(series.residual),
    }
}

/// Number of samples of one window: two seconds or four periods of the slowest mode, at most a tenth of the
/// series.
fn window_length(series: &Series<'_>) -> usize {
    let seconds = if series.slowest_hz > 0.0 { (4.0 / series.slowest_hz).max(2.0) } else { 2.0 };
    ((seconds * series.rate_hz) as usize).clamp(40, (series.residual.len() / 8).max(40))
}

/// Window by window: share of the whitened residual that its regression on powers of the simulated output and
/// its speed explains, against what is left; pooled over windows. The chance of as much, and the share that
/// is explained beyond chance.
fn structure(series: &Series<'_>, white: &[f64], whiten: &dyn Fn(&[f64]) -> Vec<f64>) -> Found {
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
            // An F ratio of many degrees below: times its rank it is about chi-squared; its mean is
            // corrected.
            statistic += (before - after) / (after / left) * (left - 2.0) / left;
            freedom += rank;
            whole += before;
            // As many columns of noise would explain their share.
            unexplained += after * (left + rank) / left;
        }
    }
    let p = if freedom == 0.0 { 1.0 } else { chi_squared_tail(statistic, freedom) };
    Found { p, share: if whole > 0.0 { (1.0 - unexplained / whole).max(0.0) } else { 0.0 } }
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

/// Regression of the whitened residual on the whitened input of the last quarter of a slow period, in twelve
/// lags.
fn cross_correlation(white: &[f64], input: &[f64], series: &Series<'_>) -> Found {
    let reach = if series.slowest_hz > 0.0 { 0.5 / series.slowest_hz } else { 0.5 };
    let step = ((reach * series.rate_hz) as usize / INPUT_LAGS).max(1);
    let mean = input.iter().sum::<f64>() / input.len().max(1) as f64;
    let mut basis = Orthonormal::default();
    for lag in 0..INPUT_LAGS {
        let shift = lag * step;
        let at = |k: usize| if k >= shift { input[k - shift] - mean } else { 0.0 };
        basis.push((0..white.len()).map(at).collect::<Vec<f64>>());
    }
    let mut rest = white.to_vec();
    let rank = basis.remove_from(&mut rest).iter().filter(|part| **part != 0.0).count() as f64;
    let (before, after) = (dot(white, white), dot(&rest, &rest));
    if after <= 0.0 || rank == 0.0 {
        return Found::NOTHING;
    }
    let count = white.len() as f64;
    let unexplained = after * (count + rank) / count;
    Found {
        p: chi_squared_tail((before - after) / (after / (count - rank)), rank),
        share: (1.0 - unexplained / before).max(0.0),
    }
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
