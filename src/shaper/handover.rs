//! Taking a new table without a jump, at rest and while moving.
//!
//! Shaping is linear, so the command may be split in two: of what it moves in each tick after the handover
//! the old cascade gets a share that falls to nothing, and the new one, its histories zero, gets the rest.
//! The setpoint is the sum of what they make of it. Each part is shaped by one whole shaper, so neither
//! leaves vibration at the modes its shaper was designed for, nothing jumps, speeds change gradually, and
//! once the old cascade has run out it contributes a constant, the origin of the new one. With the lag and
//! the fade of a [`super::Transition`] the setpoint never moves faster than the command has, and it stays
//! between the ends of a monotonic command (docs/derivations/handover.md). A command that reverses meanwhile
//! could overshoot its own range, which is why [`crate::control`] takes tables at rest and during moves, not
//! during sweeps.

use super::cascade::Cascade;
use super::transition::{Fade, Share};
use crate::units::Nanometres;

/// The live cascade, and for a while the one it replaced.
#[derive(Debug)]
pub struct Shaping<'m> {
    active: Cascade<'m>,
    /// The position relative to which the active cascade's samples are.
    origin_nm: i32,
    outgoing: Option<Outgoing<'m>>,
}

/// A replaced cascade that still moves the setpoint.
#[derive(Debug)]
struct Outgoing<'m> {
    cascade: Cascade<'m>,
    origin_nm: i32,
    /// What it has been given of the command, from its origin.
    input_nm: i32,
    share: Share,
    /// The whole command in the last tick.
    command_nm: i32,
    /// Until it has run out, if it is given nothing more.
    ticks_left: u32,
}

/// A cascade was refused because the one before the live one still moves the setpoint.
#[derive(Debug)]
pub struct HandoverUnderWay<'m> {
    /// The refused cascade's memory.
    pub history: &'m mut [i32],
}

impl<'m> Shaping<'m> {
    /// Starts with `cascade` at rest at `position`.
    pub fn at_rest(cascade: Cascade<'m>, position: Nanometres) -> Self {
        Self { active: cascade, origin_nm: position.0, outgoing: None }
    }

    /// Whether a handover is under way, so that a further one has to wait.
    pub fn is_handing_over(&self) -> bool {
        self.outgoing.is_some()
    }

    /// Whether a command that has been constant for `quiet_ticks` ticks no longer moves the setpoint.
    pub fn is_settled(&self, quiet_ticks: u32) -> bool {
        self.outgoing.is_none() && quiet_ticks >= self.active.duration_ticks()
    }

    /// Lets `next` shape what the command does after `command`, its position in the last tick, for
    /// `quiet_ticks` of which it has been constant, as `fade` gives it over. Returns the replaced cascade's
    /// memory where that no longer moves the setpoint; otherwise [`Self::step`] will, when it has run out.
    ///
    /// # Errors
    /// [`HandoverUnderWay`] gives the memory of `next` back while an earlier handover is under way.
    pub fn hand_over(
        &mut self,
        next: Cascade<'m>,
        fade: Fade,
        command: Nanometres,
        quiet_ticks: u32,
    ) -> Result<Option<&'m mut [i32]>, HandoverUnderWay<'m>> {
        if self.outgoing.is_some() {
            return Err(HandoverUnderWay { history: next.into_history() });
        }
        // A shaper that changes nothing has always run out, and may move all the same.
        let settled = quiet_ticks > 0 && self.is_settled(quiet_ticks);
        let origin_nm = core::mem::replace(&mut self.origin_nm, command.0);
        let cascade = core::mem::replace(&mut self.active, next);
        if settled {
            return Ok(Some(cascade.into_history()));
        }
        let ticks_left = cascade.duration_ticks();
        let (input_nm, command_nm) = (command.0 - origin_nm, command.0);
        self.outgoing =
            Some(Outgoing { cascade, origin_nm, input_nm, share: fade.start(), command_nm, ticks_left });
        Ok(None)
    }

    /// Shapes the command of one tick. Returns the setpoint and, in the tick after the replaced cascade has
    /// run out, its memory.
    #[inline]
    pub fn step(&mut self, command: Nanometres) -> (Nanometres, Option<&'m mut [i32]>) {
        if self.outgoing.is_some() {
            return self.step_both(command);
        }
        let shaped_nm = self.active.step(command.0 - self.origin_nm);
        (Nanometres(self.origin_nm.saturating_add(shaped_nm)), None)
    }

    /// A tick of a handover. Apart from the others, which then are as short as if there were none.
    #[cold]
    #[inline(never)]
    fn step_both(&mut self, command: Nanometres) -> (Nanometres, Option<&'m mut [i32]>) {
        let mut base_nm = self.origin_nm;
        let mut retired = None;
        if let Some(outgoing) = &mut self.outgoing {
            let before_nm = core::mem::replace(&mut outgoing.command_nm, command.0);
            let kept_nm = outgoing.share.of(command.0 - before_nm);
            if kept_nm != 0 {
                outgoing.input_nm += kept_nm;
                self.origin_nm += kept_nm;
                outgoing.ticks_left = outgoing.cascade.duration_ticks();
            }
            if kept_nm == 0 && outgoing.ticks_left == 0 {
                retired = self.outgoing.take().map(|outgoing| outgoing.cascade.into_history());
            } else {
                outgoing.ticks_left = outgoing.ticks_left.saturating_sub(1);
                let held_nm = outgoing.cascade.step(outgoing.input_nm);
                base_nm = outgoing.origin_nm.saturating_add(held_nm);
            }
        }
        let shaped_nm = self.active.step(command.0 - self.origin_nm);
        (Nanometres(base_nm.saturating_add(shaped_nm)), retired)
    }

    /// Moves command and setpoint by so much at once, the machine being elsewhere than it was thought to be.
    /// For a shaper that is settled: its history is kept, for it is relative to the origin.
    pub fn shift(&mut self, by_nm: i32) {
        self.origin_nm = self.origin_nm.wrapping_add(by_nm);
    }

    /// Ends the lag that the active cascade has had since it was taken while the command moved. Nothing moves
    /// if [`Self::is_settled`].
    pub fn end_lag(&mut self) {
        self.active.end_lag();
    }
}
