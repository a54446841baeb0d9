//! An input and an output on one uniform grid.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;
use stillbeam_recording::Recording;

use crate::error::IdentifyError;
use crate::forced_record::{MIN_ROWS, present, readings};
use crate::interpolation::{InputInterpolation, PiecewiseCubic};
use crate::spectra::{CrossSpectra, Window};

/// Input density, relative to its largest, below which a frequency counts as not excited.
const EXCITED: f64 = 1e-4;

/// An input and an output, sampled evenly and at the same times.
#[derive(Debug, Clone, PartialEq)]
pub struct UniformRecord {
    /// The input, in its own unit.
    pub input: Vec<f64>,
    /// The output, in its own unit.
    pub output: Vec<f64>,
    /// Sampling interval, s.
    pub interval_s: f64,
}

impl UniformRecord {
    /// The two columns of a recording on a grid at the output's rate, where both are recorded. Samples that
    /// are missing or off the grid are interpolated: enough for spectra, not for the fit of the record.
    ///
    /// # Errors
    /// [`IdentifyError`] when a column is missing or has too few samples.
    pub fn from_recording(recording: &Recording, input: &str, output: &str) -> Result<Self, IdentifyError> {
        let (u, y) = (present(recording, input)?, readings(recording, output)?);
        let ends = |times: &[f64]| match (times.first(), times.last()) {
            (Some(first), Some(last)) => (*first, *last),
            _ => (0.0, 0.0),
        };
        let (u_ends, y_ends) = (ends(&u.time_s), ends(&y.time_s));
        let (first_s, last_s) = (u_ends.0.max(y_ends.0), u_ends.1.min(y_ends.1));
        let mut intervals: Vec<f64> = y.time_s.windows(2).map(|t| t[1] - t[0]).collect();
        let middle = intervals.len() / 2;
        let median_s = *intervals.select_nth_unstable_by(middle, f64::total_cmp).1;
        // Stamps with a pathological median must not ask for more memory than the record itself is worth.
        let steps = (((last_s - first_s) / median_s).round().max(0.0) as usize).min(20 * y.time_s.len());
        if steps + 1 < MIN_ROWS {
            return Err(IdentifyError::TooFewSamples {
                recording: recording.name.clone(),
                column: output.to_owned(),
                found: steps + 1,
                required: MIN_ROWS,
                context: " while the input is recorded",
            });
        }
        let interval_s = (last_s - first_s) / steps as f64;
        let grid = || (0..=steps).map(|k| (first_s + k as f64 * interval_s).min(last_s));
        let on_grid = |times: &[f64], values: &[f64]| -> Vec<f64> {
            let curve = PiecewiseCubic::new(times, values, InputInterpolation::Cubic);
            curve.sample(grid()).into_iter().map(|value| value[0]).collect()
        };
        Ok(Self { input: on_grid(&u.time_s, &u.values), output: on_grid(&y.time_s, &y.values), interval_s })
    }

    /// Lowest and highest frequency, Hz, at which the input's density is within 40 dB (a power ratio of 10⁻⁴)
    /// of its largest.
    pub fn excited_band_hz(&self) -> [f64; 2] {
        let segment = (self.input.len() / 4).max(8);
        let spectra =
            CrossSpectra::welch(&self.input, &self.output, self.interval_s, segment, Window::Hamming);
        let top = spectra.input.iter().skip(1).fold(0.0_f64, |top, value| top.max(*value));
        let lines = spectra.frequency_hz.iter().zip(&spectra.input).skip(1);
        let excited = lines.filter(|(_, density)| **density >= EXCITED * top).map(|(f, _)| *f);
        excited.fold([f64::INFINITY, 0.0], |band, f| [band[0].min(f), band[1].max(f)])
    }

    /// Spectra of the whole record without a window, from zero to the Nyquist frequency, and the lines'
    /// distance in Hz.
    pub(crate) fn spectra(&self) -> (Vec<Complex64>, Vec<Complex64>, f64) {
        let length = self.input.len().min(self.output.len());
        let fft = FftPlanner::new().plan_fft_forward(length);
        let transform = |signal: &[f64]| {
            let mut bins: Vec<Complex64> =
                signal.iter().take(length).map(|value| Complex64::new(*value, 0.0)).collect();
            fft.process(&mut bins);
            bins.truncate(length / 2 + 1);
            bins
        };
        (transform(&self.input), transform(&self.output), 1.0 / (length as f64 * self.interval_s))
    }
}
