//! What is written down of a run: readings with noise, in steps.

use std::fmt::Write;

use crate::random::Random;

/// How a channel was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Channel {
    /// Root mean square of white noise, in the channel's unit.
    pub noise_rms: f64,
    /// Readings are multiples of this; 0: of nothing.
    pub step: f64,
}

impl Channel {
    /// Readings of true values.
    pub fn read(self, truth: &[f64], random: &mut Random) -> Vec<f64> {
        let mut reading = |value: &f64| {
            let seen = value + self.noise_rms * random.normal();
            if self.step > 0.0 { (seen / self.step).round() * self.step } else { seen }
        };
        truth.iter().map(&mut reading).collect()
    }
}

/// Text of a recording from its columns.
pub fn text(rate_hz: f64, columns: &[(String, Vec<f64>)]) -> String {
    let mut text = String::from("time_s");
    for (name, _) in columns {
        text.push(',');
        text.push_str(name);
    }
    text.push('\n');
    let count = columns.first().map_or(0, |(_, samples)| samples.len());
    for k in 0..count {
        // Writing into a string cannot fail.
        let _ = write!(text, "{:.6}", k as f64 / rate_hz);
        for (_, samples) in columns {
            let _ = write!(text, ",{:.10e}", samples[k]);
        }
        text.push('\n');
    }
    text
}

/// Root mean square about the mean.
pub fn spread(values: &[f64]) -> f64 {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}
