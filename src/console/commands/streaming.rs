//! `stream` and `echo`: what comes over the line besides replies.

use core::fmt::Write;

use super::say;
use super::words::{Words, no_more, on_off, parse_switch};
use crate::console::Console;
use crate::console::error::CommandError;
use crate::control::Request;
use crate::settings::{Key, Settings};

impl Console<'_> {
    pub(super) fn stream<'l>(
        &mut self,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
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

    pub(super) fn switch_echo<'l>(
        &mut self,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
        let on = parse_switch(words.next(), "echo", "echo on|off")?;
        no_more(words, "echo", "echo on|off")?;
        self.editor.set_echo(on);
        say(out, format_args!("ok echo {}", on_off(on)));
        Ok(())
    }
}
