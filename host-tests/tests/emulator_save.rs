//! `save` of the unmodified release image, with models of what the emulator lacks: the flash that stands
//! still with the whole chip while it erases, the watchdog, the counter of ticks, and a serial port that
//! loses what comes meanwhile.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use stillbeam::board::{ByteLink, Session};
use stillbeam_firmware::machine::TIMER_CLOCK_HZ;
use stillbeam_firmware::settings::{Key, Settings, SettingsStore};
use stillbeam_firmware::watchdog::{OSCILLATOR_HZ, Patience};
use stillbeam_host_tests::emulator::clock_cover::{ClockCover, Region};
use stillbeam_host_tests::emulator::stand_in::{Effect, Moment, Regions, Registers};
use stillbeam_host_tests::emulator::thumb::Direction;
use stillbeam_host_tests::emulator::unmodelled::Access;
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions};
use stillbeam_host_tests::flash_controller::{FlashController, Operation, SECTOR, SETTINGS};
use stillbeam_host_tests::serial_line::{SerialLine, register as serial};
use stillbeam_host_tests::watchdog_timer::WatchdogTimer;

const PATIENCE: Duration = Duration::from_secs(60);
const FLASH_REGISTERS: u32 = 0x4002_3c00;
/// Access control, and its switches of both caches.
const ACCESS: u32 = FLASH_REGISTERS;
const CACHES: u32 = 0x600;
const WATCHDOG: Region = Region { base: 0x4000_3000, length: 0x10 };
/// Status and data of USART1, and its interrupt.
const PORT: Region = Region { base: 0x4001_1000, length: 8 };
const PORT_INTERRUPT: u8 = 37;
/// The counter of TIM9.
const TICK_COUNTER: Region = Region { base: 0x4001_4024, length: 4 };
/// Set and reset bits of port B, whose lowest pin enables the drive.
const PORT_B: u32 = 0x4002_0418;
const ENABLE: u32 = 1;
/// The step timer's first control register, and its counter's switch.
const STEP_TIMER: u32 = 0x4001_0000;
const COUNTS: u32 = 1;

/// From tick to tick in the emulator.
const TICK_CLOCKS: u64 = 21_000;
/// More than from one look at the line to the next, which every tick is.
const BYTE_CLOCKS: u64 = 25_000;
/// What a sector of 128 KiB takes typically (datasheet of the STM32F405).
const ERASE_S: u32 = 1;
/// From one look at the board's time to the next.
const LOOK: Duration = Duration::from_millis(1);
/// A reset by the pin.
const RESET_BY_PIN: u32 = 0x0400_0000;

/// What is behind the registers.
struct Chip {
    flash: FlashController,
    watchdog: WatchdogTimer,
    line: SerialLine,
    moment: Moment,
    first_tick: Option<u64>,
    effects: VecDeque<Effect>,
    /// The port's interrupt is pending for what is in the port now.
    interrupted: bool,
    /// What somebody says while a sector is erased.
    said_meanwhile: &'static [u8],
    /// How patient the watchdog was at each erase, in seconds, and the flash's access control.
    erases: Vec<(f64, u32)>,
    words: u32,
}

impl Chip {
    fn new(flash: FlashController) -> Self {
        Self {
            flash,
            // The one that is in a hurry.
            watchdog: WatchdogTimer::new(OSCILLATOR_HZ[2]),
            line: SerialLine::new(BYTE_CLOCKS),
            moment: Moment { clocks: 0, exception: 0 },
            first_tick: None,
            effects: VecDeque::new(),
            interrupted: false,
            said_meanwhile: b"",
            erases: Vec::new(),
            words: 0,
        }
    }

    /// Ticks that were due until now; they are asked for soon after one.
    fn ticks(&mut self) -> u32 {
        let since = self.moment.clocks - *self.first_tick.get_or_insert(self.moment.clocks);
        // Counts modulo 2¹⁶.
        ((since + TICK_CLOCKS / 2) / TICK_CLOCKS) as u32 & 0xffff
    }

    fn carry_out(&mut self, operation: Operation) {
        match operation {
            Operation::Programmed { address, value } => {
                self.words += 1;
                self.effects.push_back(Effect::Memory(address, value.to_le_bytes().to_vec()));
            }
            Operation::Erased { address } => {
                self.erases.push((self.watchdog.patience_s(), self.flash.read(ACCESS)));
                self.line.send(std::mem::take(&mut self.said_meanwhile));
                self.effects.push_back(Effect::Memory(address, vec![0xff; SECTOR as usize]));
                self.effects.push_back(Effect::Stall(ERASE_S * TIMER_CLOCK_HZ));
            }
        }
    }
}

impl Registers for Chip {
    const OBSERVES: bool = true;

    fn read(&mut self, address: u32) -> u32 {
        match address {
            _ if WATCHDOG.contains(address) => self.watchdog.read(address - WATCHDOG.base),
            _ if TICK_COUNTER.contains(address) => self.ticks(),
            _ if PORT.contains(address) => {
                self.interrupted &= address - PORT.base != serial::DR;
                self.line.read(address - PORT.base)
            }
            _ => self.flash.read(address),
        }
    }

    fn write(&mut self, address: u32, value: u32) {
        match address {
            _ if WATCHDOG.contains(address) => self.watchdog.write(address - WATCHDOG.base, value),
            _ if PORT.contains(address) => self.line.write(address - PORT.base, value),
            _ if TICK_COUNTER.contains(address) => {}
            _ => {
                if let Some(operation) = self.flash.write(address, value) {
                    self.carry_out(operation);
                }
            }
        }
    }

    fn observe(&mut self, moment: Moment) {
        self.moment = moment;
        self.watchdog.advance(moment.clocks);
        self.line.advance(moment.clocks);
    }

    fn effect(&mut self) -> Option<Effect> {
        if let Some(effect) = self.effects.pop_front() {
            return Some(effect);
        }
        let interrupts = self.line.interrupts() && !self.interrupted;
        self.interrupted |= interrupts;
        interrupts.then_some(Effect::Interrupt(PORT_INTERRUPT))
    }
}

/// The host's end of the line, whose time is the board's.
struct Wire(Arc<Mutex<Chip>>);

impl ByteLink for Wire {
    fn name(&self) -> &str {
        "the modelled line"
    }

    fn write_all(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        looked_at(&self.0).line.send(bytes);
        Ok(())
    }

    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> std::io::Result<usize> {
        let deadline = self.clock() + patience;
        loop {
            let sent = looked_at(&self.0).line.take_sent(buffer.len());
            if !sent.is_empty() || self.clock() >= deadline {
                buffer.iter_mut().zip(&sent).for_each(|(place, byte)| *place = *byte);
                return Ok(sent.len());
            }
            std::thread::sleep(LOOK);
        }
    }

    fn clock(&self) -> Duration {
        let clocks = looked_at(&self.0).moment.clocks;
        Duration::from_secs_f64(clocks as f64 / f64::from(TIMER_CLOCK_HZ))
    }

    fn pause(&mut self, duration: Duration) {
        let until = self.clock() + duration;
        while self.clock() < until {
            std::thread::sleep(LOOK);
        }
    }
}

fn looked_at(chip: &Mutex<Chip>) -> MutexGuard<'_, Chip> {
    chip.lock().expect("no panic")
}

/// Lets a held board run while somebody speaks to it.
fn run<T>(emulator: &mut Emulator, chip: &Arc<Mutex<Chip>>, work: impl FnOnce(Session) -> T) -> T {
    let flash: Vec<Region> =
        ClockCover::REGIONS.into_iter().filter(|region| region.contains(FLASH_REGISTERS)).collect();
    let registers: Vec<Region> = flash.into_iter().chain([WATCHDOG, PORT, TICK_COUNTER]).collect();
    let regions = Regions { registers: &registers, written: &[SETTINGS] };
    let wire = Wire(Arc::clone(chip));
    emulator
        .standing_in_for(regions, chip, || {
            work(Session::start_within(Box::new(wire), PATIENCE).expect("the console answers"))
        })
        .expect("every access is served")
}

/// The sectors as the board's, in this process's memory.
struct Sectors {
    bytes: Vec<u8>,
    erases: u32,
}

impl ErrorType for Sectors {
    type Error = Infallible;
}

impl ReadNorFlash for Sectors {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Infallible> {
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Sectors {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR as usize;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Infallible> {
        self.erases += 1;
        self.bytes[from as usize..to as usize].fill(0xff);
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Infallible> {
        let stored = self.bytes.iter_mut().skip(offset as usize);
        stored.zip(bytes).for_each(|(stored, byte)| *stored &= byte);
        Ok(())
    }
}

/// Sectors in which so much is stored that the next save has to erase one.
fn nearly_full() -> Vec<u8> {
    let mut sectors = Sectors { bytes: vec![0xff; SETTINGS.length as usize], erases: 0 };
    let mut before = sectors.bytes.clone();
    for round in 1.. {
        let mut settings = Settings::default();
        settings.set(Key::Velocity, &format!("{}", 100 + round % 2)).expect("within its range");
        let mut store = SettingsStore::new(sectors);
        block_on(store.save(&settings, None)).expect("saved");
        sectors = store.into_flash();
        if sectors.erases > 0 {
            break;
        }
        before.clone_from(&sectors.bytes);
    }
    before
}

/// The writes to the drive's lines and to the step timer, in their order.
type Heard = Arc<Mutex<Vec<(u32, u32)>>>;

fn boot(flash: Vec<u8>) -> Option<(Emulator, Heard)> {
    let Some(image) = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from) else {
        println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
        return None;
    };
    let heard = Heard::default();
    let listening = Arc::clone(&heard);
    let listener = Box::new(move |Access { address, direction, value }| {
        if direction == Direction::Store && [PORT_B, STEP_TIMER].contains(&address) {
            let _a_test_that_has_panicked = listening.lock().map(|mut heard| heard.push((address, value)));
        }
    });
    let flash = vec![(SETTINGS.base, flash)];
    let options = EmulatorOptions { held: true, flash, shift: 0, ..EmulatorOptions::default() };
    Some((Emulator::boot_heard_by(&image, &options, listener).expect("the image boots"), heard))
}

fn say(session: &mut Session, lines: &[&str]) {
    for line in lines {
        session.command_when_ready(line).expect(line);
    }
}

fn counter(session: &mut Session, name: &str) -> u32 {
    let status = session.command("status").expect("status");
    let counters = status.line("counters").expect("counters");
    let key = format!("{name}=");
    let text = counters.split_ascii_whitespace().find_map(|word| word.strip_prefix(key.as_str()));
    text.map_or(0, |text| text.parse().expect("a number"))
}

#[test]
fn an_erase_finds_the_drive_off_the_watchdog_patient_and_loses_nothing_unsaid() {
    let stored = nearly_full();
    let Some((mut emulator, heard)) = boot(stored.clone()) else { return };
    let chip = Arc::new(Mutex::new(Chip::new(FlashController::holding(stored))));
    run(&mut emulator, &chip, |mut session| {
        assert_eq!(session.command("info").expect("info").line("settings_store"), Some("ok"));
        session.enable_virtual_drive().expect("enabled");
        let refusal = session.command("save").expect_err("the drive is on").to_string();
        assert!(refusal.contains("drive"), "{refusal}");
        assert_eq!(looked_at(&chip).words, 0);
        session.disable_drive().expect("disabled");
        let from = heard.lock().expect("no panic").len();
        say(&mut session, &["set move.velocity_mm_s 123", "apply"]);
        looked_at(&chip).said_meanwhile = b"status\r";
        let saved = session.command("save").expect("saved").ok_line;
        println!("{saved}");

        // What was said meanwhile is refused as a whole, and the session says its own line again.
        let lost = counter(&mut session, "overrun");
        assert_eq!((lost, session.repeated()), (1, 1), "one overrun of many bytes");
        let missed = counter(&mut session, "missed_tick");
        let status = session.command("status").expect("status");
        assert_eq!((missed, status.line("fault"), status.line("drive")), (1, Some("none"), Some("disabled")));
        let events = session.command("events").expect("events").lines;
        let missed = events.iter().find_map(|line| line.split_once(" missed_tick ")).expect("an event");
        let missed: u32 = missed.1.parse().expect("a number");
        assert!((3990..4100).contains(&missed), "{missed} ticks of a second at 4 kHz");
        let heard = heard.lock().expect("no panic");
        let (lines, steps): (Vec<_>, Vec<_>) = heard[from..].iter().partition(|(at, _)| *at == PORT_B);
        assert!(lines.len() > 100 && lines.iter().all(|(_, value)| value & ENABLE == 0), "the drive is off");
        assert!(steps.iter().all(|(_, value)| value & COUNTS == 0), "nothing moves: {steps:?}");
    });
    let chip = looked_at(&chip);
    let [(patience_s, access)] = chip.erases[..] else { panic!("{:?}", chip.erases) };
    assert!((patience_s - Patience::SAVING.seconds(OSCILLATOR_HZ[2])).abs() < 1e-12, "{patience_s}");
    // What the caches hold of an erased sector would be wrong.
    assert_eq!((access & CACHES, chip.flash.read(ACCESS) & CACHES), (0, CACHES));
    assert!(Patience::NORMAL.seconds(OSCILLATOR_HZ[2]) < f64::from(ERASE_S), "it would have bitten");
    assert_eq!(chip.watchdog.bitten_at(), None);
    assert!((chip.watchdog.patience_s() - Patience::NORMAL.seconds(OSCILLATOR_HZ[2])).abs() < 1e-12);
    assert!(chip.words > 0 && chip.flash.is_locked());
    assert_eq!((chip.flash.refused(), chip.line.lost()), (0, 6));

    emulator.reset(RESET_BY_PIN, PATIENCE).expect("it starts anew");
    let chip = Arc::new(Mutex::new(Chip::new(FlashController::holding(chip.flash.memory().to_vec()))));
    run(&mut emulator, &chip, |mut session| {
        let info = session.command("info").expect("info");
        assert_eq!((info.line("settings_store"), info.line("settings_damaged")), (Some("ok"), Some("none")));
        let velocity = session.command("get move.velocity_mm_s").expect("get").lines.join(" ");
        assert!(velocity.contains("= 123 mm/s") && velocity.contains("{123}"), "{velocity}");
        assert_eq!(looked_at(&chip).words, 0, "a start writes nothing");
    });
}
