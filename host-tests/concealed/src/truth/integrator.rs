//! The truth in time: fourth-order Runge-Kutta steps; stick and slip of dry friction as events located inside
//! a step.

use nalgebra::{DMatrix, DVector};

use super::jet::Jet;
use super::law::{Dry, Smooth};
use super::plant::{LinearPlant, Vector};

/// Halvings that locate an event: a step over 2^40.
const HALVINGS: usize = 40;
/// More changes between stick and slip within one step are taken as rest.
const MOST_EVENTS: usize = 60;
/// Forces on one machine; further ones are refused by [`Machine::new`].
const MOST_FORCES: usize = 6;

/// What acts on a point of a plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Force {
    /// Dry friction.
    Dry(Dry),
    /// Follows from position and speed.
    Smooth(Smooth),
    /// Bouc-Wen: `dF/dz = k − (beta sgn(F dz) + gamma)|F|`.
    Hysteresis([f64; 3]),
}

impl Force {
    /// The same force in one run among others.
    pub fn of_run(self, mark: u64) -> Self {
        match self {
            Self::Smooth(law) => Self::Smooth(law.of_run(mark)),
            other => other,
        }
    }
}

/// What a dry contact does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Contact {
    Sticks,
    Slips { forward: bool },
}

/// A force from time, positions and velocities.
pub type Renewed<'r> = &'r mut dyn FnMut(f64, &Vector, &Vector) -> f64;

/// A plant with forces, ready to run.
pub struct Machine<'a> {
    plant: &'a LinearPlant,
    /// Point and force.
    forces: Vec<(usize, Force)>,
    drift_per_s: f64,
}

/// Positions and velocities at equal steps, and the input there.
#[derive(Debug, Clone, Default)]
pub struct Track {
    /// Seconds between entries; the first is time 0.
    pub step_s: f64,
    /// Coordinates.
    pub positions: Vec<Vector>,
    /// Their rates.
    pub velocities: Vec<Vector>,
    /// What came out of the drive.
    pub input: Vec<Jet>,
    /// How often a contact changed between stick and slip.
    pub events: usize,
}

#[derive(Debug, Clone, Copy)]
struct State {
    x: Vector,
    v: Vector,
    /// One per force; used by hysteresis.
    memory: [f64; MOST_FORCES],
}

impl<'a> Machine<'a> {
    /// Forces, each with its point, on a plant whose frequencies change by a share per second; `None` for too
    /// many forces or a point that is not there.
    pub fn new(plant: &'a LinearPlant, forces: Vec<(usize, Force)>, drift_per_s: f64) -> Option<Self> {
        let known = forces.iter().all(|(point, _)| *point < plant.points.len());
        (known && forces.len() <= MOST_FORCES).then_some(Self { plant, forces, drift_per_s })
    }

    /// Runs from `(positions, velocities)` for `count` steps of `step_s` seconds; `input` is known at every
    /// instant.
    pub fn run(
        &self,
        start: (Vector, Vector),
        input: &dyn Fn(f64) -> Jet,
        step_s: f64,
        count: usize,
    ) -> Track {
        self.run_holding(start, input, step_s, count, (1, &mut |_, _, _| 0.0))
    }

    /// The same with a force beside the input that is renewed every so many steps, from time, positions and
    /// velocities, and held.
    pub fn run_holding(
        &self,
        start: (Vector, Vector),
        input: &dyn Fn(f64) -> Jet,
        step_s: f64,
        count: usize,
        (every, renewed): (usize, Renewed<'_>),
    ) -> Track {
        let mut state = State { x: start.0, v: start.1, memory: [0.0; MOST_FORCES] };
        let mut contacts = vec![Contact::Sticks; self.forces.len()];
        for (index, (point, _)) in self.forces.iter().enumerate() {
            let v = self.point_speed(*point, &state, input(0.0));
            if v.abs() > 0.0 {
                contacts[index] = Contact::Slips { forward: v > 0.0 };
            }
        }
        let mut held = renewed(0.0, &state.x, &state.v);
        let at_first = input(0.0) + Jet::constant(held);
        self.settle_contacts(0.0, &state, at_first, &mut contacts);
        let mut track = Track { step_s, ..Track::default() };
        for number in 0..=count {
            let time_s = number as f64 * step_s;
            if number % every == 0 {
                held = renewed(time_s, &state.x, &state.v);
            }
            let beside = Jet::constant(held);
            let input = |time_s: f64| input(time_s) + beside;
            track.positions.push(state.x);
            track.velocities.push(state.v);
            track.input.push(input(time_s));
            if number < count {
                track.events += self.step(time_s, step_s, &mut state, &mut contacts, &input);
            }
        }
        track
    }

    /// One step, cut at every event; how many there were.
    fn step(
        &self,
        begin_s: f64,
        step_s: f64,
        state: &mut State,
        contacts: &mut [Contact],
        input: &dyn Fn(f64) -> Jet,
    ) -> usize {
        let (mut time_s, end_s) = (begin_s, begin_s + step_s);
        let mut events = 0;
        while end_s - time_s > 1e-12 * step_s {
            let left_s = end_s - time_s;
            let whole = self.advance(time_s, left_s, state, contacts, input);
            if events > MOST_EVENTS || !self.broken(end_s, &whole, contacts, input) {
                *state = whole;
                break;
            }
            let (mut good_s, mut bad_s) = (0.0, left_s);
            for _ in 0..HALVINGS {
                let middle_s = 0.5 * (good_s + bad_s);
                let trial = self.advance(time_s, middle_s, state, contacts, input);
                if self.broken(time_s + middle_s, &trial, contacts, input) {
                    bad_s = middle_s;
                } else {
                    good_s = middle_s;
                }
            }
            let there = self.advance(time_s, bad_s, state, contacts, input);
            time_s += bad_s;
            *state = there;
            self.change_contacts(time_s, state, contacts, input);
            events += 1;
        }
        events
    }

    /// Runge-Kutta of fourth order; what sticks is put back to rest.
    fn advance(
        &self,
        time_s: f64,
        h: f64,
        state: &State,
        contacts: &[Contact],
        input: &dyn Fn(f64) -> Jet,
    ) -> State {
        let along = |slope: &State, by: f64| State {
            x: state.x + slope.x * by,
            v: state.v + slope.v * by,
            memory: std::array::from_fn(|k| state.memory[k] + by * slope.memory[k]),
        };
        let (u0, u1, u2) = (input(time_s), input(time_s + 0.5 * h), input(time_s + h));
        let k1 = self.slope(time_s, state, u0, contacts);
        let k2 = self.slope(time_s + 0.5 * h, &along(&k1, 0.5 * h), u1, contacts);
        let k3 = self.slope(time_s + 0.5 * h, &along(&k2, 0.5 * h), u1, contacts);
        let k4 = self.slope(time_s + h, &along(&k3, h), u2, contacts);
        let mut end = State {
            x: state.x + (k1.x + (k2.x + k3.x) * 2.0 + k4.x) * (h / 6.0),
            v: state.v + (k1.v + (k2.v + k3.v) * 2.0 + k4.v) * (h / 6.0),
            memory: std::array::from_fn(|k| {
                let sum = k1.memory[k] + 2.0 * (k2.memory[k] + k3.memory[k]) + k4.memory[k];
                state.memory[k] + h / 6.0 * sum
            }),
        };
        for (index, (point, _)) in self.forces.iter().enumerate() {
            if self.is_dry(index) && contacts[index] == Contact::Sticks {
                let v = self.point_speed(*point, &end, u2);
                let point = &self.plant.points[*point];
                end.v -= point.push * (v / point.row.dot(&point.push));
            }
        }
        end
    }

    fn slope(&self, time_s: f64, state: &State, u: Jet, contacts: &[Contact]) -> State {
        let (free, memory) = self.without_sticking(time_s, state, u, contacts);
        let v = self.with_sticking(free, u, contacts).0;
        State { x: state.v, v, memory }
    }

    /// Accelerations without the forces of what sticks, and rates of the memories.
    fn without_sticking(
        &self,
        time_s: f64,
        state: &State,
        u: Jet,
        contacts: &[Contact],
    ) -> (Vector, [f64; MOST_FORCES]) {
        let plant = self.plant;
        let mut acceleration = -(plant.spring * state.x);
        if plant.prescribed {
            acceleration += plant.input * u.value;
        }
        if self.drift_per_s != 0.0 {
            let factor = (1.0 + self.drift_per_s * time_s).powi(2);
            for (k, moves) in plant.drifts.iter().enumerate() {
                if *moves {
                    acceleration[k] *= factor;
                }
            }
        }
        if !plant.prescribed {
            acceleration += plant.input * u.value;
        }
        acceleration -= plant.damper * state.v;
        acceleration += plant.input_rate * u.rate;
        let mut rates = [0.0; MOST_FORCES];
        for (index, (at, force)) in self.forces.iter().enumerate() {
            let point = &plant.points[*at];
            let z = point.row.dot(&state.x) + point.base * u.value;
            let v = point.row.dot(&state.v) + point.base * u.rate;
            let size = match force {
                Force::Smooth(law) => law.force(time_s, z, v, u.value),
                Force::Hysteresis([k, beta, gamma]) => {
                    let f = state.memory[index];
                    let turn = beta * (f * v).signum() + gamma;
                    rates[index] = (k - turn * f.abs()) * v;
                    -f
                }
                Force::Dry(dry) => match contacts[index] {
                    Contact::Sticks => 0.0,
                    Contact::Slips { forward: true } => -dry.sliding(true, v.max(0.0), z),
                    Contact::Slips { forward: false } => dry.sliding(false, (-v).max(0.0), z),
                },
            };
            acceleration.axpy(size, &point.push, 1.0);
        }
        (acceleration, rates)
    }

    /// Adds the forces that keep what sticks at rest; these forces, one per force (0 elsewhere).
    fn with_sticking(
        &self,
        mut acceleration: Vector,
        u: Jet,
        contacts: &[Contact],
    ) -> (Vector, [f64; MOST_FORCES]) {
        let mut holding = [0.0; MOST_FORCES];
        let sticks = |index: &usize| self.is_dry(*index) && contacts[*index] == Contact::Sticks;
        if !(0..self.forces.len()).any(|index| sticks(&index)) {
            return (acceleration, holding);
        }
        let stuck: Vec<usize> = (0..self.forces.len()).filter(sticks).collect();
        let point = |index: usize| &self.plant.points[self.forces[index].0];
        let coupled =
            DMatrix::from_fn(stuck.len(), stuck.len(), |a, b| point(stuck[a]).row.dot(&point(stuck[b]).push));
        let wanted = DVector::from_fn(stuck.len(), |a, _| {
            -(point(stuck[a]).row.dot(&acceleration) + point(stuck[a]).base * u.bend)
        });
        if let Some(forces) = coupled.lu().solve(&wanted) {
            for (&index, &force) in stuck.iter().zip(forces.iter()) {
                holding[index] = force;
                acceleration.axpy(force, &point(index).push, 1.0);
            }
        }
        (acceleration, holding)
    }

    fn is_dry(&self, index: usize) -> bool {
        matches!(self.forces[index].1, Force::Dry(_))
    }

    fn point_speed(&self, point: usize, state: &State, u: Jet) -> f64 {
        let point = &self.plant.points[point];
        point.row.dot(&state.v) + point.base * u.rate
    }

    fn point_place(&self, point: usize, state: &State, u: Jet) -> f64 {
        let point = &self.plant.points[point];
        point.row.dot(&state.x) + point.base * u.value
    }

    /// A speed that counts as none: rounding of the velocities that make it up.
    fn still(&self, state: &State) -> f64 {
        1e-13 * (1.0 + state.v.amax())
    }

    /// Whether a contact no longer does what it is said to do.
    fn broken(&self, time_s: f64, state: &State, contacts: &[Contact], input: &dyn Fn(f64) -> Jet) -> bool {
        let mut held = None;
        self.forces.iter().enumerate().any(|(index, (point, force))| {
            let Force::Dry(dry) = force else { return false };
            let u = input(time_s);
            match contacts[index] {
                Contact::Slips { forward } => {
                    let v = self.point_speed(*point, state, u);
                    if forward { v < -self.still(state) } else { v > self.still(state) }
                }
                Contact::Sticks => {
                    let held = held.get_or_insert_with(|| self.held(time_s, state, u, contacts));
                    !holds(dry, held[index], self.point_place(*point, state, u))
                }
            }
        })
    }

    fn held(&self, time_s: f64, state: &State, u: Jet, contacts: &[Contact]) -> [f64; MOST_FORCES] {
        let (free, _) = self.without_sticking(time_s, state, u, contacts);
        self.with_sticking(free, u, contacts).1
    }

    /// At an event: what came to rest sticks if it can, what is held too weakly slips.
    fn change_contacts(
        &self,
        time_s: f64,
        state: &mut State,
        contacts: &mut [Contact],
        input: &dyn Fn(f64) -> Jet,
    ) {
        let u = input(time_s);
        for (index, (point, force)) in self.forces.iter().enumerate() {
            let (Force::Dry(_), Contact::Slips { forward }) = (force, contacts[index]) else { continue };
            let v = self.point_speed(*point, state, u);
            let still = self.still(state);
            if if forward { v < -still } else { v > still } {
                contacts[index] = Contact::Sticks;
                let point = &self.plant.points[*point];
                state.v -= point.push * (v / point.row.dot(&point.push));
            }
        }
        self.settle_contacts(time_s, state, u, contacts);
    }

    /// Lets go, one after the other, what cannot be held.
    fn settle_contacts(&self, time_s: f64, state: &State, u: Jet, contacts: &mut [Contact]) {
        for _ in 0..self.forces.len() {
            let held = self.held(time_s, state, u, contacts);
            let loose = self.forces.iter().enumerate().find(|(index, (point, force))| match force {
                Force::Dry(dry) => {
                    contacts[*index] == Contact::Sticks
                        && !holds(dry, held[*index], self.point_place(*point, state, u))
                }
                _ => false,
            });
            let Some((index, _)) = loose else { break };
            // Friction points against the motion that it cannot stop.
            contacts[index] = Contact::Slips { forward: held[index] < 0.0 };
        }
    }
}

/// Whether friction can give a force.
fn holds(dry: &Dry, force: f64, z: f64) -> bool {
    // A negative force works against motion forward.
    force.abs() <= dry.holding(force < 0.0, z)
}
