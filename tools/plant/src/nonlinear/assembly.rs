//! The machine: every link of the chain in its place, run over a recording's times.

use super::control::Loop;
use super::engine::{Before, Effort, Element, Engine};
use super::guide::Guide;
use super::{longest_step_s, pieces};
use crate::catalogue::{Action, Clip, ForceLaw, Late, SignalLaw, Step, action};
use crate::error::PlantError;
use crate::model::{BASE_POSITION, Input, InvalidParameter, Model, Physics, Problem};
use crate::modes::moved_mass_kg;
use crate::stamps::Stamps;
use crate::state_space::{BaseMotion, Row, StateSpace};

/// What a run gives: the plant at the times that were looked at, and the places of the time stamps among
/// them.
pub(crate) struct Run {
    pub(crate) time_s: Vec<f64>,
    /// The input as recorded or as the controller gave it.
    pub(crate) input: Vec<f64>,
    pub(crate) outputs: Vec<Vec<f64>>,
    /// Position of the base, or the input where the model has no base.
    pub(crate) base: Vec<f64>,
    /// Index of each time stamp in the above.
    pub(crate) stamps: Vec<usize>,
}

/// Outputs that differ by less than this share of their largest value are the same.
const SAME: f64 = 1e-6;

impl Run {
    /// Whether another run of the same machine has the same outputs at the time stamps.
    pub(crate) fn is_near(&self, other: &Self) -> bool {
        let at_stamps = |run: &Self, output: usize| {
            run.stamps.iter().map(|&index| run.outputs[output][index]).collect::<Vec<f64>>()
        };
        (0..self.outputs.len()).all(|output| {
            let [ours, theirs] = [self, other].map(|run| at_stamps(run, output));
            let largest = ours.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
            ours.iter().zip(&theirs).all(|(a, b)| (a - b).abs() <= SAME * largest)
        })
    }
}

/// A model put together for simulation.
pub(crate) struct Machine<'a> {
    pub(super) signals: Vec<Box<dyn SignalLaw>>,
    /// The servo, run apart where something lies between it and the base.
    pub(super) servo: Option<Engine>,
    pub(super) motions: Vec<Box<dyn SignalLaw>>,
    pub(super) plant: Engine,
    pub(super) base: Row,
    pub(super) control: Option<Loop<'a>>,
    pub(super) longest_step_s: f64,
    /// How often every step is halved beside.
    pub(super) halvings: u32,
}

/// What the input passes on its way to the drive, in order.
pub(crate) fn signals(model: &Model) -> Result<Vec<Box<dyn SignalLaw>>, PlantError> {
    let mut signals: Vec<Box<dyn SignalLaw>> = Vec::new();
    let limits = model.setup().drive_limits;
    if limits.dead_time_s > 0.0 {
        signals.push(Box::new(Late::new(limits.dead_time_s)));
    }
    if let Some(limit) = limits.limit {
        signals.push(Box::new(Clip { limit }));
    }
    for physics in &model.setup().physics {
        if let Action::Signal(law) = action(model, physics, 0.0)? {
            signals.push(law);
        }
    }
    Ok(signals)
}

/// A signal behind all that it passes, at a time that never decreases.
pub(crate) fn passed(signals: &mut [Box<dyn SignalLaw>], time_s: f64, value: f64) -> f64 {
    signals.iter_mut().fold(value, |value, law| law.pass(time_s, value))
}

impl<'a> Machine<'a> {
    /// Builds the chain for an input that starts at `start`.
    ///
    /// `reference` holds times and samples of the controller's reference; with it the loop is closed.
    pub(crate) fn new(
        model: &'a Model,
        start: f64,
        reference: Option<(&'a [f64], &'a [f64])>,
        longest_step_s_given: Option<f64>,
        guide: Option<&Guide>,
    ) -> Result<Self, PlantError> {
        let signals = signals(model)?;
        let mut motions: Vec<Box<dyn SignalLaw>> = Vec::new();
        let mut forces: Vec<&Physics> = Vec::new();
        let limits = model.setup().drive_limits;
        for physics in &model.setup().physics {
            match action(model, physics, 0.0)? {
                Action::Motion(law) => motions.push(law),
                Action::Force(_) => forces.push(physics),
                Action::Signal(_) | Action::Sensor(_) | Action::Structure(_) => {}
            }
        }
        let (plant_model, servo) = match model.servo() {
            Some(drive) if !motions.is_empty() => {
                let motion = BaseMotion::new(&[], Some(drive));
                let points = motion.points(&[], moved_mass(model)?, "m");
                (behind_the_servo(model), Some(motion.into_space(Vec::new(), points)))
            }
            _ => (model.clone(), None),
        };
        let free = StateSpace::new(&plant_model)?;
        let state = free.initial(&plant_model, start)?;
        let space = guide.map_or_else(|| free.clone(), |guide| guide.held(free.clone()));
        let longest_step_s = longest_step_s_given.unwrap_or_else(|| {
            servo.iter().chain([&space]).map(longest_step_s).fold(f64::INFINITY, f64::min)
        });
        let mut at_servo = Vec::new();
        let mut at_plant = guide.map_or_else(Vec::new, |guide| guide.elements(&space));
        for physics in forces {
            let for_servo = servo.as_ref().filter(|_| acts_on_base(physics));
            let target = for_servo.unwrap_or(&space);
            let elements = elements(model, physics, target)?;
            if for_servo.is_some() { at_servo.extend(elements) } else { at_plant.extend(elements) }
        }
        if let Some(limit_m_s2) = limits.acceleration_limit_m_s2 {
            let Some((point, effort)) = servo_effort(model, servo.as_ref().unwrap_or(&space))? else {
                let key = "drive.acceleration_limit_m_s2";
                return Err(InvalidParameter::new(key, Problem::NeedsServo).into());
            };
            let mass = moved_mass(model)?.unwrap_or(1.0);
            let law = Box::new(MotorLimit { limit: limit_m_s2 * mass });
            let element = Element { law, effort, point, sign: 1.0 };
            if servo.is_some() { at_servo.push(element) } else { at_plant.push(element) }
        }
        let laws = at_servo.iter().chain(&at_plant);
        let shorter = laws.map(|element| element.law.shorter_steps()).fold(1.0, f64::max);
        let base = match space.find_point("base") {
            Some((index, _)) => space.points()[index].displacement.clone(),
            None => Row { state: vec![0.0; space.order()], value: 1.0, slope: 0.0 },
        };
        let control = match (&model.setup().controller, reference) {
            (Some(controller), Some((time_s, samples))) => {
                Some(Loop::new(controller, &space, time_s, samples)?)
            }
            _ => None,
        };
        Ok(Self {
            signals,
            servo: servo.map(|servo| {
                let state = servo.rest_at(start);
                Engine::new(servo, state, at_servo)
            }),
            motions,
            plant: Engine::new(space, state, at_plant),
            base,
            control,
            longest_step_s: longest_step_s / shorter,
            halvings: 0,
        })
    }

    /// The longest sub-step, seconds, halvings apart.
    pub(crate) fn longest_step_s(&self) -> f64 {
        self.longest_step_s
    }

    /// The same with every step halved so often beside.
    pub(crate) fn with_halvings(self, halvings: u32) -> Self {
        Self { halvings, ..self }
    }

    /// Runs over the time stamps; `input` has one sample per stamp and is not looked at in closed loop.
    /// Every sub-step is kept if `dense`, else the time stamps only.
    pub(crate) fn run(
        mut self,
        stamps: &Stamps<'_>,
        input: &[f64],
        zero_order: bool,
        dense: bool,
    ) -> Result<Run, PlantError> {
        let mut run = Run {
            time_s: Vec::new(),
            input: Vec::new(),
            outputs: vec![Vec::new(); self.plant.space.outputs().len()],
            base: Vec::new(),
            stamps: Vec::with_capacity(stamps.len()),
        };
        let mut slope_before = 0.0;
        for index in 0..stamps.len() {
            run.stamps.push(run.time_s.len());
            let Some(interval_s) = stamps.interval_s(index) else { break };
            let start_s = stamps.at(index);
            // What has run away does not come back, and laws take long to find forces for it.
            if ran_away(&self.plant.state) {
                return Err(PlantError::RanAway { time_s: start_s });
            }
            let (from, to) = match input.get(index..index + 2) {
                Some(&[from, to]) => (from, if zero_order { from } else { to }),
                _ => (0.0, 0.0),
            };
            let mut done_s = 0.0;
            while done_s < interval_s * (1.0 - 1e-9) {
                let stretch_s = self.stretch_s(start_s, done_s, interval_s);
                let pieces = pieces(stretch_s, self.longest_step_s, self.halvings);
                let step_s = stretch_s / pieces;
                for piece in 0..pieces as usize {
                    let past_s = done_s + piece as f64 * step_s;
                    let (u, u_end) = match &self.control {
                        Some(control) => (control.output(), control.output()),
                        None => {
                            let at = |past_s: f64| from + (to - from) * (past_s / interval_s);
                            (at(past_s), at(past_s + step_s))
                        }
                    };
                    let is_stamp = past_s == 0.0;
                    let look = (dense || is_stamp).then_some(&mut run);
                    self.sub_step(start_s + past_s, step_s, (u, u_end), &mut slope_before, look)?;
                }
                done_s += stretch_s;
            }
        }
        self.close(stamps, input, slope_before, &mut run);
        Ok(run)
    }

    /// Up to the next time stamp or renewal of the controller, which is renewed if it is due.
    fn stretch_s(&mut self, start_s: f64, done_s: f64, interval_s: f64) -> f64 {
        let left_s = interval_s - done_s;
        let Some(control) = &mut self.control else { return left_s };
        let now_s = start_s + done_s;
        let close_s = 1e-9 * interval_s;
        while control.next_s() <= now_s + close_s {
            control.renew(&self.plant.state);
        }
        let until_s = control.next_s() - now_s;
        if until_s < left_s - close_s { until_s } else { left_s }
    }

    /// One sub-step; what the outputs are at its start goes into the run if `look` is set.
    fn sub_step(
        &mut self,
        time_s: f64,
        step_s: f64,
        (u, u_end): (f64, f64),
        slope_before: &mut f64,
        run: Option<&mut Run>,
    ) -> Result<(), PlantError> {
        let mut from = passed(&mut self.signals, time_s, u);
        let mut to = passed(&mut self.signals, time_s + step_s, u_end);
        if let Some(servo) = &mut self.servo {
            let before = servo.state[0];
            servo.advance(time_s, step_s, from, to)?;
            (from, to) = (before, servo.state[0]);
        }
        let mut shift = |time_s: f64, y: f64| self.motions.iter_mut().fold(y, |y, law| law.pass(time_s, y));
        (from, to) = (shift(time_s, from), shift(time_s + step_s, to));
        let slope = (to - from) / step_s;
        let Some(run) = run else {
            *slope_before = slope;
            return self.plant.advance(time_s, step_s, from, to);
        };
        // A motion's speed jumps from stretch to stretch; the mean of both is what is seen.
        self.look(run, time_s, u, from, 0.5 * (*slope_before + slope));
        *slope_before = slope;
        let before = Before::of(&self.plant);
        self.plant.advance(time_s, step_s, from, to)?;
        self.plant.felt(&before, &mut run.outputs);
        Ok(())
    }

    fn look(&self, run: &mut Run, time_s: f64, u: f64, behind_drive: f64, slope: f64) {
        run.time_s.push(time_s);
        run.input.push(u);
        run.base.push(self.base.read(&self.plant.state, behind_drive, slope));
        self.plant.read(behind_drive, slope, &mut run.outputs);
    }

    fn close(&mut self, stamps: &Stamps<'_>, input: &[f64], slope: f64, run: &mut Run) {
        let Some(last) = stamps.len().checked_sub(1) else { return };
        let time_s = stamps.at(last);
        let u = match &self.control {
            Some(control) => control.output(),
            None => input.get(last).copied().unwrap_or(0.0),
        };
        let mut to = passed(&mut self.signals, time_s, u);
        if let Some(servo) = &self.servo {
            to = servo.state[0];
        }
        to = self.motions.iter_mut().fold(to, |y, law| law.pass(time_s, y));
        self.look(run, time_s, u, to, slope);
    }
}

/// Whether a state is beyond any machine, in units of metres, newtons and whatever else a model may have.
pub(super) fn ran_away(state: &[f64]) -> bool {
    const BEYOND: f64 = 1e12;
    !state.iter().all(|entry| entry.abs() < BEYOND)
}

/// The same model with its base position as input and no drive.
fn behind_the_servo(model: &Model) -> Model {
    let mut behind = model.clone();
    match &mut behind {
        Model::BeamOnBase(beam) => {
            beam.drive = None;
            beam.input = Some(Input::new(BASE_POSITION));
        }
        Model::Modal(modal) => {
            modal.drive = None;
            modal.input = Some(Input::new(BASE_POSITION));
        }
        Model::Lumped(_) => {}
    }
    // Linear laws stay; the others have been put to work already and may not fit this model.
    let linear = |physics: &Physics| matches!(action(model, physics, 0.0), Ok(Action::Structure(_)));
    behind.setup_mut().physics.retain(linear);
    behind.setup_mut().initial.remove("base");
    behind
}

/// Mass that a servo moves; `None` for a model that knows none.
fn moved_mass(model: &Model) -> Result<Option<f64>, PlantError> {
    match model {
        Model::BeamOnBase(beam) => moved_mass_kg(beam).map(Some),
        _ => Ok(None),
    }
}

fn acts_on_base(physics: &Physics) -> bool {
    match physics.location.as_str() {
        "base" | "drive" => true,
        "environment" => physics.on.as_deref().is_none_or(|on| on == "base"),
        _ => false,
    }
}

/// The law of a table at every point that it acts on.
pub(crate) fn elements(
    model: &Model,
    physics: &Physics,
    space: &StateSpace,
) -> Result<Vec<Element>, PlantError> {
    let mut effort = Effort::None;
    let points: Vec<(usize, f64)> = match physics.location.as_str() {
        "drive" => {
            let Some((point, found)) = servo_effort(model, space)? else {
                return Err(place_error(physics, space, &physics.location));
            };
            effort = found;
            vec![(point, 1.0)]
        }
        "environment" => environment_points(physics, space)?,
        location => {
            let found = space.find_point(location);
            vec![found.ok_or_else(|| place_error(physics, space, location))?]
        }
    };
    let mut elements = Vec::new();
    for (point, sign) in points {
        let stiffness = space.points()[point].stiffness;
        let Action::Force(law) = action(model, physics, stiffness)? else { continue };
        let effort = std::mem::replace(&mut effort, Effort::None);
        elements.push(Element { law, effort, point, sign });
    }
    Ok(elements)
}

/// Where a law of the environment acts: where it says, or else a drift on everything springy and a
/// disturbance on the first point there is.
fn environment_points(physics: &Physics, space: &StateSpace) -> Result<Vec<(usize, f64)>, PlantError> {
    if let Some(on) = &physics.on {
        return Ok(vec![space.find_point(on).ok_or_else(|| place_error(physics, space, on))?]);
    }
    let points = space.points().iter().enumerate();
    let found: Vec<(usize, f64)> = if physics.id == "parameter_drift" {
        points.filter(|(_, point)| point.stiffness != 0.0).map(|(index, _)| (index, 1.0)).collect()
    } else {
        let preferred = ["base", "beam"].into_iter().find_map(|name| space.find_point(name));
        preferred.or_else(|| (!space.points().is_empty()).then_some((0, 1.0))).into_iter().collect()
    };
    if found.is_empty() { Err(place_error(physics, space, "environment")) } else { Ok(found) }
}

fn place_error(physics: &Physics, space: &StateSpace, found: &str) -> PlantError {
    PlantError::Place {
        what: format!("{} at {}", physics.id, physics.location),
        found: found.to_owned(),
        allowed: space.point_names(),
    }
}

/// The point at which the drive pushes, and how its force is read.
fn servo_effort(model: &Model, space: &StateSpace) -> Result<Option<(usize, Effort)>, PlantError> {
    let input = model.input();
    if let (Model::Lumped(lumped), Some(input)) = (model, input) {
        let body = lumped.input.as_ref().map(|input| input.body.as_str()).unwrap_or_default();
        return Ok(space.find_point(body).map(|(point, _)| (point, Effort::Input(input.gain))));
    }
    let Some((base, _)) = space.find_point("base") else { return Ok(None) };
    if model.servo().is_some() {
        return Ok(Some((base, Effort::Servo(moved_mass(model)?.unwrap_or(1.0)))));
    }
    Ok(input.filter(|input| !input.is_motion()).map(|input| (base, Effort::Input(input.gain))))
}

/// A motor that gives no more than its limit: takes back what the servo asks beyond it.
struct MotorLimit {
    limit: f64,
}

impl ForceLaw for MotorLimit {
    fn force(&self, step: &Step) -> f64 {
        let asked = step.effort;
        if asked.abs() <= self.limit {
            return 0.0;
        }
        // What is taken back makes the servo ask for something else before the step is over.
        (self.limit.copysign(asked) - asked) / (1.0 + step.effort_gain)
    }
}
