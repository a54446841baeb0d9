//! `info` and `status`.

use core::fmt::Write;

use super::say;
use super::words::on_off;
use crate::console::Console;
use crate::decimal::Decimal;
use crate::machine::CORE_CYCLES_PER_TIMER_CLOCK;
use crate::source::SourceKind;
use crate::units::TickRate;

impl Console<'_> {
    pub(super) fn info(&self, out: &mut dyn Write) {
        let table = &self.table;
        say(out, format_args!("firmware stillbeam {}", self.identity.version));
        say(out, format_args!("board {}", self.identity.board));
        say(out, format_args!("tick_hz {}", Decimal(table.tick_rate().hz())));
        say(out, format_args!("build 0x{:08x}", self.identity.build));
        match self.identity.brown_out {
            Some(level) => say(out, format_args!("brown_out {level}")),
            None => say(out, format_args!("brown_out unknown")),
        }
        self.describe_source(out);
        say(out, format_args!("shaper {}", on_off(self.shaper_on)));
        say(out, format_args!("shaper_source {}", self.live.shaper_source().name()));
        say(out, format_args!("shaper_modes {}", table.stages().len()));
        self.describe_table(out);
        self.describe_uploaded(out);
        match &self.plan {
            Some(plan) => say(out, format_args!("plan_crc32 0x{:08x}", plan.crc32)),
            None => say(out, format_args!("plan_crc32 none")),
        }
        self.describe_stored(out);
        self.describe_restart(out);
        say(out, format_args!("ok info"));
    }

    fn describe_table(&self, out: &mut dyn Write) {
        let table = &self.table;
        say(out, format_args!("shaper_crc32 0x{:08x}", table.crc32()));
        say(out, format_args!("shaper_duration_ms {:.3}", Decimal(table.duration_s() * 1e3)));
        say(out, format_args!("shaper_delay_ms {:.3}", Decimal(table.delay_s() * 1e3)));
        let lag_s = table.tick_rate().seconds(self.lag_ticks);
        say(out, format_args!("shaper_lag_ms {:.3}", Decimal(lag_s * 1e3)));
        say(out, format_args!("history_samples {} of {}", table.history_samples(), self.history_samples));
    }

    fn describe_uploaded(&self, out: &mut dyn Write) {
        for (name, table) in [("table_crc32", self.uploaded.as_ref()), ("table_stored", self.stored.table())]
        {
            match table {
                Some(table) => say(out, format_args!("{name} 0x{:08x}", table.crc32())),
                None => say(out, format_args!("{name} none")),
            }
        }
    }

    fn describe_stored(&self, out: &mut dyn Write) {
        say(out, format_args!("settings_loaded {}", self.stored.loaded()));
        say(out, format_args!("settings_skipped {}", self.stored.skipped()));
        say(out, format_args!("settings_unknown {}", self.stored.unknown()));
        match self.stored.damage() {
            None => say(out, format_args!("settings_damaged none")),
            Some(damage) => say(out, format_args!("settings_damaged {damage}")),
        }
        match self.store_fault {
            None => say(out, format_args!("settings_store ok")),
            Some(fault) => say(out, format_args!("settings_store {fault}")),
        }
    }

    /// Of the tick, in cycles of the core: the last one, the longest one, and from one to the next. `None`
    /// where the counter is beyond the slowest tick and so is none that begins anew with each: the
    /// emulator's.
    pub(super) fn tick_cycles(&self) -> Option<[u32; 3]> {
        let (last, worst) = self.status.durations();
        let slowest = f64::from(self.identity.timer_clock_hz) / TickRate::RANGE_HZ.0;
        let known = f64::from(worst) <= slowest;
        let clocks = [last, worst, self.clocks_per_tick()];
        known.then(|| clocks.map(|clocks| clocks * CORE_CYCLES_PER_TIMER_CLOCK))
    }

    fn print_durations(&self, out: &mut dyn Write) {
        match self.tick_cycles() {
            None => say(out, format_args!("tick_cycles unknown")),
            Some([last, worst, period]) => {
                say(out, format_args!("tick_cycles last={last} worst={worst} period={period}"));
            }
        }
    }

    /// Where the command comes from, and by what it is multiplied.
    fn describe_source(&self, out: &mut dyn Write) {
        let source = self.live.source();
        say(out, format_args!("source {}", source.kind().name()));
        if source.kind() != SourceKind::Moves {
            let (gear_nm, gear_counts) = source.gear();
            say(out, format_args!("source_gear {gear_nm} nm for {gear_counts} counts"));
        }
    }

    /// What the pulses of another controller have made, and by how much the setpoint is behind them.
    fn print_source(&self, out: &mut dyn Write) {
        let kind = self.live.source().kind();
        if kind == SourceKind::Moves {
            say(out, format_args!("source moves"));
            return;
        }
        let source = self.status.source();
        let tick_rate = self.table.tick_rate();
        let delay_s = self.table.delay_s() + self.live.source().delay_ticks() * tick_rate.period_s();
        say(
            out,
            format_args!(
                "source {} {} counts={} saturated_ticks={} behind_nm={} delay_ms={:.3}",
                kind.name(),
                if source.is_following() { "following" } else { "ignored" },
                source.counted(),
                source.saturated_ticks(),
                source.behind_nm(),
                Decimal(delay_s * 1e3)
            ),
        );
    }

    pub(super) fn print_status(&mut self, out: &mut dyn Write) {
        say(out, format_args!("state {}", self.status.activity().name()));
        say(out, format_args!("tick {}", self.status.tick()));
        say(out, format_args!("command_nm {}", self.status.command().0));
        say(out, format_args!("setpoint_nm {}", self.status.setpoint().0));
        say(out, format_args!("dropped_samples {}", self.status.dropped()));
        let referenced = if self.status.is_referenced() { "known" } else { "unknown" };
        say(out, format_args!("reference {referenced}"));
        self.print_durations(out);
        self.print_source(out);
        self.print_faults(out);
        say(out, format_args!("ok status"));
    }
}
