//! How an excitation fades in and out: its amplitude follows the minimum-jerk polynomial, whose first and
//! second derivatives vanish at both ends, so that neither velocity nor acceleration jumps.

use super::fine::upper_product;
use super::quintic::smooth_step;
use crate::units::TickRate;

/// A fade over a number of ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Taper {
    ticks: u32,
    /// ⌊2⁶⁴ / ticks⌋.
    step: u64,
}

/// The largest magnitudes of a taper's first three derivatives, per second to the first, second and third.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TaperSlopes {
    pub(super) first: f64,
    pub(super) second: f64,
    pub(super) third: f64,
}

impl TaperSlopes {
    /// Where nothing fades.
    pub(super) const NONE: Self = Self { first: 0.0, second: 0.0, third: 0.0 };
}

impl Taper {
    /// The fade nearest to this duration.
    pub(super) fn new(duration_s: f64, rate: TickRate) -> Self {
        let ticks = libm::round(duration_s * rate.hz()).max(2.0) as u32;
        Self { ticks, step: u64::MAX / u64::from(ticks) }
    }

    pub(super) fn ticks(self) -> u32 {
        self.ticks
    }

    pub(super) fn slopes(self, rate: TickRate) -> TaperSlopes {
        let per_s = 1.0 / rate.seconds(self.ticks);
        TaperSlopes {
            first: 15.0 / 8.0 * per_s,
            second: 5.773_502_691_896_258 * per_s * per_s,
            third: 60.0 * per_s * per_s * per_s,
        }
    }

    /// `magnitude`, to sixty bits, as it is so many ticks from the start or from the end.
    #[inline]
    pub(super) fn fade(self, magnitude: u64, ticks_from_end: u32) -> u64 {
        if ticks_from_end >= self.ticks {
            return magnitude;
        }
        upper_product(magnitude, smooth_step(self.step * u64::from(ticks_from_end))) << 4
    }
}
