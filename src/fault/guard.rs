//! The last look at a setpoint before it goes out.

use crate::units::Nanometres;

/// The travel, checked on what the shaper made of the command.
///
/// A setpoint beyond it may come back but not go further out: travel that was narrowed around a machine at rest outside of
/// it leaves a way back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TravelGuard {
    low: Nanometres,
    high: Nanometres,
}

impl TravelGuard {
    /// Guards the positions from `low` to `high`, both permitted.
    pub fn new(low: Nanometres, high: Nanometres) -> Self {
        Self { low, high }
    }

    /// Whether going from `before` to `next` leaves the travel or goes further out.
    #[inline]
    pub fn forbids(&self, before: Nanometres, next: Nanometres) -> bool {
        (next > self.high && next > before) || (next < self.low && next < before)
    }
}
