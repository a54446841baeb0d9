//! A model run over a whole recording.

use serde::{Deserialize, Serialize};
use stillbeam_recording::Recording;

use crate::advances::Advances;
use crate::catalogue::{Action, action};
use crate::error::PlantError;
use crate::model::{DriveLimits, FORCE, Model, Sensor};
use crate::nonlinear::{Dense, Look, Machine, Run, Sensing};
use crate::prescribed_base::ModalState;
use crate::stamps::Stamps;
use crate::state_space::StateSpace;

/// What a force does between two samples. A motion of the base always goes in straight lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Hold {
    /// A straight line to the next sample: a force that was measured.
    #[default]
    #[serde(rename = "first", alias = "first_order")]
    FirstOrder,
    /// The same until the next sample: a force that a digital controller put out.
    #[serde(rename = "zero", alias = "zero_order")]
    ZeroOrder,
}

/// Whether a controller that the model has is run in closed loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Feedback {
    /// In closed loop if the model has a controller and the recording its reference.
    #[default]
    IfPossible,
    /// Never: the recorded input is used as it is.
    Open,
}

/// How a recording is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SimulateOptions {
    /// What a force does between samples.
    pub hold: Hold,
    /// Rate of the output samples in hertz, counted from the first input sample; `None`: at the input's
    /// times.
    pub output_rate_hz: Option<f64>,
    /// Closed loop or open.
    pub feedback: Feedback,
    /// Whether the model's sensors add their noise; without it a simulation is what the sensor would read on
    /// average.
    pub sensor_noise: bool,
    /// Another seed is another draw of that noise, for every sensor; 0 is the draw of the sensors' own seeds.
    pub noise_seed: u64,
    /// The longest sub-step between samples, seconds, for a model with left-out physics. A law that needs
    /// shorter ones takes its share of it (a play a quarter). Half of it quarters the error. `None` begins
    /// with what the plant's fastest motion asks, and halves it until that changes no output by more than a
    /// millionth of its largest value, four times at most.
    pub longest_step_s: Option<f64>,
}

/// Runs the model over the recording's input column, with a force held first-order and outputs at the input's
/// times. See [`simulate_with`].
///
/// # Errors
/// As [`simulate_with`].
pub fn simulate(model: &Model, recording: &Recording) -> Result<Recording, PlantError> {
    simulate_with(model, recording, &SimulateOptions::default())
}

/// Runs the model over the recording's input column.
///
/// The plant is at rest up to the first sample: a force is zero before it, a base has been standing where it
/// starts. The result has the input's column, then the model's outputs, at the input's times or at the
/// output rate; its name is the recording's with `, simulated`. Between samples nothing is approximated, so
/// the outputs depend on neither the input's nor the output's rate, beyond what [`Hold`] says.
///
/// Left-out physics, sensors and a controller take the plant through sub-steps
/// ([`SimulateOptions::longest_step_s`]); the linear part stays exact, forces are of second order.
///
/// A velocity output under base motion is the mean of the two speeds at a tick, where it jumps.
///
/// # Errors
/// [`PlantError::NoInput`] for a free-decay model; [`PlantError::Recording`] when the column (or the
/// controller's reference) is missing or the recording malformed; [`PlantError::InputGap`];
/// [`PlantError::Rate`] and [`PlantError::OutputSize`] for the output rate; [`PlantError::Invalid`],
/// [`PlantError::Degenerate`] and [`PlantError::TooFast`] for the model.
pub fn simulate_with(
    model: &Model,
    recording: &Recording,
    options: &SimulateOptions,
) -> Result<Recording, PlantError> {
    model.check()?;
    let input = model.input().ok_or(PlantError::NoInput)?;
    let is_held = options.hold == Hold::ZeroOrder || input.hold == Some(Hold::ZeroOrder);
    let zero_order = is_held && !model.input_is_motion();
    let reference = match &model.setup().controller {
        Some(controller) if options.feedback == Feedback::IfPossible => {
            recording.column(&controller.reference_column).ok().map(|samples| (controller, samples))
        }
        _ => None,
    };
    let stamps = Stamps::new(&recording.time_s);
    let (driven_by, samples) = match reference {
        Some((controller, samples)) => (&controller.reference_column, samples),
        None => (&input.column, recording.column(&input.column)?),
    };
    check_input(recording, driven_by, samples)?;
    let output_s = match options.output_rate_hz {
        None => stamps.to_vec(),
        Some(rate_hz) => stamps.resampled(rate_hz)?,
    };
    let columns = if reference.is_none() && is_linear(model)? {
        let space = StateSpace::new(model)?;
        let initial = space.initial(model, samples.first().copied().unwrap_or(0.0))?;
        run(&space, initial, &Line { stamps, samples, zero_order }, &output_s)?
    } else {
        let closed = reference.map(|(_, samples)| (recording.time_s.as_slice(), samples));
        let open = if closed.is_some() { &[] } else { samples };
        run_machine(model, &stamps, open, closed, zero_order, &output_s, options)?
    };
    let time_s = match options.output_rate_hz {
        None => recording.time_s.clone(),
        Some(_) => output_s,
    };
    let mut result = Recording::new(format!("{}, simulated", recording.name), time_s);
    if let Some((controller, samples)) = reference
        && options.output_rate_hz.is_none()
    {
        result = result.with_column(controller.reference_column.clone(), samples.to_vec());
    }
    result = result.with_column(input.column.clone(), columns.input);
    for (column, samples) in model.output_columns().into_iter().zip(columns.outputs) {
        // A beam's base position may be its input, handed through.
        if column != input.column {
            result = result.with_column(column, samples);
        }
    }
    Ok(result)
}

impl Model {
    /// Whether nothing but the linear plant lies between input and outputs: no left-out physics but linear
    /// one, no controller, no sensors, no limits of the drive.
    pub fn is_linear(&self) -> bool {
        self.setup().controller.is_none() && is_linear(self).unwrap_or(false)
    }
}

/// The same, a controller apart.
pub(crate) fn is_linear(model: &Model) -> Result<bool, PlantError> {
    let linear = |physics| Ok::<_, PlantError>(matches!(action(model, physics, 0.0)?, Action::Structure(_)));
    for physics in &model.setup().physics {
        if !linear(physics)? {
            return Ok(false);
        }
    }
    let setup = model.setup();
    Ok(setup.drive_limits == DriveLimits::default() && setup.sensors.iter().all(Sensor::is_ideal))
}

/// Runs a model with left-out physics, a controller or sensors.
fn run_machine(
    model: &Model,
    stamps: &Stamps<'_>,
    input: &[f64],
    closed: Option<(&[f64], &[f64])>,
    zero_order: bool,
    output_s: &[f64],
    options: &SimulateOptions,
) -> Result<Columns, PlantError> {
    let sensing = Sensing::new(model)?;
    let hold = if zero_order { Hold::ZeroOrder } else { Hold::FirstOrder };
    // What is wanted at stamps only needs no sub-step kept: there may be millions of them.
    let every = match options.output_rate_hz {
        None => Some(1),
        Some(_) if zero_order => None,
        Some(_) => stamps.per_output(output_s),
    };
    let resampled = every.is_none();
    let between = resampled || sensing.looks_between();
    let looks = (every.unwrap_or(1), between);
    let run = plant_run(model, stamps, (input, hold), closed, looks, options.longest_step_s)?;
    let at_stamps = |samples: &[f64]| run.stamps.iter().map(|&index| samples[index]).collect::<Vec<f64>>();
    let noise_seed = options.sensor_noise.then_some(options.noise_seed);
    let read = |index: usize, samples: &[f64]| {
        if sensing.is_ideal() && !resampled {
            return at_stamps(samples);
        }
        let dense = Dense { time_s: &run.time_s, samples, base: &run.base };
        sensing.recorded(index, &dense, output_s, noise_seed)
    };
    let outputs = run.outputs.iter().enumerate().map(|(index, samples)| read(index, samples)).collect();
    let input = if resampled {
        let dense = Dense { time_s: &run.time_s, samples: &run.input, base: &run.base };
        let mut place = 0;
        output_s.iter().map(|&time_s| dense.before(time_s, &mut place, zero_order)).collect()
    } else {
        // A run that is not dense does not keep what goes into it unchanged.
        if run.input.is_empty() {
            input.iter().step_by(looks.0).copied().collect()
        } else {
            at_stamps(&run.input)
        }
    };
    Ok(Columns { input, outputs })
}

/// The plant over the stamps, looked at every so often or, if the second of `looks` is set, in every sub-step
/// too; in sub-steps of this length or, where none is given, fine ones.
fn plant_run(
    model: &Model,
    stamps: &Stamps<'_>,
    (input, hold): (&[f64], Hold),
    closed: Option<(&[f64], &[f64])>,
    (every, between): (usize, bool),
    longest_step_s: Option<f64>,
) -> Result<Run, PlantError> {
    let start = input.first().copied().unwrap_or(0.0);
    let machine = || Machine::new(model, start, closed, longest_step_s, None);
    let is_held = hold == Hold::ZeroOrder;
    if let Some(step_s) = longest_step_s {
        if step_s <= 0.0 || step_s.is_nan() {
            return Err(PlantError::Rate { found_hz: 1.0 / step_s });
        }
        let mut run = machine()?.run(stamps, input, is_held, between)?;
        run.stamps = run.stamps.into_iter().step_by(every).collect();
        return Ok(run);
    }
    in_fine_steps(|halvings| {
        let machine = machine()?.with_halvings(halvings);
        if between {
            let mut run = machine.run(stamps, input, is_held, true)?;
            run.stamps = run.stamps.into_iter().step_by(every).collect();
            return Ok(run);
        }
        let look = Look { every, between, smooth_s: Some(machine.longest_step_s()) };
        machine.run_lean(stamps, (input, hold), look)
    })
}

/// Halvings of the sub-steps at most: a machine that chatters settles at no length.
const MOST_HALVINGS: u32 = 4;
/// Sub-steps that are kept at most for the sake of another halving.
const MOST_KEPT: usize = 4_000_000;

/// A run whose steps, halved once more, change nothing; `run_in` makes one in steps halved so often.
fn in_fine_steps(run_in: impl Fn(u32) -> Result<Run, PlantError>) -> Result<Run, PlantError> {
    let mut run = run_in(0)?;
    for halvings in 1..=MOST_HALVINGS {
        if 2 * run.time_s.len() > MOST_KEPT {
            break;
        }
        let finer = run_in(halvings)?;
        let is_settled = finer.is_near(&run);
        run = finer;
        if is_settled {
            break;
        }
    }
    Ok(run)
}

/// The free vibration from given modal states (at the first of `time_s`), the base held or the force zero.
///
/// `time_s` are seconds, strictly increasing. The result has the model's outputs.
///
/// # Errors
/// [`PlantError::InitialStates`] unless there is one state per mode; [`PlantError::Recording`] when the times
/// do not increase or are fewer than a recording needs; [`PlantError::Invalid`], [`PlantError::Degenerate`]
/// and [`PlantError::TooFast`] for the model.
pub fn free_decay(model: &Model, initial: &[ModalState], time_s: Vec<f64>) -> Result<Recording, PlantError> {
    let space = StateSpace::held(model)?;
    let mut state: Vec<f64> = initial.iter().flat_map(|state| [state.displacement, state.velocity]).collect();
    // What is beside the modes, a base that slides freely, starts at rest.
    let is_mode = |point: &&crate::state_space::InjectionPoint| point.name.starts_with("mode ");
    let modes = match model {
        Model::Modal(_) => space.points().iter().filter(is_mode).count(),
        _ => space.system.value.len() / 2,
    };
    if state.len() == 2 * modes {
        state.resize(space.system.value.len(), 0.0);
    }
    if state.len() != space.system.value.len() {
        let found = initial.len();
        return Err(PlantError::InitialStates { modes, found });
    }
    let mut result = Recording::new("free decay, simulated", time_s);
    let samples = vec![0.0; result.len()];
    let probe = result.clone().with_column(FORCE, samples.clone());
    probe.check()?;
    let line = Line { stamps: Stamps::new(&result.time_s), samples: &samples, zero_order: true };
    let columns = run(&space, state, &line, &line.stamps.to_vec())?;
    for (readout, samples) in space.outputs().iter().zip(columns.outputs) {
        result = result.with_column(readout.column.clone(), samples);
    }
    Ok(result)
}

/// The input as a function of time.
struct Line<'a> {
    stamps: Stamps<'a>,
    samples: &'a [f64],
    zero_order: bool,
}

impl Line<'_> {
    /// Slope of the stretch that starts at sample `index`; zero for the last, which starts none.
    fn slope(&self, index: usize) -> f64 {
        let ends = self.samples.get(index..index + 2);
        match (self.stamps.interval_s(index), ends) {
            (Some(interval_s), Some(&[from, to])) if !self.zero_order => (to - from) / interval_s,
            _ => 0.0,
        }
    }
}

struct Columns {
    input: Vec<f64>,
    outputs: Vec<Vec<f64>>,
}

impl Columns {
    fn push(&mut self, space: &StateSpace, state: &[f64], u: f64, slope: f64) {
        self.input.push(u);
        for (readout, samples) in space.outputs().iter().zip(&mut self.outputs) {
            samples.push(readout.row.read(state, u, slope));
        }
    }
}

/// Walks along the input, stretch by stretch, and looks aside at every output time.
fn run(
    space: &StateSpace,
    mut state: Vec<f64>,
    line: &Line<'_>,
    output_s: &[f64],
) -> Result<Columns, PlantError> {
    let mut advances = Advances::new(&space.system);
    let mut scratch = Vec::with_capacity(state.len());
    let mut aside = Vec::with_capacity(state.len());
    let mut columns = Columns {
        input: Vec::with_capacity(output_s.len()),
        outputs: vec![Vec::with_capacity(output_s.len()); space.outputs().len()],
    };
    let mut output_s = output_s.iter().copied().peekable();
    let mut slope_before = 0.0;
    for (index, &u) in line.samples.iter().enumerate() {
        let interval_s = line.stamps.interval_s(index);
        let start_s = line.stamps.at(index);
        let slope = line.slope(index);
        // The last sample answers for whatever rounding has put just beyond it.
        let (end_s, close_s) = match interval_s {
            Some(interval_s) => (start_s + interval_s, 1e-9 * interval_s),
            None => (f64::INFINITY, f64::INFINITY),
        };
        while let Some(time_s) = output_s.next_if(|&time_s| time_s + close_s.min(1.0) < end_s) {
            let past_s = time_s - start_s;
            if past_s <= close_s {
                let at_tick = match interval_s {
                    Some(_) => 0.5 * (slope_before + slope),
                    None => slope_before,
                };
                columns.push(space, &state, u, at_tick);
            } else {
                aside.clone_from(&state);
                let advance = advances.partial(past_s)?;
                advance.apply(&mut aside, &mut scratch, u, slope);
                columns.push(space, &aside, u + slope * past_s, slope);
            }
        }
        if let Some(interval_s) = interval_s {
            let advance = advances.whole(interval_s)?;
            advance.apply(&mut state, &mut scratch, u, slope);
        }
        slope_before = slope;
    }
    Ok(columns)
}

/// Whether an input can be simulated from: well-formed stamps and a value at each of them.
pub(crate) fn check_input(recording: &Recording, column: &str, samples: &[f64]) -> Result<(), PlantError> {
    recording.check()?;
    match samples.iter().position(|sample| sample.is_nan()) {
        None => Ok(()),
        Some(index) => Err(PlantError::InputGap {
            recording: recording.name.clone(),
            column: column.to_owned(),
            row: index + 2,
        }),
    }
}
