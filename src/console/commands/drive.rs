//! `enable`, `disable`, `position`.

use core::fmt::Write;

use super::say;
use super::words::{Words, no_more};
use crate::console::Console;
use crate::console::error::{Busy, CommandError, Refused};
use crate::control::Request;
use crate::decimal::{self, Decimal};
use crate::drive::State;
use crate::motion::MotionError;
use crate::shaper::{Cascade, Transition};
use crate::source::SourceKind;
use crate::units::{MAX_TRAVEL_MM, Nanometres};

impl Console<'_> {
    /// Lets the drive run, from where the machine is.
    pub(super) fn enable(&mut self, out: &mut dyn Write) -> Result<(), CommandError<'static>> {
        const COMMAND: &str = "enable";
        self.require_rest(COMMAND)?;
        match self.status.drive() {
            State::NotReady => {
                let reason = Refused::Lacking(self.status.lacking());
                return Err(CommandError::Fault { command: COMMAND, reason });
            }
            State::Stopping => {
                return Err(CommandError::Busy { command: COMMAND, reason: Busy::Drive(State::Stopping) });
            }
            State::Disabled => {
                self.forget_history(COMMAND)?;
                self.request(COMMAND, Request::Enable)?;
            }
            // After a stop another controller's pulses are followed again.
            State::Enabled if self.live.source().kind() != SourceKind::Moves => {
                self.request(COMMAND, Request::Enable)?;
            }
            State::Enabling | State::Enabled | State::Fault => {}
        }
        say(out, format_args!("ok enable ('status' says when the drive is enabled)"));
        Ok(())
    }

    /// Brings the setpoint to rest and switches the drive off. Always accepted.
    pub(super) fn disable(&mut self, out: &mut dyn Write) -> Result<(), CommandError<'static>> {
        self.request("disable", Request::Disable)?;
        say(out, format_args!("ok disable"));
        Ok(())
    }

    /// Says where the machine stands.
    pub(super) fn set_position<'l>(
        &mut self,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
        const COMMAND: &str = "position";
        const USAGE: &str = "position set MM";
        let usage = CommandError::Usage { command: COMMAND, usage: USAGE };
        let (Some("set"), Some(text)) = (words.next(), words.next()) else { return Err(usage) };
        no_more(words, COMMAND, USAGE)?;
        let position_mm = decimal::parse(text).ok_or(usage)?;
        let range_mm = (-MAX_TRAVEL_MM, MAX_TRAVEL_MM);
        let outside = MotionError::Travel { position_mm, range_mm };
        let position = Nanometres::from_mm(position_mm)
            .ok_or(CommandError::Motion { command: COMMAND, error: outside })?;
        self.require_drive_off(COMMAND)?;
        self.require_settled(COMMAND)?;
        self.forget_history(COMMAND)?;
        self.request(COMMAND, Request::SetPosition(position))?;
        say(out, format_args!("ok position set_mm={}", Decimal(position.to_mm())));
        Ok(())
    }

    /// Gives the live shaper a history of nothing but rest, so that it may begin anywhere.
    fn forget_history(&mut self, command: &'static str) -> Result<(), CommandError<'static>> {
        self.reclaim();
        let handover = CommandError::Busy { command, reason: Busy::Handover };
        let history = self.spare_history.take().ok_or(handover)?;
        match Cascade::with_lag(&self.table, 0, history) {
            Ok(cascade) => {
                self.request(command, Request::Shape(cascade, Transition::AT_REST.fade))?;
                self.lag_ticks = 0;
                Ok(())
            }
            // The same table is live, in as much memory.
            Err(refused) => {
                self.spare_history = Some(refused.history);
                Err(handover)
            }
        }
    }

    /// Refuses until command and setpoint stand still for good, a fault or not.
    fn require_settled(&self, command: &'static str) -> Result<(), CommandError<'static>> {
        use crate::telemetry::{Activity, Flags};
        let activity = self.status.activity();
        let settled = match activity {
            Activity::Rest => true,
            Activity::Fault => self.status.flags().contains(Flags::SETTLED),
            _ => false,
        };
        if settled { Ok(()) } else { Err(CommandError::Busy { command, reason: Busy::Activity(activity) }) }
    }
}
