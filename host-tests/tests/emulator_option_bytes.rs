//! What the unmodified release image writes into the chip's option bytes: the brown-out level, and nothing
//! else of them.

use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Duration;

use stillbeam::board::Session;
use stillbeam::board::serial::SerialBoard;
use stillbeam_host_tests::emulator::clock_cover::{ClockCover, Region};
use stillbeam_host_tests::emulator::stand_in::Registers;
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions};

const PATIENCE: Duration = Duration::from_secs(60);
/// FLASH_OPTKEYR, FLASH_SR and FLASH_OPTCR (RM0090).
const OPTION_KEYS: u32 = 0x4002_3c08;
const STATUS: u32 = 0x4002_3c0c;
const OPTIONS: u32 = 0x4002_3c14;
/// As from the factory: no brown-out level, everything locked.
const FACTORY: u32 = 0x0fff_aaed;

const LOCK: u32 = 1;
const START: u32 = 2;

/// The flash controller with its option bytes, and everything that is written to them.
#[derive(Default)]
struct FlashController {
    cover: ClockCover,
    writes: Vec<(u32, u32)>,
    /// What the status says once programming has started.
    fault: u32,
}

impl Registers for FlashController {
    fn read(&mut self, address: u32) -> u32 {
        let started = self.writes.iter().any(|&(at, value)| at == OPTIONS && value & START != 0);
        if address == STATUS && started { self.fault } else { self.cover.read(address) }
    }

    fn write(&mut self, address: u32, value: u32) {
        if [OPTION_KEYS, OPTIONS].contains(&address) {
            self.writes.push((address, value));
        }
        let options = self.cover.read(OPTIONS);
        match address {
            // The second key opens the lock.
            OPTION_KEYS if self.writes.len() == 2 => self.cover.write(OPTIONS, options & !LOCK),
            OPTIONS if options & LOCK != 0 => {}
            // The programming is over at once.
            OPTIONS => self.cover.write(OPTIONS, value & !START),
            _ => self.cover.write(address, value),
        }
    }
}

/// Asks for a level; the reply and what was written.
fn ask_for(level: &str, fault: u32) -> Option<(String, Vec<(u32, u32)>)> {
    let Some(image) = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from) else {
        println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
        return None;
    };
    let mut emulator = Emulator::boot(&image, &EmulatorOptions::default()).expect("the image boots");
    let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
    let port = SerialBoard::open(&path).expect("the port opens");
    let mut session = Session::start_within(Box::new(port), PATIENCE).expect("the console answers");
    let info = session.command("info").expect("info");
    assert_eq!(info.line("brown_out"), Some("off"), "as the chip came");
    let flash = Mutex::new(FlashController { fault, ..FlashController::default() });
    let regions: Vec<Region> = ClockCover::REGIONS.into_iter().filter(|r| r.contains(OPTIONS)).collect();
    let reply = emulator
        .standing_in(&regions, &flash, || match session.command(&format!("brownout set {level}")) {
            Ok(reply) => reply.ok_line,
            Err(error) => error.to_string(),
        })
        .expect("every access is served");
    Some((reply, flash.into_inner().expect("no panic").writes))
}

#[test]
fn the_image_unlocks_the_option_bytes_writes_the_level_alone_and_locks_them() {
    let Some((reply, writes)) = ask_for("level_3", 0) else { return };
    assert_eq!(reply, "ok brownout level=level_3");
    let level = FACTORY & !(0b1100 | LOCK);
    let expected = [
        (OPTION_KEYS, 0x0819_2a3b),
        (OPTION_KEYS, 0x4c5d_6e7f),
        (OPTIONS, level),
        (OPTIONS, level | START),
        (OPTIONS, level | LOCK),
    ];
    assert_eq!(writes, expected);
}

#[test]
fn a_fault_of_the_flash_is_a_refusal_with_the_level_of_before() {
    const PROGRAMMING_SEQUENCE: u32 = 1 << 7;
    let Some((reply, _)) = ask_for("level_2", PROGRAMMING_SEQUENCE) else { return };
    assert!(reply.contains("brownout: the level is still off"), "{reply}");
}
