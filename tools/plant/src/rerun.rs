//! One recording, simulated again and again with models that differ: what a fit does thousands of times.

use std::sync::Arc;

use stillbeam_recording::Recording;

use crate::advances::Advances;
use crate::blocks::Blocks;
use crate::error::PlantError;
use crate::linear::{Advance, dot};
use crate::model::{Model, Physics};
use crate::nonlinear::{Dense, Guide, Look, Machine, Sensing, elements, passed, signals};
use crate::simulate::{Hold, check_input, is_linear};
use crate::stamps::Stamps;
use crate::state_space::{ForceSeries, StateSpace};

/// A recording's input, checked once, and the stamps at which outputs are wanted.
///
/// [`Rerun::outputs`] computes what [`simulate()`](crate::simulate()) computes in steps of the same length,
/// to rounding and without copies, checks of the recording and columns.
#[derive(Debug, Clone)]
pub struct Rerun {
    time_s: Vec<f64>,
    input: Vec<f64>,
    reference: Option<Vec<f64>>,
    every: usize,
    /// What the input does between its samples.
    hold: Hold,
    /// What an output that shows the input itself has to be corrected by, one sample per wanted stamp.
    unseen: Option<Vec<f64>>,
    /// What holds the machine to the recorded motion.
    guide: Option<Arc<Guide>>,
}

/// How long the steps are between which the forces of laws are taken anew.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepLengths {
    /// The longest where forces are not smooth, seconds: a contact is met, dry friction turns round. As
    /// [`SimulateOptions::longest_step_s`](crate::SimulateOptions::longest_step_s).
    pub short_s: f64,
    /// The longest where they are, seconds; `None`: as where they are not.
    pub smooth_s: Option<f64>,
    /// How often all steps are halved beside: once makes a quarter of the error, at most.
    pub halvings: u32,
}

impl Rerun {
    /// Prepares a recording for models with this input and controller; outputs are wanted at every `every`-th
    /// time stamp (1 or more), from the first on. A model without input is simulated without force.
    ///
    /// # Errors
    /// [`PlantError::Recording`] when the input's column is missing or the recording malformed;
    /// [`PlantError::InputGap`].
    pub fn new(recording: &Recording, model: &Model, every: usize) -> Result<Self, PlantError> {
        let input = match model.input() {
            Some(input) => {
                let samples = recording.column(&input.column)?;
                check_input(recording, &input.column, samples)?;
                samples.to_vec()
            }
            None => {
                recording.check()?;
                vec![0.0; recording.len()]
            }
        };
        let controller = model.setup().controller.as_ref();
        let reference = controller.and_then(|controller| {
            let samples = recording.column(&controller.reference_column).ok()?;
            check_input(recording, &controller.reference_column, samples).is_ok().then(|| samples.to_vec())
        });
        let time_s = recording.time_s.clone();
        Ok(Self {
            time_s,
            input,
            reference,
            every: every.max(1),
            hold: Hold::FirstOrder,
            unseen: None,
            guide: None,
        })
    }

    /// With an input that does this between its samples; a straight line if nothing is said.
    #[must_use]
    pub fn with_hold(self, hold: Hold) -> Self {
        Self { hold, ..self }
    }

    /// With the input as it was at the wanted stamps.
    ///
    /// Straight lines between samples weaken what the input's samples drive, which other values than the true
    /// ones make up for. An output that shows the input itself, the position of a base that is moved, then
    /// has to read the true ones.
    #[must_use]
    pub fn with_true_input(self, samples: &[f64]) -> Self {
        let driving = self.input.iter().step_by(self.every);
        let unseen = driving.zip(samples).map(|(driving, true_value)| true_value - driving).collect();
        Self { unseen: Some(unseen), ..self }
    }

    /// With a machine that is held to a recorded motion.
    #[must_use]
    pub fn with_guide(self, guide: Arc<Guide>) -> Self {
        Self { guide: Some(guide), ..self }
    }

    /// What holds the machine to a recorded motion, if anything does.
    pub fn guide(&self) -> Option<&Guide> {
        self.guide.as_deref()
    }

    /// A model as it is simulated here, from this input on.
    fn machine<'m>(
        &'m self,
        model: &'m Model,
        start: f64,
        steps: Option<StepLengths>,
    ) -> Result<Machine<'m>, PlantError> {
        let short_s = steps.map(|steps| steps.short_s);
        let machine = Machine::new(model, start, self.closed(), short_s, self.guide.as_deref())?;
        Ok(machine.with_halvings(steps.map_or(0, |steps| steps.halvings)))
    }

    /// The linear part of a model as it is simulated here: held to a recorded motion where one guides it.
    ///
    /// # Errors
    /// As [`StateSpace::new`].
    pub fn space(&self, model: &Model) -> Result<StateSpace, PlantError> {
        let free = StateSpace::new(model)?;
        Ok(match &self.guide {
            Some(guide) => guide.held(free),
            None => free,
        })
    }

    /// The same, outputs wanted at every `nth` (1 or more) of the stamps only; the input is followed as
    /// before.
    #[must_use]
    pub fn thinned(&self, nth: usize) -> Self {
        let nth = nth.max(1);
        let unseen = self.unseen.as_ref().map(|samples| samples.iter().step_by(nth).copied().collect());
        Self { every: self.every * nth, unseen, ..self.clone() }
    }

    /// The same under another input, of which there are as many samples.
    #[must_use]
    pub fn with_input(&self, samples: Vec<f64>) -> Self {
        Self { input: samples, unseen: None, ..self.clone() }
    }

    /// The same, driven `factor` times as hard.
    pub fn scaled(&self, factor: f64) -> Self {
        let times = |samples: &[f64]| samples.iter().map(|value| factor * value).collect::<Vec<f64>>();
        Self {
            input: times(&self.input),
            reference: self.reference.as_deref().map(times),
            unseen: self.unseen.as_deref().map(times),
            guide: None,
            ..self.clone()
        }
    }

    /// The outputs of a model at the wanted stamps, in the model's order, sensors without their noise.
    ///
    /// `steps`: how long the steps are between which the forces of laws are taken anew.
    ///
    /// # Errors
    /// As [`simulate_with`](crate::simulate_with()), and [`PlantError::RanAway`] where that would return
    /// numbers that are not finite.
    pub fn outputs(&self, model: &Model, steps: Option<StepLengths>) -> Result<Vec<Vec<f64>>, PlantError> {
        model.check()?;
        let stamps = Stamps::new(&self.time_s);
        let start = self.input.first().copied().unwrap_or(0.0);
        if self.reference.is_none() && self.guide.is_none() && is_linear(model)? {
            let space = StateSpace::new(model)?;
            let initial = space.initial(model, start)?;
            let mut outputs = self.linear(&space, initial, &stamps)?;
            self.show_true_input(model, &space.shares_of_input(), &mut outputs)?;
            return Ok(outputs);
        }
        let sensing = Sensing::new(model)?;
        let machine = self.machine(model, start, steps)?;
        let look = Look {
            every: self.every,
            between: sensing.looks_between(),
            smooth_s: steps.and_then(|steps| steps.smooth_s),
        };
        let shares = machine.shares_of_input();
        let run = machine.run_lean(&stamps, (self.driving(), self.hold), look)?;
        let wanted_s: Vec<f64> = run.stamps.iter().map(|&index| run.time_s[index]).collect();
        let outputs = run.outputs.iter().enumerate().map(|(index, samples)| {
            if sensing.is_ideal() {
                return run.stamps.iter().map(|&stamp| samples[stamp]).collect();
            }
            let dense = Dense { time_s: &run.time_s, samples, base: &run.base };
            sensing.recorded(index, &dense, &wanted_s, None)
        });
        let mut outputs: Vec<Vec<f64>> = outputs.collect();
        self.show_true_input(model, &shares, &mut outputs)?;
        Ok(outputs)
    }

    /// Times and samples of what a closed loop follows.
    fn closed(&self) -> Option<(&[f64], &[f64])> {
        self.reference.as_deref().map(|samples| (self.time_s.as_slice(), samples))
    }

    /// The recorded input where that drives: nothing in a closed loop, whose controller does.
    fn driving(&self) -> &[f64] {
        if self.is_in_loop() { &[] } else { &self.input }
    }

    /// Corrects what outputs show of the input itself.
    fn show_true_input(
        &self,
        model: &Model,
        shares: &[f64],
        outputs: &mut [Vec<f64>],
    ) -> Result<(), PlantError> {
        let Some(unseen) = self.unseen.as_ref().filter(|_| shares.iter().any(|share| *share != 0.0)) else {
            return Ok(());
        };
        let missing = self.behind_the_drive(model, unseen)?;
        for (share, samples) in shares.iter().zip(outputs) {
            if *share != 0.0 {
                samples.iter_mut().zip(&missing).for_each(|(sample, missing)| *sample += share * missing);
            }
        }
        Ok(())
    }

    /// What of a correction of the input arrives behind the model's drive: nothing of it where that is at its
    /// limit.
    fn behind_the_drive(&self, model: &Model, unseen: &[f64]) -> Result<Vec<f64>, PlantError> {
        let (mut with, mut without) = (signals(model)?, signals(model)?);
        if with.is_empty() {
            return Ok(unseen.to_vec());
        }
        let driving = self.time_s.iter().zip(&self.input).step_by(self.every);
        let missing = driving.zip(unseen).map(|((&time_s, &value), unseen)| {
            passed(&mut with, time_s, value + unseen) - passed(&mut without, time_s, value)
        });
        Ok(missing.collect())
    }

    /// The linear plant from one wanted stamp to the next.
    fn linear(
        &self,
        space: &StateSpace,
        mut state: Vec<f64>,
        stamps: &Stamps<'_>,
    ) -> Result<Vec<Vec<f64>>, PlantError> {
        let count = stamps.len();
        let mut outputs = vec![Vec::with_capacity(count / self.every + 1); space.outputs().len()];
        let mut next = Vec::with_capacity(state.len());
        let mut advances = Advances::new(&space.system);
        let uniform = matches!(stamps, Stamps::Uniform { .. });
        let mut slope_before = 0.0;
        let mut strides: Option<Stride> = None;
        let mut index = 0;
        while index < count {
            let interval_s = stamps.interval_s(index);
            let u = self.input[index];
            let slope = interval_s
                .map_or(slope_before, |interval_s| slope_of(self.hold, u, self.input[index + 1], interval_s));
            if index % self.every == 0 {
                for (output, samples) in space.outputs().iter().zip(&mut outputs) {
                    let at_tick =
                        if interval_s.is_some() { 0.5 * (slope_before + slope) } else { slope_before };
                    samples.push(output.row.read(&state, u, at_tick));
                }
            }
            let Some(interval_s) = interval_s else { break };
            // Listed stamps differ by rounding even where they are meant to be even: one sample that is
            // missing must not cost a matrix exponential for each that is there.
            let one = if uniform { advances.whole(interval_s)? } else { advances.partial(interval_s)? };
            if uniform && index % self.every == 0 && index + self.every < count {
                let stride =
                    strides.get_or_insert_with(|| Stride::new(&one, interval_s, self.every, self.hold));
                let piece = &self.input[index..=index + self.every];
                stride.apply(&mut state, &mut next, piece);
                slope_before = slope_of(self.hold, piece[self.every - 1], piece[self.every], interval_s);
                index += self.every;
            } else {
                one.apply(&mut state, &mut next, u, slope);
                slope_before = slope;
                index += 1;
            }
        }
        Ok(outputs)
    }
}

/// What the injection points of a machine do, one sample per wanted stamp.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Seconds.
    pub time_s: Vec<f64>,
    /// The input as it was recorded.
    pub input: Vec<f64>,
    /// Displacement and velocity of every point, in the order of [`StateSpace::points`].
    pub points: Vec<[Vec<f64>; 2]>,
}

impl Rerun {
    /// Whether the model's controller drives it, not the recorded input.
    pub fn is_in_loop(&self) -> bool {
        self.reference.is_some()
    }

    /// What the injection points of a model do at the wanted stamps; `None` where a servo or something loose
    /// moves apart from them.
    ///
    /// # Errors
    /// As [`Rerun::outputs`].
    pub fn motion(&self, model: &Model, steps: Option<StepLengths>) -> Result<Option<Motion>, PlantError> {
        model.check()?;
        let stamps = Stamps::new(&self.time_s);
        let start = self.input.first().copied().unwrap_or(0.0);
        let mut machine = self.machine(model, start, steps)?;
        if !machine.shows_points() {
            return Ok(None);
        }
        machine.watch_points();
        let smooth_s = steps.and_then(|steps| steps.smooth_s);
        let look = Look { every: self.every, between: false, smooth_s };
        let run = machine.run_lean(&stamps, (self.driving(), self.hold), look)?;
        let wanted = |samples: &[f64]| run.stamps.iter().map(|&stamp| samples[stamp]).collect::<Vec<f64>>();
        let points = run.outputs.chunks_exact(2).map(|rows| [wanted(&rows[0]), wanted(&rows[1])]).collect();
        let input = self.input.iter().step_by(self.every).copied().collect();
        Ok(Some(Motion { time_s: wanted(&run.time_s), input, points }))
    }
}

/// The force that a law would exert along a motion that it does not change, at every point where it acts;
/// nothing for a law that is no force.
///
/// # Errors
/// [`PlantError::Place`] and [`PlantError::Invalid`] as when the law is simulated.
pub fn force_along(
    model: &Model,
    physics: &Physics,
    motion: &Motion,
) -> Result<Vec<ForceSeries>, PlantError> {
    let space = StateSpace::new(model)?;
    let mut series = Vec::new();
    for element in elements(model, physics, &space)? {
        let Some([displacement, velocity]) = motion.points.get(element.point) else { continue };
        series.push(ForceSeries {
            point: element.point,
            samples: element.along(motion, displacement, velocity),
        });
    }
    Ok(series)
}

/// Several equal steps at once, the input a straight line in each: `x(t + n h) = Φⁿ x(t) + Σ_k W_k u_k`.
struct Stride {
    transition: Blocks,
    /// Row by row: effect of the input's value at every corner of the way.
    corners: Vec<f64>,
    count: usize,
}

impl Stride {
    fn new(step: &Advance, step_s: f64, steps: usize, hold: Hold) -> Self {
        let order = step.size();
        // The state after the way for a unit of every start value, then of every corner.
        let nothing = vec![0.0; order];
        let run = |start: &[f64], input: &dyn Fn(usize) -> f64| {
            let (mut state, mut next) = (start.to_vec(), Vec::with_capacity(order));
            for k in 0..steps {
                let slope = slope_of(hold, input(k), input(k + 1), step_s);
                step.apply(&mut state, &mut next, input(k), slope);
            }
            state
        };
        let unit = |index: usize| (0..order).map(|k| f64::from(k == index)).collect::<Vec<f64>>();
        let columns: Vec<Vec<f64>> = (0..order).map(|index| run(&unit(index), &|_| 0.0)).collect();
        let corners: Vec<Vec<f64>> =
            (0..=steps).map(|corner| run(&nothing, &|k| f64::from(k == corner))).collect();
        let by_rows = |columns: &[Vec<f64>]| {
            (0..order).flat_map(|row| columns.iter().map(move |column| column[row])).collect::<Vec<f64>>()
        };
        let transition = Blocks::new(order, &by_rows(&columns));
        Self { transition, corners: by_rows(&corners), count: steps + 1 }
    }

    /// Advances a state; `scratch` holds nothing between calls.
    fn apply(&self, state: &mut Vec<f64>, scratch: &mut Vec<f64>, input: &[f64]) {
        scratch.clear();
        self.transition.times(state, scratch);
        for (entry, by_input) in scratch.iter_mut().zip(self.corners.chunks_exact(self.count)) {
            *entry += dot(by_input, input);
        }
        std::mem::swap(state, scratch);
    }
}

/// The input's slope from one sample to the next, `step_s` seconds later.
fn slope_of(hold: Hold, from: f64, to: f64, step_s: f64) -> f64 {
    match hold {
        Hold::FirstOrder => (to - from) / step_s,
        Hold::ZeroOrder => 0.0,
    }
}
