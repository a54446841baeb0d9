//! The firmware image: wiring only. What it does is in the library.
//!
//! On a host the same file compiles to a program that prints the version and the settings the image has.

#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(target_os = "none")]
mod image {
    #[cfg(feature = "defmt")]
    use defmt_rtt as _;
    use embassy_executor::SpawnToken;
    use embassy_futures::block_on;
    use embassy_futures::yield_now;
    use heapless::String;
    use heapless::spsc::Consumer;
    use static_cell::ConstStaticCell;
    use stillbeam_firmware::board::flash::SettingsSectors;
    use stillbeam_firmware::board::serial::LineErrors;
    use stillbeam_firmware::board::{
        self, brown_out, clocks, core_coupled, crash, digital_inputs, emergency_stop, encoder, executor,
        flash_accelerator, image, outputs, restart, self_test, serial, step_pulses, supply, tick_timer,
        watchdog,
    };
    use stillbeam_firmware::console::{CommandError, Console, Effect, Identity, MAX_REPLY};
    use stillbeam_firmware::drive::State;
    use stillbeam_firmware::fault::Event;
    use stillbeam_firmware::machine::{HISTORY_SAMPLES, History, Machine, TIMER_CLOCK_HZ};
    use stillbeam_firmware::restart::Restart;
    use stillbeam_firmware::settings::{DriveSettings, Settings, SettingsStore};
    use stillbeam_firmware::source::SourceKind;
    use stillbeam_firmware::telemetry::Sample;
    use stillbeam_firmware::telemetry::sender::Sender;
    use stillbeam_firmware::watchdog::Patience;

    static MACHINE: ConstStaticCell<Machine<'static>> = ConstStaticCell::new(Machine::new());
    static HISTORY: ConstStaticCell<History> = ConstStaticCell::new([0; HISTORY_SAMPLES]);

    const IDENTITY: Identity = Identity {
        version: env!("CARGO_PKG_VERSION"),
        board: "stm32f405rg",
        build: 0,
        timer_clock_hz: TIMER_CLOCK_HZ,
        brown_out: None,
    };

    #[cortex_m_rt::entry]
    fn main() -> ! {
        if let Some(task) = start_up() {
            executor::start().spawn(task);
        }
        executor::sleep()
    }

    /// Sets everything up and returns the one task there is. Not part of `main`, whose stack is never given
    /// back: what lies there for a moment, the machine's parts and the task before it is in its place, takes
    /// more than 10 KiB.
    #[inline(never)]
    fn start_up() -> Option<SpawnToken<impl Sized>> {
        restart::enter_bootloader_if_asked();
        let mut restart = restart::read();
        let clock = clocks::start_crystal();
        let peripherals = embassy_stm32::init(clocks::config(clock));
        flash_accelerator::enable();
        outputs::configure();
        encoder::configure();
        digital_inputs::configure();
        emergency_stop::configure();
        step_pulses::prepare();
        tick_timer::configure();
        clocks::watch_crystal(clock);
        supply::watch();
        // Given away once, here.
        let history = core_coupled::take_history()?;
        let identity = IDENTITY.with(image::checksum(), brown_out::level());
        let mut parts = MACHINE.take().split(identity, [HISTORY.take(), history]);
        serial::open(parts.asked);
        board::stillbeam_boot_complete();
        // Drive disabled and no tick yet: the time for whatever a power cut left to be done.
        let mut store = SettingsStore::new(SettingsSectors::new(peripherals.FLASH));
        let restored = parts.console.restore(block_on(store.load()));
        if clock == clocks::Source::Internal && restart.crash.is_none() {
            restart.crash = Some(crash::no_crystal());
        }
        if restart.must_hold() {
            parts.controller.hold_after_crash();
        }
        log_start(&restart, parts.console.settings());
        parts.console.note_restart(restart);
        follow_settings(&parts.console);
        emergency_stop::set_at_once(parts.console.settings().safety().stops_at_once());
        // The first tick knows the settings.
        parts.controller.take_waiting_requests();
        // From here on the tick says whether the drive is enabled.
        tick_timer::start(parts.controller, parts.console.clocks_per_tick());
        watchdog::start();
        // The one task there is finds its place free.
        serve(parts.console, restored, store, parts.samples, clock).ok()
    }

    /// Answers the console and sends samples, for ever.
    #[embassy_executor::task]
    async fn serve(
        mut console: Console<'static>,
        restored: Result<(), CommandError<'static>>,
        mut store: SettingsStore<SettingsSectors>,
        mut samples: Consumer<'static, Sample>,
        clock: clocks::Source,
    ) {
        let mut followed = Followed::by(&console);
        let mut text = String::<MAX_REPLY>::new();
        let mut line_errors = LineErrors::default();
        let mut sender = Sender::new();
        let mut drive_state = State::default();
        console.greet(restored, &mut text);
        loop {
            let said = text.len();
            console.announce(&mut text);
            log_faults(text.get(said..).unwrap_or_default());
            serial::send(text.as_bytes()).await;
            text.clear();
            let drive = console.drive_state();
            log_drive(core::mem::replace(&mut drive_state, drive), drive);
            tick_timer::console_made_round();
            tick_timer::heartbeat_or(|| samples.ready() || serial::has_received()).await;
            line_errors = note_line_errors(&mut console, line_errors);
            if let Some(outgoing) = samples.dequeue().and_then(|sample| sender.send(sample)) {
                serial::send(&outgoing).await;
            }
            // One at a time, so that samples and what is said unasked come between lines.
            let Some(byte) = serial::received() else { continue };
            console.feed(byte, &mut text);
            // Samples and the watchdog do not wait for what takes long.
            while console.work(&mut text) {
                console.announce(&mut text);
                serial::send(text.as_bytes()).await;
                text.clear();
                tick_timer::console_made_round();
                while let Some(sample) = samples.dequeue() {
                    if let Some(outgoing) = sender.send(sample) {
                        serial::send(&outgoing).await;
                    }
                }
                yield_now().await;
            }
            while console.has_waiting_request() {
                yield_now().await;
            }
            match console.take_effect() {
                None => {}
                Some(Effect::Save) => {
                    watchdog::set_patience(Patience::SAVING);
                    let (settings, table) = (console.settings_to_store(), console.table_to_store());
                    // The driver waits in place, so this never yields; run here, its state is on the stack.
                    let saved = block_on(store.save(settings, table));
                    console.saved(saved, &mut text);
                    watchdog::set_patience(Patience::NORMAL);
                }
                Some(Effect::ForgetCrash) => {
                    crash::forget();
                    console.crash_forgotten(&mut text);
                }
                Some(Effect::SelfTest) => {
                    console.self_tested(self_test::run(clock), &mut text);
                    follow_settings(&console);
                }
                Some(Effect::SetBrownOut(level)) => {
                    watchdog::set_patience(Patience::SAVING);
                    console.brown_out_set(level, brown_out::set(level), &mut text);
                    watchdog::set_patience(Patience::NORMAL);
                }
                Some(Effect::Reboot(start)) => {
                    serial::send(text.as_bytes()).await;
                    serial::sent().await;
                    restart::reboot(start)
                }
            }
            followed.update(&console);
            if let Some(left) = sender.follow(console.streaming()) {
                serial::send(&left).await;
            }
            log_refusals(&text);
            serial::send(text.as_bytes()).await;
            text.clear();
        }
    }

    /// Counts what went wrong on the line since `before`.
    fn note_line_errors(console: &mut Console<'_>, before: LineErrors) -> LineErrors {
        let now = serial::errors();
        let (overruns, damaged) = (now.overruns - before.overruns, now.damaged - before.damaged);
        if overruns != 0 {
            console.note(Event::Overrun, overruns as i32);
            log_line_error();
        }
        if damaged != 0 {
            console.note(Event::Line, damaged as i32);
            log_line_error();
        }
        now
    }

    /// Sets the hardware up for what runs.
    fn follow_settings(console: &Console<'_>) {
        let settings = console.settings();
        board::follow(settings.drive(), settings.source().kind(), console.tick_rate());
    }

    /// What the hardware was last set up for.
    struct Followed {
        clocks_per_tick: u32,
        drive: DriveSettings,
        source: SourceKind,
    }

    impl Followed {
        fn by(console: &Console<'_>) -> Self {
            let settings = console.settings();
            Self {
                clocks_per_tick: console.clocks_per_tick(),
                drive: *settings.drive(),
                source: settings.source().kind(),
            }
        }

        /// Sets the hardware up anew where a command has changed what it depends on.
        fn update(&mut self, console: &Console<'_>) {
            let now = Self::by(console);
            emergency_stop::set_at_once(console.settings().safety().stops_at_once());
            if now.clocks_per_tick != self.clocks_per_tick {
                tick_timer::set_clocks_per_tick(now.clocks_per_tick);
                log_rate(now.clocks_per_tick);
            } else if now.drive == self.drive && now.source == self.source {
                return;
            }
            log_settings(console.settings());
            follow_settings(console);
            *self = now;
        }
    }

    #[cfg(feature = "defmt")]
    fn log_start(restart: &Restart, settings: &Settings) {
        defmt::info!(
            "started after {=str}, crash on record: {=bool}",
            restart.cause.name(),
            restart.crash.is_some()
        );
        log_settings(settings);
    }

    #[cfg(not(feature = "defmt"))]
    fn log_start(_restart: &Restart, _settings: &Settings) {}

    /// The drive's state, where it is another than before.
    #[cfg(feature = "defmt")]
    fn log_drive(before: State, now: State) {
        if now != before {
            defmt::info!("drive {} -> {}", before, now);
        }
    }

    #[cfg(not(feature = "defmt"))]
    fn log_drive(_before: State, _now: State) {}

    /// The refusals in a reply.
    #[cfg(feature = "defmt")]
    fn log_refusals(reply: &str) {
        for line in reply.lines().filter(|line| line.starts_with("err ")) {
            defmt::warn!("{=str}", line);
        }
    }

    #[cfg(not(feature = "defmt"))]
    fn log_refusals(_reply: &str) {}

    /// What the console says unasked: faults as they come up.
    #[cfg(feature = "defmt")]
    fn log_faults(announced: &str) {
        for line in announced.lines() {
            defmt::warn!("{=str}", line);
        }
    }

    #[cfg(not(feature = "defmt"))]
    fn log_faults(_announced: &str) {}

    #[cfg(feature = "defmt")]
    fn log_rate(clocks_per_tick: u32) {
        defmt::info!("tick every {} timer clocks", clocks_per_tick);
    }

    #[cfg(not(feature = "defmt"))]
    fn log_rate(_clocks_per_tick: u32) {}

    #[cfg(feature = "defmt")]
    fn log_settings(settings: &Settings) {
        defmt::info!("{}", settings);
    }

    #[cfg(not(feature = "defmt"))]
    fn log_settings(_settings: &Settings) {}

    #[cfg(feature = "defmt")]
    fn log_line_error() {
        defmt::warn!("serial line error");
    }

    #[cfg(not(feature = "defmt"))]
    fn log_line_error() {}
}

#[cfg(not(target_os = "none"))]
fn main() {
    use stillbeam_firmware::settings::{Key, Settings};

    let defaults = Settings::default();
    println!("stillbeam firmware {} for stm32f405rg; settings:", env!("CARGO_PKG_VERSION"));
    for key in Key::all() {
        println!("{key} = {} {}: {}", defaults.get(key), key.unit(), key.meaning());
    }
}
