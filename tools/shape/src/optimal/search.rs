//! The fewest ticks: doubling until the tolerance is met, then bisection, every step answered with a proof.
//!
//! A shaper of n ticks may start a tick late and so is one of n + 1 ticks: the least residual never grows
//! with the duration, and bisection finds the one duration at which the tolerance is first met.

use super::fixed_duration::{Memory, Problem, Verdict};
use crate::error::ShapeError;

/// The shortest duration that was found.
#[derive(Clone, Debug)]
pub(super) struct Shortest {
    pub(super) end_tick: u32,
    /// A shaper of this duration that leaves at most the tolerance.
    pub(super) verdict: Verdict,
    /// No shaper of one tick less leaves less than this.
    pub(super) bound_one_tick_less: f64,
}

/// How the search ended.
pub(super) enum Found {
    Shortest(Shortest),
    /// Not within the longest duration: the least residual there.
    Beyond(Verdict),
}

impl Problem {
    /// The shortest duration that leaves at most `tolerance`, from one tick up to `longest`; up to `step`
    /// ticks more than that, if a rough answer will do.
    ///
    /// # Errors
    /// [`ShapeError::Solver`].
    pub(super) fn shortest(&self, tolerance: f64, longest: u32, step: u32) -> Result<Found, ShapeError> {
        let mut memory = Memory::default();
        // Tick 0 alone is no shaper and leaves everything.
        let (mut low, mut low_bound) = (0, 1.0);
        let mut high = self.first_guess().clamp(1, longest);
        let mut best = loop {
            let verdict = self.least_residual(high, Some(tolerance), &mut memory)?;
            if verdict.worst <= tolerance {
                break verdict;
            }
            if high == longest {
                return Ok(Found::Beyond(verdict));
            }
            (low, low_bound) = (high, verdict.bound);
            high = high.saturating_mul(2).min(longest);
        };
        while high - low > step {
            let middle = low + (high - low) / 2;
            let verdict = self.least_residual(middle, Some(tolerance), &mut memory)?;
            if verdict.worst <= tolerance {
                (high, best) = (middle, verdict);
            } else {
                (low, low_bound) = (middle, verdict.bound);
            }
        }
        // Where nothing is left to gain the taps are fewest.
        if step == 1 {
            let least = self.least_residual(high, None, &mut memory)?;
            if least.worst <= best.worst {
                best = least;
            }
        }
        Ok(Found::Shortest(Shortest { end_tick: high, verdict: best, bound_one_tick_less: low_bound }))
    }

    /// Half a period of the slowest mode: below it little can be done.
    fn first_guess(&self) -> u32 {
        let slowest_hz = self.modes.iter().map(|mode| mode.nominal_hz()).fold(f64::INFINITY, f64::min);
        (0.5 / (slowest_hz * self.tick_s)) as u32
    }
}
