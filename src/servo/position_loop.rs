//! The position loop around a drive that takes a velocity: the setpoint's own velocity goes out, and on top
//! of it a share of the distance between setpoint and encoder, within a limit.

use crate::units::{Nanometres, TickRate};

/// How the loop is set up, in a person's units.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LoopGains {
    /// Velocity per distance, in 1/s; zero is no loop.
    pub gain_per_s: f64,
    /// The largest velocity that the loop adds to the setpoint's, in mm/s.
    pub limit_mm_s: f64,
}

impl Default for LoopGains {
    /// No loop; 50 mm/s once there is one.
    fn default() -> Self {
        Self { gain_per_s: 0.0, limit_mm_s: 50.0 }
    }
}

/// A velocity, in nanometres per tick, Q8.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VelocityQ8(pub i64);

impl VelocityQ8 {
    /// Bits after the point.
    pub const FRACTION_BITS: u32 = 8;
}

/// [`LoopGains`] made ready for one tick rate: a multiplication and two comparisons per tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PositionLoop {
    /// The share of the distance that is made up in a tick, Q30, at most a half.
    share: i64,
    /// The largest correction.
    limit: VelocityQ8,
}

const SHARE_BITS: u32 = 30;

impl PositionLoop {
    /// Makes gains ready for a tick rate. More than half of the distance in a tick would not be stable with
    /// any drive, so that is where the gain ends.
    pub fn new(gains: &LoopGains, tick_rate: TickRate) -> Self {
        let share = (gains.gain_per_s * tick_rate.period_s()).clamp(0.0, 0.5);
        let limit_nm = gains.limit_mm_s * 1.0e6 * tick_rate.period_s();
        // A cast from a float saturates.
        let fixed = |number: f64, bits: u32| libm::round(libm::scalbn(number, bits as i32)) as i64;
        let limit = VelocityQ8(fixed(limit_nm, VelocityQ8::FRACTION_BITS));
        Self { share: fixed(share, SHARE_BITS), limit }
    }

    /// What is added to the velocity of a setpoint whose machine is at `position`.
    #[inline]
    pub fn correction(&self, setpoint: Nanometres, position: Nanometres) -> VelocityQ8 {
        // At most 2³² · 2²⁹: no overflow.
        let product = (i64::from(setpoint.0) - i64::from(position.0)) * self.share;
        let correction = product >> (SHARE_BITS - VelocityQ8::FRACTION_BITS);
        let VelocityQ8(limit) = self.limit;
        VelocityQ8(correction.max(-limit).min(limit))
    }
}
