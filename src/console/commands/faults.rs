//! `events`, `clear`, `emergency`, `encoder` and `crash`.

use core::fmt::Write;

use super::say;
use super::words::{Words, no_more};
use crate::console::error::{Busy, CommandError, Refused};
use crate::console::{Console, Effect};
use crate::control::Request;
use crate::drive::State;
use crate::fault::{Event, Fault};
use crate::settings::Settings;
use crate::source::SourceKind;
use crate::telemetry::{Activity, Flags};
use crate::units::TickRate;

impl Console<'_> {
    /// Lists the events since the last time and forgets them.
    pub(super) fn list_events(&mut self, out: &mut dyn Write) {
        let mut listed = 0;
        while let Some(record) = self.events.take() {
            say(out, format_args!("event {} {} {}", record.tick, record.event.name(), record.value));
            listed += 1;
        }
        say(out, format_args!("ok events count={listed}"));
    }

    /// Goes on after a fault whose cause is gone.
    pub(super) fn clear(&mut self, out: &mut dyn Write) -> Result<(), CommandError<'static>> {
        self.require_taken("clear")?;
        let Some(fault) = self.status.fault() else {
            say(out, format_args!("ok clear nothing"));
            return Ok(());
        };
        let flags = self.status.flags();
        let still = |reason| Err(CommandError::Fault { command: "clear", reason });
        if flags.contains(Flags::EMERGENCY_INPUT) {
            return still(Refused::EmergencyInput);
        }
        // A drive that is off adopts the actual position when it is enabled.
        let holds = !flags.contains(Flags::DRIVE_DISABLED);
        if holds && flags.contains(Flags::ENCODER_OFF) && self.live.drive().stops_on_encoder() {
            let error_nm = self.status.encoder().0.wrapping_sub(self.status.setpoint().0);
            return still(Refused::EncoderOff { error_nm });
        }
        if !flags.contains(Flags::SETTLED) {
            return Err(CommandError::Busy { command: "clear", reason: Busy::Activity(Activity::Settling) });
        }
        self.request("clear", Request::Clear)?;
        self.forget_announced();
        say(out, format_args!("ok clear {}", fault.name()));
        Ok(())
    }

    pub(super) fn emergency(&mut self, out: &mut dyn Write) -> Result<(), CommandError<'static>> {
        self.request("emergency", Request::Emergency)?;
        say(out, format_args!("ok emergency ('clear' goes on)"));
        Ok(())
    }

    /// Counts the encoder from where the setpoint is.
    pub(super) fn reference_encoder<'l>(
        &mut self,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
        const USAGE: &str = "encoder reference";
        if words.next() != Some("reference") {
            return Err(CommandError::Usage { command: "encoder", usage: USAGE });
        }
        no_more(words, "encoder", USAGE)?;
        self.require_still("encoder")?;
        if self.live.drive().encoder().is_none() {
            return Err(CommandError::Fault { command: "encoder", reason: Refused::NoEncoder });
        }
        self.request("encoder", Request::ReferenceEncoder)?;
        say(out, format_args!("ok encoder position_nm={}", self.status.setpoint().0));
        Ok(())
    }

    /// The reply comes when the record has been erased.
    pub(super) fn clear_crash<'l>(&mut self, mut words: Words<'l>) -> Result<(), CommandError<'l>> {
        const USAGE: &str = "crash clear";
        if words.next() != Some("clear") {
            return Err(CommandError::Usage { command: "crash", usage: USAGE });
        }
        no_more(words, "crash", USAGE)?;
        self.effect = Some(Effect::ForgetCrash);
        Ok(())
    }

    pub(super) fn print_faults(&mut self, out: &mut dyn Write) {
        let flags = self.status.flags();
        say(out, format_args!("fault {}", self.status.fault().map_or("none", Fault::name)));
        say(out, format_args!("drive {}", self.status.drive().name()));
        say(out, format_args!("lacking {}", self.status.lacking()));
        let [first, second, third] = Flags::INPUTS.map(|input| u8::from(flags.contains(input)));
        say(out, format_args!("inputs {first} {second} {third}"));
        if self.live.drive().encoder().is_some() {
            say(out, format_args!("encoder_nm {}", self.status.encoder().0));
        }
        say(out, format_args!("events {}", self.events.len()));
        let _best_effort = out.write_str("counters");
        for event in Event::ALL {
            let _best_effort = write!(out, " {}={}", event.name(), self.status.counters().count(event));
        }
        say(out, format_args!(""));
    }

    pub(super) fn describe_restart(&self, out: &mut dyn Write) {
        say(out, format_args!("reset {}", self.restart.cause.name()));
        match &self.restart.crash {
            None => say(out, format_args!("crash none")),
            Some(crash) => say(out, format_args!("crash {crash}")),
        }
    }

    /// Refuses settings that the outputs cannot follow, or that would rescale them under way.
    pub(super) fn check_outputs(
        &self,
        settings: &Settings,
        tick_rate: TickRate,
        command: &'static str,
    ) -> Result<(), CommandError<'static>> {
        let limit_mm_s = settings.limits().velocity_mm_s;
        if let Some(most_mm_s) = settings.drive().pulse_velocity_mm_s(tick_rate)
            && limit_mm_s > most_mm_s
        {
            return Err(CommandError::PulseRate { limit_mm_s, most_mm_s });
        }
        if let Some(most_mm_s) = settings.drive().analog_velocity_mm_s()
            && limit_mm_s > most_mm_s
        {
            return Err(CommandError::AnalogVelocity { limit_mm_s, most_mm_s });
        }
        if let Some(lacks) = settings.drive().position_loop_lacks() {
            return Err(CommandError::PositionLoop { lacks });
        }
        if let Some(misfit) = settings.source().misfit(&settings.limits(), tick_rate) {
            return Err(CommandError::Source(misfit));
        }
        let rescales = settings.drive().rescales(self.live.drive())
            || settings.inputs() != self.live.inputs()
            || settings.source() != self.live.source()
            || tick_rate != self.table.tick_rate();
        if rescales {
            // No output of an enabled drive may step, and nobody but a drive that is off minds.
            self.require_drive_off(command)?;
        }
        let followed = settings.source().kind() != SourceKind::Moves;
        let other_travel = settings.limits().travel_mm != self.live.limits().travel_mm;
        let other_homing = settings.homing() != self.live.homing();
        if other_travel || other_homing || followed && settings.limits() != self.live.limits() {
            // A motion under way was planned for the travel as it is, and one of another controller is not
            // planned at all.
            self.require_still(command)?;
        }
        Ok(())
    }

    /// Refuses what must not happen while the setpoint changes. A fault holds it.
    pub(super) fn require_still(&self, command: &'static str) -> Result<(), CommandError<'static>> {
        self.require_taken(command)?;
        match self.status.activity() {
            Activity::Rest => Ok(()),
            // A fault holds it when its stop is over.
            Activity::Fault if self.status.drive() != State::Stopping => Ok(()),
            activity => Err(CommandError::Busy { command, reason: Busy::Activity(activity) }),
        }
    }
}
