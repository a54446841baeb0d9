//! What takes the console longer than the watchdog waits: done a few milliseconds at a time.

use core::fmt::Write;

use super::Console;
use super::error::CommandError;
use crate::motion::{MultisineDrawing, PieceMemory, PlanError, PlanOutline, PlanSurvey, StopSurvey};

/// Ticks of a plan that are gone through at a time: some 5 ms on the board.
const TICKS: u32 = 2048;

/// What a command has begun.
pub(super) enum LongWork<'m> {
    /// A multisine, line by line.
    Drawing(MultisineDrawing<'m>),
    /// `plan commit`: the plan that has come is gone through.
    Survey(PlanSurvey),
    /// `play`: the stops out of the plan are looked at.
    Stops { survey: StopSurvey, backwards: bool },
}

/// What it has become.
pub(super) enum Finished<'m> {
    Drawing(MultisineDrawing<'m>),
    Survey(Result<PlanOutline, PlanError>),
    Stops { survey: StopSurvey, backwards: bool },
}

/// After one go.
pub(super) enum Step<'m> {
    More(LongWork<'m>),
    Done(Finished<'m>),
}

impl<'m> LongWork<'m> {
    /// One go: `arriving` is the plan that has come, `kept` the one that is played.
    pub(super) fn go_on(self, arriving: &[u8], kept: Option<&PieceMemory>) -> Step<'m> {
        match self {
            Self::Drawing(mut drawing) => {
                if drawing.draw_line() {
                    Step::More(Self::Drawing(drawing))
                } else {
                    Step::Done(Finished::Drawing(drawing))
                }
            }
            Self::Survey(mut survey) => match survey.go_on(arriving, TICKS) {
                Ok(None) => Step::More(Self::Survey(survey)),
                Ok(Some(outline)) => Step::Done(Finished::Survey(Ok(outline))),
                Err(error) => Step::Done(Finished::Survey(Err(error))),
            },
            Self::Stops { mut survey, backwards } => {
                if kept.is_some_and(|pieces| survey.go_on(pieces, TICKS)) {
                    Step::More(Self::Stops { survey, backwards })
                } else {
                    Step::Done(Finished::Stops { survey, backwards })
                }
            }
        }
    }
}

impl<'m> Console<'m> {
    /// Ends the command that began it.
    pub(super) fn finish(
        &mut self,
        work: Finished<'m>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'static>> {
        match work {
            Finished::Drawing(drawing) => self.finish_drawing(drawing, out),
            Finished::Survey(outline) => self.finish_commit(outline, out),
            Finished::Stops { survey, backwards } => self.finish_play(&survey, backwards, out),
        }
    }
}
