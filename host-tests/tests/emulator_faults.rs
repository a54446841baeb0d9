//! Crashes, resets and emergencies of the unmodified release image on an emulated board.
//!
//! The image has no back door by which it could be made to fail: the debugger's link breaks it from outside.

use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

use stillbeam::board::Session;
use stillbeam::board::serial::SerialBoard;
use stillbeam_firmware::restart::CrashRecord;
use stillbeam_host_tests::emulator::rsp::RspClient;
use stillbeam_host_tests::emulator::{
    Emulator, EmulatorError, EmulatorOptions, REST_LIMIT, panic_site, thumb,
};

const STACK_POINTER: u8 = 13;
const PC: u8 = 15;
/// Where memory.x has the record of a crash.
const CRASH: u32 = 0x2001_ff00;
/// RCC_CSR after a reset by software and by the watchdog, the pin's flag with it as on the chip.
const SOFTWARE_RESET: u32 = 0x1400_0000;
const WATCHDOG_RESET: u32 = 0x2400_0000;
/// For a machine that is busy with other things.
const PATIENCE: Duration = Duration::from_secs(30);
const BOOT_LIMIT: Duration = Duration::from_secs(60);

fn image() -> Option<PathBuf> {
    let image = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from);
    if image.is_none() {
        println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
    }
    image
}

fn boot(image: &Path) -> Emulator {
    Emulator::boot(image, &EmulatorOptions::default()).expect("the image boots")
}

fn talk(emulator: &Emulator) -> Session {
    let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
    let port = SerialBoard::open(&path).expect("the port opens");
    Session::start_within(Box::new(port), PATIENCE).expect("the console answers")
}

/// Sets registers and memory of a stopped CPU.
fn lead_astray(
    client: &mut RspClient<UnixStream>,
    break_it: impl FnOnce(&mut dyn FnMut(u8, u32), &mut dyn FnMut(u32, &[u8])),
) {
    let mut registers = Vec::new();
    let mut memory = Vec::new();
    break_it(&mut |register, value| registers.push((register, value)), &mut |address, bytes| {
        memory.push((address, bytes.to_vec()));
    });
    for (address, bytes) in memory {
        client.write_memory(address, &bytes).expect("written");
    }
    for (register, value) in registers {
        client.set_register(register, value).expect("set");
    }
}

/// Lets the CPU run for a moment and stops it again; the record that is in memory then.
fn crash(
    emulator: &mut Emulator,
    break_it: impl FnOnce(&mut dyn FnMut(u8, u32), &mut dyn FnMut(u32, &[u8])),
) -> CrashRecord {
    let mut client = emulator.debug().expect("a link");
    lead_astray(&mut client, break_it);
    // It stops by itself only for breakpoints, and the handler ends in a loop.
    client.resume(Duration::from_millis(500)).expect_err("it does not come back");
    client.interrupt().expect("stopped");
    let bytes = client.memory(CRASH, 256).expect("the region is read");
    client.detach().expect("detached");
    CrashRecord::decode(&bytes.try_into().expect("256 bytes")).expect("a record")
}

/// The registers that stop the machine, and the first word of the record: where the order matters.
const DRIVE_ENABLE: u32 = 0x4002_0418;
const STEP_TIMER: u32 = 0x4001_0000;
const ANALOG: u32 = 0x4000_7408;
/// The interrupt controller's "disable", and the tick there: TIM2 is number 28.
const DISABLE_INTERRUPT: u32 = 0xe000_e180;
const TICK: u32 = 1 << 28;

/// What the image writes there after it has failed, in order: the place, and the value of a register. The
/// tick, which writes to the same outputs, is off: virtual time goes on to the next one whenever the CPU is
/// resumed, so there would be nothing but ticks.
fn last_writes(
    emulator: &mut Emulator,
    break_it: impl FnOnce(&mut dyn FnMut(u8, u32), &mut dyn FnMut(u32, &[u8])),
) -> (Vec<(u32, u32)>, CrashRecord) {
    const WATCHED: [u32; 4] = [DRIVE_ENABLE, STEP_TIMER, ANALOG, CRASH];
    let mut client = emulator.debug().expect("a link");
    client.write_word(DISABLE_INTERRUPT, TICK).expect("disabled");
    lead_astray(&mut client, break_it);
    for address in WATCHED {
        client.watch(address, 4).expect("watched");
    }
    let mut writes = Vec::new();
    // As long as it takes until the record, and then for long enough to see that there is no more.
    let mut patience = PATIENCE;
    while let Ok(stop) = client.resume(patience) {
        let address = stop.watchpoint.expect("it stops for what is watched");
        let value = if address == CRASH {
            patience = Duration::from_millis(500);
            0
        } else {
            let pc = client.register(PC).expect("read");
            let code = client.memory(pc, 4).expect("read");
            let half = |at: usize| u16::from_le_bytes([code[at], code[at + 1]]);
            let access = thumb::decode(half(0), half(2)).expect("a word is stored");
            assert_eq!(access.direction, thumb::Direction::Store);
            client.register(access.transfer).expect("read")
        };
        writes.push((address, value));
        // The CPU stands before the access.
        client.unwatch(address, 4).expect("not watched");
        client.step(PATIENCE).expect("stepped");
        client.watch(address, 4).expect("watched again");
    }
    client.interrupt().expect("stopped");
    for address in WATCHED {
        client.unwatch(address, 4).expect("not watched");
    }
    let bytes = client.memory(CRASH, 256).expect("the region is read");
    let record = CrashRecord::decode(&bytes.try_into().expect("256 bytes")).expect("a whole record");
    client.detach().expect("detached");
    // The record's first word may be written in parts.
    writes.dedup();
    (writes, record)
}

/// The drive is disabled first, by one store; then the steps, then the analog output if it is a speed. All of
/// it twice, because a tick may come between, and then the record; after that nothing. So nothing that goes
/// wrong with the record leaves the machine running.
#[test]
fn a_panic_and_a_hard_fault_make_the_outputs_safe_before_they_write_the_record() {
    let Some(image) = image() else { return };
    let site = panic_site::find(&image).expect("an image has places that panic");
    // Enable, "in position", charge pump and brake.
    const DISABLED: (u32, u32) = (DRIVE_ENABLE, 1 << 16 | 1 << 21 | 1 << 22 | 1 << 26);
    const NO_STEPS: (u32, u32) = (STEP_TIMER, 1 << 3);
    const STANDSTILL: (u32, u32) = (ANALOG, 2048);
    for (quantity, safe) in
        [("position", &[DISABLED, NO_STEPS][..]), ("velocity", &[DISABLED, NO_STEPS, STANDSTILL])]
    {
        for kind in ["panic", "hard_fault"] {
            let mut emulator = boot(&image);
            let mut session = talk(&emulator);
            session.command_when_ready(&format!("set analog.quantity {quantity}")).expect("accepted");
            for line in ["set move.velocity_mm_s 5", "apply"] {
                session.command_when_ready(line).expect(line);
            }
            session.enable_virtual_drive().expect("enabled");
            session.command_when_ready("move 100").expect("accepted");
            drop(session);
            let (writes, record) = last_writes(&mut emulator, |register, memory| {
                let nowhere = CRASH - 64;
                memory(nowhere, &[0x00, 0xde, 0x00, 0xde]);
                register(PC, if kind == "panic" { site.address } else { nowhere });
            });
            println!("{kind}, {quantity}: {writes:x?}");
            assert_eq!(record.kind.name(), kind);
            assert_eq!(writes, [safe, safe, &[(CRASH, 0)]].concat(), "{kind}, {quantity}");
        }
    }
}

/// What `info` says after `key`.
fn info(session: &mut Session, key: &str) -> String {
    let info = session.command("info").expect("info");
    info.line(key).unwrap_or_else(|| panic!("no {key} in {info:?}")).to_owned()
}

#[test]
fn a_hard_fault_is_recorded_outlives_the_reset_and_holds_the_machine_until_cleared() {
    let Some(image) = image() else { return };
    let mut emulator = boot(&image);
    {
        let mut session = talk(&emulator);
        session.enable_virtual_drive().expect("enabled");
        session.command("move 20").expect("accepted");
    }
    // An undefined instruction in memory of the test's own choice: unused RAM below the record.
    let nowhere = CRASH - 64;
    let record = crash(&mut emulator, |register, memory| {
        memory(nowhere, &[0x00, 0xde, 0x00, 0xde]);
        register(PC, nowhere);
    });
    assert_eq!((record.kind.name(), record.registers.pc), ("hard_fault", nowhere));
    assert_eq!(record.registers.cfsr, 0x0001_0000, "undefined instruction");
    assert!(record.tick > 0);

    emulator.reset(WATCHDOG_RESET, BOOT_LIMIT).expect("it starts again");
    let mut session = talk(&emulator);
    assert_eq!(info(&mut session, "reset"), "watchdog");
    assert_eq!(info(&mut session, "crash"), record.to_string());
    let status = session.command("status").expect("status");
    assert_eq!((status.line("fault"), status.line("drive")), (Some("restart"), Some("fault")));
    assert!(session.command("move 1").expect_err("held").to_string().contains("clear"));
    session.command("crash clear").expect("forgotten");
    session.command_when_ready("clear").expect("cleared");
    let status = session.command("status").expect("status");
    assert_eq!((status.line("fault"), status.line("drive")), (Some("none"), Some("not_ready")));
    assert!(session.command("move 1").expect_err("the drive is off").to_string().contains("enable"));
    session.enable_virtual_drive().expect("enabled");
    session.command("move 1").expect("accepted");
    assert_eq!(session.wait_for_rest(REST_LIMIT).expect("rest"), 1_000_000, "the tick runs");
}

#[test]
fn a_reset_without_a_crash_leaves_a_drive_that_is_off_until_it_is_enabled() {
    let Some(image) = image() else { return };
    let mut emulator = boot(&image);
    for _ in 0..2 {
        // At once: a reset late in virtual time is refused, and on a busy machine time runs while the console
        // talks.
        emulator.reset(SOFTWARE_RESET, BOOT_LIMIT).expect("it starts again");
    }
    let mut session = talk(&emulator);
    assert_eq!(
        (info(&mut session, "reset"), info(&mut session, "crash")),
        ("software".into(), "none".into())
    );
    assert_eq!(session.command("status").expect("status").line("drive"), Some("not_ready"));
    assert!(session.command("move 1").expect_err("the drive is off").to_string().contains("enable"));
    session.enable_virtual_drive().expect("enabled");
    session.command("move 1").expect("accepted");
    assert_eq!(session.wait_for_rest(PATIENCE).expect("rest"), 1_000_000, "the tick runs");
}

#[test]
fn a_board_that_has_just_been_switched_on_says_so() {
    let Some(image) = image() else { return };
    let emulator = boot(&image);
    let mut session = talk(&emulator);
    assert_eq!(
        (info(&mut session, "reset"), info(&mut session, "crash")),
        ("power_on".into(), "none".into())
    );
}

/// Longer than the counter goes with which the emulator's timer is set right.
#[test]
fn a_reset_so_late_that_the_tick_would_stand_still_is_an_error() {
    let Some(image) = image() else { return };
    let mut emulator = boot(&image);
    let mut session = talk(&emulator);
    // A second of the board is 84 ms of virtual time, whatever the tick rate; the fewer ticks, the sooner it
    // is over.
    for line in ["set tick.rate_hz 500", "apply"] {
        session.command_when_ready(line).expect(line);
    }
    session.enable_virtual_drive().expect("enabled");
    session.command_when_ready("decay 10 60").expect("accepted");
    session.wait_for_rest(PATIENCE).expect("rest");
    drop(session);
    let late = emulator.reset(SOFTWARE_RESET, BOOT_LIMIT);
    assert!(matches!(late, Err(EmulatorError::LateReset)), "{late:?}");
}

#[test]
fn a_panic_of_the_release_image_is_recorded_with_its_place_and_holds_the_machine_after_the_reset() {
    let Some(image) = image() else { return };
    let site = panic_site::find(&image).expect("an image has places that panic");
    let mut emulator = boot(&image);
    let mut client = emulator.debug().expect("a link");
    let mut word = |place: u32| client.read_word(site.location + 4 * place).expect("read");
    let (name, length, line) = (word(0), word(1), word(2));
    let name = client.memory(name, length as usize).expect("read");
    client.detach().expect("detached");
    let expected = format!("{}:{line}", String::from_utf8(name).expect("text").trim_end_matches('\0'));
    assert!(expected.contains(".rs:"), "{expected}");

    // The image's own instructions from here on: what names the place, the panic, the handler.
    let record = crash(&mut emulator, |register, _| register(PC, site.address));
    assert_eq!((record.kind.name(), record.message.as_str()), ("panic", expected.as_str()));

    emulator.reset(WATCHDOG_RESET, BOOT_LIMIT).expect("it starts again");
    let mut session = talk(&emulator);
    assert_eq!(info(&mut session, "crash"), record.to_string());
    let status = session.command("status").expect("status");
    assert_eq!((status.line("fault"), status.line("drive")), (Some("restart"), Some("fault")));
}

#[test]
fn a_stack_that_runs_over_ends_in_a_fault_that_is_recorded() {
    let Some(image) = image() else { return };
    let mut emulator = boot(&image);
    let low = emulator.stack().low;
    let record = crash(&mut emulator, |register, memory| {
        // `push {r0-r7}; b .-2`: a recursion without end, from where the stack has 256 bytes left.
        let nowhere = CRASH - 64;
        memory(nowhere, &[0xff, 0xb4, 0xfd, 0xe7]);
        register(STACK_POINTER, low + 256);
        register(PC, nowhere);
    });
    assert_eq!(record.kind.name(), "hard_fault");
    assert!(record.registers.sp < low + 64, "{record}");
    assert_eq!(record.message.as_str(), "the stack is full");
}

#[test]
fn an_edge_at_the_emergency_input_stops_the_machine_until_cleared_and_enabled() {
    let Some(image) = image() else { return };
    let mut emulator = boot(&image);
    let mut session = talk(&emulator);
    // The emulator has no port B to drive. The edge's interrupt is set pending as the edge would: EXTI1 is
    // number 7.
    const PEND: u32 = 0xe000_e200;
    for category in ["category_0", "category_1"] {
        session.disable_drive().expect("off");
        for line in [
            "set emergency.input high",
            "set move.velocity_mm_s 5",
            &format!("set emergency.stop {category}"),
            "apply",
        ] {
            session.command_when_ready(line).expect(line);
        }
        session.enable_virtual_drive().expect("enabled");
        session
            .command_when_ready(if category == "category_0" { "move 100" } else { "move -100" })
            .expect("accepted");
        let mut client = emulator.debug().expect("a link");
        client.write_word(PEND, 1 << 7).expect("pending");
        client.detach().expect("detached");
        while session.drive_state().expect("status") == "stopping" {}
        let status = session.command("status").expect("status");
        assert_eq!((status.line("fault"), status.line("drive")), (Some("emergency"), Some("fault")));
        let events = session.command("events").expect("events");
        assert!(events.lines.iter().any(|event| event.ends_with("emergency 1")), "{events:?}");
        let held = status.line("setpoint_nm").map(str::to_owned);
        assert_eq!(session.command("status").expect("status").line("setpoint_nm"), held.as_deref());
        session.command_when_ready("clear").expect("cleared");
        let status = session.command("status").expect("status");
        let known = if category == "category_0" { "position" } else { "nothing" };
        assert_eq!(status.line("lacking"), Some(known), "a machine that has coasted is anywhere");
    }

    // The port reads low there, which is a level to act on too.
    for line in ["set emergency.input low", "apply"] {
        session.command_when_ready(line).expect(line);
    }
    assert_eq!(session.command("status").expect("status").line("fault"), Some("emergency"));
    assert!(session.command("clear").expect_err("still active").to_string().contains("release"));
}

#[test]
fn long_replies_arrive_whole() {
    let Some(image) = image() else { return };
    let emulator = boot(&image);
    let mut session = talk(&emulator);
    for _ in 0..20 {
        let settings = session.command("get").expect("get").lines;
        assert!(settings.iter().map(String::len).sum::<usize>() > 1024, "longer than the port's buffer");
        assert!(session.command("help").expect("help").lines.len() > 20);
    }
}
