//! The firmware's core in this process: the same console, the same tick, on a clock that runs as fast as it
//! can.
//!
//! Time passes only while somebody reads or pauses, one tick after the other, so every run is the same to the
//! bit. It is the portable core that runs, not the image: interrupts, drivers and the serial line are the
//! emulated or the real board's.

use std::collections::VecDeque;
use std::fmt;
use std::time::Duration;

use embassy_futures::block_on;
use stillbeam_firmware::console::{Console, Effect, Identity};
use stillbeam_firmware::control::{Inputs, TickOutput};
use stillbeam_firmware::machine::{HISTORY_SAMPLES, Machine, Parts, TIMER_CLOCK_HZ};
use stillbeam_firmware::self_test::SelfTest;
use stillbeam_firmware::settings::SettingsStore;
use stillbeam_firmware::telemetry::sender::Sender;

use super::ByteLink;
use super::ram_flash::RamFlash;

/// What is wired to the board: the inputs of a tick, from the outputs of the tick before; none before the
/// first.
pub type Wiring = Box<dyn FnMut(Option<&TickOutput>) -> Inputs>;

/// The core as a board.
pub struct InProcessBoard {
    wiring: Wiring,
    last: Option<TickOutput>,
    parts: Parts<'static>,
    store: SettingsStore<RamFlash>,
    sender: Sender,
    /// Bytes on their way to the host.
    outgoing: VecDeque<u8>,
    clock_s: f64,
}

impl fmt::Debug for InProcessBoard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("InProcessBoard").field("clock_s", &self.clock_s).finish_non_exhaustive()
    }
}

impl InProcessBoard {
    /// A board as after reset with nothing at its inputs, its greeting already sent.
    ///
    /// The machine's memory, some 115 KiB, is given to the process for good: its parts borrow from it.
    pub fn new() -> Self {
        Self::wired(Box::new(|_| Inputs::default()))
    }

    /// The same with something at its inputs: an encoder that follows the setpoint, a trigger.
    pub fn wired(wiring: Wiring) -> Self {
        let machine: &'static mut Machine<'static> = Box::leak(Box::new(Machine::new()));
        let identity = Identity {
            version: env!("CARGO_PKG_VERSION"),
            board: "core",
            build: 0,
            timer_clock_hz: TIMER_CLOCK_HZ,
            brown_out: None,
        };
        let histories = [(); 2].map(|()| Box::leak(Box::new([0; HISTORY_SAMPLES])));
        let parts = machine.split(identity, histories);
        let mut board = Self {
            wiring,
            last: None,
            parts,
            store: SettingsStore::new(RamFlash::new()),
            sender: Sender::new(),
            outgoing: VecDeque::new(),
            clock_s: 0.0,
        };
        let restored = board.parts.console.restore(block_on(board.store.load()));
        board.say(|console, text| console.greet(restored, text));
        board
    }

    fn say(&mut self, speak: impl FnOnce(&mut Console<'static>, &mut String)) {
        let mut text = String::new();
        speak(&mut self.parts.console, &mut text);
        self.outgoing.extend(text.as_bytes());
    }

    fn tick(&mut self) {
        let period_s = self.parts.console.tick_rate().period_s();
        self.clock_s += period_s;
        let inputs = (self.wiring)(self.last.as_ref());
        self.last = Some(self.parts.controller.tick(inputs));
        while let Some(sample) = self.parts.samples.dequeue() {
            self.outgoing.extend(self.sender.send(sample).unwrap_or_default());
        }
    }

    /// A tick while no reply is under way, and what the console says unasked after it.
    fn idle_tick(&mut self) {
        self.tick();
        self.say(|console, text| console.announce(text));
    }
}

impl Default for InProcessBoard {
    fn default() -> Self {
        Self::new()
    }
}

impl ByteLink for InProcessBoard {
    fn name(&self) -> &str {
        "core"
    }

    fn write_all(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        for byte in bytes {
            self.say(|console, text| {
                console.feed(*byte, text);
                while console.work(text) {}
            });
            // Before the tick takes it, because every tick sends its sample.
            self.outgoing.extend(self.sender.follow(self.parts.console.streaming()).unwrap_or_default());
            // As on the board: the reply is out when the interrupt has taken what the line asked for.
            while self.parts.console.has_waiting_request() {
                self.tick();
            }
            match self.parts.console.take_effect() {
                None => {}
                Some(Effect::Save) => {
                    let console = &self.parts.console;
                    let saved =
                        block_on(self.store.save(console.settings_to_store(), console.table_to_store()));
                    self.say(|console, text| console.saved(saved, text));
                }
                Some(Effect::Reboot(_)) => {}
                // There are no pins.
                Some(Effect::SelfTest) => {
                    self.say(|console, text| console.self_tested(SelfTest::default(), text));
                }
                Some(Effect::SetBrownOut(level)) => {
                    self.say(|console, text| console.brown_out_set(level, level, text));
                }
                Some(Effect::ForgetCrash) => self.say(|console, text| console.crash_forgotten(text)),
            }
            self.say(|console, text| console.announce(text));
        }
        Ok(())
    }

    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> std::io::Result<usize> {
        let deadline_s = self.clock_s + patience.as_secs_f64();
        while self.outgoing.is_empty() && self.clock_s < deadline_s {
            self.idle_tick();
        }
        let count = buffer.len().min(self.outgoing.len());
        for (place, byte) in buffer.iter_mut().zip(self.outgoing.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }

    fn clock(&self) -> Duration {
        Duration::from_secs_f64(self.clock_s)
    }

    fn pause(&mut self, duration: Duration) {
        let deadline_s = self.clock_s + duration.as_secs_f64();
        while self.clock_s < deadline_s {
            self.idle_tick();
        }
    }
}
