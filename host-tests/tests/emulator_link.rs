//! The serial line of the unmodified release image: bytes that work at once, and bytes that were lost.

use std::path::{Path, PathBuf};
use std::time::Duration;

use stillbeam::board::serial::SerialBoard;
use stillbeam::board::{ByteLink as _, Session};
use stillbeam_firmware::real_time::RealTimeByte;
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions, REST_LIMIT, thumb};

const PATIENCE: Duration = Duration::from_secs(30);

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

fn port(emulator: &Emulator) -> SerialBoard {
    let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
    SerialBoard::open(&path).expect("the port opens")
}

fn talk(emulator: &Emulator) -> Session {
    Session::start_within(Box::new(port(emulator)), PATIENCE).expect("the console answers")
}

/// Reads until a whole line contains `wanted`.
fn read_until(port: &mut SerialBoard, wanted: &str) -> String {
    let deadline = port.clock() + PATIENCE;
    let (mut text, mut buffer) = (String::new(), [0; 1024]);
    while port.clock() < deadline {
        let count = port.read(&mut buffer, Duration::from_millis(100)).expect("read");
        text += &String::from_utf8_lossy(&buffer[..count]);
        // What is behind the last line break is still to be continued.
        let whole = text.rsplit_once('\n').map_or("", |(whole, _)| whole);
        if whole.lines().any(|line| line.contains(wanted)) {
            return text;
        }
    }
    panic!("no {wanted:?} in {text:?}");
}

#[test]
fn a_stop_byte_behind_half_a_line_stops_the_image_with_checksums_on() {
    let Some(image) = image() else { return };
    let emulator = boot(&image);
    let mut session = talk(&emulator);
    // Virtual time runs ahead of a busy computer: the motion takes half an hour of it.
    for line in ["set move.velocity_mm_s 0.01", "apply"] {
        session.command_when_ready(line).expect(line);
    }
    session.enable_virtual_drive().expect("enabled");
    session.command_when_ready("move 20").expect("accepted");
    drop(session);
    let mut raw = port(&emulator);
    raw.write_all(b"checksum on\r").expect("written");
    read_until(&mut raw, "ok checksum on");
    raw.write_all(b"mov").expect("written");
    raw.write_all(&[RealTimeByte::STATUS]).expect("written");
    let said = read_until(&mut raw, "! status ");
    assert!(said.contains("! status state=moving"), "{said}");
    raw.write_all(&[RealTimeByte::STOP]).expect("written");
    drop(raw);
    let mut session = talk(&emulator);
    let rest_nm = session.wait_for_rest(REST_LIMIT).expect("rest");
    assert!((0..19_000_000).contains(&rest_nm), "{rest_nm}");
    assert_eq!(session.command("status").expect("status").line("fault"), Some("none"));
}

/// The emulator's port takes the next byte only when the last one was read, so it cannot lose any. The
/// debugger's link shows the interrupt the flag as the port would, once.
#[test]
fn a_line_that_an_overrun_has_cut_is_refused_and_counted() {
    /// USART1's status, its flags "overrun" and "byte received".
    const STATUS: u32 = 0x4001_1000;
    const OVERRUN: u32 = 1 << 3;
    const PC: u8 = 15;
    const PROGRAM_STATUS: u8 = 25;
    /// The port's interrupt, number 37, in the program status. The sender looks at the port's status too.
    const PORT: u32 = 16 + 37;
    let Some(image) = image() else { return };
    let mut emulator = boot(&image);
    drop(talk(&emulator));
    let mut raw = port(&emulator);
    let mut client = emulator.debug().expect("a link");
    client.watch(STATUS, 4).expect("watched");
    raw.write_all(b"m").expect("written");
    client.resume(PATIENCE).expect("the byte comes");
    while client.register(PROGRAM_STATUS).expect("read") & 0x1ff != PORT {
        client.unwatch(STATUS, 4).expect("not watched");
        client.step(PATIENCE).expect("stepped");
        client.watch(STATUS, 4).expect("watched");
        client.resume(PATIENCE).expect("the byte comes");
    }
    let pc = client.register(PC).expect("read");
    let code = client.memory(pc, 4).expect("read");
    let half = |at: usize| u16::from_le_bytes([code[at], code[at + 1]]);
    let access = thumb::decode(half(0), half(2)).expect("a word is loaded");
    client.unwatch(STATUS, 4).expect("not watched");
    client.step(PATIENCE).expect("stepped");
    let status = client.register(access.transfer).expect("read");
    client.set_register(access.transfer, status | OVERRUN).expect("set");
    client.detach().expect("detached");
    raw.write_all(b"ve 10\r").expect("written");
    read_until(&mut raw, "err crc line: bytes of it were lost");
    drop(raw);
    let mut session = talk(&emulator);
    let status = session.command("status").expect("status");
    assert!(status.line("counters").is_some_and(|counts| counts.contains(" overrun=1")), "{status:?}");
    assert_eq!(status.line("state"), Some("rest"));
}
