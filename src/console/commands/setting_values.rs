//! `get`, `set`, `apply`, `revert`, `defaults`, `save`.

use core::fmt::Write;

use super::say;
use super::words::{Words, no_more, parse_key};
use crate::console::error::{CommandError, Refused};
use crate::console::{Console, Effect};
use crate::control::{Request, Setup};
use crate::drive::Lacking;
use crate::settings::{Key, Settings};
use crate::units::TickRate;

impl Console<'_> {
    pub(super) fn get<'l>(&self, mut words: Words<'l>, out: &mut dyn Write) -> Result<(), CommandError<'l>> {
        let name = words.next();
        no_more(words, "get", "get [NAME]")?;
        match name {
            Some(name) => {
                self.print_setting(parse_key(name)?, out);
                say(out, format_args!("ok get"));
            }
            None => {
                Key::all().for_each(|key| self.print_setting(key, out));
                self.say_table("get", out);
            }
        }
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

    pub(super) fn set<'l>(
        &mut self,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
        const USAGE: CommandError<'static> = CommandError::Usage { command: "set", usage: "set NAME VALUE" };
        let (Some(name), Some(text), None) = (words.next(), words.next(), words.next()) else {
            return Err(USAGE);
        };
        let key = parse_key(name)?;
        self.staged.set(key, text).map_err(|refusal| CommandError::Value { key, refusal })?;
        say(out, format_args!("ok set {key} = {}; 'apply' to use it", self.staged.get(key)));
        Ok(())
    }

    pub(super) fn apply(&mut self, out: &mut dyn Write) -> Result<(), CommandError<'static>> {
        let staged = self.staged.clone();
        self.run(&staged, self.shaper_on, "apply")?;
        self.live = staged;
        self.say_table("apply", out);
        Ok(())
    }

    pub(super) fn revert(&mut self, out: &mut dyn Write) {
        self.staged = self.live.clone();
        say(out, format_args!("ok revert"));
    }

    pub(super) fn stage_defaults(&mut self, out: &mut dyn Write) {
        self.staged = Settings::default();
        say(out, format_args!("ok defaults ('apply' uses them)"));
    }

    /// The reply comes when the effect has been carried out.
    pub(super) fn save(&mut self) -> Result<(), CommandError<'static>> {
        self.require_rest("save")?;
        if self.distrusted {
            // A new seal would make of what is left what was wanted.
            return Err(CommandError::Fault { command: "save", reason: Refused::Lacking(Lacking::SETTINGS) });
        }
        // An erase stops the whole chip, its supervision of the drive included.
        self.require_drive_off("save")?;
        self.effect = Some(Effect::Save);
        Ok(())
    }

    /// Takes what runs for what is wanted, although it may not be what was saved.
    pub(super) fn confirm_settings<'l>(
        &mut self,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
        const USAGE: &str = "settings confirm";
        if words.next() != Some("confirm") {
            return Err(CommandError::Usage { command: "settings", usage: USAGE });
        }
        no_more(words, "settings", USAGE)?;
        self.require_taken("settings")?;
        self.distrusted = false;
        let setup = self.setup(&self.live, self.tick_rate(), self.table.absolute_gain());
        self.request("settings", Request::Configure(setup))?;
        say(out, format_args!("ok settings confirm ('save' stores them)"));
        Ok(())
    }

    /// What the tick needs of `settings`.
    pub(super) fn setup(&self, settings: &Settings, tick_rate: TickRate, shaper_gain: f64) -> Setup {
        let mut setup = settings.setup(tick_rate, shaper_gain);
        setup.drive.lacking = setup.drive.lacking.with(Lacking::SETTINGS, self.distrusted);
        setup
    }

    /// Runs what was stored, or leaves it staged and says why.
    pub(in crate::console) fn run_stored(&mut self) -> Result<(), CommandError<'static>> {
        self.staged = self.stored.settings().clone();
        if self.staged == self.live && !self.distrusted {
            return Ok(());
        }
        let staged = self.staged.clone();
        self.run(&staged, self.shaper_on, "apply")?;
        self.live = staged;
        Ok(())
    }
}
