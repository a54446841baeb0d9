//! The minimum-jerk move: x = D (10 s³ − 15 s⁴ + 6 s⁵) at the fraction s of its duration (Flash and Hogan, J.
//! Neurosci. 5, 1985).
//!
//! At most 15/8 D/T of velocity, 10/√3 D/T² of acceleration and, at both ends, 60 D/T³ of jerk.

use super::boxes::PerTick;
use super::fine::{FinePosition, upper_product};
use crate::elementary::cube_root;

/// The longest duration in ticks. It leaves s steps of 2⁻²⁴ and more, far above the 2⁻⁶⁴ that s is counted
/// in.
const MAX_TICKS: f64 = 16.0e6;

/// The shortest duration over `distance_nm` within the limits, in ticks.
///
/// # Errors
/// The number of ticks when it is too large.
pub(super) fn shortest_ticks(distance_nm: f64, limits: PerTick) -> Result<u32, f64> {
    const VELOCITY: f64 = 15.0 / 8.0;
    const ACCELERATION: f64 = 5.773_502_691_896_258;
    const JERK: f64 = 60.0;
    let by_velocity = VELOCITY * distance_nm / limits.velocity;
    let by_acceleration = libm::sqrt(ACCELERATION * distance_nm / limits.acceleration);
    let by_jerk = cube_root(JERK * distance_nm / limits.jerk);
    let ticks = libm::ceil(by_velocity.max(by_acceleration).max(by_jerk)).max(1.0);
    if ticks.is_finite() && ticks <= MAX_TICKS { Ok(ticks as u32) } else { Err(ticks) }
}

/// A minimum-jerk move on its way.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct QuinticCourse {
    /// ⌊2⁶⁴ / duration⌋.
    step: u64,
    /// s, Q64.
    elapsed: u64,
    /// D in nanometres, 28 fractional bits.
    distance: u64,
}

impl QuinticCourse {
    /// A course over a distance, not negative.
    pub(super) fn new(ticks: u32, distance_nm: u32) -> Self {
        Self { step: u64::MAX / u64::from(ticks), elapsed: 0, distance: u64::from(distance_nm) << 28 }
    }

    /// What has been travelled one tick later. Not for the last tick, where s would be one.
    #[inline]
    pub(super) fn step(&mut self) -> FinePosition {
        self.elapsed = self.elapsed.wrapping_add(self.step);
        // Q60 times D with 28 bits, less 64, leaves the 24 bits of a fine position.
        FinePosition(upper_product(smooth_step(self.elapsed), self.distance) as i64)
    }
}

/// 10 s³ − 15 s⁴ + 6 s⁵ in Q60 for s < 1 in Q64. Monotonic but for the last of the 60 bits.
#[inline]
pub(super) fn smooth_step(s: u64) -> u64 {
    let cube = upper_product(upper_product(s, s), s);
    // Q60: 15 and 10 fit.
    let inner = (15 << 60) - upper_product(s, 6 << 60);
    let outer = (10 << 60) - upper_product(s, inner);
    upper_product(cube, outer)
}
