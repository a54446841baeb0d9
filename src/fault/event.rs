//! Events, and how often each has happened.

use core::sync::atomic::{AtomicU32, Ordering};

/// Something that happened and should not go unnoticed.
///
/// Each kind is raised either by the tick or by the console's task, never by both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Event {
    /// The timer ran on without the tick. Value: ticks lost. By the tick.
    MissedTick,
    /// The next tick was due before this one had ended. By the tick.
    LateTick,
    /// A setpoint beyond the travel, on its way out. Value: the position in nm. By the tick.
    Limit,
    /// An output at its end: the analog range, or more steps than fit. Value: the setpoint in nm. By the
    /// tick.
    Clamp,
    /// The encoder is off the setpoint by more than the window. Value: the error in nm. By the tick.
    Encoder,
    /// The emergency input (value 1) or command (value 0). By the tick.
    Emergency,
    /// A fault was cleared. By the tick.
    Cleared,
    /// A sample found its queue full. By the tick.
    SampleLost,
    /// A byte with a framing error or noise. Value: how many. By the console.
    Line,
    /// A frame or line with a wrong checksum. By the console.
    Crc,
    /// A frame that is not one. By the console.
    Frame,
    /// The processor was reset. Value: the cause's bits, see [`crate::restart::ResetCause`]. By the console.
    Reset,
    /// The reset came from the watchdog. By the console.
    Watchdog,
    /// The record of a crash was found. By the console.
    Crash,
    /// Bytes were lost on the serial line. Value: how often. By the console.
    Overrun,
    /// The host was silent for too long during a motion. Value: `link.timeout_ms`. By the console.
    LinkLost,
    /// A limit input became active. Value: -1 at the lower end, 1 at the upper one. By the tick.
    LimitInput,
    /// The drive says that it is not ready, or reports a fault. By the tick.
    Drive,
    /// Homing has found the reference. Value: by how much positions have changed, in nm. By the tick.
    Homed,
    /// Homing has come too far without finding the reference. Value: the setpoint in nm. By the tick.
    HomeFailed,
}

impl Event {
    /// Every kind, in the order of their counters.
    pub const ALL: [Self; 20] = [
        Self::MissedTick,
        Self::LateTick,
        Self::Limit,
        Self::Clamp,
        Self::Encoder,
        Self::Emergency,
        Self::Cleared,
        Self::SampleLost,
        Self::Line,
        Self::Crc,
        Self::Frame,
        Self::Reset,
        Self::Watchdog,
        Self::Crash,
        Self::Overrun,
        Self::LinkLost,
        Self::LimitInput,
        Self::Drive,
        Self::Homed,
        Self::HomeFailed,
    ];

    /// The word that `events` and `status` print.
    pub fn name(self) -> &'static str {
        match self {
            Self::MissedTick => "missed_tick",
            Self::LateTick => "late_tick",
            Self::Limit => "limit",
            Self::Clamp => "clamp",
            Self::Encoder => "encoder",
            Self::Emergency => "emergency",
            Self::Cleared => "cleared",
            Self::SampleLost => "sample_lost",
            Self::Line => "line_error",
            Self::Crc => "crc_error",
            Self::Frame => "frame_error",
            Self::Reset => "reset",
            Self::Watchdog => "watchdog",
            Self::Crash => "crash",
            Self::Overrun => "overrun",
            Self::LinkLost => "link_lost",
            Self::LimitInput => "limit_input",
            Self::Drive => "drive",
            Self::Homed => "homed",
            Self::HomeFailed => "home_failed",
        }
    }
}

/// One event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EventRecord {
    /// The tick it happened in; for the console's, the newest tick it knew of.
    pub tick: u32,
    /// What happened.
    pub event: Event,
    /// What the kind says of its value, else zero.
    pub value: i32,
}

/// Events that wait for the console, and events that the console keeps. A full queue loses the newest, which
/// are still counted.
pub const MAX_EVENTS: usize = 32;

/// How often each kind of event has happened since the start; wraps after 2³².
#[derive(Debug)]
pub struct Counters {
    counts: [AtomicU32; Event::ALL.len()],
}

impl Counters {
    /// Nothing has happened yet.
    pub const fn new() -> Self {
        Self { counts: [const { AtomicU32::new(0) }; Event::ALL.len()] }
    }

    /// How often `event` has happened.
    pub fn count(&self, event: Event) -> u32 {
        self.counts.get(event as usize).map_or(0, |count| count.load(Ordering::Relaxed))
    }

    /// Counts one more. Each kind has one party that counts it, so reading and then writing loses nothing.
    #[inline]
    pub fn add(&self, event: Event) {
        if let Some(count) = self.counts.get(event as usize) {
            count.store(count.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
        }
    }
}

impl Default for Counters {
    fn default() -> Self {
        Self::new()
    }
}
