//! What the tick does where another controller's pulses are the command.
//!
//! They are it from when the drive is enabled until something stops it; before and after they are counted and
//! nothing more. What stops a move stops them: the command, or where that is not enough the setpoint itself,
//! is braked.

use super::{Controller, Motion};
use crate::motion::StopPlan;
use crate::source::{Source, SourceSetup};
use crate::units::Nanometres;

impl Controller<'_> {
    /// Reads the pulses like this from now on. Another source begins with the drive off.
    #[cold]
    #[inline(never)]
    pub(super) fn configure_source(&mut self, setup: Option<SourceSetup>) {
        match (&mut self.source, setup, &self.setup.source) {
            (Some(source), Some(setup), Some(before)) if setup.is_same_source(before) => {
                source.set_limits(setup.limits);
            }
            (source, setup, _) => {
                *source = setup.map(Source::new);
                self.lags = false;
            }
        }
    }

    /// Lets the pulses be the command, from where the setpoint is. For a shaper that has settled there.
    #[cold]
    #[inline(never)]
    pub(super) fn begin_following(&mut self) {
        let Some(source) = &mut self.source else { return };
        source.begin_at(self.setpoint);
        self.lags = false;
        self.past_shaper = false;
        self.shaping.end_lag();
        self.braking = self.setup.braking;
        self.ramp_ticks = self.setup.drive.times.ramp;
        self.recent = [self.command.into(); 3];
        self.change_motion(Motion::Following);
    }

    /// Follows again after a stop that has left the drive enabled.
    pub(super) fn follow_again(&mut self) {
        if matches!(self.motion, Motion::Hold) && self.is_at_rest() && self.latch.fault().is_none() {
            self.begin_following();
        }
    }

    /// The command of this tick.
    #[inline(never)]
    pub(super) fn follow_source(&mut self) {
        let Some(source) = &mut self.source else { return };
        let position = source.step();
        let [_, before, now] = self.recent;
        self.recent = [before, now, position];
        let command = position.rounded();
        self.quiet_ticks = if command == self.command { self.quiet_ticks.saturating_add(1) } else { 0 };
        self.command = command;
    }

    /// Brings the command to rest. What the setpoint is behind it is not caught up with: it is braked itself.
    pub(super) fn stop_following(&mut self) {
        if self.lags {
            self.brake_setpoint();
        } else {
            self.change_motion(Motion::Stop(StopPlan::new(self.recent, self.braking.hardest())));
        }
    }

    /// The setpoint that the limits permit.
    #[inline(never)]
    pub(super) fn limited(&mut self, shaped: Nanometres) -> Nanometres {
        let Some(source) = &mut self.source else { return shaped };
        let following = matches!(self.motion, Motion::Following);
        let mut behind_nm = 0;
        let mut limited = shaped;
        let mut gives_up = false;
        if !self.past_shaper {
            limited = source.limited(self.earlier_setpoint, self.setpoint, shaped);
            behind_nm = shaped.0.wrapping_sub(limited.0);
            self.lags = behind_nm != 0;
            // After a stop nothing is caught up with: not a count, and not what lies beyond the travel.
            let stands = limited == self.setpoint && self.setpoint == self.earlier_setpoint;
            gives_up = self.lags && !following && (stands || source.is_more_than_a_count(behind_nm));
        }
        self.links.status.source().publish(source.counted(), source.saturated_ticks(), behind_nm, following);
        if gives_up { self.brake_now() } else { limited }
    }

    /// Brakes the setpoint itself from this tick on.
    #[cold]
    fn brake_now(&mut self) -> Nanometres {
        self.brake_setpoint();
        self.step_braking()
    }
}
