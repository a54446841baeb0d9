//! Errors as a recorded input has them, and what they do to a machine: a part of the residual of the right
//! model.
//!
//! A simulation is driven by what was recorded of an input, noise and steps included, and the machine was
//! not. What that makes of the output has the size of the noise and the colour of the machine: a lightly
//! damped mode rings with it. Some draws of it, each as long as the recording, stand for its size, its colour
//! and their scatter.

use crate::adequacy::{ErrorDraw, InputError};
use crate::input_noise::InputNoise;
use crate::noise::NoiseSource;
use crate::record::Record;
use crate::simulation::Hypothesis;
use crate::stacking::{RecordFit, Stack};

/// Draws for one recording: their mean and scatter are known to a quarter.
const DRAWS: u64 = 8;

/// What was drawn for one recording.
#[derive(Debug, Clone)]
pub(crate) struct DrawnError {
    draws: Vec<Draw>,
}

#[derive(Debug, Clone)]
struct Draw {
    /// The input's error at the record's stamps.
    input: Vec<f64>,
    /// What it does to every output of the model, there too.
    outputs: Vec<Vec<f64>>,
}

impl DrawnError {
    /// `None` where the input has no error to speak of, or does not drive.
    pub(crate) fn of(record: &Record, machine: &Hypothesis) -> Option<Self> {
        let samples = record.input.as_ref().filter(|_| !record.rerun.is_in_loop())?;
        let noise = InputNoise::of(samples);
        if noise == InputNoise::default() {
            return None;
        }
        let draw = |number: u64| {
            let input = noise.drawn(samples, number);
            let rerun = record.driven_by(&input);
            let outputs = rerun.outputs(&machine.model, Some(record.longest_step_s)).ok()?;
            Some(Draw { input, outputs })
        };
        Some(Self { draws: (0..DRAWS).map(draw).collect::<Option<_>>()? })
    }

    /// On one output (its place in the record) of the record that has this number in the stack. A floor from
    /// standstill was seen without it.
    pub(crate) fn on(
        &self,
        (stack, index): (&Stack<'_>, usize),
        fit: &RecordFit,
        place: usize,
        floor: NoiseSource,
    ) -> Option<InputError> {
        let draws = self.draws.iter().map(|draw| draw.on((stack, index), fit, place));
        Some(InputError {
            draws: draws.collect::<Option<_>>()?,
            is_in_floor: floor != NoiseSource::QuietStretches,
        })
    }
}

impl Draw {
    fn on(&self, (stack, index): (&Stack<'_>, usize), fit: &RecordFit, place: usize) -> Option<ErrorDraw> {
        let record = stack.records[index];
        let answers: Vec<Vec<f64>> = record
            .outputs
            .iter()
            .map(|output| {
                let answer = self.outputs.get(output.index)?;
                Some(output.at.iter().map(|&stamp| answer[stamp]).collect())
            })
            .collect::<Option<_>>()?;
        // Offsets and the initial state make up for a part of it, as they do in the recording.
        let mut left = stack.weighted(index, &answers);
        fit.nuisances.remove_from(&mut left);
        let start: usize = record.outputs[..place].iter().map(|output| output.at.len()).sum();
        let signal = &record.outputs[place];
        let weighting = stack.weights[index].get(place)?;
        Some(ErrorDraw {
            input: signal.at.iter().map(|&stamp| self.input[stamp]).collect(),
            residual: weighting.undone(&left[start..start + signal.at.len()]),
            simulated: answers.into_iter().nth(place)?,
        })
    }
}
