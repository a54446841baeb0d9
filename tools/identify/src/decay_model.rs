//! The model of a free decay, and its use where a mode decays too fast to show as a peak.

use rustfft::num_complex::Complex64;

use crate::column::Column;
use crate::decay_modes::Part;
use crate::drift::chebyshev;
use crate::modal_response::{Pole, free_response};
use crate::narrow_band::WholeSpectrum;
use crate::ringing::DecayRecord;

use crate::forced_model::{pole, pole_parameters};
use crate::separable::{Separable, fit};

/// Decay times after which a free response counts as over: exp(-36) is the rounding of a double.
const DECAYED: f64 = 36.0;

/// Parameters: ln f and ln zeta of every mode. Linear: cosine and sine amplitude of every mode, offset,
/// powers of time.
pub(crate) struct DecayModel<'r> {
    pub(crate) time_s: &'r [f64],
    pub(crate) output: &'r [f64],
    pub(crate) modes: usize,
    /// Highest power of time of what the sensor still drifts by.
    pub(crate) powers: usize,
}

/// Highest power of time that may be left of a drift, and periods of the slowest mode for each: fewer, and
/// the two could not be told apart.
const POWERS: (usize, f64) = (3, 3.0);

impl<'r> DecayModel<'r> {
    /// The model of a record with modes at these frequencies.
    pub(crate) fn of(record: &'r DecayRecord, modes: usize, lowest_hz: f64) -> Self {
        let powers = match record.drifts {
            true => ((lowest_hz * record.duration_s() / POWERS.1) as usize).min(POWERS.0),
            false => 0,
        };
        Self { time_s: &record.time_s, output: &record.output, modes, powers }
    }
}

impl Separable for DecayModel<'_> {
    fn target(&self, _: &[f64]) -> Vec<f64> {
        self.output.to_vec()
    }

    fn blocks(&self) -> usize {
        self.modes + 1
    }

    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Column> {
        if block == self.modes {
            return trend(self.time_s, self.powers);
        }
        let pole = pole(parameters, block);
        // Beyond this the response is below the rounding of its beginning.
        let over_s = DECAYED * pole.decay_time_s();
        let rows = self.time_s.partition_point(|t| *t <= over_s);
        free_response(pole, 0.0, &self.time_s[..rows]).map(Column::from).into()
    }

    fn depends(&self, block: usize, parameter: usize) -> bool {
        parameter / 2 == block
    }

    /// d exp(lambda t) = t exp(lambda t) d lambda, of the real part and of the imaginary part.
    fn tangents(
        &self,
        block: usize,
        parameters: &[f64],
        columns: &[Column],
        coefficients: &[f64],
    ) -> Vec<(usize, Column)> {
        // The trend may be two columns as well.
        let is_mode = block < self.modes;
        let ([cosine, sine], [a, b], true) = (columns, coefficients, is_mode) else { return Vec::new() };
        let turns = pole(parameters, block).lambda_slopes();
        let tangent = |turn: Complex64| {
            let (c, s) = (a * turn.re + b * turn.im, b * turn.re - a * turn.im);
            let pairs = cosine.values.iter().zip(&sine.values);
            let values = self.time_s.iter().zip(pairs).map(|(t, (x, y))| t * (c * x + s * y));
            Column::from(values.collect::<Vec<f64>>())
        };
        turns.into_iter().enumerate().map(|(side, turn)| (2 * block + side, tangent(turn))).collect()
    }
}

/// A constant and powers of time.
fn trend(time_s: &[f64], powers: usize) -> Vec<Column> {
    let last_s = time_s.last().copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
    (0..=powers)
        .map(|power| time_s.iter().map(|t| chebyshev(power, t / last_s)).collect::<Vec<f64>>().into())
        .collect()
}

/// Shares of the spectrum's strongest frequency, and dampings, from which a heavily damped mode is searched.
const HEAVY_FREQUENCIES: [f64; 3] = [0.7, 1.0, 1.5];
const HEAVY_DAMPINGS: [f64; 3] = [0.05, 0.15, 0.4];

/// The one mode of a decay so heavily damped that its spectrum has no peak to speak of: tried from several
/// starts, taken when it explains most of the record and far more than noise would let it.
pub(crate) fn heavily_damped(time_s: &[f64], output: &[f64], whole: &WholeSpectrum) -> Option<Part> {
    let model = DecayModel { time_s, output, modes: 1, powers: 0 };
    let strongest_hz = whole.strongest_hz()?;

    let starts = HEAVY_FREQUENCIES
        .iter()
        .flat_map(|share| HEAVY_DAMPINGS.map(|damping_ratio| (share * strongest_hz, damping_ratio)))
        .map(|(frequency_hz, damping_ratio)| Pole { frequency_hz, damping_ratio });
    let best = starts
        .filter_map(|start| fit(&model, &pole_parameters(start, 0.7)))
        .min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))?;
    let n = output.len() as f64;
    let mean = output.iter().sum::<f64>() / n;
    let power: f64 = output.iter().map(|y| (y - mean).powi(2)).sum();
    let ratio = power / best.sum_of_squares.max(f64::MIN_POSITIVE);
    let found = pole(&best.parameters, 0);
    let explains = ratio > 2.0 && n * ratio.ln() > 10.0 + 5.0 * n.ln();
    explains.then(|| Part::alone(found, 0.5 * found.frequency_hz))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trend_of_any_number_of_columns_has_no_tangents() {
        let time_s: Vec<f64> = (0..100).map(|k| 0.01 * f64::from(k)).collect();
        let output = vec![0.0; 100];
        for powers in 0..=POWERS.0 {
            let model = DecayModel { time_s: &time_s, output: &output, modes: 1, powers };
            let parameters = [3.0_f64.ln(), 0.01_f64.ln()];
            let columns = model.block(1, &parameters);
            let factors = vec![1.0; columns.len()];
            assert!(model.tangents(1, &parameters, &columns, &factors).is_empty(), "{powers}");
        }
    }
}
