//! A command's words, understood or refused with its usage.

use crate::console::error::CommandError;
use crate::decimal;
use crate::settings::Key;

/// A command's words after its name.
pub(super) type Words<'l> = core::str::SplitAsciiWhitespace<'l>;

pub(super) fn no_more<'l>(
    mut words: Words<'l>,
    command: &'static str,
    usage: &'static str,
) -> Result<(), CommandError<'l>> {
    if words.next().is_none() { Ok(()) } else { Err(CommandError::Usage { command, usage }) }
}

pub(super) fn parse_key(name: &str) -> Result<Key, CommandError<'_>> {
    name.parse().map_err(|_| CommandError::UnknownName(name))
}

pub(super) fn parse_switch(
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

pub(super) fn on_off(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}

pub(super) fn parse_number(
    word: Option<&str>,
    command: &'static str,
    usage: &'static str,
) -> Result<f64, CommandError<'static>> {
    word.and_then(decimal::parse)
        .filter(|number| number.is_finite())
        .ok_or(CommandError::Usage { command, usage })
}
