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
use crate::noise::{NoiseFloor, NoiseSource};
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
    /// `None` where the input has no error to speak of, or does not drive. What the model states of its noise
    /// holds, else what its readings show.
    pub(crate) fn of(record: &Record, machine: &Hypothesis) -> Option<Self> {
        let samples = record.input.as_ref().filter(|_| !record.rerun.is_in_loop())?;
        let seen = InputNoise::of(samples);
        let stated = machine.model.input().and_then(|input| input.noise_rms);
        let noise = InputNoise { white_rms: stated.unwrap_or(seen.white_rms), ..seen };
        if noise == InputNoise::default() {
            return None;
        }
        let draw = |number: u64| {
            let input = noise.drawn(samples, number);
            let rerun = record.driven_by(&input);
            let answers =
                rerun.outputs(&machine.model, Some(record.sub_steps.lengths(&machine.model))).ok()?;
            let sampled = |output: &OutputSignal| {
                let answer = answers.get(output.index)?;
                Some(output.at.iter().map(|&stamp| answer[stamp]).collect())
            };
            let outputs = record.outputs.iter().map(sampled).collect::<Option<_>>()?;
            Some(Draw { input, outputs })
        };
        Some(Self { draws: (0..DRAWS).map(draw).collect::<Option<_>>()? })
    }

    /// On one output (its place in the record) of the record that has this number in the stack; no floor has
    /// any of it yet.
    pub(crate) fn on(
        &self,
        (stack, index): (&Stack<'_>, usize),
        fit: &RecordFit,
        place: usize,
    ) -> Option<InputError> {
        let draws = self.draws.iter().map(|draw| draw.on((stack, index), fit, place));
        Some(InputError { draws: draws.collect::<Option<_>>()?, in_floor: 0.0 })
    }
}

/// Tells the errors of all recordings of an output how much of them its floor has already. One from
/// standstill was seen without any, and one that is stated is the sensor's own; any other was seen over all
/// recordings, and has of each what they have on the average. An input that was driven harder may be noisier,
/// too. A floor that was seen where it is quiet has no more of them than it is itself: a base that nothing
/// holds wanders under the noise of a force, slowly and far, and a quiet stretch shows nothing of that.
pub(crate) fn tell_floor(errors: &mut [Option<InputError>], floor: &NoiseFloor) {
    if matches!(floor.source, NoiseSource::QuietStretches | NoiseSource::Stated) {
        return;
    }
    let powers = errors.iter().map(|error| error.as_ref().map_or(0.0, InputError::mean_power));
    let average = powers.sum::<f64>() / errors.len().max(1) as f64;
    let in_floor = average.min(floor.rms * floor.rms);
    errors.iter_mut().flatten().for_each(|error| error.in_floor = in_floor);
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

#[cfg(test)]
mod tests {
    use stillbeam_plant::Model;
    use stillbeam_recording::{Recording, Role};

    use super::*;

    fn drawn(input: &str) -> Option<DrawnError> {
        let text = format!(
            "schema = 1\nkind = \"modal\"\nmode = [{{ frequency_hz = 2.0, damping_ratio = 0.01, participation = [1.0] }}]\n\
             input = {{ column = \"force_N\"{input} }}\noutput = [{{ column = \"tip_m\" }}]"
        );
        let model = Model::from_toml("mode.toml", &text).unwrap();
        let time_s: Vec<f64> = (0..2000).map(|k| 0.01 * f64::from(k)).collect();
        let wave: Vec<f64> = time_s.iter().map(|t| 3.0 * (9.0 * t).sin()).collect();
        let recording =
            Recording::new("run", time_s).with_column("force_N", wave.clone()).with_column("tip_m", wave);
        let record = Record::new(&recording, Role::Train, &model, Some(2.0), Some(2.0)).unwrap();
        DrawnError::of(&record, &Hypothesis::given(&model))
    }

    #[test]
    fn a_noise_that_the_model_states_is_drawn_where_the_readings_show_none() {
        let rms = |draw: &Draw| {
            let square = draw.input.iter().map(|error| error * error).sum::<f64>() / draw.input.len() as f64;
            square.sqrt()
        };
        let shown = drawn("").map_or(0.0, |drawn| rms(&drawn.draws[0]));
        assert!(shown < 1e-6, "a smooth input shows {shown} N");
        let drawn = drawn(", noise_rms = 0.02").expect("it is stated");
        assert!(drawn.draws.iter().all(|draw| (rms(draw) - 0.02).abs() < 1e-3));
    }

    #[test]
    fn a_floor_holds_no_more_of_the_inputs_errors_than_it_is_itself() {
        let error = |rms: f64| {
            let residual = vec![rms; 10];
            let draw = ErrorDraw { input: Vec::new(), simulated: Vec::new(), residual };
            Some(InputError { draws: vec![draw], in_floor: 0.0 })
        };
        let told = |source: NoiseSource, floor_rms: f64| {
            let mut errors = [error(3.0), None, error(1.0)];
            tell_floor(&mut errors, &NoiseFloor { rms: floor_rms, source, samples: 10.0 });
            errors.into_iter().flatten().map(|error| error.in_floor).collect::<Vec<f64>>()
        };
        let average = (9.0 + 1.0) / 3.0;
        for in_floor in told(NoiseSource::QuietQuarter, 5.0) {
            assert!((in_floor - average).abs() < 1e-12, "{in_floor}");
        }
        assert_eq!(told(NoiseSource::QuietQuarter, 0.5), [0.25, 0.25]);
        assert_eq!(told(NoiseSource::Stated, 5.0), [0.0, 0.0]);
    }
}
