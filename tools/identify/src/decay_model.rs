//! The model of a free decay, and its use where a mode decays too fast to show as a peak.

use rustfft::num_complex::Complex64;

use crate::decay_modes::Part;
use crate::modal_response::{Pole, free_response};
use crate::narrow_band::WholeSpectrum;

use crate::separable::{Separable, fit};
use crate::sweep_fit::{pole, pole_parameters};

/// Parameters: ln f and ln zeta of every mode. Linear: cosine and sine amplitude of every mode, offset.
pub(crate) struct DecayModel<'r> {
    pub(crate) time_s: &'r [f64],
    pub(crate) output: &'r [f64],
    pub(crate) modes: usize,
}

impl Separable for DecayModel<'_> {
    fn target(&self, _: &[f64]) -> Vec<f64> {
        self.output.to_vec()
    }

    fn blocks(&self) -> usize {
        self.modes + 1
    }

    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Vec<f64>> {
        let time_s = self.time_s;
        if block == self.modes {
            return vec![vec![1.0; time_s.len()]];
        }
        free_response(pole(parameters, block), 0.0, time_s).into()
    }

    fn depends(&self, block: usize, parameter: usize) -> bool {
        parameter / 2 == block
    }

    /// d exp(lambda t) = t exp(lambda t) d lambda, real part and imaginary part.
    fn block_derivatives(&self, block: usize, parameter: usize, parameters: &[f64]) -> Option<Vec<Vec<f64>>> {
        let pole = pole(parameters, block);
        let [cosine, sine] = free_response(pole, 0.0, self.time_s);
        let zeta = pole.damping_ratio;
        // With respect to ln f, then ln zeta.
        let change = match parameter % 2 {
            0 => pole.lambda(),
            _ => Complex64::new(-1.0, -zeta / (1.0 - zeta * zeta).sqrt()) * (zeta * pole.omega()),
        };
        let pairs = || self.time_s.iter().zip(cosine.iter().zip(&sine));
        let real = pairs().map(|(t, (c, s))| t * (change.re * c - change.im * s)).collect();
        let imaginary = pairs().map(|(t, (c, s))| t * (change.im * c + change.re * s)).collect();
        Some(vec![real, imaginary])
    }
}

/// Shares of the spectrum's strongest frequency, and dampings, from which a heavily damped mode is searched.
const HEAVY_FREQUENCIES: [f64; 3] = [0.7, 1.0, 1.5];
const HEAVY_DAMPINGS: [f64; 3] = [0.05, 0.15, 0.4];

/// The one mode of a decay so heavily damped that its spectrum has no peak to speak of: tried from several
/// starts, taken when it explains most of the record and far more than noise would let it.
pub(crate) fn heavily_damped(time_s: &[f64], output: &[f64], whole: &WholeSpectrum) -> Option<Part> {
    let model = DecayModel { time_s, output, modes: 1 };
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
