//! Steps of a state space by the lengths that a simulation meets, each made once and cheaply.

use std::collections::HashMap;
use std::rc::Rc;

use nalgebra::DMatrix;

use crate::blocks::Blocks;
use crate::error::PlantError;
use crate::linear::dot;
use crate::state_space::StateSpace;

/// Steps kept for reuse; beyond that the stamps are irregular and reuse is rare.
const MAX_STEPS: usize = 4096;

/// Lengths that agree to this many seconds are one: stamps are rounded, plants do not care.
const SAME_WITHIN_S: f64 = 1e-12;

/// Terms of the exponential's series, enough below [`MOST_RADIANS`].
const TERMS: usize = 16;

/// The series is used while the fastest motion turns no more than this in a step: its remainder is then
/// 0.5^16/16!.
const MOST_RADIANS: f64 = 0.5;

/// One place at which a law acts.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Port {
    /// Displacement: state, input value, input slope.
    pub(super) z: (Vec<f64>, f64, f64),
    /// Velocity.
    pub(super) v: (Vec<f64>, f64, f64),
    /// What a unit force adds to `x'`.
    pub(super) force: Vec<f64>,
}

/// What forces at the ports change there in a step.
#[derive(Debug, Clone, Default)]
pub(super) struct Gains {
    /// `z[i][j]`: displacement at the end at port i per mean force at port j.
    pub(super) z: Vec<Vec<f64>>,
    /// The same for velocities.
    pub(super) v: Vec<Vec<f64>>,
    /// As `z`, per rise of a force that grows in a straight line and has no mean.
    pub(super) z_rise: Vec<Vec<f64>>,
    pub(super) v_rise: Vec<Vec<f64>>,
}

/// A step for forces at the ports that are constant or grow in a straight line.
#[derive(Debug)]
pub(super) struct PortStep {
    transition: Vec<f64>,
    blocks: Blocks,
    value: Vec<f64>,
    slope: Vec<f64>,
    /// Per port: what a unit force has added to the state at the end.
    pub(super) force: Vec<Vec<f64>>,
    /// The same for one that grows in a straight line from -1/2 to 1/2.
    pub(super) rise: Vec<Vec<f64>>,
    pub(super) gains: Gains,
}

impl PortStep {
    /// The transition, row by row.
    pub(super) fn transition(&self) -> &[f64] {
        &self.transition
    }

    /// Effect of the input's value at the start.
    pub(super) fn value(&self) -> &[f64] {
        &self.value
    }

    /// Effect of the input's slope.
    pub(super) fn slope(&self) -> &[f64] {
        &self.slope
    }

    /// Writes into `next` the state after the step without forces.
    pub(super) fn advance(&self, state: &[f64], u: f64, slope: f64, next: &mut Vec<f64>) {
        next.clear();
        self.blocks.times(state, next);
        for (entry, (value, gamma)) in next.iter_mut().zip(self.value.iter().zip(&self.slope)) {
            // In the order of a dense row, so that blocks change nothing to the last bit.
            *entry = *entry + value * u + gamma * slope;
        }
    }
}

/// All steps of one state space.
pub(super) struct Steps {
    /// State, input value, input slope, then one column per port and one per slope of its force, as one
    /// system whose inputs stand still.
    joined: DMatrix<f64>,
    /// `joined^k / k!`, for short steps of any length.
    powers: Vec<DMatrix<f64>>,
    order: usize,
    fastest_rad_s: f64,
    ports: Vec<Port>,
    known: HashMap<i64, Rc<PortStep>>,
    last: Option<(i64, Rc<PortStep>)>,
}

impl Steps {
    pub(super) fn new(space: &StateSpace, ports: Vec<Port>) -> Self {
        let order = space.order();
        let size = order + 2 + 2 * ports.len();
        let mut joined = DMatrix::zeros(size, size);
        joined.view_mut((0, 0), (order, order)).copy_from(space.a());
        for row in 0..order {
            joined[(row, order)] = space.input_value()[row];
            joined[(row, order + 1)] = space.input_slope()[row];
            for (index, port) in ports.iter().enumerate() {
                joined[(row, order + 2 + index)] = port.force[row];
            }
        }
        joined[(order, order + 1)] = 1.0;
        for index in 0..ports.len() {
            joined[(order + 2 + index, order + 2 + ports.len() + index)] = 1.0;
        }
        let mut powers = vec![DMatrix::identity(size, size)];
        for term in 1..TERMS {
            let next = &powers[term - 1] * &joined / term as f64;
            powers.push(next);
        }
        let fastest_rad_s = space.fastest_rad_s();
        Self { joined, powers, order, fastest_rad_s, ports, known: HashMap::new(), last: None }
    }

    pub(super) fn ports(&self) -> &[Port] {
        &self.ports
    }

    /// Steps with the same key are one.
    pub(super) fn key_of(step_s: f64) -> i64 {
        (step_s / SAME_WITHIN_S).round() as i64
    }

    /// The step of `step_s` seconds.
    pub(super) fn of(&mut self, step_s: f64) -> Result<Rc<PortStep>, PlantError> {
        let key = Self::key_of(step_s);
        if let Some((last, step)) = &self.last
            && *last == key
        {
            return Ok(Rc::clone(step));
        }
        let step = match self.known.get(&key) {
            Some(step) => Rc::clone(step),
            None => {
                if self.known.len() >= MAX_STEPS {
                    self.known.clear();
                }
                let step = Rc::new(self.make(step_s)?);
                self.known.insert(key, Rc::clone(&step));
                step
            }
        };
        self.last = Some((key, Rc::clone(&step)));
        Ok(step)
    }

    fn make(&self, step_s: f64) -> Result<PortStep, PlantError> {
        let exponential = if self.fastest_rad_s * step_s <= MOST_RADIANS {
            let mut factor = 1.0;
            let mut sum = self.powers[0].clone();
            for power in &self.powers[1..] {
                factor *= step_s;
                sum.zip_apply(power, |entry, term| *entry += factor * term);
            }
            sum
        } else {
            crate::linear::exponential(&self.joined * step_s)
                .ok_or(PlantError::TooFast { duration_s: step_s })?
        };
        if !exponential.iter().all(|entry| entry.is_finite()) {
            return Err(PlantError::TooFast { duration_s: step_s });
        }
        let order = self.order;
        let column = |index| exponential.column(index).iter().take(order).copied().collect::<Vec<f64>>();
        let count = self.ports.len();
        let force: Vec<Vec<f64>> = (0..count).map(|index| column(order + 2 + index)).collect();
        let rise: Vec<Vec<f64>> = (0..count)
            .map(|index| {
                let by_slope = column(order + 2 + count + index);
                by_slope
                    .iter()
                    .zip(&force[index])
                    .map(|(slope, force)| slope / step_s - 0.5 * force)
                    .collect()
            })
            .collect();
        let gains = |row: &dyn Fn(&Port) -> &Vec<f64>, columns: &[Vec<f64>]| {
            let ports = self.ports.iter();
            ports.map(|port| columns.iter().map(|column| dot(row(port), column)).collect()).collect()
        };
        let transition: Vec<f64> = (0..order)
            .flat_map(|row| (0..order).map(move |column| (row, column)))
            .map(|place| exponential[place])
            .collect();
        Ok(PortStep {
            blocks: Blocks::new(order, &transition),
            transition,
            value: column(order),
            slope: column(order + 1),
            gains: Gains {
                z: gains(&|port| &port.z.0, &force),
                v: gains(&|port| &port.v.0, &force),
                z_rise: gains(&|port| &port.z.0, &rise),
                v_rise: gains(&|port| &port.v.0, &rise),
            },
            force,
            rise,
        })
    }
}
