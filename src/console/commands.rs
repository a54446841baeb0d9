//! One function per command.

use core::fmt::{self, Write};

use super::error::{Busy, CommandError};
use super::{Console, Effect, help};
use crate::control::Request;
use crate::motion::{MovePlan, SweepKind, SweepPlan, SweepSpec};
use crate::settings::{Key, Settings};
use crate::shaper::table::TableError;
use crate::shaper::{Cascade, MAX_MODES, Mode, ShaperTable};
use crate::telemetry::Activity;
use crate::units::TickRate;

/// A command's words after its name.
type Words<'l> = core::str::SplitAsciiWhitespace<'l>;

/// Nothing but `Ok` can be done about output that does not fit; [`super::MAX_REPLY`] rules it out.
fn say(out: &mut dyn Write, line: fmt::Arguments<'_>) {
    let _best_effort = out.write_fmt(line).and_then(|()| out.write_str("\r\n"));
}

impl<'m> Console<'m> {
    pub(super) fn execute<'l>(&mut self, line: &'l str, out: &mut dyn Write) -> Result<(), CommandError<'l>> {
        let mut words = line.split_ascii_whitespace();
        let command = words.next().unwrap_or_default();
        match command {
            "help" => help::help(words, out),
            "info" => no_more(words, "info", "info").map(|()| self.info(out)),
            "status" => no_more(words, "status", "status").map(|()| self.print_status(out)),
            "get" => self.get(words, out),
            "set" => self.set(words, out),
            "apply" => no_more(words, "apply", "apply").and_then(|()| self.apply(out)),
            "revert" => no_more(words, "revert", "revert").map(|()| self.revert(out)),
            "defaults" => no_more(words, "defaults", "defaults").map(|()| self.stage_defaults(out)),
            "save" => no_more(words, "save", "save").and_then(|()| self.save()),
            "shaper" => self.switch_shaper(words, out),
            "move" => self.start_move(words, out),
            "sweep" => self.start_sweep(words, out),
            "stop" => no_more(words, "stop", "stop").and_then(|()| self.stop(out)),
            "stream" => self.stream(words, out),
            "echo" => self.switch_echo(words, out),
            _ => Err(CommandError::UnknownCommand(command)),
        }
    }

    fn info(&self, out: &mut dyn Write) {
        let table = &self.table;
        say(out, format_args!("firmware stillbeam {}", self.identity.version));
        say(out, format_args!("board {}", self.identity.board));
        say(out, format_args!("tick_hz {}", table.tick_rate().hz()));
        say(out, format_args!("shaper {}", on_off(self.shaper_on)));
        say(out, format_args!("shaper_modes {}", table.stages().len()));
        self.describe_table(out);
        self.describe_stored(out);
        say(out, format_args!("ok info"));
    }

    fn describe_table(&self, out: &mut dyn Write) {
        let table = &self.table;
        say(out, format_args!("shaper_crc32 0x{:08x}", table.crc32()));
        say(out, format_args!("shaper_duration_ms {:.3}", table.duration_s() * 1e3));
        say(out, format_args!("shaper_delay_ms {:.3}", table.delay_s() * 1e3));
        say(out, format_args!("history_samples {} of {}", table.history_samples(), self.history_samples));
    }

    fn describe_stored(&self, out: &mut dyn Write) {
        say(out, format_args!("settings_loaded {}", self.stored.loaded()));
        say(out, format_args!("settings_skipped {}", self.stored.skipped()));
        say(out, format_args!("settings_unknown {}", self.stored.unknown()));
        match self.store_fault {
            None => say(out, format_args!("settings_store ok")),
            Some(fault) => say(out, format_args!("settings_store {fault}")),
        }
    }

    fn print_status(&self, out: &mut dyn Write) {
        say(out, format_args!("state {}", self.status.activity().name()));
        say(out, format_args!("tick {}", self.status.tick()));
        say(out, format_args!("command_nm {}", self.status.command().0));
        say(out, format_args!("setpoint_nm {}", self.status.setpoint().0));
        say(out, format_args!("dropped_samples {}", self.status.dropped()));
        say(out, format_args!("ok status"));
    }

    fn get<'l>(&self, mut words: Words<'l>, out: &mut dyn Write) -> Result<(), CommandError<'l>> {
        let name = words.next();
        no_more(words, "get", "get [NAME]")?;
        match name {
            Some(name) => self.print_setting(parse_key(name)?, out),
            None => Key::all().for_each(|key| self.print_setting(key, out)),
        }
        say(out, format_args!("ok get"));
        Ok(())
    }

    fn print_setting(&self, key: Key, out: &mut dyn Write) {
        let (live, staged) = (self.live.get(key), self.staged.get(key));
        let default = Settings::default().get(key);
        let unit = key.unit();
        let space = if unit.is_empty() { "" } else { " " };
        let _best_effort = write!(out, "{key} = {live}{space}{unit} [{default}] ");
        let _best_effort = match self.stored.get(key) {
            Some(stored) => write!(out, "{{{stored}}}"),
            None => out.write_str("{-}"),
        };
        if live == staged {
            say(out, format_args!(""));
        } else {
            say(out, format_args!(" staged {staged}"));
        }
    }

    fn set<'l>(&mut self, mut words: Words<'l>, out: &mut dyn Write) -> Result<(), CommandError<'l>> {
        const USAGE: CommandError<'static> = CommandError::Usage { command: "set", usage: "set NAME VALUE" };
        let (Some(name), Some(text), None) = (words.next(), words.next(), words.next()) else {
            return Err(USAGE);
        };
        let key = parse_key(name)?;
        self.staged.set(key, text).map_err(|refusal| CommandError::Value { key, refusal })?;
        say(out, format_args!("ok set {key} = {}; 'apply' to use it", self.staged.get(key)));
        Ok(())
    }

    fn apply(&mut self, out: &mut dyn Write) -> Result<(), CommandError<'static>> {
        let staged = self.staged.clone();
        self.run(&staged, self.shaper_on, "apply")?;
        self.live = staged;
        self.say_table("apply", out);
        Ok(())
    }

    fn revert(&mut self, out: &mut dyn Write) {
        self.staged = self.live.clone();
        say(out, format_args!("ok revert"));
    }

    fn stage_defaults(&mut self, out: &mut dyn Write) {
        self.staged = Settings::default();
        say(out, format_args!("ok defaults; 'apply' to use them"));
    }

    /// The reply comes when the effect has been carried out.
    fn save(&mut self) -> Result<(), CommandError<'static>> {
        self.require_rest("save")?;
        self.effect = Some(Effect::Save(self.live.clone()));
        Ok(())
    }

    /// Runs what was stored, or leaves it staged and says why.
    pub(super) fn run_stored(&mut self) -> Result<(), CommandError<'static>> {
        self.staged = self.stored.settings().clone();
        if self.staged == self.live {
            return Ok(());
        }
        let staged = self.staged.clone();
        self.run(&staged, self.shaper_on, "apply")?;
        self.live = staged;
        Ok(())
    }

    fn switch_shaper<'l>(
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

    fn say_table(&self, command: &str, out: &mut dyn Write) {
        let table = &self.table;
        say(
            out,
            format_args!(
                "ok {command} crc32=0x{:08x} modes={} duration_ms={:.3} delay_ms={:.3}",
                table.crc32(),
                table.stages().len(),
                table.duration_s() * 1e3,
                table.delay_s() * 1e3
            ),
        );
    }

    /// Builds everything that `settings` need and hands it to the interrupt, or refuses and changes nothing.
    fn run(
        &mut self,
        settings: &Settings,
        shaper_on: bool,
        command: &'static str,
    ) -> Result<(), CommandError<'static>> {
        self.require_taken(command)?;
        let tick_rate = settings.tick_rate().attainable(self.identity.timer_clock_hz);
        if tick_rate != self.table.tick_rate() {
            self.require_rest(command)?;
        } else if self.status.activity() == Activity::Sweeping {
            // See `shaper::handover`: the command must not reverse while a table is replaced.
            let reason = Busy::Activity(Activity::Sweeping);
            return Err(CommandError::Busy { command, reason });
        }
        let table = if shaper_on { design(settings, tick_rate)? } else { ShaperTable::identity(tick_rate) };
        let (needed, available) = (table.history_samples(), self.history_samples);
        if needed > available {
            return Err(CommandError::Memory { needed, available, tick_rate });
        }
        let history = self.spare_history.take().or_else(|| self.retired.dequeue());
        let Some(history) = history else {
            return Err(CommandError::Busy { command, reason: Busy::Handover });
        };
        let cascade = match Cascade::new(&table, history) {
            Ok(cascade) => cascade,
            Err(refused) => {
                self.spare_history = Some(refused.history);
                return Err(CommandError::Memory { needed: refused.needed, available, tick_rate });
            }
        };
        // The queue is empty and has room for both.
        self.request(command, Request::Shape(cascade))?;
        let (braking, analog) = (settings.braking(), settings.analog_scale());
        self.request(command, Request::Configure { braking, analog })?;
        self.table = table;
        Ok(())
    }

    fn start_move<'l>(&mut self, mut words: Words<'l>, out: &mut dyn Write) -> Result<(), CommandError<'l>> {
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

    fn start_sweep<'l>(&mut self, mut words: Words<'l>, out: &mut dyn Write) -> Result<(), CommandError<'l>> {
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

    fn stop(&mut self, out: &mut dyn Write) -> Result<(), CommandError<'static>> {
        self.request("stop", Request::Stop)?;
        say(out, format_args!("ok stop"));
        Ok(())
    }

    fn stream<'l>(&mut self, mut words: Words<'l>, out: &mut dyn Write) -> Result<(), CommandError<'l>> {
        const USAGE: &str = "stream on [TICKS_PER_SAMPLE]|off";
        let on = parse_switch(words.next(), "stream", USAGE)?;
        let decimation = match (on, words.next()) {
            (false, None) => 0,
            (true, None) => self.live.stream_decimation(),
            (true, Some(text)) => {
                // Checked like the setting of the same meaning.
                let mut checked = Settings::default();
                let key = Key::StreamDecimation;
                checked.set(key, text).map_err(|refusal| CommandError::Value { key, refusal })?;
                checked.stream_decimation()
            }
            (false, Some(_)) => return Err(CommandError::Usage { command: "stream", usage: USAGE }),
        };
        no_more(words, "stream", USAGE)?;
        self.request("stream", Request::Stream { decimation })?;
        say(out, format_args!("ok stream {} decimation={decimation}", on_off(on)));
        Ok(())
    }

    fn switch_echo<'l>(&mut self, mut words: Words<'l>, out: &mut dyn Write) -> Result<(), CommandError<'l>> {
        let on = parse_switch(words.next(), "echo", "echo on|off")?;
        no_more(words, "echo", "echo on|off")?;
        self.editor.set_echo(on);
        say(out, format_args!("ok echo {}", on_off(on)));
        Ok(())
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

fn no_more<'l>(
    mut words: Words<'l>,
    command: &'static str,
    usage: &'static str,
) -> Result<(), CommandError<'l>> {
    if words.next().is_none() { Ok(()) } else { Err(CommandError::Usage { command, usage }) }
}

fn parse_key(name: &str) -> Result<Key, CommandError<'_>> {
    name.parse().map_err(|_| CommandError::UnknownName(name))
}

fn parse_switch(
    word: Option<&str>,
    command: &'static str,
    usage: &'static str,
) -> Result<bool, CommandError<'static>> {
    match word {
        Some("on") => Ok(true),
        Some("off") => Ok(false),
        _ => Err(CommandError::Usage { command, usage }),
    }
}

fn parse_number(
    word: Option<&str>,
    command: &'static str,
    usage: &'static str,
) -> Result<f64, CommandError<'static>> {
    word.and_then(|word| word.parse().ok())
        .filter(|number: &f64| number.is_finite())
        .ok_or(CommandError::Usage { command, usage })
}

fn on_off(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}
