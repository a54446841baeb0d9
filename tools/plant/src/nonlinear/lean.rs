//! The same sub-steps in little code and no memory traffic: for fits, which run one plant thousands of times.
//!
//! A chain that has neither a servo apart nor a controller is one linear map of state, input and slope per
//! sub-step, and the forces of its laws. With the order known to the compiler the map is a handful of vector
//! instructions. [`Machine::run`] is the reference that this is tested against.

use std::collections::HashMap;
use std::rc::Rc;

use super::assembly::{Machine, Run, passed, ran_away};
use super::engine::{Before, Effort, Element, Engine, settled};
use super::pieces;
use super::smooth::{Begun, Course, most_bend, smooth_forces};
use super::steps::{Gains, Port, PortStep};
use crate::catalogue::Step;
use crate::error::PlantError;
use crate::simulate::Hold;
use crate::stamps::Stamps;
use crate::state_space::Row;

/// What of a run is kept.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Look {
    /// Every how many stamps the outputs are wanted, from the first.
    pub(crate) every: usize,
    /// Whether what lies between is wanted too, sub-step by sub-step.
    pub(crate) between: bool,
    /// The longest step along which forces are taken to be smooth until they are seen not to be, seconds.
    pub(crate) smooth_s: Option<f64>,
}

/// A linear function of state, input and slope.
struct Reading<const N: usize> {
    state: [f64; N],
    value: f64,
    slope: f64,
}

impl<const N: usize> Reading<N> {
    fn new(state: &[f64], value: f64, slope: f64) -> Self {
        Self { state: array(state), value, slope }
    }

    fn of_row(row: &Row) -> Self {
        Self::new(&row.state, row.value, row.slope)
    }

    #[inline]
    fn at(&self, state: &[f64; N], u: f64, slope: f64) -> f64 {
        let products = self.state.iter().zip(state).map(|(a, b)| a * b);
        products.sum::<f64>() + (self.value * u + self.slope * slope)
    }
}

/// One sub-step of one length.
struct Map<const N: usize> {
    /// Columns of the transition.
    columns: [[f64; N]; N],
    value: [f64; N],
    slope: [f64; N],
    /// Per law: what a unit force has added at the end.
    force: Vec<[f64; N]>,
    /// Displacement and velocity at the end by the state at the start, without force.
    ends: Vec<[Reading<N>; 2]>,
    /// Per law: what a rise of its force by one, without a mean, has added at the end.
    rise: Vec<[f64; N]>,
    gains: Gains,
}

impl<const N: usize> Map<N> {
    fn new(step: &PortStep, step_s: f64, ports: &[Port]) -> Self {
        let mut columns = [[0.0; N]; N];
        for (row, entries) in step.transition().chunks_exact(N.max(1)).enumerate() {
            for (column, entry) in columns.iter_mut().zip(entries) {
                column[row] = *entry;
            }
        }
        let (value, slope): ([f64; N], [f64; N]) = (array(step.value()), array(step.slope()));
        let end = |(row, by_value, by_slope): &(Vec<f64>, f64, f64)| {
            let row: [f64; N] = array(row);
            let through = |column: &[f64; N]| row.iter().zip(column).map(|(a, b)| a * b).sum::<f64>();
            Reading {
                state: std::array::from_fn(|index| through(&columns[index])),
                value: through(&value) + by_value,
                // The input at the end is that at the start and the slope's share.
                slope: through(&slope) + by_value * step_s + by_slope,
            }
        };
        Self {
            ends: ports.iter().map(|port| [end(&port.z), end(&port.v)]).collect(),
            force: step.force.iter().map(|column| array(column)).collect(),
            rise: step.rise.iter().map(|column| array(column)).collect(),
            gains: step.gains.clone(),
            columns,
            value,
            slope,
        }
    }

    #[inline]
    fn advance(&self, state: &[f64; N], u: f64, slope: f64) -> [f64; N] {
        let mut next: [f64; N] = std::array::from_fn(|row| self.value[row] * u + self.slope[row] * slope);
        for (column, entry) in self.columns.iter().zip(state) {
            for (sum, factor) in next.iter_mut().zip(column) {
                *sum += factor * entry;
            }
        }
        next
    }
}

/// The first `N` entries.
fn array<const N: usize>(entries: &[f64]) -> [f64; N] {
    std::array::from_fn(|index| entries.get(index).copied().unwrap_or(0.0))
}

/// The plant at work.
struct Lean<const N: usize> {
    engine: Engine,
    state: [f64; N],
    starts: Vec<[Reading<N>; 2]>,
    outputs: Vec<(Reading<N>, Vec<f64>)>,
    /// Whether any of them shows forces at once.
    feels: bool,
    base: Reading<N>,
    maps: HashMap<i64, Rc<Map<N>>>,
    /// Those used last, by the bits of their length.
    recent: Vec<(u64, Rc<Map<N>>)>,
    /// Laws in this sub-step, each as if it were alone.
    alone: Vec<Step>,
    /// The same, with what the drive exerts, in a step along which forces are smooth.
    begun: Vec<Begun>,
    /// Forces over the last step, and over the one that is tried.
    courses: [Vec<Course>; 2],
    /// Forces where the first step after a look begins; nothing before it is made.
    felt_first: Vec<f64>,
    pieces: Pieces,
    /// How often steps are halved beside, and how far forces may bend along them.
    halvings: u32,
    most_bend: f64,
}

/// Maps kept at hand.
const RECENT: usize = 12;

/// How an interval between samples is gone through.
#[derive(Clone, Copy, Default)]
struct Pieces {
    interval_s: f64,
    count: usize,
    step_s: f64,
    /// How often a piece may be halved.
    halvings: u32,
}

impl Pieces {
    /// In steps of `smooth_s` at most, which are halved down to `short_s` where forces are not smooth; all of
    /// them halved so often `beside`.
    fn new(interval_s: f64, (smooth_s, short_s): (f64, f64), beside: u32) -> Self {
        let whole = pieces(interval_s, smooth_s, 0);
        let halvings = (interval_s / whole / short_s * (1.0 - 1e-9)).log2().ceil().max(0.0) as u32;
        let pieces = pieces(interval_s, smooth_s, beside);
        Self { interval_s, count: pieces as usize, step_s: interval_s / pieces, halvings }
    }
}

impl<const N: usize> Lean<N> {
    fn new(engine: Engine, base: &Row, halvings: u32) -> Self {
        let starts = engine
            .ports()
            .iter()
            .map(|port| [&port.z, &port.v].map(|(state, value, slope)| Reading::new(state, *value, *slope)));
        let outputs = engine.space.outputs().iter().map(|output| {
            let through = engine.elements.iter();
            let through = through.map(|element| output.feedthrough[element.point] * element.sign).collect();
            (Reading::of_row(&output.row), through)
        });
        let outputs: Vec<(Reading<N>, Vec<f64>)> = outputs.collect();
        Self {
            feels: outputs.iter().any(|(_, through)| through.iter().any(|share| *share != 0.0)),
            state: array(&engine.state),
            starts: starts.collect(),
            outputs,
            base: Reading::of_row(base),
            maps: HashMap::new(),
            recent: Vec::with_capacity(RECENT),
            alone: Vec::with_capacity(engine.elements.len()),
            begun: Vec::with_capacity(engine.elements.len()),
            courses: [(); 2].map(|()| vec![Course::default(); engine.elements.len()]),
            felt_first: Vec::with_capacity(engine.elements.len()),
            pieces: Pieces::default(),
            halvings,
            most_bend: most_bend(halvings),
            engine,
        }
    }

    /// The map over `step_s` seconds.
    fn map(&mut self, step_s: f64) -> Result<Rc<Map<N>>, PlantError> {
        if let Some((_, map)) = self.recent.iter().find(|(bits, _)| *bits == step_s.to_bits()) {
            return Ok(Rc::clone(map));
        }
        let key = Engine::key_of(step_s);
        let map = match self.maps.get(&key) {
            Some(map) => Rc::clone(map),
            None => {
                let step = self.engine.step(step_s)?;
                let map = Rc::new(Map::new(&step, step_s, self.engine.ports()));
                // Irregular stamps seldom have the same step twice.
                if self.maps.len() >= 4096 {
                    self.maps.clear();
                }
                self.maps.insert(key, Rc::clone(&map));
                map
            }
        };
        if self.recent.len() >= RECENT {
            self.recent.clear();
        }
        self.recent.push((step_s.to_bits(), Rc::clone(&map)));
        Ok(map)
    }

    #[inline]
    fn see(&self, index: usize, map: &Map<N>, time_s: f64, step_s: f64, from: f64, slope: f64) -> Step {
        let [z, v] = &self.starts[index];
        let [z_end, v_end] = &map.ends[index];
        let (v, v_free) = (v.at(&self.state, from, slope), v_end.at(&self.state, from, slope));
        let v_gain = map.gains.v[index][index];
        let (effort, effort_gain) = match self.engine.elements[index].effort {
            Effort::None => (0.0, 0.0),
            Effort::Input(gain) => (gain * (from + 0.5 * slope * step_s), 0.0),
            Effort::Servo(mass) => {
                let per_velocity = mass / step_s;
                (per_velocity * (v_free - v), per_velocity * v_gain - 1.0)
            }
        };
        Step {
            time_s,
            step_s,
            z: z.at(&self.state, from, slope),
            v,
            z_free: z_end.at(&self.state, from, slope),
            v_free,
            z_gain: map.gains.z[index][index],
            v_gain,
            effort,
            effort_gain,
            near: self.engine.forces[index],
        }
    }

    #[inline]
    fn advance(&mut self, map: &Map<N>, time_s: f64, step_s: f64, from: f64, slope: f64) {
        let mut next = map.advance(&self.state, from, slope);
        match self.engine.elements.len() {
            0 => {}
            1 => {
                let seen = self.see(0, map, time_s, step_s, from, slope);
                let law = &mut self.engine.elements[0].law;
                let force = law.force(&seen);
                law.made(&seen, force);
                self.engine.forces[0] = force;
            }
            count => {
                self.alone.clear();
                for index in 0..count {
                    let seen = self.see(index, map, time_s, step_s, from, slope);
                    self.alone.push(seen);
                }
                let (elements, forces): (&mut [Element], &mut [f64]) =
                    (&mut self.engine.elements, &mut self.engine.forces);
                settled(elements, forces, &self.alone, &map.gains);
            }
        }
        for (column, force) in map.force.iter().zip(&self.engine.forces) {
            for (entry, share) in next.iter_mut().zip(column) {
                *entry += share * force;
            }
        }
        self.state = next;
        self.engine.has_moved = true;
    }

    /// From one sample to the next in steps as long as forces are smooth, after a look at the first, for
    /// which the input grows at the second of `look`.
    fn glide_on(
        &mut self,
        lengths: (f64, f64),
        start_s: f64,
        interval_s: f64,
        (from, slope): (f64, f64),
        look: Option<(&mut Run, f64)>,
    ) -> Result<(), PlantError> {
        let before = (self.feels && look.is_some()).then(|| Before::of(&self.engine));
        let mut seen = look.map(|(run, slope_there)| {
            self.look(run, start_s, from, slope_there);
            run
        });
        self.felt_first.clear();
        if self.pieces.interval_s != interval_s {
            self.pieces = Pieces::new(interval_s, lengths, self.halvings);
        }
        let Pieces { count, step_s, halvings, .. } = self.pieces;
        for piece in 0..count {
            let past_s = piece as f64 * step_s;
            self.glide(halvings, start_s + past_s, step_s, from + slope * past_s, slope)?;
        }
        if let (Some(before), Some(run)) = (before, &mut seen) {
            self.felt(&before, &self.felt_first, run);
        }
        Ok(())
    }

    /// Advances in steps as long as forces are smooth along them, a step being halved so often at most.
    fn glide(
        &mut self,
        halvings: u32,
        time_s: f64,
        step_s: f64,
        from: f64,
        slope: f64,
    ) -> Result<(), PlantError> {
        let map = self.map(step_s)?;
        if !self.advance_smoothly(&map, time_s, step_s, from, slope) {
            if halvings > 0 {
                let half_s = 0.5 * step_s;
                self.glide(halvings - 1, time_s, half_s, from, slope)?;
                return self.glide(halvings - 1, time_s + half_s, half_s, from + slope * half_s, slope);
            }
            self.advance(&map, time_s, step_s, from, slope);
            for (course, force) in self.courses[0].iter_mut().zip(&self.engine.forces) {
                course.stepped(*force);
            }
        }
        if self.felt_first.is_empty() {
            self.felt_first.extend(self.courses[0].iter().map(|course| course.start));
        }
        Ok(())
    }

    /// One step along which all forces are smooth; makes none and says so where they are not.
    fn advance_smoothly(&mut self, map: &Map<N>, time_s: f64, step_s: f64, from: f64, slope: f64) -> bool {
        self.begun.clear();
        for index in 0..self.engine.elements.len() {
            let efforts = match self.engine.elements[index].effort {
                Effort::Input(gain) => [gain * from, gain * (from + slope * step_s)],
                Effort::None | Effort::Servo(_) => [0.0; 2],
            };
            self.begun.push(Begun { seen: self.see(index, map, time_s, step_s, from, slope), efforts });
        }
        let [before, courses] = &mut self.courses;
        courses.clone_from(before);
        if !smooth_forces(&self.engine.elements, &self.begun, &map.gains, courses, self.most_bend) {
            return false;
        }
        self.courses.swap(0, 1);
        let courses = &self.courses[0];
        let mut next = map.advance(&self.state, from, slope);
        for ((by_mean, by_rise), course) in map.force.iter().zip(&map.rise).zip(courses) {
            for ((entry, mean), rise) in next.iter_mut().zip(by_mean).zip(by_rise) {
                *entry += mean * course.mean + rise * course.rise;
            }
        }
        for (index, begun) in self.begun.iter().enumerate() {
            let (z_free, v_free) = map.gains.end(index, &begun.seen, courses);
            let made = Step { z_free, v_free, z_gain: 0.0, v_gain: 0.0, ..begun.seen };
            self.engine.elements[index].law.made(&made, courses[index].mean);
            self.engine.forces[index] = courses[index].end();
        }
        self.state = next;
        self.engine.has_moved = true;
        true
    }

    /// As [`Engine::felt`], for these forces after the look.
    fn felt(&self, before: &Before, after: &[f64], run: &mut Run) {
        for ((_, through), samples) in self.outputs.iter().zip(&mut run.outputs) {
            if let Some(last) = samples.last_mut() {
                *last += before.change(through.iter().copied(), after);
            }
        }
    }

    fn look(&self, run: &mut Run, time_s: f64, u: f64, slope: f64) {
        run.time_s.push(time_s);
        run.base.push(self.base.at(&self.state, u, slope));
        for ((row, through), samples) in self.outputs.iter().zip(&mut run.outputs) {
            let through = through.iter().zip(&self.engine.forces).map(|(a, b)| a * b).sum::<f64>();
            samples.push(row.at(&self.state, u, slope) + through);
        }
    }
}

impl Machine<'_> {
    /// Whether nothing runs apart from the plant.
    pub(crate) fn is_plain(&self) -> bool {
        self.shows_points() && self.control.is_none()
    }

    /// Whether all motion is that of the plant's state.
    pub(crate) fn shows_points(&self) -> bool {
        self.servo.is_none() && self.motions.is_empty()
    }

    /// Whether nothing but forces of laws stands between steps that are as long as these allow.
    fn glides(&self, look: Look) -> bool {
        let told = |element: &Element| !matches!(element.effort, Effort::Servo(_));
        self.is_plain()
            && self.signals.is_empty()
            && !look.between
            && !self.plant.elements.is_empty()
            && self.plant.elements.iter().all(told)
    }

    /// How much of the input every output shows at once; nothing where something with a memory lies in
    /// between.
    pub(crate) fn shares_of_input(&self) -> Vec<f64> {
        if self.is_plain() { self.plant.space.shares_of_input() } else { Vec::new() }
    }

    /// Reads displacement and velocity of every injection point in turn instead of the model's outputs.
    pub(crate) fn watch_points(&mut self) {
        self.plant.space.watch_points();
    }

    /// As [`Machine::run`], keeping what [`Look`] says: by the lean form where that covers the machine.
    /// The run's input is left empty, and its stamps are those that were wanted.
    pub(crate) fn run_lean(
        self,
        stamps: &Stamps<'_>,
        input: (&[f64], Hold),
        look: Look,
    ) -> Result<Run, PlantError> {
        macro_rules! by_order {
            ($($order:literal)*) => {
                match self.plant.space.order() {
                    $($order if self.is_plain() => lean::<$order>(self, stamps, input, look),)*
                    _ => {
                        let mut run = self.run(stamps, input.0, input.1 == Hold::ZeroOrder, look.between)?;
                        run.stamps = run.stamps.into_iter().step_by(look.every.max(1)).collect();
                        Ok(run)
                    }
                }
            };
        }
        by_order!(1 2 3 4 5 6 7 8 9 10 11 12 13 14)
    }
}

fn lean<const N: usize>(
    machine: Machine<'_>,
    stamps: &Stamps<'_>,
    (input, hold): (&[f64], Hold),
    look: Look,
) -> Result<Run, PlantError> {
    let smooth_s = look.smooth_s.filter(|_| machine.glides(look));
    let Machine { mut signals, plant, base, longest_step_s, halvings, .. } = machine;
    let mut lean = Lean::<N>::new(plant, &base, halvings);
    let every = look.every.max(1);
    let mut run = Run {
        time_s: Vec::new(),
        input: Vec::new(),
        outputs: vec![Vec::with_capacity(stamps.len() / every + 1); lean.outputs.len()],
        base: Vec::new(),
        stamps: Vec::with_capacity(stamps.len() / every + 1),
    };
    let mut slope_before = 0.0;
    for index in 0..stamps.len() {
        let wanted = index % every == 0;
        if wanted {
            run.stamps.push(run.time_s.len());
        }
        let start_s = stamps.at(index);
        // What has run away does not come back, and laws take long to find forces for it.
        if wanted && ran_away(&lean.state) {
            return Err(PlantError::RanAway { time_s: start_s });
        }
        let (Some(interval_s), Some(&[from, to])) = (stamps.interval_s(index), input.get(index..index + 2))
        else {
            let u = input.get(index).copied().unwrap_or(0.0);
            let u = passed(&mut signals, start_s, u);
            lean.look(&mut run, start_s, u, slope_before);
            break;
        };
        let to = if hold == Hold::ZeroOrder { from } else { to };
        if let Some(smooth_s) = smooth_s {
            let slope = (to - from) / interval_s;
            let look = wanted.then_some((&mut run, 0.5 * (slope_before + slope)));
            lean.glide_on((smooth_s, longest_step_s), start_s, interval_s, (from, slope), look)?;
            slope_before = slope;
            continue;
        }
        let pieces = pieces(interval_s, longest_step_s, halvings);
        let step_s = interval_s / pieces;
        let map = lean.map(step_s)?;
        for piece in 0..pieces as usize {
            let past_s = piece as f64 * step_s;
            let time_s = start_s + past_s;
            let at = |past_s: f64| from + (to - from) * (past_s / interval_s);
            let (mut u, mut u_end) = (at(past_s), at(past_s + step_s));
            if !signals.is_empty() {
                u = passed(&mut signals, time_s, u);
                u_end = passed(&mut signals, time_s + step_s, u_end);
            }
            let slope = (u_end - u) / step_s;
            let before = (look.between || (wanted && piece == 0)).then(|| {
                lean.look(&mut run, time_s, u, 0.5 * (slope_before + slope));
                lean.feels.then(|| Before::of(&lean.engine))
            });
            slope_before = slope;
            lean.advance(&map, time_s, step_s, u, slope);
            if let Some(before) = before.flatten() {
                lean.felt(&before, &lean.engine.forces, &mut run);
            }
        }
    }
    Ok(run)
}
