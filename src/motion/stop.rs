//! The controlled stop: the command runs down at the acceleration limit from whatever velocity it has.

use super::MoveLimits;
use crate::units::{Nanometres, TickRate};

/// Fractional bits of positions and velocities here: a limit of 1 mm/s² at 20 kHz is still 10⁻⁶ accurate.
const FRACTION_BITS: u32 = 24;

/// How strongly a stop brakes: computed outside the interrupt, from the limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Braking {
    /// Change of velocity per tick, nm/tick² with [`FRACTION_BITS`].
    deceleration: i64,
}

impl Braking {
    /// Braking at the acceleration limit.
    pub fn new(limits: &MoveLimits, tick_rate: TickRate) -> Self {
        let per_tick_nm = limits.acceleration_mm_s2 * 1.0e6 / (tick_rate.hz() * tick_rate.hz());
        // At least one unit, so that a stop always ends.
        Self { deceleration: (libm::round(libm::scalbn(per_tick_nm, FRACTION_BITS as i32)) as i64).max(1) }
    }
}

/// A stop in progress.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StopPlan {
    position: i64,
    velocity: i64,
    braking: Braking,
}

impl StopPlan {
    /// Stops a command that was at `before` and one tick later at `now`.
    #[inline]
    pub fn new(before: Nanometres, now: Nanometres, braking: Braking) -> Self {
        Self {
            position: i64::from(now.0) << FRACTION_BITS,
            velocity: (i64::from(now.0) - i64::from(before.0)) << FRACTION_BITS,
            braking,
        }
    }

    /// The position of the next tick; `None` once at rest.
    #[inline]
    pub fn step(&mut self) -> Option<Nanometres> {
        if self.velocity == 0 {
            return None;
        }
        let braking = self.braking.deceleration;
        self.velocity = if self.velocity > 0 {
            (self.velocity - braking).max(0)
        } else {
            (self.velocity + braking).min(0)
        };
        self.position += self.velocity;
        Some(Nanometres((self.position >> FRACTION_BITS) as i32))
    }
}
