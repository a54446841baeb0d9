//! A machine on the bench: console and tick of the core, driven by hand.

use embassy_futures::block_on;
use stillbeam_firmware::console::{Console, Effect, Identity, MAX_REPLY};
use stillbeam_firmware::control::{Controller, Inputs, TickOutput};
use stillbeam_firmware::machine::{HISTORY_SAMPLES, Machine, TIMER_CLOCK_HZ};
use stillbeam_firmware::restart::Restart;
use stillbeam_firmware::settings::SettingsStore;
use stillbeam_firmware::telemetry::{Activity, Sample};

use crate::flash::MockFlash;

/// The identity of the real board, so that tables come out the same.
pub const IDENTITY: Identity =
    Identity { version: "bench", board: "bench", build: 0, timer_clock_hz: TIMER_CLOCK_HZ };

/// Console, tick and samples of one machine.
pub struct Bench {
    console: Console<'static>,
    controller: Controller<'static>,
    samples: heapless::spsc::Consumer<'static, Sample>,
    store: SettingsStore<MockFlash>,
    greeting: String,
    activity: Activity,
    /// Setpoints of ticks that nobody has asked for yet, in nanometres.
    log_nm: Vec<i32>,
}

impl Bench {
    /// A machine as after its first reset, with echo off. Its memory is leaked: tests are short.
    pub fn new() -> Self {
        Self::with_flash(MockFlash::new())
    }

    /// A machine as after a reset that finds this in its flash, with echo off.
    pub fn with_flash(flash: MockFlash) -> Self {
        Self::start(flash, Restart::default())
    }

    /// A machine that starts for this reason, with echo off.
    pub fn restarted(restart: Restart) -> Self {
        Self::start(MockFlash::new(), restart)
    }

    fn start(flash: MockFlash, restart: Restart) -> Self {
        let machine: &'static mut Machine<'static> = Box::leak(Box::new(Machine::new()));
        let histories = [(); 2].map(|()| Box::leak(Box::new([0; HISTORY_SAMPLES])));
        let mut parts = machine.split(IDENTITY, histories);
        let mut store = SettingsStore::new(flash);
        let restored = parts.console.restore(block_on(store.load()));
        if restart.must_hold() {
            parts.controller.hold_after_crash();
        }
        parts.console.note_restart(restart);
        let mut greeting = LimitedReply::default();
        parts.console.greet(restored, &mut greeting);
        let mut bench = Self {
            console: parts.console,
            controller: parts.controller,
            samples: parts.samples,
            store,
            greeting: greeting.text,
            activity: Activity::Rest,
            log_nm: Vec::new(),
        };
        bench.send("echo off");
        bench
    }

    /// What it said first.
    pub fn greeting(&self) -> &str {
        &self.greeting
    }

    /// The same flash in a machine after another reset.
    pub fn reset(self) -> Self {
        Self::with_flash(self.into_flash())
    }

    /// What is left of the machine: its flash.
    pub fn into_flash(self) -> MockFlash {
        self.store.into_flash()
    }

    /// Sends a line and returns the lines of the reply. Ticks while a request waits, as time would pass on the board.
    pub fn send(&mut self, line: &str) -> Vec<String> {
        self.send_bytes(format!("{line}\r").as_bytes()).lines().map(str::to_owned).collect()
    }

    /// Sends raw bytes and returns everything that comes back, echo included.
    pub fn send_bytes(&mut self, bytes: &[u8]) -> String {
        let mut received = String::new();
        for byte in bytes {
            let mut reply = LimitedReply::default();
            self.console.feed(*byte, &mut reply);
            while self.console.work(&mut reply) {}
            while self.console.has_waiting_request() {
                self.tick();
            }
            match self.console.take_effect() {
                None => {}
                Some(Effect::Save) => {
                    let (settings, table) = (self.console.settings_to_store(), self.console.table_to_store());
                    let saved = block_on(self.store.save(settings, table));
                    self.console.saved(saved, &mut reply);
                }
                Some(Effect::Reboot(_)) => {}
                Some(Effect::ForgetCrash) => self.console.crash_forgotten(&mut reply),
            }
            received += &reply.text;
        }
        received
    }

    /// What the console says unasked, as the board's task would ask it to between two replies.
    pub fn announced(&mut self) -> String {
        let mut announcement = LimitedReply::default();
        self.console.announce(&mut announcement);
        announcement.text
    }

    /// Sends a line that must be accepted and returns its `ok` line.
    ///
    /// # Panics
    /// When the reply does not end in `ok`.
    pub fn accept(&mut self, line: &str) -> String {
        let reply = self.send(line);
        let last = reply.last().cloned().unwrap_or_default();
        assert!(last.starts_with("ok"), "{line:?} was answered {reply:?}");
        last
    }

    /// Sends a line that must be refused and returns its `err` line.
    ///
    /// # Panics
    /// When the reply does not end in `err`.
    pub fn refuse(&mut self, line: &str) -> String {
        let reply = self.send(line);
        let last = reply.last().cloned().unwrap_or_default();
        assert!(last.starts_with("err "), "{line:?} was answered {reply:?}");
        last
    }

    /// One tick.
    pub fn tick(&mut self) -> TickOutput {
        self.tick_with(Inputs::default())
    }

    /// One tick that finds this at its inputs.
    pub fn tick_with(&mut self, inputs: Inputs) -> TickOutput {
        let output = self.controller.tick(inputs);
        self.log_nm.push(output.setpoint.0);
        output
    }

    /// The console alone, to be fed while the test ticks itself.
    pub fn console(&mut self) -> &mut Console<'static> {
        &mut self.console
    }

    /// Setpoints of all ticks since the log was cleared or taken, in nanometres.
    pub fn take_log(&mut self) -> Vec<i32> {
        std::mem::take(&mut self.log_nm)
    }

    /// Forgets the setpoints so far.
    pub fn clear_log(&mut self) {
        self.log_nm.clear();
    }

    /// Ticks until rest, and returns all setpoints since the log was cleared or taken, in nanometres.
    pub fn run_to_rest(&mut self) -> Vec<i32> {
        while self.activity() != Activity::Rest {
            self.tick();
        }
        std::mem::take(&mut self.log_nm)
    }

    /// What `status` says of the state.
    pub fn activity(&mut self) -> Activity {
        let reply = self.send("status");
        let name = reply.iter().find_map(|line| line.strip_prefix("state ")).unwrap_or_default();
        self.activity =
            Activity::ALL.into_iter().find(|activity| activity.name() == name).unwrap_or(self.activity);
        self.activity
    }

    /// Takes the samples that wait.
    pub fn samples(&mut self) -> Vec<Sample> {
        std::iter::from_fn(|| self.samples.dequeue()).collect()
    }
}

impl Default for Bench {
    fn default() -> Self {
        Self::new()
    }
}

/// As much room as the board has, and an error past it like there.
#[derive(Default)]
struct LimitedReply {
    text: String,
}

impl std::fmt::Write for LimitedReply {
    fn write_str(&mut self, part: &str) -> std::fmt::Result {
        assert!(self.text.len() + part.len() <= MAX_REPLY, "a reply is longer than the board's buffer");
        self.text.write_str(part)
    }
}
