//! The force that would explain the rest: a smoother of the refitted model with an unknown force at each
//! place.
//!
//! Binned over position and speed it shows what a static law would have to look like, and where the machine
//! has never been. `smoother` has the maths.

use nalgebra::DVector;
use rayon::prelude::*;
use serde::Serialize;
use stillbeam_plant::state_space::InjectionPoint;
use stillbeam_plant::{Hold, Motion, Physics, StateSpace, force_along};

use super::smoother::{ForcedError, Readings, reading};
use crate::noise::NoiseFloor;
use crate::record::{OutputSignal, Record};
use crate::simulation::{Hypothesis, at_samples, simulate, state_count};
use crate::stacking::RecordFit;
use crate::study::{OnAll, Study};

/// Cells along either axis.
pub const CELLS: usize = 12;

/// A latent force over position and speed at one place.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ForceSurface {
    /// The place.
    pub location: String,
    /// Units of displacement and force.
    pub displacement_unit: String,
    /// Unit of the force.
    pub force_unit: String,
    /// Ends of both axes: displacement from, to; velocity from, to.
    pub range: [f64; 4],
    /// Mean force per cell, velocity by velocity; `None` where the machine never was.
    pub mean: Vec<Option<f64>>,
    /// Standard error of the mean, from its scatter between visits of the cell.
    pub stderr: Vec<Option<f64>>,
    /// Where laws were found at this place: the mean of their force per cell, along the same motion.
    pub law: Option<Vec<Option<f64>>>,
    /// Root mean square of the force.
    pub rms: f64,
    /// Share (0 to 1) of its power that is a function of position and speed.
    pub static_share: f64,
    /// Logarithm of the likelihood of the residuals with a force here, less that with none.
    pub log_likelihood_gain: f64,
}

/// Longest stretch that is smoothed, samples: a force that acts shows in it.
const MOST_SAMPLES: usize = 12_000;

/// Surfaces of all places at which a force could act, the likeliest first.
pub(crate) fn latent_forces(
    study: &Study,
    refitted: &Hypothesis,
    on_all: &OnAll,
    floors: &[Option<NoiseFloor>],
) -> Vec<ForceSurface> {
    let Ok(space) = StateSpace::new(&refitted.model) else { return Vec::new() };
    let mut surfaces: Vec<ForceSurface> = (0..space.points().len())
        .into_par_iter()
        .filter_map(|point| surface(study, &space, on_all, floors, point, None))
        .collect();
    surfaces.sort_by(|a, b| b.log_likelihood_gain.total_cmp(&a.log_likelihood_gain));
    surfaces
}

/// Surfaces at the places of laws: what the extended model lacks when its laws of that place are taken out
/// again.
pub(crate) fn forces_of_laws(
    study: &Study,
    extended: &Hypothesis,
    on_all: &OnAll,
    floors: &[Option<NoiseFloor>],
) -> Vec<ForceSurface> {
    let Ok(space) = StateSpace::new(&extended.model) else { return Vec::new() };
    let starts = |fits: &[RecordFit]| fits.iter().map(|fit| fit.initial.clone()).collect::<Vec<Vec<f64>>>();
    let at_place = |(point, described): (usize, &InjectionPoint)| {
        let mut without = extended.clone();
        let laws = &mut without.model.setup_mut().physics;
        let (here, elsewhere): (Vec<Physics>, Vec<Physics>) =
            std::mem::take(laws).into_iter().partition(|law| law.location == described.name);
        *laws = elsewhere;
        if here.is_empty() {
            return None;
        }
        let on_all = study.on_all(&without, &starts(&on_all.train), &starts(&on_all.held_out)).ok()?;
        let course =
            |moments: &[Moment], record: &Record| law_forces(&without, &here, moments, record, point);
        surface(study, &space, &on_all, floors, point, Some(&course))
    };
    space.points().iter().enumerate().filter_map(at_place).collect()
}

/// Displacement, velocity and force at one moment.
pub(crate) type Moment = [f64; 3];

/// The force of laws along the moments of a record.
type LawForces<'l> = dyn Fn(&[Moment], &Record) -> Option<Vec<f64>> + 'l;

/// The force of laws at a place along the moments of a record.
pub(crate) fn law_forces(
    model: &Hypothesis,
    laws: &[Physics],
    moments: &[Moment],
    record: &Record,
    point: usize,
) -> Option<Vec<f64>> {
    let at = samples_of(record)?;
    let here = [0, 1].map(|axis| moments.iter().map(|moment| moment[axis]).collect::<Vec<f64>>());
    let still = vec![0.0; moments.len()];
    let mut points = vec![[still.clone(), still.clone()]; point];
    points.push(here);
    let input = record.input.as_ref().map_or(still.clone(), |input| at.iter().map(|&k| input[k]).collect());
    let motion = Motion { time_s: at.iter().map(|&k| record.time_s[k]).collect(), input, points };
    let mut sum = still;
    for law in laws {
        for series in force_along(&model.model, law, &motion).ok()?.iter().filter(|s| s.point == point) {
            sum.iter_mut().zip(&series.samples).for_each(|(sum, force)| *sum += force);
        }
    }
    Some(sum)
}

/// The stamps that are smoothed: evenly spaced as those of the first output are, also where samples of it are
/// missing.
fn samples_of(record: &Record) -> Option<Vec<usize>> {
    Some(evenly(&record.outputs.first()?.at))
}

/// The places from the first to the last of these, so far apart as most of them are.
fn evenly(at: &[usize]) -> Vec<usize> {
    let mut apart: Vec<usize> = at.windows(2).map(|pair| pair[1] - pair[0]).collect();
    apart.sort_unstable();
    let stride = apart.get(apart.len() / 2).copied().unwrap_or(1).max(1);
    let (Some(first), Some(last)) = (at.first(), at.last()) else { return Vec::new() };
    (*first..=*last).step_by(stride).take(MOST_SAMPLES).collect()
}

/// The motion at a place, and the force there that would explain how recordings depart from a linear model
/// that was at rest when each began; one per training recording. `None` where one has no such beginning.
///
/// Outputs for which `tells` holds are read.
///
/// Unlike a fit's residuals these departures have no initial state and no offset fitted to them: a force that
/// changes the motion beyond recognition would be taken for those. In a loop they are from what the recorded
/// force alone would have moved: what holds the machine against a force that the model lacks is part of what
/// was recorded.
pub(crate) fn motions_from_rest(
    study: &Study,
    linear: &Hypothesis,
    floors: &[Option<NoiseFloor>],
    point: usize,
    tells: &dyn Fn(usize) -> bool,
) -> Option<Vec<Vec<Moment>>> {
    let space = StateSpace::new(&linear.model).ok()?;
    let from_rest = |record: &Record| {
        let input = record.input.as_ref()?;
        let simulated = if record.rerun.is_in_loop() {
            // The linear machine alone is run open loop.
            if !linear.is_linear() {
                return None;
            }
            let start = space.rest_at(*input.first()?);
            let trace = space.run(&record.time_s, input, Hold::FirstOrder, &[], &start).ok()?;
            at_samples(record, &trace.outputs)?
        } else {
            simulate(linear, record, &vec![0.0; state_count(linear)?])?
        };
        let departures = record.outputs.iter().zip(&simulated).map(|(output, simulated)| {
            let departure: Vec<f64> = output.samples.iter().zip(simulated).map(|(m, s)| m - s).collect();
            let first = &departure[..departure.len().min(FIRST_SAMPLES)];
            let zero = first.iter().sum::<f64>() / first.len().max(1) as f64;
            departure.into_iter().map(|value| value - zero).collect::<Vec<f64>>()
        });
        let departures = departures.zip(&record.outputs).map(|(departures, output)| {
            if tells(output.index) { departures } else { vec![f64::NAN; departures.len()] }
        });
        let departures: Vec<Vec<f64>> = departures.collect();
        Some(smoothed(study, &space, record, (&[], &departures), floors, point)?.0)
    };
    study.train.iter().map(from_rest).collect()
}

/// Readings from which a sensor's zero is taken where the machine is at rest to begin with.
const FIRST_SAMPLES: usize = 8;

fn surface(
    study: &Study,
    space: &StateSpace,
    on_all: &OnAll,
    floors: &[Option<NoiseFloor>],
    point: usize,
    laws: Option<&LawForces<'_>>,
) -> Option<ForceSurface> {
    let mut moments: Vec<Vec<Moment>> = Vec::new();
    let mut law_courses: Vec<Vec<f64>> = Vec::new();
    let mut gain = 0.0;
    for (record, fit) in study.train.iter().zip(&on_all.train) {
        let departures = residuals_of(study, record, fit);
        let (found, better) = smoothed(study, space, record, (&fit.initial, &departures), floors, point)?;
        law_courses.extend(laws.and_then(|forces| forces(&found, record)));
        moments.push(found);
        gain += better;
    }
    let law = (law_courses.len() == moments.len()).then_some(&law_courses[..]);
    let described = &space.points()[point];
    bin(&moments, law).map(|binned| ForceSurface {
        location: described.name.clone(),
        displacement_unit: described.displacement_unit.clone(),
        force_unit: described.force_unit.clone(),
        log_likelihood_gain: gain,
        ..binned
    })
}

/// What a fit leaves over, output by output, in the outputs' units.
fn residuals_of(study: &Study, record: &Record, fit: &RecordFit) -> Vec<Vec<f64>> {
    let mut start = 0;
    let of_output = |output: &OutputSignal| {
        let range = start..start + output.at.len();
        start = range.end;
        study.weighting(output.index).undone(&fit.residuals[range])
    };
    record.outputs.iter().map(of_output).collect()
}

fn smoothed(
    study: &Study,
    space: &StateSpace,
    record: &Record,
    (initial, departures): (&[f64], &[Vec<f64>]),
    floors: &[Option<NoiseFloor>],
    point: usize,
) -> Option<(Vec<Moment>, f64)> {
    // All outputs at the first one's samples.
    let at = samples_of(record)?;
    let mut rows: Vec<DVector<f64>> = Vec::new();
    let mut noises = Vec::new();
    let mut series: Vec<Vec<f64>> = Vec::new();
    let told =
        |(_, departures): &(&OutputSignal, &Vec<f64>)| departures.iter().any(|value| value.is_finite());
    for (output, departures) in record.outputs.iter().zip(departures).filter(told) {
        let mut values = vec![f64::NAN; at.len()];
        for (k, value) in output.at.iter().zip(departures) {
            if let Ok(place) = at.binary_search(k) {
                values[place] = *value;
            }
        }
        rows.push(reading(&space.outputs()[output.index], point));
        noises.push(floors[output.index].as_ref()?.rms.powi(2));
        series.push(values);
    }
    let step_s = record.duration_s() / (record.time_s.len().max(2) - 1) as f64;
    let interval_s = step_s * (at.last()? - at.first()?) as f64 / (at.len().max(2) - 1) as f64;
    let order = space.order();
    let error = ForcedError::new(space, point, interval_s)?;
    let readings = Readings { rows, noises, series };
    let hertz = |frequency_hz: Option<f64>| 1.0 / (std::f64::consts::TAU * frequency_hz.unwrap_or(1.0));
    let fastest_s = (0.25 * hertz(study.fastest_hz)).max(1.5 * interval_s);
    let slowest_s = (4.0 * hertz(study.slowest_hz)).max(4.0 * fastest_s);
    let prior = error.likeliest(&readings, fastest_s, slowest_s)?;
    let best = error.run(&readings, Some(prior));
    let none = error.run(&readings, None).log_likelihood;
    let states = best.smooth(&readings);
    let motion = motion(space, record, initial, point, &at)?;
    let described = &space.points()[point];
    let moments = states
        .iter()
        .zip(motion)
        .map(|(state, [z, v])| {
            let error = &state.as_slice()[..order];
            let add = |row: &[f64]| row.iter().zip(error).map(|(a, b)| a * b).sum::<f64>();
            [z + add(&described.displacement.state), v + add(&described.velocity.state), state[order]]
        })
        .collect();
    Some((moments, best.log_likelihood - none))
}

/// The motion at a place under the refitted model.
fn motion(
    space: &StateSpace,
    record: &Record,
    initial: &[f64],
    point: usize,
    at: &[usize],
) -> Option<Vec<[f64; 2]>> {
    let zeros = vec![0.0; record.time_s.len()];
    let input = record.input.as_deref().unwrap_or(&zeros);
    let first = input.first().copied().unwrap_or(0.0);
    let mut start = space.rest_at(first);
    let names = space.points().iter().filter(|point| point.is_coordinate).map(|point| point.name.clone());
    let rest = space.rest_at(0.0);
    for (name, pair) in names.zip(initial.chunks_exact(2)) {
        let given = std::iter::once((name, (pair[0], pair[1]))).collect();
        let moved = space.state_from(&given, 0.0).ok()?;
        for ((state, moved), rest) in start.iter_mut().zip(moved).zip(&rest) {
            *state += moved - rest;
        }
    }
    let trace = space.run(&record.time_s, input, Hold::FirstOrder, &[], &start).ok()?;
    Some(at.iter().map(|&k| [trace.displacements[point][k], trace.velocities[point][k]]).collect())
}

/// Means per cell; `None` where nothing moved.
fn bin(moments: &[Vec<Moment>], law: Option<&[Vec<f64>]>) -> Option<ForceSurface> {
    let all = || moments.iter().flatten();
    let ends = |axis: usize| {
        all().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], m| [low.min(m[axis]), high.max(m[axis])])
    };
    let ([z0, z1], [v0, v1]) = (ends(0), ends(1));
    if !(z1 > z0 && v1 > v0) {
        return None;
    }
    let cell = |m: &Moment| {
        let place = |value: f64, low: f64, high: f64| {
            (((value - low) / (high - low) * CELLS as f64) as usize).min(CELLS - 1)
        };
        place(m[1], v0, v1) * CELLS + place(m[0], z0, z1)
    };
    // Means of single visits: samples of one visit are not independent.
    let mut visits: Vec<Vec<f64>> = vec![Vec::new(); CELLS * CELLS];
    let mut weights: Vec<f64> = vec![0.0; CELLS * CELLS];
    for course in moments {
        let mut k = 0;
        while k < course.len() {
            let here = cell(&course[k]);
            let mut end = k;
            while end < course.len() && cell(&course[end]) == here {
                end += 1;
            }
            visits[here].push(course[k..end].iter().map(|m| m[2]).sum::<f64>() / (end - k) as f64);
            weights[here] += (end - k) as f64;
            k = end;
        }
    }
    let average = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let mean: Vec<Option<f64>> =
        visits.iter().map(|visits| (!visits.is_empty()).then(|| average(visits))).collect();
    let stderr = visits
        .iter()
        .zip(&mean)
        .map(|(visits, mean)| {
            let mean = (*mean)?;
            let n = visits.len() as f64;
            let square: f64 = visits.iter().map(|value| (value - mean).powi(2)).sum();
            (visits.len() > 1).then(|| (square / (n - 1.0) / n).sqrt())
        })
        .collect();
    let law = law.map(|courses| {
        let mut sums = vec![(0.0, 0.0); CELLS * CELLS];
        for (moment, force) in all().zip(courses.iter().flatten()) {
            let (sum, count) = &mut sums[cell(moment)];
            *sum += force;
            *count += 1.0;
        }
        sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| sum / count)).collect()
    });
    let count = all().count() as f64;
    let power = all().map(|m| m[2] * m[2]).sum::<f64>();
    let rest: f64 = all().map(|m| (m[2] - mean[cell(m)].unwrap_or(0.0)).powi(2)).sum();
    Some(ForceSurface {
        location: String::new(),
        displacement_unit: String::new(),
        force_unit: String::new(),
        range: [z0, z1, v0, v1],
        mean,
        stderr,
        law,
        rms: (power / count.max(1.0)).sqrt(),
        static_share: if power > 0.0 { (1.0 - rest / power).clamp(0.0, 1.0) } else { 0.0 },
        log_likelihood_gain: 0.0,
    })
}

#[cfg(test)]
mod tests {
    use stillbeam_recording::Recording;

    use super::*;
    use crate::axis_in_loop::{axis, axis_with, run};
    use crate::noise::NoiseSource;

    /// The loop holds the slide where it shall be: what is left of the position hardly shows the force, the
    /// recorded one does.
    #[test]
    fn a_force_that_a_loop_holds_up_is_seen_in_what_the_recorded_force_would_not_have_moved() {
        let linear = axis();
        let truth = axis_with(Physics::new("coulomb_friction", "slider").with("force", 40.0));
        let recording = run(&truth);
        let recordings = [recording.clone(), Recording { name: "again".to_owned(), ..recording }];
        let study = Study::new(&linear, &recordings, &[]).unwrap();
        let floors = vec![Some(NoiseFloor { rms: 1e-6, source: NoiseSource::Repeats, samples: 4000.0 })];
        let moments = motions_from_rest(&study, &Hypothesis::given(&linear), &floors, 0, &|_| true).unwrap();
        let moving = moments[0].iter().filter(|[_, v, _]| v.abs() > 0.1);
        let (along, count) =
            moving.fold((0.0, 0.0), |(sum, n), [_, v, force]| (sum - force * v.signum(), n + 1.0));
        assert!(count > 1000.0 && (along / count / 40.0 - 1.0).abs() < 0.1, "{} N", along / count);

        let with_friction = Hypothesis::given(&truth);
        assert!(
            motions_from_rest(&study, &with_friction, &floors, 0, &|_| true).is_none(),
            "not what a law of its own does"
        );
    }

    #[test]
    fn a_missing_sample_leaves_the_others_as_far_apart_as_they_are() {
        assert_eq!(evenly(&[0, 3, 6, 12, 15]), [0, 3, 6, 9, 12, 15]);
        assert_eq!(evenly(&[2, 3, 4, 6, 7]), [2, 3, 4, 5, 6, 7]);
        assert!(evenly(&[]).is_empty());
    }
}
