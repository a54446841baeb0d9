//! The modal model of frequency responses: poles common to all, complex residues, and what lies beyond the
//! band.

use std::f64::consts::TAU;

use rustfft::num_complex::Complex64;

use super::choice::ModalModel;
use crate::column::Column;
use crate::forced_model::pole;
use crate::frf::FrfEstimate;
use crate::modal_response::Pole;
use crate::separable::Separable;

/// H(f) of every response is the sum over the modes of R / (jω - λ) and its conjugate, and a constant, a
/// share with 1/ω² and one with ω²: rigid body and modes beyond the band. Rows are the real and then the
/// imaginary parts, response by response, each response in units of its root mean square.
#[derive(Clone)]
pub(super) struct ResponseModel {
    lines: Vec<Vec<f64>>,
    target: Vec<f64>,
    /// Root mean square of every response.
    pub(super) scales: Vec<f64>,
    modes: usize,
}

/// Columns of one mode and one response.
pub(super) const PER_RESPONSE: usize = 2;

impl ResponseModel {
    pub(super) fn new(responses: &[FrfEstimate]) -> Self {
        let mut model = Self { lines: Vec::new(), target: Vec::new(), scales: Vec::new(), modes: 0 };
        for frf in responses {
            let power: f64 = frf.response.iter().map(Complex64::norm_sqr).sum();
            let scale = (power / frf.response.len().max(1) as f64).sqrt().max(f64::MIN_POSITIVE);
            model.target.extend(frf.response.iter().map(|value| value.re / scale));
            model.target.extend(frf.response.iter().map(|value| value.im / scale));
            model.lines.push(frf.frequency_hz.clone());
            model.scales.push(scale);
        }
        model
    }

    /// A column of one response from its complex values.
    fn column(start: usize, values: &[Complex64]) -> Column {
        let parts = values.iter().map(|value| value.re).chain(values.iter().map(|value| value.im));
        Column { start, values: parts.collect() }
    }

    /// The lines of every response with its first row.
    fn rows(&self) -> impl Iterator<Item = (usize, &Vec<f64>)> {
        let mut end = 0;
        self.lines.iter().map(move |lines| {
            let start = end;
            end += 2 * lines.len();
            (start, lines)
        })
    }

    /// How a residue of one and of j look over the lines.
    fn residues(pole: Pole, hz: f64) -> [Complex64; 2] {
        let (lambda, s) = (pole.lambda(), Complex64::new(0.0, TAU * hz));
        let (own, mirrored) = ((s - lambda).inv(), (s - lambda.conj()).inv());
        // In units of half the peak: all columns of one size.
        let unit = pole.damping_ratio * pole.omega();
        [(own + mirrored) * unit, Complex64::i() * (own - mirrored) * unit]
    }
}

impl ModalModel for ResponseModel {
    fn with_modes(&self, modes: usize) -> Self {
        Self { modes, ..self.clone() }
    }

    fn modes(&self) -> usize {
        self.modes
    }

    fn numbers_per_mode(&self) -> usize {
        2 + PER_RESPONSE * self.lines.len()
    }

    fn band_hz(&self) -> [f64; 2] {
        let ends = |lines: &Vec<f64>| [lines.first(), lines.last()].map(|end| end.copied().unwrap_or(0.0));
        let bands = self.lines.iter().map(ends);
        bands.fold([f64::INFINITY, 0.0], |all, band| [all[0].min(band[0]), all[1].max(band[1])])
    }
}

impl Separable for ResponseModel {
    fn target(&self, _parameters: &[f64]) -> Vec<f64> {
        self.target.clone()
    }

    fn blocks(&self) -> usize {
        self.modes + 1
    }

    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Column> {
        let mut columns = Vec::new();
        for (start, lines) in self.rows() {
            if block < self.modes {
                let pole = pole(parameters, block);
                let both: Vec<[Complex64; 2]> = lines.iter().map(|hz| Self::residues(pole, *hz)).collect();
                for side in 0..PER_RESPONSE {
                    let values: Vec<Complex64> = both.iter().map(|pair| pair[side]).collect();
                    columns.push(Self::column(start, &values));
                }
                continue;
            }
            let middle_hz = lines[lines.len() / 2];
            let beyond: [fn(f64) -> Complex64; 4] = [
                |_| Complex64::from(1.0),
                |_| Complex64::i(),
                |x| Complex64::from(1.0 / (x * x)),
                |x| Complex64::from(x * x),
            ];
            for shape in beyond {
                let values: Vec<Complex64> = lines.iter().map(|hz| shape(hz / middle_hz)).collect();
                columns.push(Self::column(start, &values));
            }
        }
        columns
    }

    fn depends(&self, block: usize, parameter: usize) -> bool {
        block < self.modes && parameter / 2 == block
    }
}
