//! What a motion may ask of the machine, as asked of the setpoint that leaves the shaper.
//!
//! A shaper with taps w(k) makes s(n) = Σ w(k) c(n − k) of the command c, and every difference of s is the
//! same sum of c's: with G = Σ |w(k)|, the setpoint's velocity, acceleration and jerk are at most G times the
//! command's, and its positions leave the command's by at most (G − 1)/2 of their span on either side. Taps
//! that are not negative and sum to one have G = 1: the limits of the command are those of the setpoint
//! (docs/derivations/motions.md).

use super::{MotionError, Profile};
use crate::units::{Nanometres, TickRate};

use super::boxes::PerTick;

/// What a motion may ask of the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MoveLimits {
    /// Largest velocity in mm/s, above zero.
    pub velocity_mm_s: f64,
    /// Largest acceleration in mm/s², above zero.
    pub acceleration_mm_s2: f64,
    /// Largest jerk in mm/s³, above zero. Trapezoids and their stops have unlimited jerk.
    pub jerk_mm_s3: f64,
    /// First and last permitted position in mm.
    pub travel_mm: (f64, f64),
    /// G: the sum of the magnitudes of the shaper's taps, 1 or more.
    pub shaper_gain: f64,
}

impl MoveLimits {
    /// Refuses a position outside the travel.
    ///
    /// # Errors
    /// [`MotionError::Travel`] with the position and the range.
    pub fn check_position(&self, position_mm: f64) -> Result<Nanometres, MotionError> {
        let refused = MotionError::Travel { position_mm, range_mm: self.travel_mm };
        if !(self.travel_mm.0..=self.travel_mm.1).contains(&position_mm) {
            return Err(refused);
        }
        Nanometres::from_mm(position_mm).ok_or(refused)
    }

    /// Refuses a command between these positions in mm when the setpoint could leave the travel.
    ///
    /// # Errors
    /// [`MotionError::Travel`] with the farthest position of the setpoint.
    pub fn check_span(&self, low_mm: f64, high_mm: f64) -> Result<(), MotionError> {
        let beyond_mm = 0.5 * (self.shaper_gain - 1.0) * (high_mm - low_mm);
        self.check_position(low_mm - beyond_mm)?;
        self.check_position(high_mm + beyond_mm)?;
        Ok(())
    }

    /// Refuses a command of this velocity when the setpoint could exceed the limit.
    ///
    /// # Errors
    /// [`MotionError::Velocity`] with what the setpoint needs.
    pub fn check_velocity(&self, command_mm_s: f64) -> Result<(), MotionError> {
        let needed_mm_s = self.shaper_gain * command_mm_s;
        let limit_mm_s = self.velocity_mm_s;
        if needed_mm_s <= limit_mm_s {
            Ok(())
        } else {
            Err(MotionError::Velocity { needed_mm_s, limit_mm_s })
        }
    }

    /// Refuses a command of this acceleration when the setpoint could exceed the limit.
    ///
    /// # Errors
    /// [`MotionError::Acceleration`] with what the setpoint needs.
    pub fn check_acceleration(&self, command_mm_s2: f64) -> Result<(), MotionError> {
        let needed_mm_s2 = self.shaper_gain * command_mm_s2;
        let limit_mm_s2 = self.acceleration_mm_s2;
        if needed_mm_s2 <= limit_mm_s2 {
            Ok(())
        } else {
            Err(MotionError::Acceleration { needed_mm_s2, limit_mm_s2 })
        }
    }

    /// Refuses a command of this jerk when the setpoint could exceed the limit.
    ///
    /// # Errors
    /// [`MotionError::Jerk`] with what the setpoint needs.
    pub fn check_jerk(&self, command_mm_s3: f64) -> Result<(), MotionError> {
        let needed_mm_s3 = self.shaper_gain * command_mm_s3;
        let limit_mm_s3 = self.jerk_mm_s3;
        if needed_mm_s3 <= limit_mm_s3 {
            Ok(())
        } else {
            Err(MotionError::Jerk { needed_mm_s3, limit_mm_s3 })
        }
    }

    /// What a command may do per tick so that its setpoint stays within the limits, in nanometres.
    pub(super) fn per_tick(&self, rate: TickRate) -> PerTick {
        let period_s = rate.period_s();
        let nm = 1.0e6 / self.shaper_gain;
        PerTick {
            velocity: self.velocity_mm_s * nm * period_s,
            acceleration: self.acceleration_mm_s2 * nm * period_s * period_s,
            jerk: self.jerk_mm_s3 * nm * period_s * period_s * period_s,
        }
    }

    /// How far a stop may still go from this velocity in mm/s and an acceleration up to this in mm/s², at
    /// most, in mm: the acceleration is taken back first, and adds to the velocity until it is.
    pub(super) fn stopping_distance_mm(&self, velocity: f64, acceleration: f64, profile: Profile) -> f64 {
        let limit = self.acceleration_mm_s2 / self.shaper_gain;
        if !profile.limits_jerk() {
            return velocity * velocity / (2.0 * limit);
        }
        let jerk = self.jerk_mm_s3 / self.shaper_gain;
        let release_s = acceleration / jerk;
        let peak = velocity + 0.5 * acceleration * release_s;
        peak * release_s
            + peak * peak / (2.0 * limit)
            + 0.5 * peak * limit / jerk
            + libm::sqrt(peak / jerk) * peak
    }

    /// How far past the end of the travel a stop in a move to that end may go, in mm: jerk can only be taken
    /// back in whole ticks. Without a limit of jerk it never does.
    pub fn stop_overshoot_mm(&self, profile: Profile, rate: TickRate) -> f64 {
        if !profile.limits_jerk() {
            return 0.0;
        }
        let period_s = rate.period_s();
        let span_mm = self.travel_mm.1 - self.travel_mm.0;
        2.0 * self.acceleration_mm_s2 * period_s * period_s + 1.0e-6 * span_mm + 2.0e-6
    }
}
