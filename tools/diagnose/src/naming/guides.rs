//! Recordings of a machine that is held to the motion that they show.
//!
//! The motion of a place is the one that a smoother makes of what the outputs there read, under an unknown
//! force at it. Where an output reads the sum of several coordinates, all of them are held.

use std::f64::consts::TAU;
use std::sync::Arc;

use stillbeam_identify::tall::dot;
use stillbeam_plant::state_space::InjectionPoint;
use stillbeam_plant::{Guide, StateSpace, Tie};
use stillbeam_recording::Role;

use super::selection::Search;
use super::sets::Member;
use crate::fit::Fitted;
use crate::locate::latent_force::motions_from_rest;
use crate::noise::NoiseFloor;
use crate::parameters::{FreeParameter, free_parameters};
use crate::record::Record;
use crate::simulation::Hypothesis;
use crate::stacking::{RecordFit, Stack};
use crate::study::{OnAll, Study};

/// While a guide holds, the model's own parameters stay within this factor of the drawing.
const HELD_WITHIN: f64 = 2.0;
/// A held machine is in step where it leaves less than this share, root mean square, of every output.
const IN_STEP: f64 = 0.4;
/// The softest guide that is tried, and the hardest: shares of the spring that moves a place as fast as the
/// fastest motion of the model.
const SOFTEST: f64 = 1e-5;
const HARDEST: f64 = 10.0;
/// From one that is tried to the next.
const HARDER: f64 = 3.0;

impl Search<'_> {
    /// The drawing beside the softest guide that holds it in step with all training recordings, and a study
    /// of those; `None` where none does.
    pub(super) fn held_in_step(&self, refitted: &Member) -> Option<(Study, Fitted)> {
        let given = Hypothesis::given(self.given);
        let hardest = self.guided_records(refitted, &given)?;
        let mut share = SOFTEST;
        while share < HARDER * HARDEST {
            let train = loosened(&hardest, share);
            let stack = Stack { records: train.iter().collect(), ..self.study.stack(Role::Train) };
            let records = stack.evaluate(&given, &[])?;
            if self.is_in_step(records.clone()) {
                let sum_of_squares = records.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum();
                let study = Study { train, ..self.study.clone() };
                // A refit that is out of step may have found none of them to be determined.
                let free: Vec<FreeParameter> =
                    free_parameters(&given).into_iter().map(held_near_the_drawing).collect();
                let values = free.iter().map(|parameter| parameter.given).collect();
                let held = Fitted { hypothesis: given, free, values, records, sum_of_squares };
                return Some((study, held));
            }
            share *= HARDER;
        }
        None
    }

    /// Whether fits of the training recordings are in step with them.
    pub(super) fn is_in_step(&self, fits: Vec<RecordFit>) -> bool {
        self.study.most_left(&OnAll { train: fits, held_out: Vec::new() }) < IN_STEP
    }

    /// The training recordings, each with a guide along the motion of the places that outputs read.
    fn guided_records(&self, refitted: &Member, given: &Hypothesis) -> Option<Vec<Record>> {
        let space = StateSpace::new(&given.model).ok()?;
        let floors = self.floors_within_readings(refitted);
        let mut ties: Vec<Vec<Tie>> = vec![Vec::new(); self.study.train.len()];
        for place in self.read_places(&space) {
            let of_place = self.ties(given, &space, &floors, &place)?;
            ties.iter_mut().zip(of_place).for_each(|(ties, tie)| ties.push(tie));
        }
        let guided = self.study.train.iter().zip(ties).map(|(record, ties)| {
            let is_whole = ties.iter().all(|tie| tie.displacement.len() == record.time_s.len());
            let guide = Guide { time_s: record.time_s.clone().into(), ties };
            is_whole.then(|| guided_by(record, guide))
        });
        guided.collect()
    }

    /// A spring and a damper from a place to its motion in every training recording.
    fn ties(
        &self,
        given: &Hypothesis,
        space: &StateSpace,
        floors: &[Option<NoiseFloor>],
        place: &str,
    ) -> Option<Vec<Tie>> {
        let (point, _) = space.find_point(place)?;
        let reads = |output: usize| self.given.output_point(output).is_none_or(|read| read == place);
        let feels = |output: usize| space.outputs()[output].feedthrough[point] != 0.0;
        let outputs = &self.study.train.first()?.outputs;
        let is_place = |output: usize| !feels(output) && !self.given.output_is_velocity(output);
        let shows_place = outputs.iter().any(|output| reads(output.index) && is_place(output.index));
        let motions = motions_from_rest(self.study, given, floors, point, &reads)?;
        let fastest_rad_s = TAU * self.study.fastest_hz?;
        let mobility = mobility(&space.points()[point]);
        let tie = |moments: Vec<[f64; 3]>| Tie {
            point: place.to_owned(),
            // Where a body is whose speed or acceleration is read is not known for long.
            stiffness: if shows_place { fastest_rad_s.powi(2) / mobility } else { 0.0 },
            damping: 2.0 * fastest_rad_s / mobility,
            displacement: moments.iter().map(|moment| moment[0]).collect(),
            velocity: moments.iter().map(|moment| moment[1]).collect(),
        };
        Some(motions.into_iter().map(tie).collect())
    }

    /// Names of the injection points that outputs read; all coordinates where an output reads the sum of
    /// several.
    fn read_places(&self, space: &StateSpace) -> Vec<String> {
        let outputs = self.study.train.iter().flat_map(|record| &record.outputs);
        let read: Option<Vec<String>> = outputs.map(|output| self.given.output_point(output.index)).collect();
        let coordinates = space.points().iter().filter(|point| point.is_coordinate);
        let mut places = read.unwrap_or_else(|| coordinates.map(|point| point.name.clone()).collect());
        places.sort_unstable();
        places.dedup();
        places
    }

    /// Noise floors that are no larger than the readings allow: what a refit leaves that is out of step is no
    /// noise.
    fn floors_within_readings(&self, refitted: &Member) -> Vec<Option<NoiseFloor>> {
        let within = |(output, floor): (usize, Option<NoiseFloor>)| {
            let signals = self.study.train.iter().flat_map(|record| &record.outputs);
            let of_output = signals.filter(|signal| signal.index == output);
            let most = of_output.map(|signal| most_noise(&signal.samples)).fold(f64::INFINITY, f64::min);
            floor.map(|floor| NoiseFloor { rms: floor.rms.min(most), ..floor })
        };
        self.study.floors(&refitted.on_all()).into_iter().enumerate().map(within).collect()
    }
}

/// What a unit force at a place does to its velocity per second: one over the mass that it feels.
fn mobility(point: &InjectionPoint) -> f64 {
    dot(&point.velocity.state, &point.force)
}

/// A parameter that stays near the drawing.
fn held_near_the_drawing(mut parameter: FreeParameter) -> FreeParameter {
    if parameter.given > 0.0 {
        parameter.lower = parameter.lower.max(parameter.given / HELD_WITHIN);
        parameter.upper = parameter.upper.min(parameter.given * HELD_WITHIN);
    }
    parameter
}

fn guided_by(record: &Record, guide: Guide) -> Record {
    Record { rerun: record.rerun.clone().with_guide(Arc::new(guide)), ..record.clone() }
}

/// The same recordings with guides so many times as hard.
pub(super) fn loosened(records: &[Record], share: f64) -> Vec<Record> {
    let softer = |record: &Record| match record.rerun.guide() {
        Some(guide) => guided_by(record, guide.loosened(share)),
        None => record.clone(),
    };
    records.iter().map(softer).collect()
}

/// The noise, root mean square, that readings can have at most: third differences of white noise have twenty
/// times its power, and those of a motion that is sampled well hardly any.
fn most_noise(samples: &[f64]) -> f64 {
    let third = samples.windows(4).map(|four| four[3] - 3.0 * four[2] + 3.0 * four[1] - four[0]);
    let (power, count) = third.fold((0.0, 0.0), |(power, count), third| (power + third * third, count + 1.0));
    (power / (20.0 * f64::max(count, 1.0))).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::naming::on_a_spring::{hardening, machine, noisy_runs, runs, searched, searched_around};
    use rand_distr::{Distribution, Normal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;
    use stillbeam_plant::{Model, Quantity};

    const NOISE_M: f64 = 1e-4;

    #[test]
    fn the_softest_guide_is_taken_that_holds_the_drawing_in_step() {
        let left = |stiffness: f64| {
            let noisy =
                |amplitudes: &[f64]| noisy_runs(&hardening(machine(), stiffness), amplitudes, NOISE_M);
            searched(&noisy(&[20.0, 40.0]), &noisy(&[30.0]), |search, refitted| {
                let (study, held) = search.held_in_step(&refitted).unwrap();
                let free = search.drawing(&refitted).unwrap().on_all();
                let hardness = study.train[0].rerun.guide().unwrap().ties[0].stiffness;
                (hardness, search.is_in_step(held.records), search.study.most_left(&free))
            })
        };
        let ((little, little_in_step, free_little), (hard, in_step, free)) = (left(1e4), left(2e5));
        assert!(little_in_step && in_step);
        assert!(free > 2.0 * IN_STEP, "out of step by itself: {free}");
        assert!(hard > 2.0 * little, "{hard} N/m for {free}, {little} N/m for {free_little}");
    }

    #[test]
    fn a_body_whose_speed_is_read_is_held_by_a_damper_alone() {
        let mut given = machine();
        let Model::Lumped(lumped) = &mut given else { panic!("bodies") };
        lumped.outputs[0].quantity = Quantity::Velocity;
        let recorded = runs(&hardening(given.clone(), 2e5), &[20.0, 40.0]);
        searched_around(&given, &recorded, &recorded[..1], |search, refitted| {
            let (study, _) = search.held_in_step(&refitted).unwrap();
            for record in &study.train {
                let tie = &record.rerun.guide().unwrap().ties[0];
                assert!(tie.stiffness == 0.0 && tie.damping > 0.0, "{}, {}", tie.stiffness, tie.damping);
            }
        });
    }

    #[test]
    fn readings_bound_their_noise_whatever_a_refit_leaves() {
        let noisy = |amplitudes: &[f64]| noisy_runs(&hardening(machine(), 2e5), amplitudes, NOISE_M);
        searched(&noisy(&[20.0, 40.0]), &noisy(&[30.0]), |search, refitted| {
            let of_refit = search.study.floors(&refitted.on_all())[0].as_ref().unwrap().rms;
            let within = search.floors_within_readings(&refitted)[0].as_ref().unwrap().rms;
            assert!(of_refit > 3.0 * NOISE_M, "{of_refit} m: it is out of step");
            assert!(within > 0.9 * NOISE_M && within < 0.5 * of_refit, "{within} m of {of_refit} m");
        });
    }

    #[test]
    fn third_differences_show_white_noise_and_no_motion() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let noise = Normal::new(0.0, 0.3).unwrap();
        let noisy: Vec<f64> =
            (0..4000).map(|k| 50.0 * (0.03 * f64::from(k)).sin() + noise.sample(&mut random)).collect();
        assert!((most_noise(&noisy) / 0.3 - 1.0).abs() < 0.1, "{}", most_noise(&noisy));
        assert_eq!(most_noise(&[1.0, 2.0]), 0.0);
    }
}
