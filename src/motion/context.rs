//! What a plan has to know besides what is asked.

use super::{MotionError, MoveLimits, Profile};
use crate::units::{Nanometres, TickRate};

/// Where a motion starts and within what.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionContext {
    /// The command at rest.
    pub start: Nanometres,
    /// What the setpoint may do.
    pub limits: MoveLimits,
    /// The shape of moves.
    pub profile: Profile,
    /// The mass that a force moves, in kg; zero where it is not known.
    pub moving_mass_kg: f64,
    /// The rate of the ticks.
    pub rate: TickRate,
}

impl MotionContext {
    /// The acceleration in mm/s² that a force in newtons gives to the moving mass.
    ///
    /// # Errors
    /// [`MotionError::NoMass`] when the mass is not known.
    pub fn acceleration_mm_s2(&self, force_newton: f64) -> Result<f64, MotionError> {
        if self.moving_mass_kg > 0.0 {
            Ok(1.0e3 * force_newton / self.moving_mass_kg)
        } else {
            Err(MotionError::NoMass)
        }
    }
}
