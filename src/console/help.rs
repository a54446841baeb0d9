//! `help` and `help NAME`.

use core::fmt::Write;

use super::error::CommandError;
use crate::settings::{Key, Settings, Value};

/// What `help` lists, in the order in which a newcomer needs it.
const COMMANDS: [(&str, &str); 14] = [
    ("help [NAME]", "this list, or the meaning, unit, range and default of a setting"),
    ("info", "firmware, tick rate and the shaper that runs"),
    ("status", "what moves, where, and how many samples were dropped"),
    ("get [NAME]", "settings as 'NAME = live [default] staged ...'"),
    ("set NAME VALUE", "stages a setting; nothing changes before 'apply'"),
    ("apply", "builds the shaper from the staged settings and uses it"),
    ("revert", "drops what was staged"),
    ("shaper on|off", "shapes or passes the command through"),
    ("move POSITION_MM", "moves to an absolute position"),
    ("sweep linear|exponential FROM_HZ TO_HZ SECONDS AMPLITUDE_MM", "sine sweep around here"),
    ("stop", "brings the command to rest"),
    ("stream on [N]|off", "'# SEQUENCE TICK COMMAND_NM SETPOINT_NM' every N ticks"),
    ("echo on|off", "off for programs: no echo, no prompt"),
    ("Ctrl-U", "clears the line"),
];

pub(super) fn help<'l>(
    mut words: core::str::SplitAsciiWhitespace<'l>,
    out: &mut dyn Write,
) -> Result<(), CommandError<'l>> {
    let name = words.next();
    if words.next().is_some() {
        return Err(CommandError::Usage { command: "help", usage: "help [NAME]" });
    }
    let printed = match name {
        None => list(out),
        Some(name) => describe(name.parse().map_err(|_| CommandError::UnknownName(name))?, out),
    };
    // The reply is below MAX_REPLY by test, so there is nothing to report.
    let _best_effort = printed.and_then(|()| out.write_str("ok help\r\n"));
    Ok(())
}

fn list(out: &mut dyn Write) -> core::fmt::Result {
    for (usage, meaning) in COMMANDS {
        write!(out, "{usage}\r\n    {meaning}\r\n")?;
    }
    Ok(())
}

fn describe(key: Key, out: &mut dyn Write) -> core::fmt::Result {
    let default = Settings::default().get(key);
    write!(out, "{key}: {}\r\n", key.meaning())?;
    match default {
        Value::Number(_) => {
            let (low, high) = key.range();
            write!(out, "range {low}..{high} {}, default {default}\r\n", key.unit())
        }
        Value::Shaper(_) => write!(out, "off, zv, zvd or zvdd, default {default}\r\n"),
    }
}
