//! `move`, `sweep`, `stop`.

use core::fmt::Write;

use super::say;
use super::words::{Words, no_more, parse_number};
use crate::console::Console;
use crate::console::error::CommandError;
use crate::control::Request;
use crate::motion::{MovePlan, SweepKind, SweepPlan, SweepSpec};

impl Console<'_> {
    pub(super) fn start_move<'l>(
        &mut self,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
        const USAGE: &str = "move POSITION_MM";
        let target_mm = parse_number(words.next(), "move", USAGE)?;
        no_more(words, "move", USAGE)?;
        self.require_rest("move")?;
        let from = self.status.command();
        let rate = self.table.tick_rate();
        let plan = MovePlan::new(from, target_mm, &self.live.limits(), rate)
            .map_err(|error| CommandError::Motion { command: "move", error })?;
        let duration_ticks = plan.duration_ticks();
        self.request("move", Request::Move(plan))?;
        say(
            out,
            format_args!(
                "ok move from_mm={} to_mm={target_mm} ticks={duration_ticks} settled_ticks={}",
                from.to_mm(),
                duration_ticks + self.table.duration_ticks()
            ),
        );
        Ok(())
    }

    pub(super) fn start_sweep<'l>(
        &mut self,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
        const USAGE: &str = "sweep linear|exponential FROM_HZ TO_HZ SECONDS AMPLITUDE_MM";
        let kind = match words.next() {
            Some("linear") => SweepKind::Linear,
            Some("exponential") => SweepKind::Exponential,
            _ => return Err(CommandError::Usage { command: "sweep", usage: USAGE }),
        };
        let mut number = || parse_number(words.next(), "sweep", USAGE);
        let spec = SweepSpec {
            kind,
            from_hz: number()?,
            to_hz: number()?,
            duration_s: number()?,
            amplitude_mm: number()?,
        };
        no_more(words, "sweep", USAGE)?;
        self.require_rest("sweep")?;
        let centre = self.status.command();
        let plan = SweepPlan::new(&spec, centre, &self.live.limits(), self.table.tick_rate())
            .map_err(|error| CommandError::Motion { command: "sweep", error })?;
        let duration_ticks = plan.duration_ticks();
        self.request("sweep", Request::Sweep(plan))?;
        say(
            out,
            format_args!(
                "ok sweep ticks={duration_ticks} settled_ticks={}",
                duration_ticks + self.table.duration_ticks()
            ),
        );
        Ok(())
    }

    pub(super) fn stop(&mut self, out: &mut dyn Write) -> Result<(), CommandError<'static>> {
        self.request("stop", Request::Stop)?;
        say(out, format_args!("ok stop"));
        Ok(())
    }
}
