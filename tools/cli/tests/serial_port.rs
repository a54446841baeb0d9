//! The serial code on a pseudo-terminal, with the core behind it in place of a board.
#![cfg(unix)]

use std::io::{ErrorKind, Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use stillbeam::board::in_process::InProcessBoard;
use stillbeam::board::serial::SerialBoard;
use stillbeam::board::{BoardError, ByteLink, Session};

/// A core that answers on a pseudo-terminal until it is dropped.
struct CoreOnTerminal {
    path: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl CoreOnTerminal {
    fn start() -> Self {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&master).unwrap();
        unlockpt(&master).unwrap();
        let path = ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
        rustix::fs::fcntl_setfl(&master, rustix::fs::OFlags::RDWR | rustix::fs::OFlags::NONBLOCK).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || serve(std::fs::File::from(master), &stopped));
        Self { path, stop, thread: Some(thread) }
    }
}

impl Drop for CoreOnTerminal {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

fn serve(mut terminal: std::fs::File, stop: &AtomicBool) {
    let mut board = InProcessBoard::new();
    let mut buffer = [0; 512];
    while !stop.load(Ordering::Relaxed) {
        // Failing to read or write means that nobody is there, or that nothing has come.
        if let Ok(count) = terminal.read(&mut buffer) {
            board.write_all(&buffer[..count]).unwrap();
        }
        let count = board.read(&mut buffer, Duration::from_millis(2)).unwrap();
        let mut rest = &buffer[..count];
        while !rest.is_empty() && !stop.load(Ordering::Relaxed) {
            match terminal.write(rest) {
                Ok(written) => rest = &rest[written..],
                Err(error) if error.kind() == ErrorKind::WouldBlock => std::thread::yield_now(),
                Err(_) => break,
            }
        }
        if count == 0 {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

#[test]
fn a_session_over_a_terminal_runs_a_whole_move() {
    let core = CoreOnTerminal::start();
    let mut session = Session::start(Box::new(SerialBoard::open(&core.path).unwrap())).unwrap();
    assert_eq!(session.board(), core.path);
    for line in ["set mode1.frequency_hz 6.9", "set mode1.damping_ratio 0.006", "set mode1.type zv", "apply"]
    {
        session.command(line).unwrap();
    }
    session.enable_virtual_drive().unwrap();
    let run = session.run_motion("move 20", 8, 0.05, &mut |_| {}).unwrap();
    assert_eq!(run.setpoints_m().last(), Some(&0.02));
    // The same move in this process, sample by sample.
    let mut here = Session::start(Box::new(InProcessBoard::new())).unwrap();
    for line in ["set mode1.frequency_hz 6.9", "set mode1.damping_ratio 0.006", "set mode1.type zv", "apply"]
    {
        here.command(line).unwrap();
    }
    here.enable_virtual_drive().unwrap();
    let all = here.run_motion("move 20", 1, 0.05, &mut |_| {}).unwrap();
    let expected = |ticks: usize| all.setpoints_m().get(ticks).copied();
    let phase = (0..8).find(|phase| {
        let streamed = run.setpoints_m();
        (1..40).all(|sample| expected(8 * sample - phase) == streamed.get(sample).copied())
    });
    assert!(phase.is_some(), "streamed over the port is what the core computes");
}

#[test]
fn a_refusal_comes_through_and_a_silent_port_is_noticed() {
    let core = CoreOnTerminal::start();
    let mut session = Session::start(Box::new(SerialBoard::open(&core.path).unwrap())).unwrap();
    assert!(matches!(session.command("move 999"), Err(BoardError::Refused { .. })));

    let silent = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&silent).unwrap();
    unlockpt(&silent).unwrap();
    let path = ptsname(&silent, Vec::new()).unwrap().into_string().unwrap();
    let port = Box::new(SerialBoard::open(&path).unwrap());
    let refused = Session::start_within(port, Duration::from_millis(300));
    assert!(matches!(refused, Err(BoardError::NoConsole { .. })));
}

/// Behind a port something moves: nothing does without consent, and nothing but what a person has said of the
/// machine enables it.
#[test]
fn a_motion_over_a_port_asks_first_and_enables_only_what_is_ready() {
    let core = CoreOnTerminal::start();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("move.csv");
    let record = |yes: bool| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_stillbeam"));
        command.args(["record", "--port", &core.path, "--after", "0", "--out"]).arg(&out);
        if yes {
            command.arg("--yes");
        }
        let run = command.args(["move", "3"]).stdin(std::process::Stdio::null()).output().unwrap();
        (run.status.code(), String::from_utf8_lossy(&run.stderr).into_owned())
    };
    let (code, messages) = record(false);
    assert!(code == Some(2) && messages.contains("will move") && messages.contains("--yes"), "{messages}");
    let (code, messages) = record(true);
    assert!(code == Some(2) && messages.contains("emergency.input"), "{messages}");
    {
        let mut session = Session::start(Box::new(SerialBoard::open(&core.path).unwrap())).unwrap();
        for line in ["set emergency.input waived", "apply", "position set 0"] {
            session.command_when_ready(line).unwrap();
        }
        assert_eq!(session.drive_state().unwrap(), "disabled", "nothing was enabled");
    }
    let (code, messages) = record(true);
    assert_eq!(code, Some(0), "{messages}");
    let mut session = Session::start(Box::new(SerialBoard::open(&core.path).unwrap())).unwrap();
    assert_eq!(session.drive_state().unwrap(), "disabled", "the drive is left as it was found");
    assert_eq!(session.command("status").unwrap().line("setpoint_nm"), Some("3000000"));
}

#[test]
fn the_console_command_talks_to_a_port() {
    use std::process::{Command, Stdio};
    let core = CoreOnTerminal::start();
    let mut child = Command::new(env!("CARGO_BIN_EXE_stillbeam"))
        .args(["console", "--port", &core.path])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(b"set mode2.type zvd\nget mode2.type\nfly\n").unwrap();
    let run = child.wait_with_output().unwrap();
    let out = String::from_utf8_lossy(&run.stdout).into_owned();
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
    assert!(out.contains("mode2.type = off [off] {-} staged zvd"), "{out}");
    assert!(out.contains("err unknown-command fly"), "{out}");
}
