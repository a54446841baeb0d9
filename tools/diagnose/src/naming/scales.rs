//! How far, how fast and against what forces each place of a machine moved: what makes a trial value
//! sensible.

use std::collections::BTreeMap;

use stillbeam_plant::Hold;
use stillbeam_plant::StateSpace;
use stillbeam_plant::catalogue::{Place, place_of};

use crate::record::Record;
use crate::simulation::{Hypothesis, motion, started_at};

/// Sizes at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale {
    /// Root mean square of the displacement about its mean.
    pub(crate) displacement: f64,
    /// Largest absolute displacement over all recordings.
    pub(crate) reach: f64,
    /// From the one end of the motion to the other, in the recording where that is farthest.
    pub(crate) travel: f64,
    /// Root mean square of the velocity.
    pub(crate) velocity: f64,
    /// A hundredth of the force that moves what it moves that fast.
    pub(crate) force: f64,
}

/// Sizes at all places of a model, and of its input.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scales {
    /// By name of the injection point.
    pub(crate) points: BTreeMap<String, Scale>,
    /// Root mean square of the input about its mean, and its largest absolute value.
    pub(crate) input: [f64; 2],
    /// Per output of the model: root mean square about its mean, and largest absolute value.
    pub(crate) outputs: Vec<[f64; 2]>,
}

impl Scales {
    /// From the linear model's motion over the recordings, each begun from its own initial state: a free
    /// decay has no other motion.
    pub(crate) fn new(hypothesis: &Hypothesis, records: &[Record], starts: &[Vec<f64>]) -> Option<Self> {
        let space = StateSpace::new(&hypothesis.model).ok()?;
        let mut scales = Self { outputs: vec![[0.0; 2]; space.outputs().len()], ..Self::default() };
        for (record, start) in records.iter().zip(starts) {
            let zeros = vec![0.0; record.time_s.len()];
            let input = record.input.as_deref().unwrap_or(&zeros);
            // What a driven recording began with may have died before anything was read, and then is
            // anything.
            let start = if record.input.is_some() { &[][..] } else { start };
            let moved = moved(hypothesis, &space, record, start, input)?;
            for (point, [displacements, velocities]) in space.points().iter().zip(&moved) {
                let displacement = spread(displacements);
                let velocity = spread(velocities);
                let inverse_mass: f64 =
                    point.velocity.state.iter().zip(&point.force).map(|(row, force)| row * force).sum();
                let rate = if displacement[0] > 0.0 { velocity[0] / displacement[0] } else { 0.0 };
                let force = if inverse_mass > 0.0 { 0.01 * velocity[0] * rate / inverse_mass } else { 0.0 };
                let found = Scale {
                    displacement: displacement[0],
                    reach: displacement[1],
                    travel: travel(displacements),
                    velocity: velocity[0],
                    force,
                };
                scales.has_moved(&point.name, found);
            }
            let spread_of_input = spread(input);
            // A base that is moved is no point at which a force could act, but a place where something may be
            // loose.
            if hypothesis.model.input_is_motion() && space.find_point("base").is_none() {
                let rates = record.time_s.windows(2).zip(input.windows(2));
                let speed: Vec<f64> = rates.map(|(t, u)| (u[1] - u[0]) / (t[1] - t[0])).collect();
                let found = Scale {
                    displacement: spread_of_input[0],
                    reach: spread_of_input[1],
                    travel: travel(input),
                    velocity: spread(&speed)[0],
                    force: 0.0,
                };
                scales.has_moved("base", found);
            }
            scales.input = larger(scales.input, spread_of_input);
            for output in &record.outputs {
                scales.outputs[output.index] = larger(scales.outputs[output.index], spread(&output.samples));
            }
        }
        Some(scales)
    }

    /// Takes a place's motion over one more recording in: the sizes are those of the recording that moves it
    /// most, the reach that of all of them. A sweep is at a stop for a moment only that a multisine of more
    /// power never comes near.
    fn has_moved(&mut self, place: &str, found: Scale) {
        let known = self.points.entry(place.to_owned()).or_insert(found);
        let larger = if found.displacement > known.displacement { found } else { *known };
        let (reach, travel) = (known.reach.max(found.reach), known.travel.max(found.travel));
        *known = Scale { reach, travel, ..larger };
    }

    /// Sizes at a law's location; those of the first moving place for laws that sit outside.
    pub(crate) fn at(&self, hypothesis: &Hypothesis, location: &str) -> Option<Scale> {
        let moves = |scale: &&Scale| scale.displacement > 0.0 && scale.velocity > 0.0;
        if let Some(scale) = self.points.get(location).filter(moves) {
            return Some(*scale);
        }
        let reversed = location.split_once('-').map(|(first, second)| format!("{second}-{first}"));
        if let Some(scale) = reversed.and_then(|name| self.points.get(&name)).filter(moves) {
            return Some(*scale);
        }
        match place_of(&hypothesis.model, location)? {
            // What sits outside acts where a force can: not on a base that is moved.
            Place::Drive | Place::Sensor | Place::Environment => {
                let yields = |scale: &&Scale| moves(scale) && scale.force > 0.0;
                self.points.values().find(yields).or_else(|| self.points.values().find(moves)).copied()
            }
            Place::Base | Place::Beam | Place::Part => None,
        }
    }
}

/// Displacement and velocity of every point under the linear model. In a loop it follows the reference:
/// driven by the recorded force alone, a slide without a spring would wander off. One that is held to a
/// recorded motion follows that.
fn moved(
    hypothesis: &Hypothesis,
    space: &StateSpace,
    record: &Record,
    start: &[f64],
    input: &[f64],
) -> Option<Vec<[Vec<f64>; 2]>> {
    if (record.rerun.is_in_loop() || record.rerun.guide().is_some())
        && let Some(motion) = motion(&hypothesis.without_laws(), record, start)
    {
        return Some(motion.points);
    }
    let started = started_at(hypothesis, record, start)?;
    let model = started.as_ref().unwrap_or(&hypothesis.model);
    let start = space.initial(model, input.first().copied().unwrap_or(0.0)).ok()?;
    let trace = space.run(&record.time_s, input, Hold::FirstOrder, &[], &start).ok()?;
    Some(trace.displacements.into_iter().zip(trace.velocities).map(|(x, v)| [x, v]).collect())
}

/// Root mean square about the mean, and largest absolute value.
fn spread(samples: &[f64]) -> [f64; 2] {
    let n = samples.len().max(1) as f64;
    let mean = samples.iter().sum::<f64>() / n;
    let square = samples.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n;
    [square.sqrt(), samples.iter().map(|value| value.abs()).fold(0.0, f64::max)]
}

fn travel(samples: &[f64]) -> f64 {
    let most = samples.iter().fold(f64::NEG_INFINITY, |most, value| most.max(*value));
    let least = samples.iter().fold(f64::INFINITY, |least, value| least.min(*value));
    (most - least).max(0.0)
}

fn larger(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].max(b[0]), a[1].max(b[1])]
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::{Model, Physics};
    use stillbeam_recording::Role;

    use super::*;
    use crate::axis_in_loop::{axis, axis_with, run};

    #[test]
    fn a_place_reaches_as_far_as_in_any_recording_and_moves_as_in_the_one_of_most_power() {
        let steady = Scale { displacement: 0.02, reach: 0.03, travel: 0.05, velocity: 0.2, force: 1.0 };
        let passing = Scale { displacement: 0.01, reach: 0.04, travel: 0.07, velocity: 0.3, force: 2.0 };
        for both in [[steady, passing], [passing, steady]] {
            let mut scales = Scales::default();
            both.into_iter().for_each(|found| scales.has_moved("motor", found));
            assert_eq!(scales.points["motor"], Scale { reach: 0.04, travel: 0.07, ..steady });
        }
    }

    /// The recorded force also holds up an offset that the model lacks: alone it would push the slide some
    /// metres away.
    #[test]
    fn a_slide_in_a_loop_travels_as_far_as_its_reference() {
        let given = axis();
        let recording = run(&axis_with(Physics::new("constant_force", "slider").with("force", 40.0)));
        let travel = |given: &Model| {
            let record = Record::new(&recording, Role::Train, given, None, None).unwrap();
            let hypothesis = Hypothesis::given(given);
            let scales = Scales::new(&hypothesis, &[record], &[vec![0.0; 2]]).unwrap();
            scales.at(&hypothesis, "slider").unwrap().travel
        };
        assert!((travel(&given) - 0.2).abs() < 0.01, "{}", travel(&given));
        let record = Record::new(&recording, Role::Train, &given, None, None).unwrap();
        let hypothesis = Hypothesis::given(&given);
        let from_anywhere = Scales::new(&hypothesis, &[record], &[vec![7.0, -30.0]]).unwrap();
        let found = from_anywhere.at(&hypothesis, "slider").unwrap().travel;
        assert!((found - 0.2).abs() < 0.01, "a start that nothing shows counts for nothing: {found}");
        let mut open = given;
        open.setup_mut().controller = None;
        assert!(travel(&open) > 1.0, "without its loop it wanders off: {}", travel(&open));
    }
}
