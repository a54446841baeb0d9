//! Errors as a recorded input has them, and what they do to a machine: a part of the residual of the right
//! model.
//!
//! A simulation is driven by what was recorded of an input, noise and steps included, and the machine was
//! not. What that makes of the output has the size of the noise and the colour of the machine: a lightly
//! damped mode rings with it. Some draws of it, each as long as the recording, stand for its size, its colour
//! and their scatter.

use stillbeam_identify::tall::Orthonormal;

use crate::adequacy::{ErrorDraw, InputError};
use crate::fit::Fitted;
use crate::input_noise::InputNoise;
use crate::noise::NoiseSource;
use crate::record::{OutputSignal, Record};
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
    /// What it does to every output of the record, at the output's samples.
    outputs: Vec<Vec<f64>>,
}

/// Draws for the recordings of a stack that a model was fitted to, as far as its parameters did not make up
/// for them: a fit follows the errors too.
pub(crate) fn drawn_beside_a_fit(stack: &Stack<'_>, fitted: &Fitted) -> Vec<Option<DrawnError>> {
    let machine = fitted.hypothesis.without_laws();
    let mut drawn: Vec<Option<DrawnError>> =
        stack.records.iter().map(|record| DrawnError::of(record, &machine)).collect();
    if drawn.iter().all(Option::is_none) {
        return drawn;
    }
    let mut parameters = Orthonormal::default();
    for column in fitted.sensitivities(stack) {
        parameters.push(column);
    }
    for number in 0..DRAWS as usize {
        let seen: Vec<Vec<f64>> = (drawn.iter().zip(&fitted.records).enumerate())
            .map(|(index, (drawn, fit))| match drawn {
                Some(drawn) => {
                    let mut seen = stack.weighted(index, &drawn.draws[number].outputs);
                    fit.nuisances.remove_from(&mut seen);
                    seen
                }
                None => vec![0.0; fit.residuals.len()],
            })
            .collect();
        let mut left = seen.concat();
        parameters.remove_from(&mut left);
        let mut start = 0;
        for (index, (drawn, seen)) in drawn.iter_mut().zip(&seen).enumerate() {
            let left = &left[start..start + seen.len()];
            start += seen.len();
            if let Some(drawn) = drawn {
                let made_up: Vec<f64> = seen.iter().zip(left).map(|(seen, left)| seen - left).collect();
                drawn.draws[number].take_off((stack, index), &made_up);
            }
        }
    }
    drawn
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
            let answers =
                rerun.outputs(&machine.model, Some(record.sub_steps.longest_s(&machine.model))).ok()?;
            let sampled = |output: &OutputSignal| {
                let answer = answers.get(output.index)?;
                Some(output.at.iter().map(|&stamp| answer[stamp]).collect())
            };
            let outputs = record.outputs.iter().map(sampled).collect::<Option<_>>()?;
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
    /// Without weighted values of one record of a stack.
    fn take_off(&mut self, (stack, index): (&Stack<'_>, usize), weighted: &[f64]) {
        let mut start = 0;
        for (output, weighting) in self.outputs.iter_mut().zip(&stack.weights[index]) {
            let values = weighting.undone(&weighted[start..start + output.len()]);
            start += output.len();
            for (value, off) in output.iter_mut().zip(&values) {
                *value -= off;
            }
        }
    }

    fn on(&self, (stack, index): (&Stack<'_>, usize), fit: &RecordFit, place: usize) -> Option<ErrorDraw> {
        let record = stack.records[index];
        // Offsets and the initial state make up for a part of it, as they do in the recording.
        let mut left = stack.weighted(index, &self.outputs);
        fit.nuisances.remove_from(&mut left);
        let start: usize = record.outputs[..place].iter().map(|output| output.at.len()).sum();
        let signal = &record.outputs[place];
        let weighting = stack.weights[index].get(place)?;
        Some(ErrorDraw {
            input: signal.at.iter().map(|&stamp| self.input[stamp]).collect(),
            residual: weighting.undone(&left[start..start + signal.at.len()]),
            simulated: self.outputs.get(place)?.clone(),
        })
    }
}
