//! The link itself: bytes that work at once, and a host that is silent while something moves.

use core::fmt::Write;

use super::Console;
use crate::fault::{Event, Fault};
use crate::real_time::RealTimeByte;
use crate::telemetry::{Activity, Flags};

/// What is known of the host.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct HostWatch {
    /// The tick in which it was last heard of.
    last_heard: u32,
    /// It was silent for too long, and the machine was asked to stop.
    lost: bool,
}

impl Console<'_> {
    /// Does what a single byte asks for; whether it did. Such a byte is part of no line. It works once more
    /// at its place in the order of what was sent, so that no line before it moves anything after it.
    pub(super) fn take_real_time(&mut self, byte: u8, out: &mut dyn Write) -> bool {
        let Some(special) = self.asked.receive(byte) else { return false };
        if matches!(special, RealTimeByte::Stop | RealTimeByte::Emergency) {
            self.editor.erase(out);
        }
        true
    }

    /// Stops a motion whose host has been silent for longer than `link.timeout_ms`.
    pub(super) fn watch_host(&mut self) {
        let tick = self.status.tick();
        let moves = matches!(
            self.status.activity(),
            Activity::Moving
                | Activity::Sweeping
                | Activity::Multisine
                | Activity::Pulsing
                | Activity::Decaying
                | Activity::Playing
                | Activity::Homing
        );
        if self.asked.take_heard() || !moves {
            self.host = HostWatch { last_heard: tick, lost: false };
            return;
        }
        let limit_ms = self.live.drive().link_timeout_ms();
        if limit_ms == 0.0 || self.host.lost {
            return;
        }
        let limit_ticks = (limit_ms * 1e-3 * self.tick_rate().hz()) as u32;
        let silent_ticks = tick.wrapping_sub(self.host.last_heard);
        if silent_ticks > limit_ticks {
            self.host.lost = true;
            self.asked.stop();
            self.note(Event::LinkLost, limit_ms as i32);
        }
    }

    /// Says in one line what moves, where, and what is wrong, if a byte asked for it.
    pub(super) fn say_asked_status(&mut self, out: &mut dyn Write) -> bool {
        if !self.asked.take_status() {
            return false;
        }
        let status = self.status;
        let drive = if status.flags().contains(Flags::DRIVE_DISABLED) { "disabled" } else { "enabled" };
        self.say_unasked(
            out,
            format_args!(
                "! status state={} tick={} setpoint_nm={} fault={} drive={drive}\r\n",
                status.activity().name(),
                status.tick(),
                status.setpoint().0,
                status.fault().map_or("none", Fault::name),
            ),
        );
        true
    }
}
