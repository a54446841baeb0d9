//! Errors as a recorded input has them, and what they do to a machine: a part of the residual of the right model.
//!
//! A simulation is driven by what was recorded of an input, noise and steps included, and the machine was not. What that makes of the output
//! has the size of the noise and the colour of the machine: a lightly damped mode rings with it. One draw of it, as long as the
//! recording, stands for its size and its colour.

use crate::adequacy::InputError;
use crate::input_noise::InputNoise;
use crate::noise::NoiseSource;
use crate::record::{OutputSignal, Record};
use crate::simulation::Hypothesis;

/// One draw for one recording.
#[derive(Debug, Clone)]
pub(crate) struct DrawnError {
    /// Per recorded output: the input's error at its samples, and what all of it does to the output.
    outputs: Vec<(Vec<f64>, Vec<f64>)>,
}

impl DrawnError {
    /// `None` where the input has no error to speak of, or does not drive.
    pub(crate) fn of(record: &Record, machine: &Hypothesis) -> Option<Self> {
        let input = record.input.as_ref().filter(|_| !record.rerun.is_in_loop())?;
        let noise = InputNoise::of(input);
        if noise == InputNoise::default() {
            return None;
        }
        let error = noise.drawn(input);
        let answers = record.driven_by(&error).outputs(&machine.model, Some(record.longest_step_s)).ok()?;
        let outputs = record.outputs.iter().map(|output| {
            let at_samples = |values: &[f64]| output.at.iter().map(|&k| values[k]).collect::<Vec<f64>>();
            Some((at_samples(&error), at_samples(answers.get(output.index)?)))
        });
        Some(Self { outputs: outputs.collect::<Option<_>>()? })
    }

    /// On one output; `None` where samples were set aside since.
    pub(crate) fn on(
        &self,
        signal: &OutputSignal,
        place: usize,
        floor: NoiseSource,
    ) -> Option<InputError<'_>> {
        let (input, output) = self.outputs.get(place).filter(|(input, _)| input.len() == signal.at.len())?;
        // A floor from standstill was seen without it.
        let unseen_power = if floor == NoiseSource::QuietStretches { mean_square(output) } else { 0.0 };
        Some(InputError { input, output, unseen_power })
    }
}

fn mean_square(values: &[f64]) -> f64 {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count
}
