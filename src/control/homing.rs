//! What the tick does of homing.
//!
//! The axis goes past the shaper, so that it is braked as soon as the switch is seen; the live shaper follows
//! unseen and settles where the axis ends. Only then positions change, by the same in everything that has
//! one, before the encoder is read: nothing that is put out notices.

use super::{Controller, Motion};
use crate::fault::Event;
use crate::fault::TravelGuard;
use crate::homing::{Homing, HomingPlan, Sense, Step};
use crate::motion::FinePosition;
use crate::servo::Pulses;
use crate::units::Nanometres;

impl Controller<'_> {
    /// Begins to look for the reference; planned at rest.
    #[cold]
    #[inline(never)]
    pub(super) fn begin_homing(&mut self, plan: HomingPlan) {
        if !self.drive.may_move() || self.has_source() || !self.is_at_rest() || self.latch.fault().is_some() {
            return;
        }
        self.shaping.end_lag();
        // At rest the setpoint is the command.
        self.past_shaper = true;
        self.recent = [self.command.into(); 3];
        self.braking = self.setup.braking;
        self.ramp_ticks = self.setup.drive.times.ramp;
        self.found = None;
        self.change_motion(Motion::Homing(Homing::new(plan, self.command.into())));
    }

    /// The command of this tick.
    #[cold]
    #[inline(never)]
    pub(super) fn step_homing(&mut self) {
        let contacts = self.conditions.flags;
        let inputs = self.setup.drive.inputs;
        let actual = self.encoder.as_ref().map_or(self.setpoint, |encoder| encoder.position());
        let behind_nm = self.setpoint.0.wrapping_sub(actual.0);
        let Motion::Homing(homing) = &mut self.motion else { return };
        let end = homing.plan().end();
        let active = match homing.plan().sense() {
            Sense::Limit => inputs.limits(inputs.unusual(contacts)).any(|limit| limit == end),
            Sense::Home => inputs.is_home(contacts),
            Sense::Stop { error_nm } => behind_nm.wrapping_mul(end) > error_nm,
        };
        match homing.step(active, actual.into()) {
            Step::To(position) => self.follow(position),
            Step::Found(edge) => {
                self.quiet_ticks = self.quiet_ticks.saturating_add(1);
                if self.shaping.is_settled(self.quiet_ticks) {
                    self.found = Some(edge);
                    // The next tick begins with it.
                    self.attention = true;
                }
            }
            Step::NotFound => {
                self.note(Event::HomeFailed, self.setpoint.0);
                self.change_motion(Motion::Hold);
            }
        }
    }

    /// Lets positions count from the reference that was found, if one was.
    pub(super) fn end_homing(&mut self) {
        let (Some(edge), Motion::Homing(homing)) = (self.found.take(), &self.motion) else { return };
        let by_nm = (FinePosition::from(homing.plan().position()) - edge).rounded().0;
        self.move_origin(by_nm);
        self.change_motion(Motion::Hold);
        self.set_referenced(true);
        self.note(Event::Homed, by_nm);
    }

    /// Adds to all positions of a machine at rest. Nothing is put out for it: steps and speeds are of
    /// differences.
    fn move_origin(&mut self, by_nm: i32) {
        let position = Nanometres(self.setpoint.0.saturating_add(by_nm));
        self.shaping.shift(by_nm);
        self.command = position;
        self.recent = [position.into(); 3];
        self.setpoint = position;
        self.earlier_setpoint = position;
        self.pulses = self.setup.pulses.map(|scale| Pulses::new(scale, position));
        if let Some(encoder) = &mut self.encoder {
            encoder.set_reference(Nanometres(encoder.position().0.saturating_add(by_nm)));
        }
    }

    /// Whether homing looks for the limit switch of this end.
    pub(super) fn looks_for_limit(&self, end: i32) -> bool {
        match &self.motion {
            Motion::Homing(homing) => homing.plan().sense() == Sense::Limit && homing.plan().end() == end,
            _ => false,
        }
    }

    /// Positions count from a reference, or no longer do.
    pub(super) fn set_referenced(&mut self, referenced: bool) {
        self.referenced = referenced;
        self.position_known |= referenced;
        self.guard_travel();
    }

    /// Guards the travel; or, where positions do not count from a reference and should, what is near to where
    /// the drive was enabled.
    pub(super) fn guard_travel(&mut self) {
        let Self { anchor, setup, .. } = self;
        self.guard = match setup.unreferenced {
            Some(reach) if !self.referenced => setup.guard.around(*anchor, reach),
            _ => setup.guard,
        };
        self.links.status.publish_reference(self.referenced, self.anchor);
    }

    /// The travel that is guarded now, at least as leniently as a motion under way needs.
    pub(super) fn lenient_guard(&self, guard: TravelGuard) -> TravelGuard {
        if self.is_at_rest() { guard } else { guard.as_lenient_as(self.setup.guard) }
    }
}
