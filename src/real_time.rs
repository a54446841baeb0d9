//! Single bytes that work at once, whatever else is on the line: half a command, a checksum that is asked
//! for, a console that is busy.
//!
//! Whoever receives bytes looks at each before the line editor does ([`Asked::receive`]); on the board that
//! is the receive interrupt. What a byte asks of the machine is waiting for the next tick then.

use core::sync::atomic::{AtomicBool, AtomicU8, Ordering};

/// What a single byte asks for. None of them is in a line: those are printable ASCII and the editing keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RealTimeByte {
    /// Bring the command to rest, and forget the line that is being typed.
    Stop,
    /// As the command `emergency`, and forget the line that is being typed.
    Emergency,
    /// Say in one line what moves, where, and what is wrong.
    Status,
    /// The host is there.
    Alive,
}

impl RealTimeByte {
    /// Ctrl-C, "end of text".
    pub const STOP: u8 = 0x03;
    /// Ctrl-X, "cancel".
    pub const EMERGENCY: u8 = 0x18;
    /// Ctrl-T.
    pub const STATUS: u8 = 0x14;
    /// Ctrl-V, "synchronous idle".
    pub const ALIVE: u8 = 0x16;

    /// What a byte asks for, if it is one of these.
    #[inline]
    pub fn of(byte: u8) -> Option<Self> {
        match byte {
            Self::STOP => Some(Self::Stop),
            Self::EMERGENCY => Some(Self::Emergency),
            Self::STATUS => Some(Self::Status),
            Self::ALIVE => Some(Self::Alive),
            _ => None,
        }
    }
}

/// Takes the place of bytes that were lost or damaged on their way ("substitute"), so that no line is taken
/// that lacks some.
pub const SUBSTITUTE: u8 = 0x1a;

/// What bytes have asked for and nobody has done yet. Shared by who receives, the tick and the console.
#[derive(Debug, Default)]
pub struct Asked {
    /// For the tick: [`STOP`] and [`EMERGENCY`].
    machine: AtomicU8,
    status: AtomicBool,
    /// A byte has come, whichever.
    heard: AtomicBool,
}

const STOP: u8 = 1;
const EMERGENCY: u8 = 2;

/// What the tick is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AskedOfTick {
    /// Bring the command to rest.
    pub stop: bool,
    /// The emergency.
    pub emergency: bool,
}

impl Asked {
    /// Nothing.
    pub const fn new() -> Self {
        Self { machine: AtomicU8::new(0), status: AtomicBool::new(false), heard: AtomicBool::new(false) }
    }

    /// Looks at a byte that has come and does what it asks for. Returns what it was.
    #[inline]
    pub fn receive(&self, byte: u8) -> Option<RealTimeByte> {
        self.heard.store(true, Ordering::Relaxed);
        let special = RealTimeByte::of(byte)?;
        match special {
            RealTimeByte::Stop => self.stop(),
            RealTimeByte::Emergency => {
                self.machine.fetch_or(EMERGENCY, Ordering::Relaxed);
            }
            RealTimeByte::Status => self.status.store(true, Ordering::Relaxed),
            RealTimeByte::Alive => {}
        }
        Some(special)
    }

    /// Asks for a stop.
    pub fn stop(&self) {
        self.machine.fetch_or(STOP, Ordering::Relaxed);
    }

    /// Whether the tick is asked for something.
    #[inline]
    pub fn waits_for_tick(&self) -> bool {
        self.machine.load(Ordering::Relaxed) != 0
    }

    /// What the tick is asked for, which it then does.
    pub fn take_for_tick(&self) -> AskedOfTick {
        let asked = self.machine.swap(0, Ordering::Relaxed);
        AskedOfTick { stop: asked & STOP != 0, emergency: asked & EMERGENCY != 0 }
    }

    /// Whether a line about the status is asked for, which is then said.
    pub fn take_status(&self) -> bool {
        self.status.swap(false, Ordering::Relaxed)
    }

    /// Whether a byte has come since the last call.
    pub fn take_heard(&self) -> bool {
        self.heard.swap(false, Ordering::Relaxed)
    }
}
