//! What the console says unasked: that a fault has come up.
//!
//! One line between two replies, `! fault NAME tick=N drive=enabled|disabled`, with a checksum while
//! `checksum` is on.

use core::fmt::Write;

use super::Console;
use super::checksum::ReplyWithChecksum;
use crate::fault::Fault;
use crate::telemetry::Flags;

/// What somebody who listens knows of faults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Announced {
    fault: Option<Fault>,
    drive_disabled: bool,
}

impl Console<'_> {
    /// Says that a fault holds the machine, or that it now disables the drive too, once each. Whoever feeds
    /// bytes calls this whenever no reply is under way.
    pub fn announce(&mut self, out: &mut dyn Write) {
        // To be logged when they happen, not when somebody asks for them.
        #[cfg(feature = "defmt")]
        self.events.collect();
        self.watch_host();
        self.say_asked_status(out);
        self.announce_fault(out);
    }

    fn announce_fault(&mut self, out: &mut dyn Write) {
        let fault = self.status.fault();
        let drive_disabled = self.status.flags().contains(Flags::DRIVE_DISABLED);
        let now = Announced { fault, drive_disabled };
        let before = core::mem::replace(&mut self.announced, now);
        let Some(fault) = fault else { return };
        if before.fault.is_some() && (before.drive_disabled || !drive_disabled) {
            return;
        }
        let (name, tick) = (fault.name(), self.status.tick());
        let drive = if drive_disabled { "disabled" } else { "enabled" };
        self.say_unasked(out, format_args!("! fault {name} tick={tick} drive={drive}\r\n"));
    }

    /// Says a line between two replies, and shows again what is being typed.
    pub(super) fn say_unasked(&self, out: &mut dyn Write, line: core::fmt::Arguments<'_>) {
        let typing = self.editor.echo();
        if typing {
            let _best_effort = out.write_str("\r\n");
        }
        if self.checksum_required {
            let mut checked = ReplyWithChecksum::new(out);
            let _best_effort = checked.write_fmt(line);
            checked.finish();
        } else {
            let _best_effort = out.write_fmt(line);
        }
        if typing {
            self.prompt(out);
            self.editor.show_again(out);
        }
    }

    /// The next fault is news, the same one too.
    pub(super) fn forget_announced(&mut self) {
        self.announced = Announced::default();
    }
}
