//! A model with values for its parameters, run over a recording.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::rc::Rc;

use stillbeam_plant::state_space::Discrete;
use stillbeam_plant::{Hold, InitialState, Model, Motion, Physics, PlantError, StateSpace, force_along};

use crate::adequacy::Resonance;
use crate::parameters::FreeParameter;
use crate::record::Record;

/// Noise of this share of a step makes the mean of rounded readings smooth.
const SMOOTH_DITHER: f64 = 0.1;

/// A model, and how many of its laws were added by the diagnosis.
#[derive(Debug, Clone)]
pub(crate) struct Hypothesis {
    pub(crate) model: Model,
    /// Its first laws are the given model's own, as many as this; the others were added.
    pub(crate) own_laws: usize,
}

impl Hypothesis {
    /// A model as given.
    pub(crate) fn given(model: &Model) -> Self {
        Self { model: model.clone(), own_laws: model.setup().physics.len() }
    }

    /// The same with other values of some parameters; `None` where the model would not be one any more.
    pub(crate) fn with_values(&self, free: &[FreeParameter], values: &[f64]) -> Option<Self> {
        let mut moved = self.clone();
        for (parameter, value) in free.iter().zip(values) {
            moved.model.set_parameter(&parameter.path, *value).ok()?;
        }
        moved.model.check().ok()?;
        Some(moved)
    }

    /// The same with some parameters back at their given values.
    pub(crate) fn with_given(&self, indices: &[usize], free: &[FreeParameter]) -> Option<Self> {
        let chosen: Vec<FreeParameter> = indices.iter().map(|&index| free[index].clone()).collect();
        let values: Vec<f64> = chosen.iter().map(|parameter| parameter.given).collect();
        self.with_values(&chosen, &values)
    }

    /// The same with one more law; its parameters are then at `physics.N.name`, N counting from 1.
    pub(crate) fn with_law(&self, law: Physics) -> Self {
        let mut extended = self.clone();
        extended.model.setup_mut().physics.push(law);
        extended
    }

    /// The same with readings that are not rounded: derivatives of rounded ones are nothing or infinite.
    /// `None` where nothing rounds.
    pub(crate) fn unrounded(&self) -> Option<Self> {
        let value = |law: &Physics, name: &str| law.parameters.get(name).copied().unwrap_or(0.0);
        // Noise before the rounding makes its mean smooth.
        let rounds = |law: &Physics| {
            law.id == "quantisation" && value(law, "dither") < SMOOTH_DITHER * value(law, "step")
        };
        self.model.setup().physics.iter().any(rounds).then(|| {
            let mut smooth = self.clone();
            for law in smooth.model.setup_mut().physics.iter_mut().filter(|law| rounds(law)) {
                law.parameters.insert("step".to_owned(), 0.0);
            }
            smooth
        })
    }

    /// The same with no law at all.
    pub(crate) fn without_laws(&self) -> Self {
        let mut linear = self.clone();
        linear.model.setup_mut().physics.clear();
        linear
    }

    /// The same with the first few of its laws only.
    pub(crate) fn with_first_laws(&self, count: usize) -> Self {
        let mut fewer = self.clone();
        fewer.model.setup_mut().physics.truncate(count);
        fewer
    }

    /// Whether the readings of a column are known to have no offset.
    pub(crate) fn zero_is_known(&self, column: &str) -> bool {
        let mut sensors = self.model.setup().sensors.iter();
        sensors.any(|sensor| sensor.zero_known && sensor.column == column)
    }

    /// Whether initial states only add their free response.
    pub(crate) fn is_linear(&self) -> bool {
        self.model.setup().physics.is_empty()
    }
}

/// Names of the coordinates that an initial state is made of.
fn coordinates(space: &StateSpace) -> Vec<String> {
    space.points().iter().filter(|point| point.is_coordinate).map(|point| point.name.clone()).collect()
}

/// The recorded outputs, simulated, where they have samples. `initial` holds displacement and velocity of
/// every coordinate, on top of the rest that the model starts from.
pub(crate) fn simulate(hypothesis: &Hypothesis, record: &Record, initial: &[f64]) -> Option<Vec<Vec<f64>>> {
    let started = started_at(hypothesis, record, initial)?;
    let model = started.as_ref().unwrap_or(&hypothesis.model);
    record.work.simulated(record.time_s.len());
    let outputs = record.rerun.outputs(model, Some(record.sub_steps.lengths(model))).ok()?;
    at_samples(record, &outputs)
}

/// What the injection points do at the record's stamps; `None` where a simulation does not show it.
pub(crate) fn motion(hypothesis: &Hypothesis, record: &Record, initial: &[f64]) -> Option<Motion> {
    let started = started_at(hypothesis, record, initial)?;
    let model = started.as_ref().unwrap_or(&hypothesis.model);
    record.rerun.motion(model, Some(record.sub_steps.lengths(model))).ok()?
}

/// What a law's force along a motion would change in the recorded outputs; in a closed loop beside what its
/// controller does about that. `None` for what is no force.
pub(crate) fn first_effect(
    hypothesis: &Hypothesis,
    record: &Record,
    law: &Physics,
    motion: &Motion,
) -> Option<Vec<Vec<f64>>> {
    let forces = force_along(&hypothesis.model, law, motion).ok()?;
    if forces.is_empty() {
        return None;
    }
    let mut space = record.rerun.space(&hypothesis.model).ok()?;
    if record.rerun.is_in_loop() {
        space = space.in_loop(hypothesis.model.setup().controller.as_ref()?)?;
    }
    let nothing = vec![0.0; motion.time_s.len()];
    let start = vec![0.0; space.order()];
    let trace = space.run(&motion.time_s, &nothing, Hold::FirstOrder, &forces, &start).ok()?;
    at_samples(record, &trace.outputs)
}

/// The model begun from an initial state on top of its own; `None` inside where that is nothing.
pub(crate) fn started_at(hypothesis: &Hypothesis, record: &Record, initial: &[f64]) -> Option<Option<Model>> {
    if initial.iter().all(|value| *value == 0.0) {
        return Some(None);
    }
    let mut model = hypothesis.model.clone();
    let space = StateSpace::new(&model).ok()?;
    set_initial(&mut model, &space, record, initial)?;
    Some(Some(model))
}

/// Of outputs at all stamps those that were recorded, where they have samples.
pub(crate) fn at_samples(record: &Record, outputs: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    record
        .outputs
        .iter()
        .map(|output| {
            let samples = outputs.get(output.index)?;
            Some(output.at.iter().map(|&k| samples[k]).collect())
        })
        .collect()
}

/// Adds to the initial state of a model, which by default is rest where the input starts.
fn set_initial(model: &mut Model, space: &StateSpace, record: &Record, initial: &[f64]) -> Option<()> {
    let start = record.input.as_ref().and_then(|input| input.first().copied()).unwrap_or(0.0);
    let rest = space.rest_at(start);
    let own = model.setup().initial.clone();
    for (name, pair) in coordinates(space).into_iter().zip(initial.chunks_exact(2)) {
        let (index, _) = space.find_point(&name)?;
        let point = &space.points()[index];
        let before = own.get(&name).copied().unwrap_or(InitialState {
            displacement: point.displacement.read(&rest, start, 0.0),
            velocity: point.velocity.read(&rest, start, 0.0),
        });
        let state =
            InitialState { displacement: before.displacement + pair[0], velocity: before.velocity + pair[1] };
        model.setup_mut().initial.insert(name, state);
    }
    Some(())
}

/// Number of values that an initial state is made of.
pub(crate) fn state_count(hypothesis: &Hypothesis) -> Option<usize> {
    Some(2 * coordinates(&StateSpace::new(&hypothesis.model).ok()?).len())
}

/// The response of every recorded output to a unit of every initial value, the input being zero: displacement
/// and velocity of every coordinate in turn, of the linear model. Last, where there are some, those of real
/// poles: a recording may begin while a base that slides freely still moves.
pub(crate) fn free_responses(hypothesis: &Hypothesis, record: &Record) -> Option<Vec<Vec<Vec<f64>>>> {
    let space = record.rerun.space(&hypothesis.model).ok()?;
    let rest = space.rest_at(0.0);
    let mut steps: HashMap<i64, Rc<Discrete>> = HashMap::new();
    let mut starts = Vec::new();
    for name in coordinates(&space) {
        for unit in [(1.0, 0.0), (0.0, 1.0)] {
            let state = space.state_from(&std::iter::once((name.clone(), unit)).collect(), 0.0).ok()?;
            starts.push(state.iter().zip(&rest).map(|(a, b)| a - b).collect::<Vec<f64>>());
        }
    }
    // Of a modal model, states behind those of the coordinates; one that no output reads changes nothing.
    let behind = if matches!(hypothesis.model, Model::Modal(_)) { starts.len() } else { space.order() };
    for index in behind..space.order() {
        if space.outputs().iter().any(|output| output.row.state.get(index).is_some_and(|share| *share != 0.0))
        {
            let mut start = vec![0.0; space.order()];
            start[index] = 1.0;
            starts.push(start);
        }
    }
    let mut respond = |start: &Vec<f64>| -> Option<Vec<Vec<f64>>> {
        record
            .outputs
            .iter()
            .map(|output| {
                let times: Vec<f64> = output.at.iter().map(|&k| record.time_s[k]).collect();
                free_response(&space, output.index, start, record.time_s[0], &times, &mut steps)
            })
            .collect()
    };
    starts.iter().map(&mut respond).collect()
}

fn free_response(
    space: &StateSpace,
    output: usize,
    start: &[f64],
    start_s: f64,
    times_s: &[f64],
    steps: &mut HashMap<i64, Rc<Discrete>>,
) -> Option<Vec<f64>> {
    let row = &space.outputs().get(output)?.row;
    let mut state = start.to_vec();
    let mut next = Vec::with_capacity(state.len());
    let mut now = start_s;
    let mut response = Vec::with_capacity(times_s.len());
    let mut last: Option<(i64, Rc<Discrete>)> = None;
    for &time_s in times_s {
        let interval_s = time_s - now;
        if interval_s > 0.0 {
            // To the nanosecond, so that stamps that differ by rounding share a step.
            let nanoseconds = (interval_s * 1e9 + 0.5) as i64;
            let step = match last.take().filter(|(length, _)| *length == nanoseconds) {
                Some((_, step)) => step,
                None => step_of(space, nanoseconds, steps)?,
            };
            step.advance(&state, 0.0, 0.0, &mut next);
            last = Some((nanoseconds, step));
            std::mem::swap(&mut state, &mut next);
            now = time_s;
        }
        response.push(row.read(&state, 0.0, 0.0));
    }
    Some(response)
}

/// A step made once.
fn step_of(
    space: &StateSpace,
    nanoseconds: i64,
    steps: &mut HashMap<i64, Rc<Discrete>>,
) -> Option<Rc<Discrete>> {
    if let Some(known) = steps.get(&nanoseconds) {
        return Some(Rc::clone(known));
    }
    let made = Rc::new(space.discretise(nanoseconds as f64 * 1e-9).ok()?);
    steps.insert(nanoseconds, Rc::clone(&made));
    Some(made)
}

/// Lowest and highest frequency at which a model vibrates, hertz; `None` when it does not.
pub(crate) fn frequency_range_hz(model: &Model) -> Result<(Option<f64>, Option<f64>), PlantError> {
    let frequencies: Vec<f64> = oscillating(model)?.iter().map(|(frequency_hz, _)| *frequency_hz).collect();
    Ok((frequencies.iter().copied().reduce(f64::min), frequencies.iter().copied().reduce(f64::max)))
}

/// Modes of the linear part of a model; none where it cannot be simulated.
pub(crate) fn resonances(model: &Model) -> Vec<Resonance> {
    let modes = oscillating(model).unwrap_or_default().into_iter();
    modes.map(|(frequency_hz, width_hz)| Resonance { frequency_hz, width_hz }).collect()
}

/// Natural frequency and half-power width of every mode that oscillates, in hertz.
fn oscillating(model: &Model) -> Result<Vec<(f64, f64)>, PlantError> {
    let eigenvalues = StateSpace::new(model)?.a().complex_eigenvalues();
    let pairs = eigenvalues.iter().filter(|value| value.im > 1e-6 * value.norm() && value.norm() > 0.0);
    Ok(pairs.map(|value| (value.norm() / TAU, -2.0 * value.re / TAU)).collect())
}
