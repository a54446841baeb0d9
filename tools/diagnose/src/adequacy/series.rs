//! The tests of one series.

use stillbeam_identify::tall::dot;

use super::coherence;
use super::input_error::{InputError, Spread};
use super::regression::{Column, Regressed};
use super::{Adequacy, Found};
use crate::input_noise::flat_power;
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
    /// Whether the floor was read off what a model leaves all the time, and is a bound only.
    pub(crate) noise_is_bound: bool,
    /// Lowest frequency of the model, hertz.
    pub(crate) slowest_hz: f64,
    /// Where the model is lightly damped.
    pub(crate) resonances: &'s [Resonance],
    /// What errors of the recorded input do, where there are any.
    pub(crate) input_error: Option<InputError>,
}

/// A mode of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Resonance {
    pub(crate) frequency_hz: f64,
    /// Half-power width of its resonance.
    pub(crate) width_hz: f64,
}

impl Resonance {
    /// Whether a line as narrow as a spectrum of this length shows it may be this resonance, shaken at
    /// random.
    fn may_be(&self, line: &Line, duration_s: f64) -> bool {
        let line_hz = RESOLVED / duration_s;
        self.width_hz < line_hz && (line.frequency_hz - self.frequency_hz).abs() < line_hz
    }
}

/// A spectrum tells apart what lies so many times its resolution from one another, tapered by nothing.
const RESOLVED: f64 = 3.0;
/// What has more power than the noise is no small error of the input, however long a motion stays in step.
const FAINT: f64 = 1.0;

/// What the tests for structure find.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tests {
    pub(super) structure: Found,
    pub(super) cross_correlation: Found,
    pub(super) line: Option<Line>,
}

/// Chances above which nobody asks what else a finding may be.
const LIKELY: f64 = 0.05;

impl Series<'_> {
    /// Whether a line may be a resonance that a small force from outside shakes, as the error of the input
    /// does.
    fn may_ring_of_itself(&self, line: &Line, noise_power: f64) -> bool {
        let count = self.residual.len();
        let power = line.share * dot(self.residual, self.residual) / count.max(1) as f64;
        let duration_s = count as f64 / self.rate_hz;
        power < FAINT * noise_power
            && self.resonances.iter().any(|resonance| resonance.may_be(line, duration_s))
    }
}

impl Tests {
    pub(super) fn of(series: &Series<'_>, noise_power: f64) -> Self {
        let colour = Autoregression::fit(&[series.residual]);
        let white = colour.whiten(series.residual);
        let whitened = |signal: &[f64]| colour.whiten(signal);
        let input = series.input.as_deref();
        let with_input =
            |input: &[f64]| cross_correlation(&white, (&whitened(input), input), series, noise_power);
        Self {
            structure: structure(series, &white, &whitened, noise_power),
            cross_correlation: input.map_or(Found::NOTHING, with_input),
            line: strongest_line(series.residual, series.rate_hz),
        }
    }

    /// Without what errors of the input explain.
    fn beyond_input_errors(self, series: &Series<'_>, noise_power: f64) -> Self {
        let line_p = self.line.map_or(1.0, |line| line.p);
        let least = self.structure.p.min(self.cross_correlation.p).min(line_p);
        let Some(error) = series.input_error.as_ref().filter(|_| least < LIKELY) else { return self };
        let by_error = error.explains(series, noise_power);
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
    let floor = series.noise_rms * series.noise_rms + error.map_or(0.0, InputError::beyond_floor);
    let power_ratio = if floor > 0.0 { power / floor } else { f64::INFINITY };
    // The scatter of a mean square of Gaussian noise, and the floor's own, which has at most this series'
    // certainty: recordings differ.
    let floor_count = (series.noise_samples as usize).clamp(1, count.max(1));
    let [own, floors] = [count, floor_count].map(|count| 2.0 / colour.effective_count(count));
    let rings = if floor > 0.0 { by_error.deviation / floor } else { 0.0 };
    let scatter = (own + floors + rings * rings).sqrt();
    let noise_power = own_noise(series.residual, by_error.mean).map_or(floor, |own| own.min(floor));
    let tests = Tests::of(series, noise_power).beyond_input_errors(series, noise_power);
    Adequacy {
        power_ratio,
        power_z: (power_ratio - 1.0) / scatter,
        power_stderr: scatter,
        structure: tests.structure,
        cross_correlation: tests.cross_correlation,
        line: tests.line.filter(|line| !series.may_ring_of_itself(line, noise_power)),
        whiteness_p: whiteness(series.residual),
        bound_ratio: if series.noise_is_bound { floor / noise_power } else { 1.0 },
    }
}

/// Power of the noise that a residual shows by itself, beside what errors of the input do: a floor that was
/// seen in what a wrong model leaves has the wrong model in it, and what goes with the motion is to be judged
/// by noise. `None` where the residual is too short to show it.
fn own_noise(residual: &[f64], by_input_errors: f64) -> Option<f64> {
    let white = flat_power(residual);
    (white > 0.0).then_some(white + by_input_errors)
}

/// Number of samples of one window: two seconds or four periods of the slowest mode, at most a tenth of the
/// series.
fn window_length(series: &Series<'_>) -> usize {
    let seconds = if series.slowest_hz > 0.0 { (4.0 / series.slowest_hz).max(2.0) } else { 2.0 };
    ((seconds * series.rate_hz) as usize).clamp(40, (series.residual.len() / 8).max(40))
}

/// Window by window: regression of the whitened residual on powers of the simulated output and its speed,
/// against what is left; pooled over windows. What is found has to go through the whole recording.
fn structure(
    series: &Series<'_>,
    white: &[f64],
    whiten: &dyn Fn(&[f64]) -> Vec<f64>,
    noise_power: f64,
) -> Found {
    let length = window_length(series);
    let plain = state_columns(series.simulated);
    let whitened: Vec<Vec<f64>> = plain.iter().map(|column| whiten(column)).collect();
    let (mut statistic, mut freedom) = (0.0, 0.0);
    let mut all = Regressed::default();
    for start in (0..white.len()).step_by(length) {
        let end = (start + length).min(white.len());
        if end - start < 40 {
            continue;
        }
        let pairs = whitened.iter().zip(&plain);
        let columns: Vec<Column<'_>> = pairs
            .map(|(white, plain)| Column { white: &white[start..end], plain: &plain[start..end] })
            .collect();
        // A level of its own in every window: drifts are not structure.
        let window = Regressed::of(&white[start..end], true, &columns);
        let Regressed { before, after, rank, left, .. } = window;
        if after > 0.0 && rank > 0.0 && left > 10.0 {
            // An F ratio of many degrees below: times its rank it is about chi-squared; its mean is
            // corrected.
            statistic += (before - after) / (after / left) * (left - 2.0) / left;
            freedom += rank;
            all = all.and(&window);
        }
    }
    let in_windows = if freedom == 0.0 { 1.0 } else { chi_squared_tail(statistic, freedom) };
    let is_driven = series.input.is_some();
    let is_faint = all.share_of_noise(noise_power) < FAINT;
    let throughout = (is_driven && is_faint && in_windows < LIKELY)
        .then(|| coherence::chance(white, &plain, length, whiten))
        .flatten();
    Found {
        p: throughout.map_or(in_windows, |throughout| throughout.max(in_windows)),
        share: all.share_of_noise(noise_power),
        share_of_white: all.share_of_white(),
    }
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
fn cross_correlation(white: &[f64], input: (&[f64], &[f64]), series: &Series<'_>, noise_power: f64) -> Found {
    let reach = if series.slowest_hz > 0.0 { 0.5 / series.slowest_hz } else { 0.5 };
    let step = ((reach * series.rate_hz) as usize / INPUT_LAGS).max(1);
    let lagged = |input: &[f64]| -> Vec<Vec<f64>> {
        let mean = input.iter().sum::<f64>() / input.len().max(1) as f64;
        let at = |lag: usize, k: usize| if k >= lag * step { input[k - lag * step] - mean } else { 0.0 };
        (0..INPUT_LAGS).map(|lag| (0..white.len()).map(|k| at(lag, k)).collect()).collect()
    };
    let (whitened, plain) = (lagged(input.0), lagged(input.1));
    let pairs = whitened.iter().zip(&plain);
    let columns: Vec<Column<'_>> = pairs.map(|(white, plain)| Column { white, plain }).collect();
    let found = Regressed::of(white, false, &columns);
    if found.after <= 0.0 || found.rank == 0.0 {
        return Found::NOTHING;
    }
    Found {
        p: chi_squared_tail((found.before - found.after) / (found.after / found.left), found.rank),
        share: found.share_of_noise(noise_power),
        share_of_white: found.share_of_white(),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_faint_line_at_a_narrow_resonance_may_be_that_resonance() {
        let residual: Vec<f64> = (0..3000).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let rings = |width_hz: f64, frequency_hz: f64, noise_power: f64| {
            let series = Series {
                residual: &residual,
                simulated: &residual,
                input: None,
                rate_hz: 100.0,
                noise_rms: 1.0,
                noise_samples: 3000.0,
                noise_is_bound: false,
                slowest_hz: 5.0,
                resonances: &[Resonance { frequency_hz: 5.0, width_hz }],
                input_error: None,
            };
            series.may_ring_of_itself(&Line { frequency_hz, p: 1e-9, share: 0.1 }, noise_power)
        };
        assert!(rings(0.02, 5.05, 1.0));
        assert!(!rings(0.02, 5.05, 0.05), "twice as loud as the noise");
        assert!(!rings(0.02, 5.2, 1.0), "beside the resonance");
        assert!(!rings(0.5, 5.05, 1.0), "a line is narrower than this resonance");
    }
}
