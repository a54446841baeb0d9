//! The watchdog of the unmodified release image, against a model of it: who starts it and who feeds it, and
//! what becomes of a board whose tick or console stands still.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use stillbeam::board::Session;
use stillbeam::board::serial::SerialBoard;
use stillbeam_firmware::machine::TIMER_CLOCK_HZ;
use stillbeam_firmware::watchdog::{HEARTBEATS_PER_S, OSCILLATOR_HZ, Patience};
use stillbeam_host_tests::emulator::clock_cover::Region;
use stillbeam_host_tests::emulator::stand_in::{Effect, Moment, Registers};
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions};
use stillbeam_host_tests::watchdog_timer::{WatchdogTimer, register};

const PATIENCE: Duration = Duration::from_secs(60);
const WATCHDOG: Region = Region { base: 0x4000_3000, length: 0x10 };
/// Numbers of interrupts: the tick, the doorbell, and the executor of the console's task.
const TICK: u32 = 28;
const DOORBELL: u32 = 66;
const EXECUTOR: u32 = 64;
/// An interrupt's number as an exception's.
const FIRST_INTERRUPT: u32 = 16;
/// Keys of the watchdog.
const START: u32 = 0xcccc;
const UNLOCK: u32 = 0x5555;
const FEED: u32 = 0xaaaa;
/// RCC_CSR after a reset by the independent watchdog, which pulls the reset pin too.
const RESET_BY_WATCHDOG: u32 = 0x2400_0000;

/// A write to the watchdog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Write {
    offset: u32,
    value: u32,
    exception: u32,
}

/// Interrupt clear-enable registers.
const NVIC_ICER: u32 = 0xe000_e180;

/// The watchdog, and who has written what.
struct Watched {
    watchdog: WatchdogTimer,
    moment: Moment,
    writes: Vec<Write>,
    /// An interrupt that is to run no more.
    to_stop: Option<u32>,
    /// The reset has been asked for.
    reset: bool,
}

impl Watched {
    fn new(oscillator_hz: f64) -> Self {
        let moment = Moment { clocks: 0, exception: 0 };
        let watchdog = WatchdogTimer::new(oscillator_hz);
        Self { watchdog, moment, writes: Vec::new(), to_stop: None, reset: false }
    }

    fn seconds(&self) -> f64 {
        self.moment.clocks as f64 / f64::from(TIMER_CLOCK_HZ)
    }

    /// The writes that feed it.
    fn feeds(&self) -> usize {
        self.writes.iter().filter(|write| (write.offset, write.value) == (register::KR, FEED)).count()
    }
}

impl Registers for Watched {
    const OBSERVES: bool = true;

    fn read(&mut self, address: u32) -> u32 {
        self.watchdog.read(address - WATCHDOG.base)
    }

    fn write(&mut self, address: u32, value: u32) {
        let offset = address - WATCHDOG.base;
        self.writes.push(Write { offset, value, exception: self.moment.exception });
        self.watchdog.write(offset, value);
    }

    fn observe(&mut self, moment: Moment) {
        self.moment = moment;
        self.watchdog.advance(moment.clocks);
    }

    fn effect(&mut self) -> Option<Effect> {
        if let Some(interrupt) = self.to_stop.take() {
            let register = NVIC_ICER + 4 * (interrupt / 32);
            return Some(Effect::Memory(register, (1_u32 << (interrupt % 32)).to_le_bytes().to_vec()));
        }
        let bites = self.watchdog.bitten_at().is_some() && !self.reset;
        self.reset |= bites;
        bites.then_some(Effect::Reset)
    }
}

/// A board that is held at the end of its start-up.
fn boot() -> Option<Emulator> {
    let Some(image) = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from) else {
        println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
        return None;
    };
    let options = EmulatorOptions { held: true, ..EmulatorOptions::default() };
    Some(Emulator::boot(&image, &options).expect("the image boots"))
}

/// Lets a held board run while somebody speaks to it, the watchdog watched.
fn run<T>(emulator: &mut Emulator, watched: &Mutex<Watched>, work: impl FnOnce(Session) -> T) -> T {
    let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
    emulator
        .standing_in(&[WATCHDOG], watched, || {
            let port = SerialBoard::open(&path).expect("the port opens");
            work(Session::start_within(Box::new(port), PATIENCE).expect("the console answers"))
        })
        .expect("every access is served")
}

fn looked_at(watched: &Mutex<Watched>) -> MutexGuard<'_, Watched> {
    watched.lock().expect("no panic")
}

fn line(session: &mut Session, command: &str, key: &str) -> String {
    session.command(command).expect(command).line(key).expect(key).to_owned()
}

/// Starts a long move; the drive is enabled.
fn set_off(session: &mut Session) {
    for command in ["set move.velocity_mm_s 1", "set emergency.input waived", "apply"] {
        session.command_when_ready(command).expect(command);
    }
    session.enable_virtual_drive().expect("enabled");
    session.command_when_ready("move 100").expect("it sets off");
}

#[test]
fn start_up_starts_the_watchdog_and_the_doorbell_alone_feeds_it_in_time() {
    let Some(mut emulator) = boot() else { return };
    // The one that is in a hurry.
    let watched = Mutex::new(Watched::new(OSCILLATOR_HZ[2]));
    run(&mut emulator, &watched, |mut session| {
        set_off(&mut session);
        while looked_at(&watched).feeds() < 60 {
            assert_eq!(line(&mut session, "status", "state"), "moving");
        }
    });
    let watched = watched.into_inner().expect("no panic");
    assert_eq!(watched.watchdog.bitten_at(), None);
    let Patience { prescaler_code, reload } = Patience::NORMAL;
    let expected = [
        (register::KR, START),
        (register::KR, UNLOCK),
        (register::PR, prescaler_code.into()),
        (register::RLR, reload.into()),
        (register::KR, FEED),
    ];
    let started: Vec<Write> = expected.map(|(offset, value)| Write { offset, value, exception: 0 }).to_vec();
    let (first, rest) = watched.writes.split_at(expected.len());
    assert_eq!(first, started);
    let fed = Write { offset: register::KR, value: FEED, exception: FIRST_INTERRUPT + DOORBELL };
    assert!(rest.iter().all(|write| *write == fed), "{rest:?}");
}

/// Lets an interrupt of a moving board run no more; what the board does after the watchdog has bitten.
fn stop(interrupt: u32, oscillator_hz: f64) {
    let Some(mut emulator) = boot() else { return };
    let watched = Mutex::new(Watched::new(oscillator_hz));
    let stopped_s = run(&mut emulator, &watched, |mut session| {
        set_off(&mut session);
        let mut watched_now = looked_at(&watched);
        watched_now.to_stop = Some(interrupt);
        let stopped_s = watched_now.seconds();
        drop(watched_now);
        let deadline = Instant::now() + PATIENCE;
        while !looked_at(&watched).reset {
            assert!(Instant::now() < deadline, "the watchdog does not bite");
            std::thread::sleep(Duration::from_millis(5));
        }
        stopped_s
    });
    let bitten_at = watched.into_inner().expect("no panic").watchdog.bitten_at().expect("it has bitten");
    let waited_s = bitten_at as f64 / f64::from(TIMER_CLOCK_HZ) - stopped_s;
    let patience_s = Patience::NORMAL.seconds(oscillator_hz);
    println!("it waits {patience_s:.2} s and bit after {waited_s:.2} s");
    // The last feed may be as old as two heartbeats are apart; looks come some time after.
    assert!(waited_s > patience_s - 2.0 / f64::from(HEARTBEATS_PER_S), "{waited_s}");

    emulator.reset(RESET_BY_WATCHDOG, PATIENCE).expect("it starts anew");
    let watched = Mutex::new(Watched::new(oscillator_hz));
    run(&mut emulator, &watched, |mut session| {
        assert_eq!(line(&mut session, "info", "reset"), "watchdog");
        let status = session.command("status").expect("status");
        assert_eq!((status.line("drive"), status.line("fault")), (Some("fault"), Some("restart")));
        let events = session.command("events").expect("events").lines.join("\n");
        assert!(events.contains(" watchdog "), "{events}");
        session.command("move 1").expect_err("nothing moves before a person has said so");
        session.command_when_ready("clear").expect("cleared");
        session.enable_virtual_drive().expect("and then it does");
    });
    assert_eq!(watched.into_inner().expect("no panic").watchdog.bitten_at(), None);
}

#[test]
fn a_tick_that_stands_still_ends_in_a_reset_and_a_start_that_moves_nothing() {
    stop(TICK, OSCILLATOR_HZ[1]);
}

#[test]
fn a_console_that_stands_still_ends_in_a_reset_and_a_start_that_moves_nothing() {
    stop(EXECUTOR, OSCILLATOR_HZ[1]);
}
