//! A recording made ready: the input on a grid fine enough to simulate from, the outputs as recorded.

use std::f64::consts::TAU;
use std::sync::Arc;

use stillbeam_plant::{Hold, Model, Rerun};
use stillbeam_recording::{Recording, Role};

use crate::between_samples::{BetweenSamples, HELD_PARTS};
use crate::cost::Work;
use crate::error::DiagnoseError;
use crate::reading_step::ReadingStep;
use crate::sub_steps::SubSteps;
use crate::zeros::Zero;

/// The fewest samples of an output that a diagnosis starts from.
const LEAST_SAMPLES: usize = 100;
/// Straight lines between grid points weaken a sine by (pi f / rate)² / 3, 0.09 % at this many points a
/// period, which the grid's values make up for to a hundredth of that.
const POINTS_PER_PERIOD: f64 = 60.0;
/// The same of a fast input, whose every sample costs much: what is left after the values have made up for
/// the lines is 0.01 %.
const FAST_POINTS_PER_PERIOD: f64 = 16.0;
/// The grid is refined at most this often.
const MOST_REFINEMENT: f64 = 16.0;
/// Motions this many times faster than the input's band are left to the exact linear part.
const BEYOND: f64 = 1.6;
/// The input stands still while it is within this share of its greatest change.
const STILL: f64 = 1e-3;
/// Readings of a machine at rest stay within this share of their largest, ...
const AT_REST: f64 = 0.02;
/// ... and show a zero other than nothing where they are so many.
const ENOUGH_AT_REST: usize = 10;

/// One output of one recording.
#[derive(Debug, Clone)]
pub(crate) struct OutputSignal {
    /// Which of the model's outputs.
    pub(crate) index: usize,
    /// Column name.
    pub(crate) column: String,
    /// Which of the record's stamps have a sample, ascending: a camera may be slower than the input's clock.
    pub(crate) at: Vec<usize>,
    /// The samples there are.
    pub(crate) samples: Vec<f64>,
    /// The step that they come in, if they do.
    pub(crate) step: Option<ReadingStep>,
    /// What the sensor reads where nothing moves, if the recording shows it; taken off the samples already.
    pub(crate) zero: Option<Zero>,
}

impl OutputSignal {
    fn of(recording: &Recording, index: usize, column: &str) -> Option<Self> {
        let all = recording.column(column).ok()?;
        let at: Vec<usize> = (0..all.len()).filter(|&k| all[k].is_finite()).collect();
        let samples: Vec<f64> = at.iter().map(|&k| all[k]).collect();
        let step = ReadingStep::of(&samples);
        Some(Self { index, column: column.to_owned(), at, samples, step, zero: None })
    }

    /// With the zero that a velocity's readings show, taken off: they begin at rest, before the input leaves
    /// its first value. An unknown zero beside an unknown first speed takes up what always brakes in one
    /// direction, dry friction above all; what a sensor reads at rest is no unknown.
    fn with_zero_seen(self, input: &[f64]) -> Self {
        let away = |value: &f64| (value - input[0]).abs();
        let most = input.iter().map(away).fold(0.0, f64::max);
        let still = input.iter().take_while(|value| away(value) <= STILL * most).count();
        let seen: Vec<f64> = self.samples[..self.at.partition_point(|stamp| *stamp < still)].to_vec();
        let reach = self.samples.iter().map(|value| value.abs()).fold(0.0, f64::max);
        let rests = |values: &[f64]| {
            let spread = values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
                - values.iter().copied().fold(f64::INFINITY, f64::min);
            !values.is_empty() && spread < AT_REST * reach
        };
        let mean = seen.iter().sum::<f64>() / seen.len().max(1) as f64;
        // A few samples show rest only where they are nothing.
        if !rests(&seen) || (seen.len() < ENOUGH_AT_REST && mean.abs() > AT_REST * reach) {
            return self;
        }
        let samples = self.samples.iter().map(|value| value - mean).collect();
        Self { samples, zero: Some(Zero { mean, samples: seen.len(), moved: 0.0 }), ..self }
    }

    /// Without the samples for which `aside` holds; they are told apart by their place in `samples`.
    pub(crate) fn without(&self, aside: &[usize]) -> Self {
        let kept = |k: &usize| aside.binary_search(k).is_err();
        let places: Vec<usize> = (0..self.at.len()).filter(kept).collect();
        Self {
            at: places.iter().map(|&k| self.at[k]).collect(),
            samples: places.iter().map(|&k| self.samples[k]).collect(),
            ..self.clone()
        }
    }
}

/// An output has all samples of its record but for a few that were set aside where it has this share of them.
const NEARLY: f64 = 0.9;

/// A recording that fits the model.
#[derive(Debug, Clone)]
pub(crate) struct Record {
    pub(crate) name: String,
    pub(crate) role: Role,
    pub(crate) time_s: Vec<f64>,
    /// At `time_s`; `None` for a free decay.
    pub(crate) input: Option<Vec<f64>>,
    /// What the input does between its samples, and into how many parts every interval is cut for it.
    pub(crate) between: (BetweenSamples, usize),
    /// What the plant is simulated over: every interval of `time_s` cut into parts where the input is a
    /// spline.
    pub(crate) rerun: Rerun,
    /// Sub-steps of forces.
    pub(crate) sub_steps: SubSteps,
    pub(crate) outputs: Vec<OutputSignal>,
    /// What modes beyond those of the model follow, at `time_s`, where their share of the outputs is freed.
    pub(crate) remainder: Vec<Vec<f64>>,
    /// Where its simulations are counted.
    pub(crate) work: Arc<Work>,
    /// Whether it was cut out of a longer one: rest is no state to begin from then.
    pub(crate) begins_moving: bool,
}

impl Record {
    /// Checks a recording against the model and readies it. `slowest_hz` and `fastest_hz` are the model's
    /// lowest and highest frequencies, if it has any.
    pub(crate) fn new(
        recording: &Recording,
        role: Role,
        model: &Model,
        slowest_hz: Option<f64>,
        fastest_hz: Option<f64>,
    ) -> Result<Self, DiagnoseError> {
        let needed = needed_columns(model);
        let column_error = |source| DiagnoseError::Column { source, needed: needed.clone() };
        recording.check().map_err(column_error)?;
        let input = match model.input() {
            None => None,
            Some(input) => {
                let samples = recording.column(&input.column).map_err(column_error)?;
                check_input(recording, &input.column, samples)?;
                Some(samples.to_vec())
            }
        };
        let mut outputs = outputs_of(recording, model)?;
        if let Some(input) = input.as_deref().filter(|_| !model.input_is_motion()) {
            let is_velocity = |output: &OutputSignal| model.output_is_velocity(output.index);
            let seen = |output: OutputSignal| {
                if is_velocity(&output) { output.with_zero_seen(input) } else { output }
            };
            outputs = outputs.into_iter().map(seen).collect();
        }
        for output in &outputs {
            check_output(recording, output, slowest_hz)?;
        }
        let rate_hz = 1.0 / recording.median_interval_s();
        let band_hz = band_hz(recording, input.as_deref(), fastest_hz);
        let guessed = |samples: &[f64]| BetweenSamples::of(&recording.time_s, samples);
        let between = BetweenSamples::stated(model)
            .unwrap_or_else(|| input.as_deref().map_or(BetweenSamples::Lines, guessed));
        let refinement = refinement(between, band_hz / rate_hz, model);
        let grid = fine_grid(recording, model, input.as_deref(), (between, refinement));
        let rerun = rerun_of(&grid, model, (between, refinement), input.as_deref())?;
        let is_driven = input.is_some();
        Ok(Self {
            name: recording.name.clone(),
            role,
            time_s: recording.time_s.clone(),
            input,
            between: (between, refinement),
            rerun,
            sub_steps: SubSteps::new(band_hz, is_driven),
            outputs,
            remainder: Vec::new(),
            work: Arc::default(),
            begins_moving: false,
        })
    }

    /// The same with every `nth` sample of its outputs; the input is followed at its own rate. Nothing is
    /// filtered: what a sensor did to a sample it did to those that are kept. The same where an output has
    /// samples of its own times; a few that were set aside are none.
    pub(crate) fn thinned(&self, nth: usize) -> Self {
        let is_nearly_full =
            |output: &OutputSignal| output.at.len() as f64 > NEARLY * self.time_s.len() as f64;
        if nth < 2 || !self.outputs.iter().all(is_nearly_full) {
            return self.clone();
        }
        let every = |samples: &[f64]| samples.iter().step_by(nth).copied().collect::<Vec<f64>>();
        let outputs = self.outputs.iter().map(|output| {
            let kept = output.at.iter().zip(&output.samples).filter(|(at, _)| at.is_multiple_of(nth));
            let (at, samples) = kept.map(|(at, sample)| (at / nth, *sample)).unzip();
            OutputSignal { at, samples, ..output.clone() }
        });
        Self {
            input: self.input.as_deref().map(every),
            rerun: self.rerun.thinned(nth),
            outputs: outputs.collect(),
            remainder: self.remainder.iter().map(|column| every(column)).collect(),
            time_s: every(&self.time_s),
            ..self.clone()
        }
    }

    /// The same with another guess of what the input does between its samples; `None` where that is not
    /// asked: nothing drives, or a controller does.
    pub(crate) fn between(
        &self,
        between: BetweenSamples,
        model: &Model,
        fastest_hz: Option<f64>,
    ) -> Option<Self> {
        let input = self.input.as_deref().filter(|_| !self.rerun.is_in_loop())?;
        let recording = Recording::new(self.name.clone(), self.time_s.clone());
        let band_hz = band_hz(&recording, Some(input), fastest_hz);
        let refinement = refinement(between, band_hz * recording.median_interval_s(), model);
        let grid = fine_grid(&recording, model, Some(input), (between, refinement));
        let rerun = rerun_of(&grid, model, (between, refinement), Some(input)).ok()?;
        Some(Self { rerun, between: (between, refinement), ..self.clone() })
    }

    /// The same run under another input, at the stamps.
    pub(crate) fn driven_by(&self, samples: &[f64]) -> Rerun {
        let (between, refinement) = self.between;
        let rerun = self.rerun.with_input(between.refined(&self.time_s, samples, refinement));
        if refinement > 1 { rerun.with_true_input(samples) } else { rerun }
    }

    /// Times of the samples of an output.
    pub(crate) fn times_s(&self, output: usize) -> Vec<f64> {
        self.outputs[output].at.iter().map(|&k| self.time_s[k]).collect()
    }

    /// Samples per second of an output.
    pub(crate) fn rate_hz(&self, output: usize) -> f64 {
        let count = self.outputs[output].at.len();
        if count > 1 && self.duration_s() > 0.0 { (count - 1) as f64 / self.duration_s() } else { 1.0 }
    }

    /// The same machine's run with this share (0 to 1) of its readings, from its beginning.
    pub(crate) fn up_to(&self, share: f64) -> Self {
        let end_s = self.time_s.first().copied().unwrap_or(0.0) + share * self.duration_s();
        let outputs = self.outputs.iter().map(|output| {
            let aside: Vec<usize> =
                (0..output.at.len()).filter(|&place| self.time_s[output.at[place]] > end_s).collect();
            output.without(&aside)
        });
        Self { outputs: outputs.collect(), ..self.clone() }
    }

    /// Pieces of this share (0 to 1), `most` at most and spread evenly, as records of their own that begin in
    /// motion; `None` where there are fewer than two, or one cannot be read, and in a loop, whose controller
    /// has a state too.
    pub(crate) fn pieces(
        &self,
        share: f64,
        most: usize,
        model: &Model,
        fastest_hz: Option<f64>,
    ) -> Option<Vec<Self>> {
        if self.rerun.is_in_loop() {
            return None;
        }
        let ready = |piece: &Recording| {
            let ready = Self::new(piece, self.role, model, None, fastest_hz).ok()?;
            let as_here = ready.between.0 == self.between.0;
            let ready = if as_here { ready } else { ready.between(self.between.0, model, fastest_hz)? };
            Some(Self { begins_moving: true, work: Arc::clone(&self.work), ..ready })
        };
        self.recorded_pieces(share, most, model)?.iter().map(ready).collect()
    }

    fn recorded_pieces(&self, share: f64, most: usize, model: &Model) -> Option<Vec<Recording>> {
        let stamps = (share * self.time_s.len() as f64) as usize;
        let count = ((1.0 / share) as usize).min(most);
        if count < 2 {
            return None;
        }
        let last = self.time_s.len().checked_sub(stamps)?;
        let first = |number: usize| number * last / (count - 1);
        let piece = |number: usize| {
            let range = first(number)..first(number) + stamps;
            let name = format!("{} from {:.3} s", self.name, self.time_s.get(range.start)?);
            let mut piece = Recording::new(name, self.time_s[range.clone()].to_vec());
            for output in &self.outputs {
                let mut samples = vec![f64::NAN; stamps];
                let places = output.at.iter().zip(&output.samples).filter(|(at, _)| range.contains(at));
                places.for_each(|(at, value)| samples[at - range.start] = *value);
                piece = piece.with_column(output.column.clone(), samples);
            }
            if let (Some(input), Some(described)) = (&self.input, model.input()) {
                piece = piece.with_column(described.column.clone(), input[range].to_vec());
            }
            Some(piece)
        };
        (0..count).map(piece).collect()
    }

    /// Length in seconds.
    pub(crate) fn duration_s(&self) -> f64 {
        match self.time_s.as_slice() {
            [first, .., last] => last - first,
            _ => 0.0,
        }
    }
}

/// Into how many parts every interval of an input is cut, whose band is this share of the sampling rate.
fn refinement(between: BetweenSamples, band: f64, model: &Model) -> usize {
    let refinement = |points: f64| (points * band).ceil().clamp(1.0, MOST_REFINEMENT) as usize;
    match between {
        BetweenSamples::Lines => 1,
        BetweenSamples::Spline => refinement(POINTS_PER_PERIOD),
        BetweenSamples::BandLimited => refinement(FAST_POINTS_PER_PERIOD),
        // A servo is told in parts of an interval; what drives at once is held by the simulation itself.
        BetweenSamples::Held if model.input_is_motion() => HELD_PARTS,
        BetweenSamples::Held => 1,
    }
}

fn rerun_of(
    grid: &Recording,
    model: &Model,
    (between, refinement): (BetweenSamples, usize),
    input: Option<&[f64]>,
) -> Result<Rerun, DiagnoseError> {
    let rerun = Rerun::new(grid, model, refinement)
        .map_err(|source| DiagnoseError::Simulation { recording: grid.name.clone(), source })?;
    let is_held = between == BetweenSamples::Held && refinement == 1;
    let rerun = if is_held { rerun.with_hold(Hold::ZeroOrder) } else { rerun };
    Ok(match input {
        Some(samples) if refinement > 1 => rerun.with_true_input(samples),
        _ => rerun,
    })
}

/// Every column that the model names.
fn needed_columns(model: &Model) -> Vec<String> {
    let mut columns: Vec<String> = model.input().map(|input| input.column.clone()).into_iter().collect();
    columns.extend(model.output_columns());
    columns
}

fn check_input(recording: &Recording, column: &str, samples: &[f64]) -> Result<(), DiagnoseError> {
    if let Some(index) = samples.iter().position(|value| value.is_nan()) {
        let source = stillbeam_plant::PlantError::InputGap {
            recording: recording.name.clone(),
            column: column.to_owned(),
            row: index + 2,
        };
        return Err(DiagnoseError::Simulation { recording: recording.name.clone(), source });
    }
    let value = samples.first().copied().unwrap_or(0.0);
    if samples.iter().all(|sample| *sample == value) {
        let (recording, column) = (recording.name.clone(), column.to_owned());
        return Err(DiagnoseError::FlatInput { recording, column, value });
    }
    Ok(())
}

/// The model's outputs that are recorded; an output that is the input itself says nothing.
fn outputs_of(recording: &Recording, model: &Model) -> Result<Vec<OutputSignal>, DiagnoseError> {
    let input = model.input().map(|input| input.column.as_str());
    let wanted: Vec<(usize, String)> = model
        .output_columns()
        .into_iter()
        .enumerate()
        .filter(|(_, column)| Some(column.as_str()) != input)
        .collect();
    let outputs: Vec<OutputSignal> =
        wanted.iter().filter_map(|(index, column)| OutputSignal::of(recording, *index, column)).collect();
    if outputs.is_empty() {
        return Err(DiagnoseError::NoOutput {
            recording: recording.name.clone(),
            outputs: wanted.into_iter().map(|(_, column)| column).collect(),
            present: recording.column_names(),
        });
    }
    Ok(outputs)
}

fn check_output(
    recording: &Recording,
    output: &OutputSignal,
    slowest_hz: Option<f64>,
) -> Result<(), DiagnoseError> {
    let (found, duration_s) = (output.samples.len(), recording.duration_s());
    let required_s = slowest_hz.filter(|frequency_hz| *frequency_hz > 0.0).map_or(0.0, |hz| 3.0 / hz);
    if found < LEAST_SAMPLES || duration_s < required_s {
        return Err(DiagnoseError::TooShort {
            recording: recording.name.clone(),
            column: output.column.clone(),
            found,
            required: LEAST_SAMPLES,
            duration_s,
            required_s,
        });
    }
    let value = output.samples.first().copied().unwrap_or(0.0);
    if output.samples.iter().all(|sample| *sample == value) {
        let (recording, column) = (recording.name.clone(), output.column.clone());
        return Err(DiagnoseError::FlatOutput { recording, column, value });
    }
    Ok(())
}

/// Highest frequency at which anything of note moves: that of the model's fastest motion, but not far beyond
/// the input's band, where a lightly damped motion stays small and a simulation that is exact for the linear
/// part follows it in any case.
fn band_hz(recording: &Recording, input: Option<&[f64]>, fastest_hz: Option<f64>) -> f64 {
    let fastest_hz = fastest_hz.unwrap_or(0.0);
    match input {
        Some(samples) => {
            let driven_hz = highest_frequency_hz(recording, samples);
            fastest_hz.min(BEYOND * driven_hz).max(driven_hz)
        }
        None => fastest_hz,
    }
}

/// A rough upper end of the input's band: from the power of its changes, weighted to where they are fastest.
fn highest_frequency_hz(recording: &Recording, samples: &[f64]) -> f64 {
    let rate_hz = 1.0 / recording.median_interval_s();
    let first: f64 = samples.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum();
    let second: f64 = samples.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).powi(2)).sum();
    if first > 0.0 { (second / first).sqrt() * rate_hz / TAU } else { 0.0 }
}

/// With the reference of the model's controller, straight between its samples, if it was recorded throughout:
/// the loop is then simulated.
fn with_reference(grid: Recording, recording: &Recording, model: &Model, refinement: usize) -> Recording {
    let Some(controller) = &model.setup().controller else { return grid };
    let name = &controller.reference_column;
    let Some(samples) = recording.column(name).ok().filter(|s| s.iter().all(|value| value.is_finite()))
    else {
        return grid;
    };
    let fine = BetweenSamples::Lines.refined(&recording.time_s, samples, refinement);
    grid.with_column(name.clone(), fine)
}

/// The input on the fine grid, as a recording to simulate over; zeros where the model has no input.
fn fine_grid(
    recording: &Recording,
    model: &Model,
    input: Option<&[f64]>,
    (between, refinement): (BetweenSamples, usize),
) -> Recording {
    let mut time_s = Vec::with_capacity(recording.len() * refinement);
    for pair in recording.time_s.windows(2) {
        let part_s = (pair[1] - pair[0]) / refinement as f64;
        time_s.extend((0..refinement).map(|part| pair[0] + part as f64 * part_s));
    }
    time_s.extend(recording.time_s.last());
    let grid = Recording::new(recording.name.clone(), time_s);
    let grid = with_reference(grid, recording, model, refinement);
    match (model.input(), input) {
        (Some(described), Some(samples)) => {
            let fine = between.refined(&recording.time_s, samples, refinement);
            grid.with_column(described.column.clone(), fine)
        }
        // A recording has a column at least; nothing drives a free decay.
        _ => {
            let nothing = vec![0.0; grid.len()];
            grid.with_column("force_N", nothing)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn speeds(samples: Vec<f64>) -> OutputSignal {
        let at = (0..samples.len()).collect();
        OutputSignal { index: 0, column: "speed_rad_s".to_owned(), at, samples, step: None, zero: None }
    }

    /// A command that begins after `still` samples, and speeds that follow it from `zero` on.
    fn started(still: usize, zero: f64) -> (Vec<f64>, OutputSignal) {
        let command = (0..500).map(|k| if k < still { 0.0 } else { 1.0 }).collect();
        let speed = |k: usize| 100.0 * (1.0 - (-(k.saturating_sub(still) as f64) / 50.0).exp());
        let ripple = |k: usize| 0.1 * (2.1 * k as f64).sin();
        (command, speeds((0..500).map(|k| zero + speed(k) + ripple(k)).collect()))
    }

    #[test]
    fn the_zero_of_a_speed_is_what_it_reads_at_rest() {
        for (still, zero, seen) in [(60, 0.3, true), (60, -25.0, true), (1, 0.2, true), (1, -25.0, false)] {
            let (command, speeds) = started(still, zero);
            let found = speeds.clone().with_zero_seen(&command);
            assert_eq!(found.zero.is_some(), seen, "{still} samples at {zero}");
            let off = found.zero.map_or(0.0, |found| (found.mean - zero).abs());
            assert!(off < 0.12, "{off}");
            let taken_off = found.zero.map_or(0.0, |found| found.mean);
            let same =
                found.samples.iter().zip(&speeds.samples).all(|(a, b)| (a + taken_off - b).abs() < 1e-12);
            assert!(same, "the samples are less their zero");
        }
    }

    #[test]
    fn a_speed_that_a_recording_begins_with_is_no_zero() {
        let (command, speeds) = started(60, 0.0);
        let coasting = |k: usize| 60.0 * (-(k as f64) / 80.0).exp();
        let moving = OutputSignal {
            samples: speeds.samples.iter().enumerate().map(|(k, speed)| speed + coasting(k)).collect(),
            ..speeds
        };
        assert_eq!(moving.with_zero_seen(&command).zero, None);
    }

    #[test]
    fn samples_that_were_set_aside_are_not_there_when_every_nth_is_kept() {
        let text = "schema = 1\nkind = \"modal\"\nmode = [{ frequency_hz = 2.0, damping_ratio = 0.02, participation = [1.0] }]\n\
                    input = { column = \"force_N\" }\noutput = [{ column = \"tip_m\" }]";
        let model = Model::from_toml("mode.toml", text).unwrap();
        let time_s: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
        let wave: Vec<f64> = time_s.iter().map(|t| (9.0 * t).sin()).collect();
        let recording = Recording::new("run", time_s)
            .with_column("force_N", wave.clone())
            .with_column("tip_m", wave.clone());
        let mut record = Record::new(&recording, Role::Train, &model, Some(2.0), Some(2.0)).unwrap();
        let output = &mut record.outputs[0];
        for place in [101, 100] {
            output.at.remove(place);
            output.samples.remove(place);
        }
        let thin = record.thinned(5);
        assert_eq!((thin.time_s.len(), thin.outputs[0].at.len()), (40, 39));
        for (at, sample) in thin.outputs[0].at.iter().zip(&thin.outputs[0].samples) {
            assert_eq!(*sample, wave[5 * at]);
        }
        record.outputs[0].at.truncate(50);
        record.outputs[0].samples.truncate(50);
        assert_eq!(record.thinned(5).time_s.len(), 200, "an output that is sampled seldom stays whole");
    }
}
