//! Taking a new table without a jump, at rest and while moving.
//!
//! Shaping is linear, so the command may be cut in two at the tick T of the handover: the part up to T,
//! held at its last value from then on, and the increment after T. The old cascade goes on with the
//! first part and the new one, its histories zero, shapes the second. The setpoint is their sum. Each part is
//! shaped by one whole shaper, so neither leaves vibration at the modes its shaper was designed for, nothing
//! jumps, and once the old cascade has run out it contributes a constant, the origin of the new one.
//! docs/derivations.md bounds the step: with non-negative taps the setpoint moves in one tick by at most the
//! largest step of the command before T plus the largest after it, and it stays between the ends of a
//! monotonic command. A command that reverses while the old cascade runs out could overshoot its own range,
//! which is why [`crate::control`] takes tables at rest and during moves, not during sweeps.

use super::cascade::Cascade;
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
    held_input_nm: i32,
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
    /// `quiet_ticks` of which it has been constant. Returns the replaced cascade's memory where that no
    /// longer moves the setpoint; otherwise [`Self::step`] will, when it has run out.
    ///
    /// # Errors
    /// [`HandoverUnderWay`] gives the memory of `next` back while an earlier handover is under way.
    pub fn hand_over(
        &mut self,
        next: Cascade<'m>,
        command: Nanometres,
        quiet_ticks: u32,
    ) -> Result<Option<&'m mut [i32]>, HandoverUnderWay<'m>> {
        if self.outgoing.is_some() {
            return Err(HandoverUnderWay { history: next.into_history() });
        }
        let settled = self.is_settled(quiet_ticks);
        let origin_nm = core::mem::replace(&mut self.origin_nm, command.0);
        let cascade = core::mem::replace(&mut self.active, next);
        if settled {
            return Ok(Some(cascade.into_history()));
        }
        let ticks_left = cascade.duration_ticks();
        let held_input_nm = command.0 - origin_nm;
        self.outgoing = Some(Outgoing { cascade, origin_nm, held_input_nm, ticks_left });
        Ok(None)
    }

    /// Shapes the command of one tick. Returns the setpoint and, in the tick after the replaced cascade has run
    /// out, its memory.
    #[inline]
    pub fn step(&mut self, command: Nanometres) -> (Nanometres, Option<&'m mut [i32]>) {
        let shaped_nm = self.active.step(command.0 - self.origin_nm);
        let Some(outgoing) = &mut self.outgoing else {
            return (Nanometres(self.origin_nm.saturating_add(shaped_nm)), None);
        };
        if outgoing.ticks_left == 0 {
            let retired = self.outgoing.take().map(|outgoing| outgoing.cascade.into_history());
            return (Nanometres(self.origin_nm.saturating_add(shaped_nm)), retired);
        }
        outgoing.ticks_left -= 1;
        let held_nm = outgoing.cascade.step(outgoing.held_input_nm);
        (Nanometres(outgoing.origin_nm.saturating_add(held_nm).saturating_add(shaped_nm)), None)
    }
}
