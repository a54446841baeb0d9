//! What the tick does when something is unusual: the drive is not simply enabled, or an input says that
//! something is wrong.
//!
//! All of it is apart from the tick, which then has registers enough for what it does every time.

use super::{Controller, DriveEvent, Motion};
use crate::drive::{Lacking, Lines, Times, Unusual};
use crate::fault::{Event, Fault};
use crate::motion::StopPlan;
use crate::servo::Pulses;
use crate::telemetry::Flags;
use crate::units::{MAX_TRAVEL_MM, Nanometres};

/// The positions that a shaper may begin at: from there to any other one fits into its arithmetic.
const FURTHEST_NM: i32 = (MAX_TRAVEL_MM * 1.0e6) as i32;

impl Controller<'_> {
    /// To inputs that say that something is wrong, or was in the last tick, and to a drive on its way.
    #[cold]
    #[inline(never)]
    pub(super) fn react(&mut self, unusual: Unusual, emergency: bool, missed_ticks: u16, late: bool) {
        self.end_homing();
        self.take_asked();
        if missed_ticks != 0 {
            self.note(Event::MissedTick, i32::from(missed_ticks));
            // At rest nothing was missed: the setpoint would not have moved.
            if !self.is_at_rest() && !self.drive.is_off() {
                self.trip(Fault::MissedTick);
            }
        }
        if late {
            self.note(Event::LateTick, 0);
        }
        let emergency = emergency || self.setup.drive.inputs.is_emergency(unusual);
        if emergency != self.conditions.flags.contains(Flags::EMERGENCY_INPUT) {
            self.conditions.put(Flags::EMERGENCY_INPUT, emergency);
            if emergency {
                self.note(Event::Emergency, 1);
            }
        }
        if emergency {
            self.trip(Fault::Emergency);
        }
        self.react_to_contacts(unusual);
        self.tell_drive(DriveEvent::Tick);
        if self.drive.is_ramping() && !matches!(self.motion, Motion::Braking(_)) {
            self.tell_drive(DriveEvent::AtRest);
        }
        self.look_at_drive();
    }

    /// To limit switches and to what the drive says of itself.
    fn react_to_contacts(&mut self, unusual: Unusual) {
        let inputs = self.setup.drive.inputs;
        let new = unusual.since(core::mem::replace(&mut self.conditions.unusual, unusual));
        if inputs.drive_fails(new) {
            self.note(Event::Drive, 0);
        }
        if inputs.drive_fails(unusual) && !self.drive.is_off() {
            self.trip(Fault::Drive);
        }
        inputs.limits(new).for_each(|end| self.note(Event::LimitInput, end));
        let direction = self.setpoint.0.wrapping_sub(self.earlier_setpoint.0).signum();
        // Away from the switch the way is free.
        let mut limits = inputs.limits(unusual);
        if direction != 0 && limits.any(|end| end == direction && !self.looks_for_limit(end)) {
            self.trip(Fault::LimitInput);
        }
    }

    /// What enabling needs and is not there.
    fn lacking(&self) -> Lacking {
        let encoder = self.encoder.as_ref().map(|encoder| encoder.position().0);
        let adoptable = match encoder {
            Some(at_nm) => {
                (self.position_known || self.setup.drive.relative)
                    && at_nm.unsigned_abs() <= FURTHEST_NM.unsigned_abs()
            }
            // Homing will find it.
            None => self.position_known || (self.setup.unreferenced.is_some() && self.setup.drive.relative),
        };
        self.setup
            .drive
            .lacking
            .with(Lacking::POSITION, !adoptable)
            .with(Lacking::EMERGENCY_RELEASED, self.conditions.flags.contains(Flags::EMERGENCY_INPUT))
            .with(Lacking::DRIVE_READY, self.setup.drive.inputs.drive_fails(self.conditions.unusual))
    }

    /// Brings the drive's permit up to date, and whether the tick has to come here again.
    pub(super) fn look_at_drive(&mut self) {
        let lacking = self.lacking();
        self.links.status.publish_lacking(lacking);
        self.tell_drive(DriveEvent::Permit(lacking.is_empty()));
        let unusual = self.conditions.flags.contains(Flags::EMERGENCY_INPUT) || self.conditions.unusual.any();
        self.attention = unusual || !self.drive.may_move();
    }

    /// Takes the drive to its next state, and the setpoint with it.
    pub(super) fn tell_drive(&mut self, event: DriveEvent) {
        let before = self.drive;
        // Limits that have changed since do not cut short what brakes with the old ones.
        let times =
            Times { ramp: self.ramp_ticks.max(self.setup.drive.times.ramp), ..self.setup.drive.times };
        let now = before.after(event, &times);
        if now == before {
            return;
        }
        self.drive = now;
        self.attention = true;
        if now.is_ramping() && !before.is_ramping() {
            self.brake_setpoint();
        } else if now.is_off() && !before.is_off() {
            self.let_go();
        } else if now.may_move() && !before.may_move() {
            // The shaper has settled where the setpoint is: see `enable` and `Request::Clear`.
            self.past_shaper = false;
            self.begin_following();
        }
        self.outputs = now.outputs();
        self.lines = self.lines.with_drive(self.outputs);
        self.conditions.put(Flags::DRIVE_DISABLED, !self.outputs.enable);
        self.links.status.publish_drive(now.state());
    }

    /// Brakes the setpoint itself from its own speed.
    pub(super) fn brake_setpoint(&mut self) {
        let (before, now) = (self.earlier_setpoint.into(), self.setpoint.into());
        self.change_motion(Motion::Braking(StopPlan::new([before, before, now], self.braking.hardest())));
        self.pass_shaper();
    }

    /// Lets the setpoint be the command itself, which is where the setpoint is.
    fn pass_shaper(&mut self) {
        self.past_shaper = true;
        self.lags = false;
        if self.command != self.setpoint {
            self.command = self.setpoint;
            self.quiet_ticks = 0;
        }
    }

    /// The drive is off: the setpoint stays, and the machine perhaps does not.
    fn let_go(&mut self) {
        let moves = self.setpoint != self.earlier_setpoint;
        if moves && self.encoder.is_none() {
            self.position_known = false;
            self.set_referenced(false);
        }
        self.change_motion(Motion::Hold);
        self.pass_shaper();
    }

    /// Adopts where the machine is and lets the drive run.
    pub(super) fn enable(&mut self) {
        if self.drive.may_move() {
            self.follow_again();
            return;
        }
        if !self.is_at_rest()
            || !self.drive.is_off()
            || !self.lacking().is_empty()
            || self.latch.fault().is_some()
        {
            return;
        }
        if let Some(encoder) = &self.encoder {
            let at = encoder.position();
            self.shift_to(at);
        }
        self.anchor = self.setpoint;
        self.guard_travel();
        self.tell_drive(DriveEvent::Enable);
    }

    /// The machine stands at `position`.
    pub(super) fn set_position(&mut self, position: Nanometres) {
        if !self.is_at_rest() || !self.drive.is_off() {
            return;
        }
        self.shift_to(position);
        if let Some(encoder) = &mut self.encoder {
            encoder.set_reference(position);
        }
        self.set_referenced(true);
    }

    /// Puts command and setpoint at `position` while the drive is off: no output makes up for it by steps or
    /// a speed.
    fn shift_to(&mut self, position: Nanometres) {
        self.shaping.shift(position.0.wrapping_sub(self.setpoint.0));
        self.command = position;
        self.recent = [position.into(); 3];
        self.setpoint = position;
        self.earlier_setpoint = position;
        if let Some(source) = &mut self.source {
            source.begin_at(position);
        }
        self.pulses = self.setup.pulses.map(|scale| Pulses::new(scale, position));
    }

    /// Goes on after a fault.
    pub(super) fn clear(&mut self) {
        self.latch.clear();
        self.lines = self.lines.with(Lines::CHARGE_PUMP, true);
        self.conditions.limit = false;
        self.note(Event::Cleared, 0);
        self.tell_drive(DriveEvent::Clear);
    }

    /// The encoder is outside its window, which says nothing while the drive is off: the machine may be
    /// pushed.
    #[cold]
    #[inline(never)]
    pub(super) fn note_encoder(&mut self, position: Nanometres, was_off: bool) {
        if self.drive.is_off() {
            return;
        }
        if !was_off {
            self.note(Event::Encoder, position.0.wrapping_sub(self.setpoint.0));
        }
        self.trip(Fault::Encoder);
    }

    /// The shaped setpoint would leave the travel: the last one is braked from its speed instead.
    #[cold]
    #[inline(never)]
    pub(super) fn brake_at_limit(&mut self, shaped: Nanometres) -> Nanometres {
        if !self.conditions.limit {
            self.note(Event::Limit, shaped.0);
        }
        self.conditions.limit = true;
        self.trip(Fault::Limit);
        self.step_braking()
    }

    /// The setpoint of a tick in which the braking has begun.
    pub(super) fn step_braking(&mut self) -> Nanometres {
        if let Motion::Braking(plan) = &mut self.motion
            && let Some(position) = plan.step()
        {
            self.follow(position);
        }
        self.command
    }

    /// Reacts to a fault.
    pub(super) fn trip(&mut self, fault: Fault) {
        if let Some(stop) = self.latch.trip(fault, self.setup.reactions) {
            self.lines = self.lines.with(Lines::IN_POSITION, false).with(Lines::CHARGE_PUMP, false);
            self.tell_drive(DriveEvent::Fault(stop));
        }
    }
}
