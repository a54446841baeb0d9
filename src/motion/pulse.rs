//! A pulse: a short smooth displacement there and back, x = 64 D s³ (1 − s)³ at the fraction s of its
//! duration.
//!
//! Position, velocity and acceleration are zero at both ends, the velocity at the top too. With p = s(1 − s)
//! the derivatives are 192 p²(1 − 2s), 384 p (1 − 5p) and 384 (1 − 2s)(1 − 10p), at most 192/(25√5), 24 and
//! 384.

use super::fine::{FinePosition, upper_product};
use super::{MotionContext, MotionError, within};
use crate::elementary::cube_root;
use crate::units::Nanometres;

/// What pulse to make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PulseSpec {
    /// How far the base goes before it comes back, in mm; its sign is the direction.
    pub distance_mm: f64,
    /// How long it takes, in seconds; the shortest time that the limits permit where nothing is said.
    pub duration_s: Option<f64>,
}

/// A pulse in progress.
#[derive(Clone, Debug, PartialEq)]
pub struct PulsePlan {
    from: Nanometres,
    backwards: bool,
    /// D in nanometres, 30 fractional bits.
    distance: u64,
    tick: u32,
    duration_ticks: u32,
    /// ⌊2⁶⁴ / duration⌋.
    step: u64,
}

impl PulseSpec {
    /// How far a stop may go from the start, in heights of the pulse: at the top the acceleration is largest
    /// and has to be taken back, where jerk is limited.
    pub const STOP_REACH: f64 = 1.01;
    /// The longest pulse in seconds.
    pub const MAX_DURATION_S: f64 = 60.0;
    /// Largest derivatives of the pulse of unit height and duration.
    const VELOCITY: f64 = 3.434_600_4;
    const ACCELERATION: f64 = 24.0;
    const JERK: f64 = 384.0;
}

impl PulsePlan {
    /// Plans a pulse from where the command is.
    ///
    /// # Errors
    /// [`MotionError`] names the parameter outside its range, or the limit that the pulse would break.
    pub fn new(spec: &PulseSpec, context: &MotionContext) -> Result<Self, MotionError> {
        let MotionContext { start, limits, rate, profile, .. } = context;
        let distance_mm = within("DISTANCE_MM", spec.distance_mm, (-1000.0, 1000.0))?;
        let height_mm = within("|DISTANCE_MM|", libm::fabs(distance_mm), (1.0e-5, 1000.0))?;
        let reach = if profile.limits_jerk() { PulseSpec::STOP_REACH } else { 1.0 };
        let top_mm = start.to_mm() + reach * distance_mm;
        limits.check_span(start.to_mm().min(top_mm), start.to_mm().max(top_mm))?;
        let shortest = [
            PulseSpec::VELOCITY * height_mm * limits.shaper_gain / limits.velocity_mm_s,
            libm::sqrt(PulseSpec::ACCELERATION * height_mm * limits.shaper_gain / limits.acceleration_mm_s2),
            cube_root(PulseSpec::JERK * height_mm * limits.shaper_gain / limits.jerk_mm_s3),
        ];
        let shortest_s = shortest.into_iter().fold(4.0 * rate.period_s(), f64::max);
        let duration_s = match spec.duration_s {
            Some(asked_s) => asked_s,
            None => shortest_s,
        };
        let duration_s =
            within("SECONDS (within the limits)", duration_s, (shortest_s, PulseSpec::MAX_DURATION_S))?;
        let duration_ticks = libm::ceil(duration_s * rate.hz()) as u32;
        Ok(Self {
            from: *start,
            backwards: distance_mm < 0.0,
            distance: (libm::round(height_mm * 1.0e6) as u64) << 30,
            tick: 0,
            duration_ticks,
            step: u64::MAX / u64::from(duration_ticks.max(1)),
        })
    }

    /// How many ticks the pulse takes from its start to the tick that is back.
    pub fn duration_ticks(&self) -> u32 {
        self.duration_ticks
    }

    /// The position of the next tick; `None` once it is back.
    #[inline]
    pub fn step(&mut self) -> Option<FinePosition> {
        if self.tick >= self.duration_ticks {
            return None;
        }
        self.tick += 1;
        let from = FinePosition::from(self.from);
        if self.tick == self.duration_ticks {
            return Some(from);
        }
        let s = self.step * u64::from(self.tick);
        let p = upper_product(s, s.wrapping_neg());
        // p³ is Q64; D with 30 fractional bits is 64 D with the 24 of a fine position.
        let cube = upper_product(upper_product(p, p), p);
        let offset = FinePosition(upper_product(cube, self.distance) as i64);
        Some(if self.backwards { from - offset } else { from + offset })
    }
}
