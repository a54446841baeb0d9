//! The real image is not reset by its own watchdog while it does what takes it longest. The emulator has no
//! watchdog, but writes to its key register can be watched.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use stillbeam::board::serial::SerialBoard;
use stillbeam::board::{BoardError, Session};
use stillbeam_firmware::motion::pieces::MAX_PLAN_TICKS;
use stillbeam_firmware::watchdog::{HEARTBEATS_PER_S, OSCILLATOR_HZ, Patience};
use stillbeam_host_tests::emulator::rsp::RspError;
use stillbeam_host_tests::emulator::{
    Emulator, EmulatorOptions, REST_LIMIT, function_address, static_address,
};
use stillbeam_host_tests::played_plans::{overlaid, upload_lines};

/// IWDG_KR (RM0090), written once per feed.
const WATCHDOG_KEY: u32 = 0x4000_3000;
const PC: u8 = 15;
const TICK_HZ: f64 = 4000.0;

/// A tick has 21 000 instructions here (`tick_alignment`) and 42 000 cycles on the chip: as if an instruction
/// took two cycles, which is more than flash waits and taken branches make of it on average.
const SHIFT: u8 = 0;

struct Board {
    session: Session,
    emulator: Emulator,
    /// The interrupt that feeds: at heartbeats, and it is rung for bytes and samples too.
    doorbell: u32,
    /// Whether it is rung for a heartbeat.
    look_due: u32,
}

/// What the doorbell did meanwhile.
#[derive(Debug, Default)]
struct Feeding {
    heartbeats: u32,
    feeds: u32,
    /// Most heartbeats in a row at which it did not feed.
    longest_pause: u32,
}

fn boot() -> Option<Board> {
    let Some(image) = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from) else {
        println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
        return None;
    };
    let doorbell = function_address(&image, "CAN2_SCE").expect("its address");
    let options = EmulatorOptions { shift: SHIFT, ..EmulatorOptions::default() };
    let emulator = Emulator::boot(&image, &options).expect("the image boots");
    let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
    let port = SerialBoard::open(&path).expect("the port opens");
    let session = Session::start(Box::new(port)).expect("the console answers");
    let look_due = static_address(&image, "LOOK_DUE").expect("its address");
    Some(Board { session, emulator, doorbell, look_due })
}

impl Board {
    /// The watchdog's food while the board answers a command, refused or not.
    fn feeding_during(&mut self, command: &str) -> Feeding {
        let mut client = self.emulator.debug().expect("the debugger's port");
        client.watch(WATCHDOG_KEY, 4).expect("a watchpoint");
        client.break_at(self.doorbell).expect("a breakpoint");
        let answered = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let watching = scope.spawn(|| {
                let (mut found, mut pause) = (Feeding::default(), 0_u32);
                while !answered.load(Ordering::Relaxed) {
                    match client.resume(Duration::from_millis(500)) {
                        Ok(_) if client.register(PC).expect("a register") == self.doorbell => {
                            let due = client.memory(self.look_due, 1).expect("a byte") != [0];
                            found.heartbeats += u32::from(due);
                            pause += u32::from(due);
                            // Off the breakpoint.
                            client.step(Duration::from_secs(5)).expect("a step");
                        }
                        Ok(_) => {
                            // The CPU stands before the access.
                            client.unwatch(WATCHDOG_KEY, 4).expect("no watchpoint");
                            client.step(Duration::from_secs(5)).expect("a step");
                            client.watch(WATCHDOG_KEY, 4).expect("a watchpoint");
                            found.feeds += 1;
                            found.longest_pause = found.longest_pause.max(pause.saturating_sub(1));
                            pause = 0;
                        }
                        Err(RspError::Timeout { .. }) => drop(client.interrupt().expect("it stops")),
                        Err(error) => panic!("{error}"),
                    }
                }
                found.longest_pause = found.longest_pause.max(pause);
                client.unwatch(WATCHDOG_KEY, 4).expect("no watchpoint");
                client.unbreak(self.doorbell).expect("no breakpoint");
                client.detach().expect("it runs on");
                found
            });
            let answer = self.session.command_when_ready(command);
            answered.store(true, Ordering::Relaxed);
            let found = watching.join().expect("watched");
            match answer {
                Ok(_) | Err(BoardError::Refused { .. }) => found,
                Err(error) => panic!("{command}: {error}"),
            }
        })
    }

    fn rest(&mut self) {
        self.session.wait_for_rest(REST_LIMIT).expect("it comes to rest");
    }
}

#[test]
fn the_watchdog_is_fed_whatever_the_console_does() {
    let Some(mut board) = boot() else { return };
    // A plan as long as they come, played where every tick has to be asked how far a stop goes, and the
    // largest tables.
    let mut lines = upload_lines(&overlaid(MAX_PLAN_TICKS / 4, &[(0, 8_000_000)]), TICK_HZ);
    let commit = lines.pop().expect("a last line");
    for number in 1..=4 {
        lines.push(format!("set mode{number}.frequency_hz {}", 2 * number));
        lines.push(format!("set mode{number}.type zvddd"));
    }
    for line in lines.into_iter().chain(["set travel.max_mm 8".to_owned(), "apply".to_owned()]) {
        board.session.command_when_ready(&line).expect(&line);
    }
    board.session.enable_virtual_drive().expect("enabled");
    let shortest_s =
        OSCILLATOR_HZ.map(|hz| Patience::NORMAL.seconds(hz)).into_iter().fold(f64::INFINITY, f64::min);
    let allowed = (shortest_s * f64::from(HEARTBEATS_PER_S)) as u32 - 1;
    let multisine = "multisine 0.1 8 100 1 1";
    for command in [
        commit.as_str(),
        "play",
        "move 5",
        "set mode1.frequency_hz 2.1",
        "apply",
        "stop",
        multisine,
        "stop",
        "get",
        "help",
        "info",
    ] {
        let found = board.feeding_during(command);
        println!("{command}: {found:?}");
        assert!(found.longest_pause < allowed, "{command}: {found:?}, {allowed} heartbeats are too many");
        if command == multisine {
            // It draws for seconds, but in steps.
            assert!(found.heartbeats > 10 && found.feeds * 10 > found.heartbeats * 8, "{found:?}");
        }
        if command == "stop" {
            board.rest();
        }
    }
}
