//! The paper's way to a spectrum: one discrete Fourier transform of the whole record through one Hamming
//! window, and modes picked from its peaks and their widths. Kept to show what it does; nothing rests on it.

use std::f64::consts::TAU;

use stillbeam_recording::Recording;

use crate::error::CliError;

/// Output over input, bin by bin.
#[derive(Clone, Debug, PartialEq)]
pub struct WholeSpectrum {
    /// Bins in hertz, one over the record's length apart.
    pub frequency_hz: Vec<f64>,
    /// Size of output over input, in output unit per input unit.
    pub magnitude: Vec<f64>,
}

/// What a peak says of a mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickedPeak {
    /// The highest bin, hertz.
    pub frequency_hz: f64,
    /// Half of the width at 1/√2 of the height, over the frequency; `None` where a flank does not fall that
    /// far.
    pub damping_ratio: Option<f64>,
}

impl WholeSpectrum {
    /// The spectrum from `low_hz` to `high_hz` of the rows in which both columns have a value, which must be
    /// equally far apart.
    ///
    /// # Errors
    /// [`CliError::Recording`] when a column is missing; [`CliError::Internal`] with fewer than three such
    /// rows.
    pub fn of(
        recording: &Recording,
        input: &str,
        output: &str,
        (low_hz, high_hz): (f64, f64),
    ) -> Result<Self, CliError> {
        let columns = recording.column(input)?.iter().zip(recording.column(output)?);
        let rows = recording.time_s.iter().zip(columns).filter(|(_, (x, y))| !x.is_nan() && !y.is_nan());
        let rows: Vec<(f64, f64, f64)> = rows.map(|(time_s, (x, y))| (*time_s, *x, *y)).collect();
        let (Some(first), Some(last), true) = (rows.first(), rows.last(), rows.len() > 2) else {
            return Err(CliError::Internal(format!("{}: no rows for a spectrum", recording.name)));
        };
        let count = rows.len() as f64;
        let interval_s = (last.0 - first.0) / (count - 1.0);
        let bin_hz = 1.0 / (count * interval_s);
        let mean = |of: fn(&(f64, f64, f64)) -> f64| rows.iter().map(of).sum::<f64>() / count;
        let (mean_x, mean_y) = (mean(|row| row.1), mean(|row| row.2));
        let windowed: Vec<(f64, f64)> = (0..)
            .zip(&rows)
            .map(|(index, (_, x, y))| {
                let weight = 0.54 - 0.46 * (TAU * (f64::from(index) + 0.5) / count).cos();
                (weight * (x - mean_x), weight * (y - mean_y))
            })
            .collect();
        let bins = (low_hz / bin_hz).ceil() as u32..=(high_hz / bin_hz).floor() as u32;
        let frequency_hz: Vec<f64> = bins.map(|bin| f64::from(bin) * bin_hz).collect();
        let magnitude = frequency_hz.iter().map(|hz| ratio(&windowed, TAU * hz * interval_s)).collect();
        Ok(Self { frequency_hz, magnitude })
    }

    /// The highest peak between two frequencies, or `None` when no bin lies there.
    pub fn pick(&self, low_hz: f64, high_hz: f64) -> Option<PickedPeak> {
        let inside =
            (0..self.frequency_hz.len()).filter(|k| (low_hz..=high_hz).contains(&self.frequency_hz[*k]));
        let top = inside.max_by(|a, b| self.magnitude[*a].total_cmp(&self.magnitude[*b]))?;
        let level = self.magnitude[top] / std::f64::consts::SQRT_2;
        let upper = (top + 1..self.magnitude.len()).find(|k| self.magnitude[*k] < level);
        let lower = (0..top).rev().find(|k| self.magnitude[*k] < level);
        // Straight lines between bins.
        let crossing = |outside: usize, inside: usize| {
            let (low, high) = (self.magnitude[outside], self.magnitude[inside]);
            let share = (level - low) / (high - low);
            self.frequency_hz[outside] + share * (self.frequency_hz[inside] - self.frequency_hz[outside])
        };
        let frequency_hz = self.frequency_hz[top];
        let damping_ratio = match (lower, upper) {
            (Some(lower), Some(upper)) => {
                let width_hz = crossing(upper, upper - 1) - crossing(lower, lower + 1);
                Some(0.5 * width_hz / frequency_hz)
            }
            _ => None,
        };
        Some(PickedPeak { frequency_hz, damping_ratio })
    }

    /// `(hertz, magnitude)` pairs.
    pub fn points(&self) -> Vec<(f64, f64)> {
        self.frequency_hz.iter().copied().zip(self.magnitude.iter().copied()).collect()
    }
}

/// |Y/X| at `step` radians per sample.
fn ratio(samples: &[(f64, f64)], step: f64) -> f64 {
    let (turn_sin, turn_cos) = step.sin_cos();
    let (mut cos, mut sin) = (1.0, 0.0);
    let (mut x, mut y) = ([0.0; 2], [0.0; 2]);
    for (input, output) in samples {
        x[0] += input * cos;
        x[1] += input * sin;
        y[0] += output * cos;
        y[1] += output * sin;
        (cos, sin) = (cos * turn_cos - sin * turn_sin, sin * turn_cos + cos * turn_sin);
    }
    y[0].hypot(y[1]) / x[0].hypot(x[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A record of a mode that rang down long before its end has the mode's own width, once the window is
    /// short against neither.
    #[test]
    fn a_long_enough_record_of_enough_damping_shows_the_damping() {
        let (hz, zeta) = (1.1_f64, 0.05_f64);
        let interval_s = 0.01;
        let omega = TAU * hz;
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        let time_s: Vec<f64> = (0..6000).map(|k| interval_s * f64::from(k)).collect();
        let pulse = |t: f64| (-(t - 30.0).powi(2) / 0.002).exp();
        let input: Vec<f64> = time_s.iter().map(|t| pulse(*t)).collect();
        let output = time_s.iter().map(|t| {
            let after = t - 30.0;
            if after < 0.0 { 0.0 } else { (-zeta * omega * after).exp() * (damped * after).sin() }
        });
        let recording = Recording::new("pulse", time_s.clone())
            .with_column("a_m", input)
            .with_column("b_m", output.collect());
        let peak = WholeSpectrum::of(&recording, "a_m", "b_m", (0.1, 8.0)).unwrap().pick(0.5, 2.0).unwrap();
        assert!((peak.frequency_hz / hz - 1.0).abs() < 0.02, "{peak:?}");
        assert!((peak.damping_ratio.unwrap() / zeta - 1.0).abs() < 0.1, "{peak:?}");
    }
}
