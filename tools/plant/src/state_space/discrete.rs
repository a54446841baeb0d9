//! The state space over one step, without discretisation error.

use nalgebra::DMatrix;

use super::{Row, StateSpace};
use crate::blocks::Blocks;
use crate::error::PlantError;
use crate::linear::{dot, exponential};

/// The state space over a step in which the input and every force are straight lines:
/// `x(t + h) = Φ x(t) + β u + γ u' + Σ_j (G_j f_j + H_j f_j')`.
///
/// Exact for such inputs: it is the exponential of the system together with its inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Discrete {
    /// `h` in seconds.
    pub step_s: f64,
    /// Number of states.
    pub order: usize,
    /// `Φ`, row by row.
    pub transition: Vec<f64>,
    blocks: Blocks,
    /// `β`: effect of the input's value at the step's start.
    pub input_value: Vec<f64>,
    /// `γ`: effect of the input's slope.
    pub input_slope: Vec<f64>,
    /// `G_j`, one vector per injection point: effect of a force's value at the step's start.
    pub force_value: Vec<Vec<f64>>,
    /// `H_j`: effect of a force's slope.
    pub force_slope: Vec<Vec<f64>>,
}

impl StateSpace {
    /// The exact step of `step_s` seconds (at least 0).
    ///
    /// # Errors
    /// [`PlantError::TooFast`] when the step is not finite or holds more than about 1e5 periods.
    pub fn discretise(&self, step_s: f64) -> Result<Discrete, PlantError> {
        let order = self.order();
        let count = 1 + self.points().len();
        let mut joined = DMatrix::zeros(order + 2 * count, order + 2 * count);
        joined.view_mut((0, 0), (order, order)).copy_from(self.a());
        // Columns: input and forces, then their slopes, each the rate of its value.
        for row in 0..order {
            joined[(row, order)] = self.input_value()[row];
            joined[(row, order + count)] = self.input_slope()[row];
            for (index, point) in self.points().iter().enumerate() {
                joined[(row, order + 1 + index)] = point.force[row];
            }
        }
        for index in 0..count {
            joined[(order + index, order + count + index)] = 1.0;
        }
        let too_fast = PlantError::TooFast { duration_s: step_s };
        let exponential = exponential(joined * step_s).ok_or(too_fast)?;
        let column = |index| exponential.column(index).iter().take(order).copied().collect::<Vec<f64>>();
        let transition: Vec<f64> = (0..order)
            .flat_map(|row| (0..order).map(move |column| (row, column)))
            .map(|place| exponential[place])
            .collect();
        Ok(Discrete {
            step_s,
            order,
            blocks: Blocks::new(order, &transition),
            transition,
            input_value: column(order),
            input_slope: column(order + count),
            force_value: (1..count).map(|index| column(order + index)).collect(),
            force_slope: (1..count).map(|index| column(order + count + index)).collect(),
        })
    }
}

impl Discrete {
    /// Writes into `next` the state a step after `state`, without forces; `u` and `slope` hold at the step's
    /// start.
    pub fn advance(&self, state: &[f64], u: f64, slope: f64, next: &mut Vec<f64>) {
        next.clear();
        self.blocks.times(state, next);
        for (entry, (value, gamma)) in next.iter_mut().zip(self.input_value.iter().zip(&self.input_slope)) {
            // In the order of a dense row, so that blocks change nothing to the last bit.
            *entry = *entry + value * u + gamma * slope;
        }
    }

    /// Adds to a state advanced by [`Discrete::advance`] what a force at point `index` does during the step:
    /// `value` at its start, growing at `slope` per second.
    pub fn add_force(&self, index: usize, value: f64, slope: f64, next: &mut [f64]) {
        let columns = self.force_value[index].iter().zip(&self.force_slope[index]);
        for (entry, (by_value, by_slope)) in next.iter_mut().zip(columns) {
            *entry += by_value * value + by_slope * slope;
        }
    }

    /// Effect of a constant unit force at point `index` on what `row` reads at the step's end.
    pub fn response(&self, row: &Row, index: usize) -> f64 {
        dot(&row.state, &self.force_value[index])
    }
}
