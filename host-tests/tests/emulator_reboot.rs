//! `reboot` and `dfu` of the unmodified release image: the drive is switched off first, the reset is asked
//! for as the core wants it, and the next start knows what it is for.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use stillbeam::board::Session;
use stillbeam::board::serial::SerialBoard;
use stillbeam_host_tests::emulator::clock_cover::Region;
use stillbeam_host_tests::emulator::stand_in::{Effect, Registers};
use stillbeam_host_tests::emulator::thumb::Direction;
use stillbeam_host_tests::emulator::unmodelled::Access;
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions};

const PATIENCE: Duration = Duration::from_secs(60);
/// Application interrupt and reset control; what it reads as, and the key with "system reset request".
const RESET_CONTROL: Region = Region { base: 0xe000_ed0c, length: 4 };
const READ_KEY: u32 = 0xfa05_0000;
const RESET: u32 = 0x05fa_0004;
/// RCC_CSR after it.
const RESET_BY_SOFTWARE: u32 = 0x1400_0000;
/// Where a crash is recorded, and what asks for the bootloader there.
const RECORD: u32 = 0x2001_ff00;
const BOOTLOADER: u32 = u32::from_le_bytes(*b"SBDF");
/// Set and reset bits of port B; the pins of enable and brake.
const PORT_B: u32 = 0x4002_0418;
const LINES: u32 = 1 | 1 << 10;

/// The core's reset.
#[derive(Default)]
struct Core {
    writes: Vec<u32>,
    reset: bool,
}

impl Registers for Core {
    fn read(&mut self, _: u32) -> u32 {
        READ_KEY
    }

    fn write(&mut self, _: u32, value: u32) {
        self.writes.push(value);
        self.reset = true;
    }

    fn effect(&mut self) -> Option<Effect> {
        std::mem::take(&mut self.reset).then_some(Effect::Reset)
    }
}

struct Board {
    emulator: Emulator,
    /// The levels of port B's outputs.
    lines: Arc<Mutex<u32>>,
}

fn boot() -> Option<Board> {
    let Some(image) = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from) else {
        println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
        return None;
    };
    let lines = Arc::new(Mutex::new(0));
    let heard = Arc::clone(&lines);
    let listener = Box::new(move |Access { address, direction, value }| {
        if (address, direction) == (PORT_B, Direction::Store) {
            let _a_test_that_has_panicked = heard.lock().map(|mut lines| {
                *lines = (*lines & !(value >> 16)) | (value & 0xffff);
            });
        }
    });
    // Held, and stood in for from the beginning: so time goes slowly enough for a reset to come in time.
    let options = EmulatorOptions { held: true, ..EmulatorOptions::default() };
    let emulator = Emulator::boot_heard_by(&image, &options, listener).expect("the image boots");
    Some(Board { emulator, lines })
}

fn looked_at<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().expect("no panic")
}

/// Lets a held board run while somebody speaks to it.
fn run(emulator: &mut Emulator, core: &Mutex<Core>, work: impl FnOnce(Session)) {
    let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
    emulator
        .standing_in(&[RESET_CONTROL], core, || {
            let port = SerialBoard::open(&path).expect("the port opens");
            work(Session::start_within(Box::new(port), PATIENCE).expect("the console answers"));
        })
        .expect("every access is served");
}

/// Says `command` to a board whose drive is enabled, and follows it to the reset.
fn leave(board: &mut Board, command: &str) {
    let core = Mutex::new(Core::default());
    let Board { emulator, lines } = board;
    run(emulator, &core, |mut session| {
        session.enable_virtual_drive().expect("enabled");
        session.command_when_ready("move 100").expect("it sets off");
        let refusal = session.command(command).expect_err("it moves").to_string();
        assert!(refusal.contains("moving"), "{refusal}");
        session.command("stop").expect("stopped");
        session.wait_for_rest(PATIENCE).expect("rest");
        while *looked_at(lines) & LINES != LINES {}
        session.command_when_ready(command).expect(command);
        while looked_at(&core).writes.is_empty() {
            std::thread::sleep(Duration::from_millis(1));
        }
    });
    assert_eq!(looked_at(&core).writes, [RESET]);
    // The thread that is told of it comes after.
    while *looked_at(lines) & LINES != 0 {}
}

#[test]
fn reboot_switches_the_drive_off_and_starts_the_firmware_anew() {
    let Some(mut board) = boot() else { return };
    leave(&mut board, "reboot");
    board.emulator.reset(RESET_BY_SOFTWARE, PATIENCE).expect("it starts anew");
    run(&mut board.emulator, &Mutex::new(Core::default()), |mut session| {
        let info = session.command("info").expect("info");
        assert_eq!((info.line("reset"), info.line("crash")), (Some("software"), Some("none")));
        assert_eq!(session.command("status").expect("status").line("drive"), Some("not_ready"));
    });
}

#[test]
fn dfu_leaves_a_mark_for_the_next_start() {
    let Some(mut board) = boot() else { return };
    leave(&mut board, "dfu");
    let mut client = board.emulator.debug().expect("a link");
    assert_eq!(client.read_word(RECORD).expect("memory"), BOOTLOADER);
}
