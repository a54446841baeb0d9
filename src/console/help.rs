//! `help` and `help NAME`.

use core::fmt::Write;

use super::error::CommandError;
use crate::decimal::Decimal;
use crate::settings::{Key, Settings, Value};
use crate::shaper::KnownTypes;

/// What `help` lists, in the order in which a newcomer needs it.
static COMMANDS: [(&str, &str); 40] = [
    ("help [NAME]", "this list, or what a command or a setting means"),
    ("info", "firmware, tick rate and the shaper that runs"),
    ("status", "what moves, where, faults, and how often what has happened"),
    ("get [NAME]", "settings as 'NAME = live [default] {stored} staged ...'"),
    ("set NAME VALUE", "stages a setting; nothing changes before 'apply'"),
    ("apply", "builds the shaper from the staged settings and uses it"),
    ("revert", "drops what was staged"),
    ("defaults", "stages the defaults"),
    ("save", "stores what runs, so that it survives a reset; while the drive is off"),
    ("settings confirm", "takes what runs for what is wanted, where the stored settings are damaged"),
    ("shaper on|off", "shapes or passes the command through"),
    ("table begin|frame|commit|abort|show", "a shaper designed elsewhere; see docs/protocol.md"),
    ("plan begin|frame|commit|abort|show", "a command designed elsewhere; see docs/protocol.md"),
    ("enable", "lets the drive run, from where the machine is; nothing moves before"),
    ("disable", "brings the setpoint to rest and switches the drive off"),
    ("position set MM", "says where the machine stands; while the drive is off"),
    ("home", "looks for the reference as home.method says; moves are short before"),
    ("play [back]", "the uploaded plan from here on, or its mirror image"),
    ("move POSITION_MM", "to an absolute position, with move.profile"),
    (
        "sweep linear|exponential FROM_HZ TO_HZ SECONDS|RATE AMPLITUDE",
        "sine around here; RATE as 0.1Hz/s (linear) or 2oct/min (exponential), AMPLITUDE as 1 (mm), 500mm/s2 or 2N",
    ),
    (
        "multisine FROM_HZ TO_HZ PERIOD_S PERIODS AMPLITUDE_MM [schroeder|SEED]",
        "all multiples of 1/PERIOD_S in the band at once",
    ),
    ("pulse DISTANCE_MM [SECONDS]", "there and back, as quick as the limits permit"),
    ("decay DISTANCE_MM SECONDS", "a short move, then holds; 'shaper off' first, or nothing rings"),
    ("stop", "brings the command to rest"),
    ("emergency", "stops as emergency.stop says: braked and then off, or off at once"),
    ("clear", "goes on after a fault, once its cause is gone"),
    ("events", "what happened since the last time, as 'event TICK NAME VALUE'"),
    ("encoder reference", "says that the machine is where the setpoint is"),
    ("reboot", "starts the firmware anew; at rest only"),
    ("dfu", "starts the chip's own bootloader, for a new firmware over USB; at rest only"),
    ("selftest", "steps against the encoder (jumpers PA8-PC6, PA11-PC7), analog output, crystal; drive off"),
    (
        "brownout set off|level_1|level_2|level_3",
        "the supply below which the chip stays in reset, into its option bytes; while the drive is off",
    ),
    ("crash clear", "forgets the record of a crash that 'info' shows"),
    (
        "stream on [N] [text|frames]|off",
        "every N ticks '# SEQUENCE TICK COMMAND_NM SETPOINT_NM STATE [ENCODER_NM FLAGS]'",
    ),
    ("echo on|off", "off for programs: no echo, no prompt"),
    ("checksum on|off", "on: refuses lines that do not end in ' *' and their CRC-32"),
    ("Ctrl-U", "clears the line"),
    ("Ctrl-C", "at once: stops, as 'stop', and clears the line"),
    ("Ctrl-X", "at once: the emergency, and clears the line"),
    ("Ctrl-T", "at once: the status in one line"),
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
        None => COMMANDS.iter().try_for_each(|command| print(command, out)),
        Some(name) => match command(name) {
            Some(command) => print(command, out),
            None => describe(name.parse().map_err(|_| CommandError::UnknownName(name))?, out),
        },
    };
    // The reply is below MAX_REPLY by test, so there is nothing to report.
    let _best_effort = printed.and_then(|()| out.write_str("ok help\r\n"));
    Ok(())
}

/// The command whose first word this is.
fn command(name: &str) -> Option<&'static (&'static str, &'static str)> {
    COMMANDS.iter().find(|(usage, _)| usage.split(' ').next() == Some(name))
}

fn print((usage, meaning): &(&str, &str), out: &mut dyn Write) -> core::fmt::Result {
    write!(out, "{usage}\r\n    {meaning}\r\n")
}

fn describe(key: Key, out: &mut dyn Write) -> core::fmt::Result {
    let default = Settings::default().get(key);
    write!(out, "{key}: {}\r\n", key.meaning())?;
    match default {
        Value::Number(_) => {
            let (low, high) = key.range();
            let unit = key.unit();
            let space = if unit.is_empty() { "" } else { " " };
            write!(out, "range {}..{}{space}{unit}, default {default}\r\n", Decimal(low), Decimal(high))
        }
        Value::Word(_) => {
            for word in key.words().unwrap_or_default() {
                write!(out, "{word} ")?;
            }
            write!(out, "default {default}\r\n")
        }
        Value::Shaper(_) => write!(out, "off, {KnownTypes}, default {default}\r\n"),
    }
}
