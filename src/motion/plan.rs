//! Any motion, ready for the interrupt.

use super::{
    DecayPlan, FinePosition, MovePlan, MultisinePlan, PieceMemory, PlayedPlan, PulsePlan, SweepPlan,
};
use crate::telemetry::Activity;

/// A motion that starts from rest and ends at rest. With a tag of one byte, which the tick reads in one
/// instruction.
#[derive(Debug)]
#[repr(u8)]
pub enum MotionPlan<'m> {
    /// To a position.
    Move(MovePlan),
    /// A sine of changing frequency.
    Sweep(SweepPlan),
    /// Many sines at once.
    Multisine(MultisinePlan<'m>),
    /// There and back.
    Pulse(PulsePlan),
    /// A move, and nothing for a while.
    Decay(DecayPlan),
    /// A command that was designed elsewhere.
    Played(PlayedPlan<'m>),
}

/// Memory that a motion borrowed.
#[derive(Debug)]
pub enum MotionMemory<'m> {
    /// A shaper's history, used for a table.
    History(&'m mut [i32]),
    /// An uploaded command.
    Pieces(&'m mut PieceMemory),
}

impl<'m> MotionPlan<'m> {
    /// Ticks from the start until the command is at rest for good.
    pub fn duration_ticks(&self) -> u32 {
        match self {
            Self::Move(plan) => plan.duration_ticks(),
            Self::Sweep(plan) => plan.duration_ticks(),
            Self::Multisine(plan) => plan.duration_ticks(),
            Self::Pulse(plan) => plan.duration_ticks(),
            Self::Decay(plan) => plan.duration_ticks(),
            Self::Played(plan) => plan.duration_ticks(),
        }
    }

    /// The position of the next tick; `None` after the last.
    #[inline]
    pub fn step(&mut self) -> Option<FinePosition> {
        match self {
            Self::Move(plan) => plan.step(),
            Self::Sweep(plan) => plan.step(),
            Self::Multisine(plan) => plan.step(),
            Self::Pulse(plan) => plan.step(),
            Self::Decay(plan) => plan.step(),
            Self::Played(plan) => plan.step(),
        }
    }

    /// What `status` calls it.
    #[inline]
    pub fn activity(&self) -> Activity {
        match self {
            Self::Move(_) => Activity::Moving,
            Self::Sweep(_) => Activity::Sweeping,
            Self::Multisine(_) => Activity::Multisine,
            Self::Pulse(_) => Activity::Pulsing,
            Self::Decay(_) => Activity::Decaying,
            Self::Played(_) => Activity::Playing,
        }
    }

    /// The memory that it borrowed, when it did.
    pub fn into_memory(self) -> Option<MotionMemory<'m>> {
        match self {
            Self::Multisine(plan) => Some(MotionMemory::History(plan.into_memory())),
            Self::Played(plan) => Some(MotionMemory::Pieces(plan.into_memory())),
            _ => None,
        }
    }
}
