//! The force that would explain the rest: a smoother of the refitted model with an unknown force at each place.
//!
//! What the refitted model leaves over obeys `x' = A x + E f`, `e = C x + noise`, with `x` the error of the state. The
//! force is an integrated random walk, whose intensity is the likeliest of a few; a Kalman filter and the smoother
//! of H. Rauch, F. Tung and C. Striebel (AIAA J. 3 (1965) 1445) give its course. Binned over position and speed it
//! shows what a static law would have to look like, and where the machine has never been.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::Serialize;
use stillbeam_plant::{Hold, StateSpace};

use crate::noise::NoiseFloor;
use crate::record::Record;
use crate::simulation::Hypothesis;
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
        .filter_map(|point| surface(study, &space, on_all, floors, point))
        .collect();
    surfaces.sort_by(|a, b| b.log_likelihood_gain.total_cmp(&a.log_likelihood_gain));
    surfaces
}

/// Displacement, velocity and force at one moment.
type Moment = [f64; 3];

fn surface(
    study: &Study,
    space: &StateSpace,
    on_all: &OnAll,
    floors: &[Option<NoiseFloor>],
    point: usize,
) -> Option<ForceSurface> {
    let mut moments: Vec<Vec<Moment>> = Vec::new();
    let mut gain = 0.0;
    for (record, fit) in study.train.iter().zip(&on_all.train) {
        let (found, better) = smoothed(study, space, record, fit, floors, point)?;
        moments.push(found);
        gain += better;
    }
    let described = &space.points()[point];
    bin(&moments).map(|binned| ForceSurface {
        location: described.name.clone(),
        displacement_unit: described.displacement_unit.clone(),
        force_unit: described.force_unit.clone(),
        log_likelihood_gain: gain,
        ..binned
    })
}

/// Intensities that are tried, as the force's root mean square drift per root second over its scale.
const INTENSITIES: [f64; 4] = [0.3, 3.0, 30.0, 300.0];

fn smoothed(
    study: &Study,
    space: &StateSpace,
    record: &Record,
    fit: &RecordFit,
    floors: &[Option<NoiseFloor>],
    point: usize,
) -> Option<(Vec<Moment>, f64)> {
    // All outputs at the first one's samples.
    let at: Vec<usize> = record.outputs.first()?.at.iter().copied().take(MOST_SAMPLES).collect();
    let mut rows: Vec<DVector<f64>> = Vec::new();
    let mut noises = Vec::new();
    let mut series: Vec<Vec<f64>> = Vec::new();
    let mut start = 0;
    for output in &record.outputs {
        let range = start..start + output.at.len();
        start = range.end;
        let weight = study.weights[output.index];
        let mut values = vec![f64::NAN; at.len()];
        for (k, value) in output.at.iter().zip(&fit.residuals[range]) {
            if let Ok(place) = at.binary_search(k) {
                values[place] = value / weight;
            }
        }
        rows.push(DVector::from_row_slice(&space.outputs()[output.index].row.state));
        noises.push(floors[output.index].as_ref()?.rms.powi(2));
        series.push(values);
    }
    let step_s = record.duration_s() / (record.time_s.len().max(2) - 1) as f64;
    let interval_s = step_s * (at.last()? - at.first()?) as f64 / (at.len().max(2) - 1) as f64;
    let discrete = space.discretise(interval_s).ok()?;
    let order = space.order();
    let transition = DMatrix::from_fn(order + 2, order + 2, |i, j| match (i, j) {
        (i, j) if i < order && j < order => discrete.transition[i * order + j],
        (i, j) if i < order && j == order => discrete.force_value[point][i],
        (i, _) if i < order => discrete.force_slope[point][i],
        (i, j) if i == j => 1.0,
        (i, j) if i == order && j == order + 1 => interval_s,
        _ => 0.0,
    });
    let filter = Filter { transition, rows, noises, series };
    let scale = force_scale(&filter, order)?;
    let none = filter.run(0.0, order).log_likelihood;
    let best = INTENSITIES
        .iter()
        .map(|intensity| filter.run((intensity * scale).powi(2) * interval_s, order))
        .max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))?;
    let states = best.smooth(&filter.transition);
    let motion = motion(space, record, fit, point, &at)?;
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
    fit: &RecordFit,
    point: usize,
    at: &[usize],
) -> Option<Vec<[f64; 2]>> {
    let zeros = vec![0.0; record.time_s.len()];
    let input = record.input.as_deref().unwrap_or(&zeros);
    let first = input.first().copied().unwrap_or(0.0);
    let mut start = space.rest_at(first);
    let names = space.points().iter().filter(|point| point.is_coordinate).map(|point| point.name.clone());
    let rest = space.rest_at(0.0);
    for (name, pair) in names.zip(fit.initial.chunks_exact(2)) {
        let given = std::iter::once((name, (pair[0], pair[1]))).collect();
        let moved = space.state_from(&given, 0.0).ok()?;
        for ((state, moved), rest) in start.iter_mut().zip(moved).zip(&rest) {
            *state += moved - rest;
        }
    }
    let trace = space.run(&record.time_s, input, Hold::FirstOrder, &[], &start).ok()?;
    Some(at.iter().map(|&k| [trace.displacements[point][k], trace.velocities[point][k]]).collect())
}

/// A force that, held for a tenth of the slowest response, moves the first output by the residual's size.
fn force_scale(filter: &Filter, order: usize) -> Option<f64> {
    let mut state = DVector::zeros(order + 2);
    state[order] = 1.0;
    let mut largest: f64 = 0.0;
    for _ in 0..200 {
        state = &filter.transition * &state;
        for row in &filter.rows {
            largest = largest.max(row.dot(&state.rows(0, order)).abs());
        }
    }
    let size = filter.series.iter().flatten().filter(|value| value.is_finite());
    let (sum, count) = size.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
    (largest > 0.0 && count > 0.0).then(|| (sum / count).sqrt() / largest)
}

struct Filter {
    transition: DMatrix<f64>,
    /// How each output reads the error of the state.
    rows: Vec<DVector<f64>>,
    /// Variance of each output's noise.
    noises: Vec<f64>,
    /// Residual of each output, NaN where there is none.
    series: Vec<Vec<f64>>,
}

struct Filtered {
    log_likelihood: f64,
    predicted: Vec<(DVector<f64>, DMatrix<f64>)>,
    updated: Vec<(DVector<f64>, DMatrix<f64>)>,
}

impl Filter {
    /// The Kalman filter with the force's slope drifting by a variance per step; outputs are taken one after another.
    fn run(&self, drift: f64, order: usize) -> Filtered {
        let size = order + 2;
        let count = self.series.first().map_or(0, Vec::len);
        let mut state = DVector::zeros(size);
        let mut covariance = DMatrix::zeros(size, size);
        // Nothing is known of the force at the start when there may be one.
        covariance[(order, order)] = drift * 1e4;
        let mut filtered = Filtered {
            log_likelihood: 0.0,
            predicted: Vec::with_capacity(count),
            updated: Vec::with_capacity(count),
        };
        for k in 0..count {
            if k > 0 {
                state = &self.transition * &state;
                covariance = &self.transition * &covariance * self.transition.transpose();
                covariance[(size - 1, size - 1)] += drift;
            }
            filtered.predicted.push((state.clone(), covariance.clone()));
            for ((row, noise), series) in self.rows.iter().zip(&self.noises).zip(&self.series) {
                let measured = series[k];
                if !measured.is_finite() {
                    continue;
                }
                let gain_row = covariance.columns(0, order) * row;
                let innovation = measured - row.dot(&state.rows(0, order));
                let variance = row.dot(&gain_row.rows(0, order)) + noise;
                filtered.log_likelihood -= 0.5 * (variance.ln() + innovation * innovation / variance);
                state += &gain_row * (innovation / variance);
                covariance -= &gain_row * gain_row.transpose() / variance;
            }
            filtered.updated.push((state.clone(), covariance.clone()));
        }
        filtered
    }
}

impl Filtered {
    /// The smoother's means.
    fn smooth(&self, transition: &DMatrix<f64>) -> Vec<DVector<f64>> {
        let mut states: Vec<DVector<f64>> = self.updated.iter().map(|(state, _)| state.clone()).collect();
        for k in (0..states.len().saturating_sub(1)).rev() {
            let (state, covariance) = &self.updated[k];
            let (next, next_covariance) = &self.predicted[k + 1];
            // Scaled, because displacements and forces differ by many orders of magnitude.
            let scale = next_covariance.diagonal().map(|value| value.max(1e-300).sqrt());
            let scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
                next_covariance[(i, j)] / (scale[i] * scale[j]) + if i == j { 1e-12 } else { 0.0 }
            });
            let Some(factor) = scaled.cholesky() else { continue };
            let step = (&states[k + 1] - next).component_div(&scale);
            let solved = factor.solve(&step).component_div(&scale);
            states[k] = state + covariance * transition.transpose() * solved;
        }
        states
    }
}

/// Means per cell; `None` where nothing moved.
fn bin(moments: &[Vec<Moment>]) -> Option<ForceSurface> {
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
        rms: (power / count.max(1.0)).sqrt(),
        static_share: if power > 0.0 { (1.0 - rest / power).clamp(0.0, 1.0) } else { 0.0 },
        log_likelihood_gain: 0.0,
    })
}
