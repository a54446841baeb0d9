//! A machine on the bench: console and tick of the core, driven by hand.

use embassy_futures::block_on;
use stillbeam_firmware::brown_out::BrownOut;
use stillbeam_firmware::console::{Console, Effect, Identity, MAX_REPLY};
use stillbeam_firmware::control::{Controller, Inputs, TickOutput};
use stillbeam_firmware::machine::{HISTORY_SAMPLES, Machine, TIMER_CLOCK_HZ};
use stillbeam_firmware::restart::Restart;
use stillbeam_firmware::self_test::SelfTest;
use stillbeam_firmware::settings::SettingsStore;
use stillbeam_firmware::telemetry::{Activity, Sample};

use crate::flash::MockFlash;

/// The identity of the real board, so that tables come out the same.
pub const IDENTITY: Identity =
    Identity { version: "bench", board: "bench", build: 0, timer_clock_hz: TIMER_CLOCK_HZ, brown_out: None };

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
    inputs: Inputs,
    /// What every tick has put out, once somebody wants to know.
    outputs: Option<Vec<TickOutput>>,
    /// The brown-out level that the option bytes keep whatever is written, where they do not take another.
    stuck_brown_out: Option<BrownOut>,
    /// What a test of the board finds.
    found: SelfTest,
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

    /// A machine that stands enabled at zero, nothing else set.
    pub fn enabled() -> Self {
        let mut bench = Self::new();
        bench.enable();
        bench.clear_log();
        bench
    }

    /// Says all that enabling needs, as a person would, and ticks until the drive is enabled. The machine is
    /// taken to stand where the setpoint is.
    ///
    /// # Panics
    /// When the drive does not come up.
    pub fn enable(&mut self) {
        if self.line("lacking").contains("emergency_input") {
            let pending: Vec<String> =
                self.send("get").into_iter().filter(|line| line.contains(" staged ")).collect();
            assert_eq!(pending, [""; 0], "settings are staged");
            self.accept("set emergency.input waived");
            self.accept("apply");
            self.tick();
        }
        if self.line("lacking").contains("position") {
            let nm: f64 = self.line("setpoint_nm").parse().expect("a number");
            self.accept(&format!("position set {}", nm / 1e6));
            self.tick();
        }
        while self.line("state") != "rest" {
            assert_ne!(self.line("state"), "fault", "a fault is to be cleared first");
            self.tick();
        }
        self.accept("enable");
        for _ in 0..100_000 {
            if self.line("drive") == "enabled" {
                return;
            }
            self.tick();
        }
        panic!("the drive is not enabled: {:?}", self.send("status"));
    }

    /// Switches the drive off where it is at rest, says these lines, applies them, and enables again.
    pub fn set_up(&mut self, lines: &[&str]) {
        for line in lines {
            self.accept(line);
        }
        self.apply_while_off();
    }

    /// Applies what is staged with the drive off, as what scales an output needs, and enables again.
    pub fn apply_while_off(&mut self) -> String {
        self.disable();
        let applied = self.accept("apply");
        self.tick();
        self.enable();
        applied
    }

    /// Switches the drive off and ticks until it is.
    pub fn disable(&mut self) {
        self.accept("disable");
        while !matches!(self.line("drive").as_str(), "disabled" | "not_ready") {
            self.tick();
        }
    }

    /// Clears the fault as soon as the shaper has settled, and enables.
    pub fn clear_and_enable(&mut self) {
        while self.line("fault") != "none" {
            self.send("clear");
            self.tick();
        }
        if self.line("drive") != "enabled" {
            self.enable();
        }
    }

    /// What `status` says under this word.
    ///
    /// # Panics
    /// When it says nothing.
    pub fn line(&mut self, key: &str) -> String {
        let reply = self.send("status");
        let found = reply.iter().find_map(|line| line.strip_prefix(key)?.strip_prefix(' '));
        found.unwrap_or_else(|| panic!("no {key} in {reply:?}")).to_owned()
    }

    /// A machine that starts for this reason and finds this in its flash, with echo off.
    pub fn restarted_with(flash: MockFlash, restart: Restart) -> Self {
        Self::start(flash, restart)
    }

    /// What is at the inputs of every tick from now on that is not told otherwise.
    pub fn set_inputs(&mut self, inputs: Inputs) {
        self.inputs = inputs;
    }

    /// What is at the inputs of every tick that is not told otherwise.
    pub fn inputs(&self) -> Inputs {
        self.inputs
    }

    /// From now on the option bytes keep this level, whatever is written.
    pub fn stick_brown_out_at(&mut self, level: BrownOut) {
        self.stuck_brown_out = Some(level);
    }

    /// From now on a test of the board finds this.
    pub fn set_found(&mut self, found: SelfTest) {
        self.found = found;
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
            inputs: Inputs::default(),
            outputs: None,
            stuck_brown_out: None,
            found: SelfTest::default(),
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

    /// Sends a line and returns the lines of the reply. Ticks while a request waits, as time would pass on
    /// the board.
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
                Some(Effect::SelfTest) => self.console.self_tested(self.found.clone(), &mut reply),
                Some(Effect::SetBrownOut(level)) => {
                    let found = self.stuck_brown_out.unwrap_or(level);
                    self.console.brown_out_set(level, found, &mut reply);
                }
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
        self.tick_with(self.inputs)
    }

    /// One tick that finds this at its inputs.
    pub fn tick_with(&mut self, inputs: Inputs) -> TickOutput {
        let output = self.controller.tick(inputs);
        match &mut self.outputs {
            Some(outputs) => outputs.push(output),
            None => self.log_nm.push(output.setpoint.0),
        }
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

    /// Outputs of all ticks since this was called last, those in which a request was taken too. From the
    /// first call on there is no log of setpoints.
    pub fn take_outputs(&mut self) -> Vec<TickOutput> {
        self.outputs.replace(Vec::new()).unwrap_or_default()
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
