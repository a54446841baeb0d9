//! The course of an unknown force from what a model leaves over: a Kalman filter and a smoother.
//!
//! The error of the state obeys `x' = A x + E f`, of which outputs read `C x + noise`. The force is white
//! noise through two equal low-pass filters of time constant `tau`: `f' = (g - f) / tau`, `g' = -g / tau +
//! w`, so that it has a size. (An integrated random walk has none, and where the outputs hardly see a force
//! its smoothed course grows without bounds.) Size and time constant are the likeliest of a few. The smoother
//! is the one of P. de Jong (J. Amer. Statist. Assoc. 84 (1989) 1085), which inverts no covariance: with
//! innovations `v`, their variances `F` and `d` the covariance of state and reading, backwards `r <- r + h
//! (v - d' r) / F` per reading and `r <- T' r` per step, and the smoothed state is the predicted one plus `P
//! r`.

use std::rc::Rc;

use nalgebra::{DMatrix, DVector};
use stillbeam_plant::StateSpace;
use stillbeam_plant::state_space::Output;

/// A force whose size and time constant are not known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prior {
    /// Its root mean square.
    pub(super) size: f64,
    /// Time constant of both low-pass filters, seconds.
    pub(super) time_constant_s: f64,
}

/// What outputs read of the error of the state, at even times.
pub(super) struct Readings {
    /// How each output reads the error of the state and, behind it, the force: see [`reading`].
    pub(super) rows: Vec<DVector<f64>>,
    /// Variance of each output's noise.
    pub(super) noises: Vec<f64>,
    /// Residual of each output, NaN where there is none.
    pub(super) series: Vec<Vec<f64>>,
}

/// How an output reads the error of the state and a force at a point: an acceleration feels that at once.
pub(super) fn reading(output: &Output, point: usize) -> DVector<f64> {
    let felt = output.feedthrough.get(point).copied().unwrap_or(0.0);
    DVector::from_iterator(output.row.state.len() + 1, output.row.state.iter().copied().chain([felt]))
}

/// The error of the state under a force at one place.
pub(super) struct ForcedError {
    order: usize,
    interval_s: f64,
    transition: Vec<f64>,
    force_value: Vec<f64>,
    force_slope: Vec<f64>,
}

impl ForcedError {
    pub(super) fn new(space: &StateSpace, point: usize, interval_s: f64) -> Option<Self> {
        let discrete = space.discretise(interval_s).ok()?;
        Some(Self {
            order: space.order(),
            interval_s,
            force_value: discrete.force_value.get(point)?.clone(),
            force_slope: discrete.force_slope.get(point)?.clone(),
            transition: discrete.transition,
        })
    }

    /// From one sample to the next: the error of the state, the force, and what comes through its first
    /// filter.
    fn step(&self, time_constant_s: f64) -> DMatrix<f64> {
        let Self { order, interval_s, .. } = *self;
        let decay = (-interval_s / time_constant_s).exp();
        DMatrix::from_fn(order + 2, order + 2, |i, j| match (i.checked_sub(order), j.checked_sub(order)) {
            (None, None) => self.transition[i * order + j],
            // The force's slope is (g - f) / tau.
            (None, Some(0)) => self.force_value[i] - self.force_slope[i] / time_constant_s,
            (None, Some(_)) => self.force_slope[i] / time_constant_s,
            (Some(k), Some(l)) if k == l => decay,
            (Some(0), Some(1)) => decay * interval_s / time_constant_s,
            _ => 0.0,
        })
    }

    /// The largest reading of the first output that has any, under a force of one held for so many steps.
    fn reach(&self, readings: &Readings, steps: usize) -> f64 {
        let step = self.step(f64::INFINITY);
        let mut state = DVector::zeros(self.order + 2);
        state[self.order] = 1.0;
        let mut largest: f64 = 0.0;
        for _ in 0..steps {
            state = &step * &state;
            for row in &readings.rows {
                largest = largest.max(row.dot(&state.rows(0, row.len())).abs());
            }
        }
        largest
    }

    /// The likeliest size and time constant between these two, judged on the first samples; `None` where a
    /// force here is not seen.
    pub(super) fn likeliest(&self, readings: &Readings, fastest_s: f64, slowest_s: f64) -> Option<Prior> {
        let readings = readings.first(JUDGED_SAMPLES);
        let values = readings.series.iter().flatten().filter(|value| value.is_finite());
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
        let reach = self.reach(&readings, HELD_STEPS);
        if !(reach > 0.0 && count > 0.0 && sum > 0.0) {
            return None;
        }
        let scale = (sum / count).sqrt() / reach;
        let likelihood = |prior: &Prior| self.filter(&readings, Some(*prior), |_| ()).0;
        let best = |priors: Vec<Prior>| {
            let rated = priors.into_iter().map(|prior| (likelihood(&prior), prior));
            rated.filter(|(rate, _)| rate.is_finite()).max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let time_constants = [fastest_s, (fastest_s * slowest_s).sqrt(), slowest_s];
        let coarse = time_constants.iter().flat_map(|time_constant_s| {
            COARSE.iter().map(|size| Prior { size: size * scale, time_constant_s: *time_constant_s })
        });
        let (rate, found) = best(coarse.collect())?;
        let fine = FINE.iter().map(|factor| Prior { size: factor * found.size, ..found });
        let (finer_rate, finer) = best(fine.collect())?;
        Some(if finer_rate > rate { finer } else { found })
    }

    /// The Kalman filter, with what a smoother needs of it.
    pub(super) fn run(&self, readings: &Readings, prior: Option<Prior>) -> Filtered {
        let mut steps = Vec::with_capacity(readings.series.first().map_or(0, Vec::len));
        let (log_likelihood, transition) = self.filter(readings, prior, |step| steps.push(step));
        Filtered { log_likelihood, steps, transition }
    }

    /// The Kalman filter; outputs are taken one after another. Without a prior there is no force. Every step
    /// is shown to `keep`; the logarithm of the likelihood and the transition come back. Where covariances
    /// have settled and no reading is missing they are not made again: they do not depend on what was read.
    fn filter(
        &self,
        readings: &Readings,
        prior: Option<Prior>,
        mut keep: impl FnMut(Step),
    ) -> (f64, DMatrix<f64>) {
        let size = self.order + 2;
        let Prior { size: force, time_constant_s } =
            prior.unwrap_or(Prior { size: 0.0, time_constant_s: f64::INFINITY });
        let transition = self.step(time_constant_s);
        let decay = (-self.interval_s / time_constant_s).exp();
        // Two filters in a row halve the variance.
        let first_variance = 2.0 * force * force;
        let fed = first_variance * (1.0 - decay * decay);
        let mut state = DVector::zeros(size);
        let mut covariance = DMatrix::zeros(size, size);
        covariance[(size - 2, size - 2)] = force * force;
        covariance[(size - 2, size - 1)] = force * force;
        covariance[(size - 1, size - 2)] = force * force;
        covariance[(size - 1, size - 1)] = first_variance;
        let propagate = |covariance: &DMatrix<f64>| {
            let mut next = &transition * covariance * transition.transpose();
            next[(size - 1, size - 1)] += fed;
            next
        };
        // The error begins somewhere: as if the force had acted before, unseen.
        for _ in 0..HELD_STEPS {
            covariance = propagate(&covariance);
        }
        let count = readings.series.first().map_or(0, Vec::len);
        let mut log_likelihood = 0.0;
        let mut settled: Option<Rc<Gains>> = None;
        let mut before: Option<Rc<Gains>> = None;
        for k in 0..count {
            if k > 0 {
                state = &transition * &state;
            }
            let measured = || readings.series.iter().map(|series| series[k]);
            let is_whole = measured().all(f64::is_finite);
            let gains = match settled.take().filter(|_| is_whole) {
                Some(gains) => gains,
                None => {
                    if k > 0 {
                        covariance = propagate(&covariance);
                    }
                    let predicted = covariance.clone();
                    let seen = readings.rows.iter().zip(&readings.noises).enumerate();
                    let seen = seen.filter(|(output, _)| readings.series[*output][k].is_finite());
                    let by_output = seen.map(|(output, (row, noise))| {
                        let with_state = covariance.columns(0, row.len()) * row;
                        let variance = row.dot(&with_state.rows(0, row.len())) + noise;
                        covariance -= &with_state * with_state.transpose() / variance;
                        Gain { output, variance, with_state }
                    });
                    let by_output = by_output.collect();
                    Rc::new(Gains { predicted, by_output, is_whole })
                }
            };
            let mut step =
                Step { predicted: state.clone(), gains: Rc::clone(&gains), innovations: Vec::new() };
            for Gain { output, variance, with_state } in &gains.by_output {
                let row = &readings.rows[*output];
                let innovation = readings.series[*output][k] - row.dot(&state.rows(0, row.len()));
                log_likelihood -= 0.5 * (variance.ln() + innovation * innovation / variance);
                state += with_state * (innovation / variance);
                step.innovations.push(innovation);
            }
            keep(step);
            let is_near = |before: &Rc<Gains>| Rc::ptr_eq(before, &gains) || before.is_near(&gains);
            let is_same = before.as_ref().is_some_and(|before| before.is_whole && is_near(before));
            settled = (gains.is_whole && is_same).then(|| Rc::clone(&gains));
            before = Some(gains);
        }
        (log_likelihood, transition)
    }
}

/// Samples on which size and time constant are judged.
const JUDGED_SAMPLES: usize = 3_000;
/// Steps for which a force is held to see its reach, and for which it has acted before the first sample.
const HELD_STEPS: usize = 200;
/// Sizes that are tried, over the one whose held force moves the outputs by the residual's size.
const COARSE: [f64; 4] = [0.1, 1.0, 10.0, 100.0];
/// Then nearby ones.
const FINE: [f64; 4] = [0.25, 0.5, 2.0, 4.0];

impl Readings {
    fn first(&self, count: usize) -> Self {
        let series = self.series.iter().map(|series| series.iter().take(count).copied().collect());
        Self { rows: self.rows.clone(), noises: self.noises.clone(), series: series.collect() }
    }
}

/// How one output corrects the state.
struct Gain {
    output: usize,
    variance: f64,
    /// Covariance of the state and the reading.
    with_state: DVector<f64>,
}

/// What a step does whatever is read.
struct Gains {
    /// Covariance of the predicted state.
    predicted: DMatrix<f64>,
    by_output: Vec<Gain>,
    /// Whether every output was read.
    is_whole: bool,
}

/// Covariances that change by less than this share from one step to the next have settled.
const SETTLED: f64 = 1e-10;

impl Gains {
    /// Whether the covariances are the same, each compared to the variances that it belongs to.
    fn is_near(&self, other: &Self) -> bool {
        let (old, new) = (&self.predicted, &other.predicted);
        (0..new.nrows()).all(|i| {
            (0..=i).all(|j| {
                let size = (new[(i, i)] * new[(j, j)]).abs().sqrt();
                (new[(i, j)] - old[(i, j)]).abs() <= SETTLED * size
            })
        })
    }
}

struct Step {
    predicted: DVector<f64>,
    gains: Rc<Gains>,
    /// In the order of the gains.
    innovations: Vec<f64>,
}

/// A run of the filter.
pub(super) struct Filtered {
    /// Logarithm of the likelihood of the readings, less a constant.
    pub(super) log_likelihood: f64,
    steps: Vec<Step>,
    transition: DMatrix<f64>,
}

impl Filtered {
    /// The smoother's means: the error of the state, then the force, then what comes through its first
    /// filter.
    pub(super) fn smooth(&self, readings: &Readings) -> Vec<DVector<f64>> {
        let size = self.transition.nrows();
        let mut adjoint = DVector::zeros(size);
        let mut states = Vec::with_capacity(self.steps.len());
        for step in self.steps.iter().rev() {
            for (gain, innovation) in step.gains.by_output.iter().zip(&step.innovations).rev() {
                let row = &readings.rows[gain.output];
                let pull = (innovation - gain.with_state.dot(&adjoint)) / gain.variance;
                let mut seen = adjoint.rows_mut(0, row.len());
                seen += row * pull;
            }
            states.push(&step.predicted + &step.gains.predicted * &adjoint);
            adjoint = self.transition.transpose() * adjoint;
        }
        states.reverse();
        states
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stillbeam_plant::Model;

    const STAGE: &str = r#"
schema = 1
kind = "lumped"

[[body]]
name = "slider"
mass = 2.0

[[spring]]
between = ["slider", "ground"]
stiffness = 80.0

[[damper]]
between = ["slider", "ground"]
damping = 1.5

[input]
column = "motor_force_N"
body = "slider"

[[output]]
column = "slider_position_m"
body = "slider"
quantity = "position"
"#;

    /// What is missed of the power of a force that is known, on a machine that is known, read with noise;
    /// with an output that is told to feel it or not.
    fn share_missed(quantity: &str, noise: f64, feels: bool) -> f64 {
        let model = Model::from_toml("stage.toml", &STAGE.replace("\"position\"", quantity)).unwrap();
        let space = StateSpace::new(&model).unwrap();
        let interval_s = 0.01;
        let force: Vec<f64> = (0..3000)
            .map(|k| {
                let time_s = interval_s * f64::from(k);
                0.3 * (4.0 * time_s).sin().signum() + 0.2 * (1.3 * time_s).cos()
            })
            .collect();
        let times: Vec<f64> = (0..3000).map(|k| interval_s * f64::from(k)).collect();
        let start = space.rest_at(0.0);
        let trace = space.run(&times, &force, stillbeam_plant::Hold::FirstOrder, &[], &start).unwrap();
        let mut random = 1_u64;
        let mut draw = || {
            // Twelve uniform ones make a normal one.
            (0..12)
                .map(|_| {
                    random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    (random >> 11) as f64 / (1_u64 << 53) as f64
                })
                .sum::<f64>()
                - 6.0
        };
        let mut row = reading(&space.outputs()[0], 0);
        if !feels {
            row[space.order()] = 0.0;
        }
        let readings = Readings {
            rows: vec![row],
            noises: vec![noise * noise],
            series: vec![trace.outputs[0].iter().map(|y| y + noise * draw()).collect()],
        };
        let error = ForcedError::new(&space, 0, interval_s).unwrap();
        let prior = error.likeliest(&readings, 0.015, 0.6).unwrap();
        let filtered = error.run(&readings, Some(prior));
        assert!(filtered.log_likelihood > error.run(&readings, None).log_likelihood + 100.0);
        let smoothed = filtered.smooth(&readings);
        let order = space.order();
        let (mut wrong, mut power) = (0.0, 0.0);
        for (state, force) in smoothed.iter().zip(&force) {
            wrong += (state[order] - force).powi(2);
            power += force * force;
        }
        wrong / power
    }

    #[test]
    fn a_known_force_is_given_back_with_its_size() {
        let missed = share_missed("\"position\"", 1e-5, true);
        assert!(missed < 0.1, "{missed} of the force's power");
    }

    #[test]
    fn an_accelerometer_feels_the_force_at_once() {
        let missed = |feels: bool| share_missed("\"acceleration\"", 1e-3, feels);
        assert!(missed(true) < 0.2 && missed(false) > 0.5, "{} {}", missed(true), missed(false));
    }
}
