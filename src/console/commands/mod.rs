//! The commands: which line is which, and one file per family of them.

mod board;
mod drive;
mod faults;
mod homing;
mod motions;
mod plan;
mod reports;
mod setting_values;
mod shaping;
mod streaming;
mod table;
mod upload;
mod words;

use core::fmt::{self, Write};

use super::error::CommandError;
use super::upload::UploadKind;
use super::{Console, help};
use crate::motion::MotionSpec;
use crate::restart::Start;
use words::no_more;

/// Nothing but `Ok` can be done about output that does not fit; [`super::MAX_REPLY`] rules it out.
fn say(out: &mut dyn Write, line: fmt::Arguments<'_>) {
    let _best_effort = out.write_fmt(line).and_then(|()| out.write_str("\r\n"));
}

impl Console<'_> {
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
            "settings" => self.confirm_settings(words, out),
            "shaper" => self.switch_shaper(words, out),
            "table" => self.upload(UploadKind::Table, words, out),
            "plan" => self.upload(UploadKind::Plan, words, out),
            "stop" => no_more(words, "stop", "stop").and_then(|()| self.stop(out)),
            "emergency" => no_more(words, "emergency", "emergency").and_then(|()| self.emergency(out)),
            "enable" => no_more(words, "enable", "enable").and_then(|()| self.enable(out)),
            "disable" => no_more(words, "disable", "disable").and_then(|()| self.disable(out)),
            "position" => self.set_position(words, out),
            "home" => no_more(words, "home", "home").and_then(|()| self.home(out)),
            "clear" => no_more(words, "clear", "clear").and_then(|()| self.clear(out)),
            "events" => no_more(words, "events", "events").map(|()| self.list_events(out)),
            "encoder" => self.reference_encoder(words, out),
            "reboot" => {
                no_more(words, "reboot", "reboot").and_then(|()| self.reboot("reboot", Start::Firmware, out))
            }
            "dfu" => no_more(words, "dfu", "dfu").and_then(|()| self.reboot("dfu", Start::Bootloader, out)),
            "selftest" => no_more(words, "selftest", "selftest").and_then(|()| self.test_board()),
            "brownout" => self.set_brown_out(words),
            "crash" => self.clear_crash(words),
            "stream" => self.stream(words, out),
            "checksum" => self.switch_checksum(words, out),
            "echo" => self.switch_echo(words, out),
            _ => match MotionSpec::parse(command, words) {
                Some(spec) => self.start(&spec?, out),
                None => Err(CommandError::UnknownCommand(command)),
            },
        }
    }
}
