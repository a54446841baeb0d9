//! The independent watchdog (RM0090, 21): a counter of a slow oscillator, that resets the chip when nobody
//! has fed it in time.

use stillbeam_firmware::machine::TIMER_CLOCK_HZ;

/// Offsets of its registers.
pub mod register {
    /// Key.
    pub const KR: u32 = 0x0;
    /// Prescaler.
    pub const PR: u32 = 0x4;
    /// Reload.
    pub const RLR: u32 = 0x8;
    /// Status.
    pub const SR: u32 = 0xc;
}

const FEED: u32 = 0xaaaa;
const UNLOCK: u32 = 0x5555;
const START: u32 = 0xcccc;
/// Periods of the oscillator that prescaler and reload take to arrive.
const UPDATE_PERIODS: f64 = 5.0;

/// The watchdog. Times are clocks of the board's timers.
#[derive(Debug, Clone)]
pub struct WatchdogTimer {
    oscillator_hz: f64,
    running: bool,
    unlocked: bool,
    prescaler_code: u32,
    reload: u32,
    /// Counts left; it bites below zero.
    left: f64,
    now: u64,
    updated_at: u64,
    updating: u32,
    bitten_at: Option<u64>,
}

impl WatchdogTimer {
    /// One that nobody has started, whose oscillator has so many hertz.
    pub fn new(oscillator_hz: f64) -> Self {
        Self {
            oscillator_hz,
            running: false,
            unlocked: false,
            prescaler_code: 0,
            reload: 0xfff,
            left: 4096.0,
            now: 0,
            updated_at: 0,
            updating: 0,
            bitten_at: None,
        }
    }

    /// It is so late.
    pub fn advance(&mut self, clocks: u64) {
        let passed_s = (clocks.saturating_sub(self.now)) as f64 / f64::from(TIMER_CLOCK_HZ);
        self.now = clocks;
        if self.running && self.bitten_at.is_none() {
            self.left -= passed_s * self.oscillator_hz / f64::from(4_u32 << self.prescaler_code.min(6));
            self.bitten_at = (self.left < 0.0).then_some(clocks);
        }
    }

    /// The firmware reads a register.
    pub fn read(&mut self, offset: u32) -> u32 {
        match offset {
            register::PR => self.prescaler_code,
            register::RLR => self.reload,
            register::SR => {
                let waited_s = (self.now - self.updated_at) as f64 / f64::from(TIMER_CLOCK_HZ);
                if waited_s * self.oscillator_hz >= UPDATE_PERIODS {
                    self.updating = 0;
                }
                self.updating
            }
            _ => 0,
        }
    }

    /// The firmware writes a register.
    pub fn write(&mut self, offset: u32, value: u32) {
        match (offset, value & 0xffff) {
            (register::KR, key) => {
                self.unlocked = key == UNLOCK;
                match key {
                    START => {
                        self.running = true;
                        self.fill();
                    }
                    FEED => self.fill(),
                    _ => {}
                }
            }
            (register::PR, code) if self.unlocked => {
                self.prescaler_code = code & 7;
                self.update(1);
            }
            (register::RLR, reload) if self.unlocked => {
                self.reload = reload & 0xfff;
                self.update(2);
            }
            _ => {}
        }
    }

    /// Whether it has been started.
    pub fn is_running(&self) -> bool {
        self.running
    }

    /// How long it waits from one feed to the next, in seconds.
    pub fn patience_s(&self) -> f64 {
        f64::from((4_u32 << self.prescaler_code.min(6)) * (self.reload + 1)) / self.oscillator_hz
    }

    /// When it has reset the chip.
    pub fn bitten_at(&self) -> Option<u64> {
        self.bitten_at
    }

    fn fill(&mut self) {
        self.left = f64::from(self.reload + 1);
    }

    fn update(&mut self, what: u32) {
        self.updating |= what;
        self.updated_at = self.now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = TIMER_CLOCK_HZ as u64;

    /// Started and unlocked, with a patience of a second.
    fn started() -> WatchdogTimer {
        let mut watchdog = WatchdogTimer::new(32_768.0);
        for (offset, value) in [
            (register::KR, START),
            (register::KR, UNLOCK),
            (register::PR, 3),
            (register::RLR, 1023),
            (register::KR, FEED),
        ] {
            watchdog.write(offset, value);
        }
        watchdog
    }

    #[test]
    fn it_bites_when_it_has_not_been_fed_for_its_patience_and_not_before() {
        let mut watchdog = started();
        assert!((watchdog.patience_s() - 1.0).abs() < 1e-12);
        watchdog.advance(SECOND * 9 / 10);
        watchdog.write(register::KR, FEED);
        watchdog.advance(SECOND * 18 / 10);
        assert_eq!(watchdog.bitten_at(), None);
        watchdog.advance(SECOND * 2);
        assert_eq!(watchdog.bitten_at(), Some(SECOND * 2));
    }

    #[test]
    fn prescaler_and_reload_need_the_key_and_take_their_time() {
        let mut watchdog = started();
        watchdog.advance(SECOND / 2);
        assert_eq!(watchdog.read(register::SR), 0);
        watchdog.write(register::RLR, 4095);
        assert!((watchdog.patience_s() - 1.0).abs() < 1e-12, "feeding has locked it");
        watchdog.write(register::KR, UNLOCK);
        watchdog.write(register::RLR, 4095);
        assert_eq!(watchdog.read(register::SR), 2);
        watchdog.advance(SECOND / 2 + SECOND / 1000);
        assert_eq!(watchdog.read(register::SR), 0);
        assert!((watchdog.patience_s() - 4.0).abs() < 1e-12);
    }

    #[test]
    fn nobody_is_bitten_by_one_that_was_never_started() {
        let mut watchdog = WatchdogTimer::new(47_000.0);
        watchdog.advance(1000 * SECOND);
        assert_eq!((watchdog.is_running(), watchdog.bitten_at()), (false, None));
    }
}
