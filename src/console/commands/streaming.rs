//! `stream`, `echo` and `checksum`: what comes over the line besides replies.

use core::fmt::Write;

use super::say;
use super::words::{Words, no_more, on_off, parse_switch};
use crate::console::Console;
use crate::console::error::CommandError;
use crate::control::Request;
use crate::settings::{Key, Settings};
use crate::telemetry::{Format, Streaming};

impl Console<'_> {
    pub(super) fn stream<'l>(
        &mut self,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
        const USAGE: &str = "stream on [TICKS_PER_SAMPLE] [text|frames] | stream off";
        let on = parse_switch(words.next(), "stream", USAGE)?;
        let streaming = if on { self.parse_streaming(&mut words, USAGE)? } else { Streaming::default() };
        no_more(words, "stream", USAGE)?;
        let decimation = streaming.decimation;
        self.request("stream", Request::Stream { decimation })?;
        self.streaming = streaming;
        say(out, format_args!("ok stream {} decimation={decimation}", on_off(on)));
        Ok(())
    }

    /// Both words may be missing.
    fn parse_streaming<'l>(
        &self,
        words: &mut Words<'l>,
        usage: &'static str,
    ) -> Result<Streaming, CommandError<'l>> {
        let mut word = words.next();
        let mut decimation = self.live.stream_decimation();
        if let Some(text) = word.filter(|word| format(word).is_none()) {
            // Checked like the setting of the same meaning.
            let mut checked = Settings::default();
            let key = Key::StreamDecimation;
            checked.set(key, text).map_err(|refusal| CommandError::Value { key, refusal })?;
            decimation = checked.stream_decimation();
            word = words.next();
        }
        let format = match word {
            None => Format::Text,
            Some(word) => format(word).ok_or(CommandError::Usage { command: "stream", usage })?,
        };
        Ok(Streaming { format, decimation })
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

    pub(super) fn switch_checksum<'l>(
        &mut self,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
        let on = parse_switch(words.next(), "checksum", "checksum on|off")?;
        no_more(words, "checksum", "checksum on|off")?;
        self.checksum_required = on;
        say(out, format_args!("ok checksum {}", on_off(on)));
        Ok(())
    }
}

fn format(word: &str) -> Option<Format> {
    match word {
        "text" => Some(Format::Text),
        "frames" => Some(Format::Frames),
        _ => None,
    }
}
