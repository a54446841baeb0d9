//! `get`, `set`, `apply`, `revert`, `defaults`, `save`.

use core::fmt::Write;

use super::say;
use super::words::{Words, no_more, parse_key};
use crate::console::error::CommandError;
use crate::console::{Console, Effect};
use crate::settings::{Key, Settings};

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
        self.effect = Some(Effect::Save);
        Ok(())
    }

    /// Runs what was stored, or leaves it staged and says why.
    pub(in crate::console) fn run_stored(&mut self) -> Result<(), CommandError<'static>> {
        self.staged = self.stored.settings().clone();
        if self.staged == self.live {
            return Ok(());
        }
        let staged = self.staged.clone();
        self.run(&staged, self.shaper_on, "apply")?;
        self.live = staged;
        Ok(())
    }
}
