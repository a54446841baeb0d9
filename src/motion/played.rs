//! An uploaded command being played.

use super::fine::FinePosition;
use super::outline::PlanOutline;
use super::pieces::{PieceCourse, PieceMemory};
use crate::units::Nanometres;

/// An uploaded command in progress, relative to where it started.
#[derive(Debug)]
pub struct PlayedPlan<'m> {
    from: Nanometres,
    to: Nanometres,
    backwards: bool,
    ticks: u32,
    ticks_left: u32,
    course: PieceCourse,
    pieces: &'m mut PieceMemory,
}

impl<'m> PlayedPlan<'m> {
    /// Plays the command in `pieces`, of which `outline` is and which [`PlanOutline::check`] has passed, or
    /// its mirror image, from `start`.
    pub fn new(
        outline: &PlanOutline,
        backwards: bool,
        start: Nanometres,
        pieces: &'m mut PieceMemory,
    ) -> Self {
        let distance = outline.distance.0;
        let to = Nanometres(if backwards { start.0 - distance } else { start.0 + distance });
        let (ticks, course) = (outline.ticks, PieceCourse::default());
        Self { from: start, to, backwards, ticks, ticks_left: ticks, course, pieces }
    }

    /// How many ticks it takes.
    pub fn duration_ticks(&self) -> u32 {
        self.ticks
    }

    /// Where it ends.
    pub fn target(&self) -> Nanometres {
        self.to
    }

    /// The position of the next tick; `None` after the last. The last is the end to the nanometre, whatever
    /// the sums are.
    #[inline]
    pub fn step(&mut self) -> Option<FinePosition> {
        if self.ticks_left <= 1 {
            self.ticks_left = self.ticks_left.checked_sub(1)?;
            return Some(self.to.into());
        }
        self.ticks_left -= 1;
        let travelled = self.course.step(self.pieces)?;
        let from = FinePosition::from(self.from);
        Some(if self.backwards { from - travelled } else { from + travelled })
    }

    /// The memory of its pieces.
    pub fn into_memory(self) -> &'m mut PieceMemory {
        self.pieces
    }
}
