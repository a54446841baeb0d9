//! Modes driven by the motion of their base.

use nalgebra::DMatrix;

use super::{InjectionPoint, Output, Row, StateSpace};
use crate::drive::ServoDrive;
use crate::linear::LinearSystem;
use crate::model::{Quantity, SETPOINT};
use crate::modes::Mode;

/// Only the setpoint goes through the drive; a recorded base position is already behind it.
pub(crate) fn drive_for<'a>(column: &str, drive: Option<&'a ServoDrive>) -> Option<&'a ServoDrive> {
    drive.filter(|_| column == SETPOINT)
}

/// Modes driven by the motion of the base, which is given by its positions at the ticks.
///
/// # Ideal drive: no acceleration needed
/// Between ticks the base moves at constant speed, so its acceleration is an impulse `Δv δ(t − t_k)` at every
/// tick. Those impulses are integrated exactly, and nothing is differentiated, by the shift `p_r = q_r' + y'`
/// (the modal speed against the ground, which no impulse can change): `q' = p − y'`, `p' = −omega² q − 2 zeta
/// omega p + 2 zeta omega y'`. The state is `q_1, p_1, q_2, p_2, ...` and `y'` the input's slope. Between
/// ticks it is the closed form of a free vibration, and a setpoint that stands still adds nothing, not even
/// rounding.
///
/// # Servo
/// With a servo the base moves smoothly and its acceleration is a combination of states:
/// `y'' = omega_d² (u − y) − 2 zeta_d omega_d y'`. The state is `y, y', q_1, q_1', ...`.
pub(crate) struct BaseMotion {
    system: LinearSystem,
    has_servo: bool,
}

impl BaseMotion {
    pub(crate) fn new(modes: &[Mode], drive: Option<&ServoDrive>) -> Self {
        let offset = if drive.is_some() { 2 } else { 0 };
        let size = offset + 2 * modes.len();
        let mut a = DMatrix::zeros(size, size);
        let mut value = vec![0.0; size];
        let mut slope = vec![0.0; size];
        if let Some(drive) = drive {
            let omega = drive.natural_frequency_rad_s();
            a[(0, 1)] = 1.0;
            a[(1, 0)] = -omega * omega;
            a[(1, 1)] = -2.0 * drive.damping_ratio * omega;
            value[1] = omega * omega;
        }
        for (index, mode) in modes.iter().enumerate() {
            let (q, speed) = (offset + 2 * index, offset + 2 * index + 1);
            a[(q, speed)] = 1.0;
            a[(speed, q)] = -mode.omega_rad_s().powi(2);
            a[(speed, speed)] = -2.0 * mode.decay_per_s();
            if drive.is_some() {
                // Minus the base's acceleration.
                a[(speed, 0)] = -a[(1, 0)];
                a[(speed, 1)] = -a[(1, 1)];
                value[speed] = -value[1];
            } else {
                slope[q] = -1.0;
                slope[speed] = 2.0 * mode.decay_per_s();
            }
        }
        Self { system: LinearSystem { a, value, slope }, has_servo: drive.is_some() }
    }

    /// Index of the displacement of mode `index` in the state; its speed follows.
    pub(crate) fn displacement(&self, index: usize) -> usize {
        if self.has_servo { 2 + 2 * index } else { 2 * index }
    }

    /// A row of nothing yet.
    pub(crate) fn row(&self) -> Row {
        Row::zero(self.system.value.len())
    }

    /// The base's position.
    pub(crate) fn base_position(&self) -> Row {
        let mut row = self.row();
        if self.has_servo {
            row.state[0] = 1.0;
        } else {
            row.value = 1.0;
        }
        row
    }

    /// The base's velocity.
    pub(crate) fn base_velocity(&self) -> Row {
        let mut row = self.row();
        if self.has_servo {
            row.state[1] = 1.0;
        } else {
            row.slope = 1.0;
        }
        row
    }

    /// Adds a multiple of a modal coordinate or of its velocity; its acceleration is refused by the model's
    /// check.
    pub(crate) fn add(&self, row: &mut Row, index: usize, quantity: Quantity, factor: f64) {
        let q = self.displacement(index);
        match quantity {
            Quantity::Position => row.state[q] += factor,
            Quantity::Velocity => {
                row.state[q + 1] += factor;
                if !self.has_servo {
                    row.slope -= factor;
                }
            }
            Quantity::Acceleration => {}
        }
    }

    /// Displacement and velocity rows of a sum of modes, `factors` times their coordinates.
    pub(crate) fn sum(&self, factors: impl IntoIterator<Item = f64>) -> (Row, Row) {
        let (mut displacement, mut velocity) = (self.row(), self.row());
        for (index, factor) in factors.into_iter().enumerate() {
            self.add(&mut displacement, index, Quantity::Position, factor);
            self.add(&mut velocity, index, Quantity::Velocity, factor);
        }
        (displacement, velocity)
    }

    /// The column of a force that adds `factors` to the modes' accelerations.
    pub(crate) fn modal_force(&self, factors: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let mut force = vec![0.0; self.system.value.len()];
        for (index, factor) in factors.into_iter().enumerate() {
            force[self.displacement(index) + 1] = factor;
        }
        force
    }

    /// Points `base` (behind a servo only) and `mode 1`, `mode 2`, ...: what every moved structure has.
    ///
    /// `moved_kg` is the mass that the servo moves; `None` reckons per kilogram.
    pub(crate) fn points(&self, modes: &[Mode], moved_kg: Option<f64>, unit: &str) -> Vec<InjectionPoint> {
        let mut points = Vec::new();
        if self.has_servo {
            let acceleration = 1.0 / moved_kg.unwrap_or(1.0);
            let mut force = self.modal_force(modes.iter().map(|_| -acceleration));
            force[1] = acceleration;
            points.push(InjectionPoint {
                name: "base".to_owned(),
                displacement: self.base_position(),
                velocity: self.base_velocity(),
                force,
                displacement_unit: "m".to_owned(),
                force_unit: if moved_kg.is_some() { "N" } else { "m/s²" }.to_owned(),
                stiffness: 0.0,
                is_coordinate: true,
            });
        }
        for (index, mode) in modes.iter().enumerate() {
            let only =
                |factor: f64| (0..modes.len()).map(move |other| if other == index { factor } else { 0.0 });
            let (displacement, velocity) = self.sum(only(1.0));
            points.push(InjectionPoint {
                name: format!("mode {}", index + 1),
                displacement,
                velocity,
                force: self.modal_force(only(1.0)),
                displacement_unit: unit.to_owned(),
                force_unit: format!("{unit}/s²"),
                stiffness: mode.omega_rad_s().powi(2),
                is_coordinate: true,
            });
        }
        points
    }

    pub(crate) fn into_space(self, outputs: Vec<Output>, points: Vec<InjectionPoint>) -> StateSpace {
        let mut rest = vec![0.0; self.system.value.len()];
        if self.has_servo {
            rest[0] = 1.0;
        }
        StateSpace::assemble(self.system, rest, outputs, points)
    }

    /// The linear system alone.
    pub(crate) fn into_system(self) -> LinearSystem {
        self.system
    }
}
