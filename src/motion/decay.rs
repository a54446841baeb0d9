//! Move and hold: a short move rings the machine, then nothing moves while its free decay is recorded.

use super::fine::FinePosition;
use super::{MotionContext, MotionError, MovePlan, within};

/// What decay to record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DecaySpec {
    /// The move, relative to where the command is, in mm.
    pub distance_mm: f64,
    /// How long to hold after it, in seconds.
    pub hold_s: f64,
}

/// A move and hold in progress.
#[derive(Clone, Debug, PartialEq)]
pub struct DecayPlan {
    start: MovePlan,
    hold_ticks: u32,
    held: FinePosition,
    held_ticks: u32,
}

impl DecayPlan {
    /// Plans the move and the hold.
    ///
    /// # Errors
    /// [`MotionError`] names the parameter outside its range, or what is wrong with the move.
    pub fn new(spec: &DecaySpec, context: &MotionContext) -> Result<Self, MotionError> {
        let hold_s = within("SECONDS", spec.hold_s, (0.1, 3600.0))?;
        within("|DISTANCE_MM|", libm::fabs(spec.distance_mm), (1.0e-5, 1000.0))?;
        let to_mm = context.start.to_mm() + spec.distance_mm;
        let start = MovePlan::new(context.start, to_mm, context.profile, &context.limits, context.rate)?;
        let held = start.target().into();
        let hold_ticks = libm::round(hold_s * context.rate.hz()) as u32;
        Ok(Self { start, hold_ticks, held, held_ticks: 0 })
    }

    /// Ticks until the command has come to rest: from there on the machine decays freely, once the shaper has
    /// run out.
    pub fn move_ticks(&self) -> u32 {
        self.start.duration_ticks()
    }

    /// How many ticks move and hold take.
    pub fn duration_ticks(&self) -> u32 {
        self.move_ticks() + self.hold_ticks
    }

    /// The position of the next tick; `None` after the hold.
    #[inline]
    pub fn step(&mut self) -> Option<FinePosition> {
        if let Some(position) = self.start.step() {
            return Some(position);
        }
        if self.held_ticks >= self.hold_ticks {
            return None;
        }
        self.held_ticks += 1;
        Some(self.held)
    }
}
