//! When the watchdog may be fed, and how long it waits.
//!
//! The chip's independent watchdog counts a low-speed oscillator that is 17 to 47 kHz, 32 kHz in the middle
//! (datasheet of the STM32F405, LSI). Every promise here is made for the worse end: nobody is reset too early
//! at 47 kHz, and 17 kHz says how long a firmware that hangs stays unnoticed.

/// The oscillator's slowest, typical and fastest, in hertz.
pub const OSCILLATOR_HZ: [f64; 3] = [17_000.0, 32_000.0, 47_000.0];

/// How long the watchdog waits to be fed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// The prescaler is 4 to the power of one, times two to the power of this: 4, 8, ... 256.
    pub prescaler_code: u8,
    /// The counter's start, at most 4095; it resets one count after zero.
    pub reload: u16,
}

impl Patience {
    /// While all is well: 0.35 s at the fastest oscillator, 0.51 s typically, 0.96 s at the slowest.
    pub const NORMAL: Self = Self { prescaler_code: 2, reload: 1023 };

    /// While settings are saved: 22 s at the fastest oscillator, 33 s typically, 62 s at the slowest. Erasing
    /// a sector stops the whole chip for up to 4 s; a save erases two at most and writes the rest anew, in
    /// one go.
    pub const SAVING: Self = Self { prescaler_code: 6, reload: 4095 };

    /// The wait in seconds, for an oscillator of this many hertz.
    pub fn seconds(self, oscillator_hz: f64) -> f64 {
        f64::from(4_u32 << self.prescaler_code) * f64::from(u32::from(self.reload) + 1) / oscillator_hz
    }
}

/// Heartbeats per second: how often it is asked whether tick and console are alive. They must have moved
/// between one heartbeat and the next.
pub const HEARTBEATS_PER_S: u32 = 20;

/// Says when the watchdog may be fed: when both the tick and the console have moved since it was last fed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Supervisor {
    fed_at: Option<Progress>,
}

/// How far tick and console have come. Both count up and wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Ticks so far.
    pub ticks: u32,
    /// Rounds that the console's task has made so far.
    pub console_rounds: u32,
}

impl Supervisor {
    /// Nothing has been fed yet; the first look only remembers.
    pub const fn new() -> Self {
        Self { fed_at: None }
    }

    /// Whether the watchdog may be fed now.
    pub fn may_feed(&mut self, now: Progress) -> bool {
        let may =
            self.fed_at.is_some_and(|fed| fed.ticks != now.ticks && fed.console_rounds != now.console_rounds);
        if may || self.fed_at.is_none() {
            self.fed_at = Some(now);
        }
        may
    }
}
