//! `shaper`, and the way of a table from settings to the interrupt.

use core::fmt::Write;

use super::say;
use super::words::{Words, no_more, parse_switch};
use crate::console::Console;
use crate::console::error::{Busy, CommandError};
use crate::console::upload::{UploadError, UploadKind};
use crate::control::Request;
use crate::decimal::Decimal;
use crate::motion::MoveLimits;
use crate::settings::{Settings, ShaperSource};
use crate::shaper::table::TableError;
use crate::shaper::{Cascade, MAX_MODES, Mode, ShaperTable, Transition};
use crate::source::SourceKind;
use crate::telemetry::Activity;
use crate::units::TickRate;

impl Console<'_> {
    pub(super) fn switch_shaper<'l>(
        &mut self,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
        let on = parse_switch(words.next(), "shaper", "shaper on|off")?;
        no_more(words, "shaper", "shaper on|off")?;
        let live = self.live.clone();
        self.run(&live, on, "shaper")?;
        self.shaper_on = on;
        self.say_table("shaper", out);
        Ok(())
    }

    pub(super) fn say_table(&self, command: &str, out: &mut dyn Write) {
        let table = &self.table;
        let _best_effort = write!(
            out,
            "ok {command} crc32=0x{:08x} modes={} duration_ms={:.3} delay_ms={:.3}",
            table.crc32(),
            table.stages().len(),
            Decimal(table.duration_s() * 1e3),
            Decimal(table.delay_s() * 1e3)
        );
        if self.lag_ticks > 0 {
            let lag_s = table.tick_rate().seconds(self.lag_ticks);
            let _best_effort = write!(out, " lag_ms={:.3}", Decimal(lag_s * 1e3));
        }
        say(out, format_args!(""));
    }

    /// Builds everything that `settings` need and hands it to the interrupt, or refuses and changes nothing.
    pub(super) fn run(
        &mut self,
        settings: &Settings,
        shaper_on: bool,
        command: &'static str,
    ) -> Result<(), CommandError<'static>> {
        self.require_taken(command)?;
        let tick_rate = settings.tick_rate().attainable(self.identity.timer_clock_hz);
        if tick_rate != self.table.tick_rate() {
            self.require_rest(command)?;
        } else if let activity @ (Activity::Sweeping
        | Activity::Multisine
        | Activity::Pulsing
        | Activity::Playing
        | Activity::Homing) = self.status.activity()
        {
            // See `shaper::handover`: the command must not reverse while a table is replaced.
            return Err(CommandError::Busy { command, reason: Busy::Activity(activity) });
        }
        self.check_outputs(settings, tick_rate, command)?;
        let table =
            if shaper_on { self.shaper(settings, tick_rate)? } else { ShaperTable::identity(tick_rate) };
        let setup = self.setup(settings, tick_rate, table.absolute_gain());
        if table == self.table {
            // Nothing to go over to: what runs is not touched, not even during a move.
            return self.request(command, Request::Configure(setup));
        }
        let transition = self.transition(&table);
        let available = self.history_samples;
        let needed = Cascade::words_with_lag(&table, transition.lag_ticks);
        let memory = |needed| {
            let at_rest = Cascade::words_with_lag(&table, 0);
            CommandError::Memory { needed, at_rest, available, tick_rate }
        };
        if needed > available {
            return Err(memory(needed));
        }
        self.reclaim();
        let history = self.spare_history.take();
        let Some(history) = history else {
            return Err(CommandError::Busy { command, reason: Busy::Handover });
        };
        let cascade = match Cascade::with_lag(&table, transition.lag_ticks, history) {
            Ok(cascade) => cascade,
            Err(refused) => {
                self.spare_history = Some(refused.history);
                return Err(memory(refused.needed));
            }
        };
        // The queue is empty and has room for both.
        self.request(command, Request::Shape(cascade, transition.fade))?;
        self.request(command, Request::Configure(setup))?;
        self.table = table;
        self.lag_ticks = transition.lag_ticks;
        Ok(())
    }

    /// How the machine changes to `table`. The fade adds no more acceleration than is permitted.
    fn transition(&self, table: &ShaperTable) -> Transition {
        // Pulses may come at any moment.
        if self.status.activity() == Activity::Rest && !self.status.source().is_following() {
            return Transition::AT_REST;
        }
        let MoveLimits { velocity_mm_s, acceleration_mm_s2, .. } = self.live.limits();
        let least_ticks = (velocity_mm_s / acceleration_mm_s2 * table.tick_rate().hz()) as u32;
        let transition = Transition::between(&self.table, self.lag_ticks, table, least_ticks);
        if self.live.source().kind() == SourceKind::Moves {
            return transition;
        }
        // Nothing would ever end a lag, and the limits of the setpoint hold without one.
        Transition { lag_ticks: 0, ..transition }
    }

    /// The table that the settings select.
    fn shaper(&self, settings: &Settings, tick_rate: TickRate) -> Result<ShaperTable, CommandError<'static>> {
        let kind = UploadKind::Table;
        match (settings.shaper_source(), &self.uploaded) {
            (ShaperSource::Designed, _) => design(settings, tick_rate),
            (ShaperSource::Uploaded, None) => Err(CommandError::Upload { kind, error: UploadError::NoTable }),
            (ShaperSource::Uploaded, Some(uploaded)) if uploaded.tick_rate() == tick_rate => {
                Ok(uploaded.table())
            }
            (ShaperSource::Uploaded, Some(uploaded)) => {
                let rate_hz = uploaded.tick_rate().hz();
                Err(CommandError::Upload { kind, error: UploadError::Rate { kind, rate_hz, tick_rate } })
            }
        }
    }
}

/// The table of the settings' shaped modes.
fn design(settings: &Settings, tick_rate: TickRate) -> Result<ShaperTable, CommandError<'static>> {
    let mut modes: heapless::Vec<Mode, MAX_MODES> = heapless::Vec::new();
    let mut numbers: heapless::Vec<usize, MAX_MODES> = heapless::Vec::new();
    for (index, mode) in settings.shaped_modes() {
        let mode = mode.map_err(|error| CommandError::Mode { index, error })?;
        // There are no more settings than MAX_MODES.
        let _fits = (modes.push(mode), numbers.push(index));
    }
    ShaperTable::design(&modes, tick_rate).map_err(|error| match error {
        TableError::Mode { index, error } => {
            CommandError::Mode { index: numbers.get(index).copied().unwrap_or(index), error }
        }
        TableError::TooManyModes { .. } => CommandError::Usage { command: "apply", usage: "apply" },
    })
}
