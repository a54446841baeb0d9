//! The modal model of a power spectrum: what modes make of an even excitation, and an even floor.

use super::choice::ModalModel;
use crate::column::Column;
use crate::forced_model::pole;
use crate::separable::Separable;

/// S(f) is the sum over the modes of (a + b f²) / ((f_r² - f²)² + (2 zeta f_r f)²), and a constant and a
/// share with f² of floor. Powers scatter in proportion to themselves: every line is weighted by one over the
/// smoothed spectrum there.
#[derive(Clone)]
pub(super) struct PowerModel {
    frequency_hz: Vec<f64>,
    weights: Vec<f64>,
    target: Vec<f64>,
    modes: usize,
}

/// Lines on either side over which the weights are smoothed.
const SMOOTH: usize = 2;

impl PowerModel {
    pub(super) fn new(frequency_hz: &[f64], density: &[f64]) -> Self {
        let weight = |k: usize| {
            let around = &density[k.saturating_sub(SMOOTH)..(k + SMOOTH + 1).min(density.len())];
            around.len() as f64 / around.iter().sum::<f64>()
        };
        let weights: Vec<f64> = (0..density.len()).map(weight).collect();
        let target = density.iter().zip(&weights).map(|(power, weight)| power * weight).collect();
        Self { frequency_hz: frequency_hz.to_vec(), weights, target, modes: 0 }
    }

    /// What a value of this model, a column or a residual, is in the spectrum's unit.
    pub(super) fn unweighted(&self, values: &[f64]) -> Vec<f64> {
        values.iter().zip(&self.weights).map(|(value, weight)| value / weight).collect()
    }

    fn weighted(&self, shape: impl Fn(f64) -> f64) -> Column {
        let lines = self.frequency_hz.iter().zip(&self.weights);
        lines.map(|(hz, weight)| shape(*hz) * weight).collect::<Vec<f64>>().into()
    }
}

impl ModalModel for PowerModel {
    fn with_modes(&self, modes: usize) -> Self {
        Self { modes, ..self.clone() }
    }

    fn modes(&self) -> usize {
        self.modes
    }

    fn numbers_per_mode(&self) -> usize {
        4
    }

    fn band_hz(&self) -> [f64; 2] {
        [self.frequency_hz.first(), self.frequency_hz.last()].map(|end| end.copied().unwrap_or(0.0))
    }
}

impl Separable for PowerModel {
    fn target(&self, _parameters: &[f64]) -> Vec<f64> {
        self.target.clone()
    }

    fn blocks(&self) -> usize {
        self.modes + 1
    }

    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Column> {
        if block == self.modes {
            let middle_hz = self.frequency_hz[self.frequency_hz.len() / 2];
            return vec![self.weighted(|_| 1.0), self.weighted(|hz| (hz / middle_hz).powi(2))];
        }
        let pole = pole(parameters, block);
        // One at the peak, nearly.
        let peak = move |hz: f64| {
            let x = hz / pole.frequency_hz;
            let damped = 2.0 * pole.damping_ratio;
            damped * damped / ((1.0 - x * x).powi(2) + (damped * x).powi(2))
        };
        vec![self.weighted(peak), self.weighted(move |hz| peak(hz) * (hz / pole.frequency_hz).powi(2))]
    }

    fn depends(&self, block: usize, parameter: usize) -> bool {
        block < self.modes && parameter / 2 == block
    }
}
