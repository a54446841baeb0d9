//! Conversations with the in-process board, and with links that misbehave.

use std::collections::VecDeque;
use std::time::Duration;

use stillbeam::board::in_process::InProcessBoard;
use stillbeam::board::{BoardError, ByteLink, Session};

fn core() -> Session {
    let mut session = Session::start(Box::new(InProcessBoard::new())).unwrap();
    session.enable_virtual_drive().unwrap();
    session
}

/// A link that answers every line from a script, and otherwise stays silent while its clock runs.
struct Scripted {
    answers: Vec<(&'static str, &'static str)>,
    line: String,
    outgoing: VecDeque<u8>,
    clock: Duration,
}

impl Scripted {
    fn new(answers: &[(&'static str, &'static str)]) -> Box<Self> {
        let mut answers = answers.to_vec();
        answers.extend([
            ("echo off", "ok echo off\r\n"),
            ("stream off", "ok stream off decimation=0\r\n"),
            ("checksum on", "err unknown-command checksum: no such command\r\n"),
            ("get link.timeout_ms", "err unknown-name link.timeout_ms: no such setting\r\n"),
        ]);
        Box::new(Self { answers, line: String::new(), outgoing: VecDeque::new(), clock: Duration::ZERO })
    }
}

impl ByteLink for Scripted {
    fn name(&self) -> &str {
        "scripted"
    }

    fn write_all(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        for byte in bytes.iter().filter(|byte| **byte != 0x15) {
            if *byte != b'\r' {
                self.line.push(char::from(*byte));
                continue;
            }
            let line = std::mem::take(&mut self.line);
            let line = line.split(" *").next().unwrap_or_default();
            if let Some((_, answer)) = self.answers.iter().find(|(command, _)| *command == line) {
                self.outgoing.extend(answer.as_bytes());
            }
        }
        Ok(())
    }

    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> std::io::Result<usize> {
        if self.outgoing.is_empty() {
            self.clock += patience;
        }
        // In crumbs, so that lines arrive in pieces.
        let count = buffer.len().min(self.outgoing.len()).min(3);
        for (place, byte) in buffer.iter_mut().zip(self.outgoing.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }

    fn clock(&self) -> Duration {
        self.clock
    }

    fn pause(&mut self, duration: Duration) {
        self.clock += duration;
    }
}

#[test]
fn replies_come_in_lines_and_end_in_ok() {
    let mut session = core();
    let info = session.command("info").unwrap();
    assert_eq!(info.ok_line, "ok info");
    assert_eq!(info.line("tick_hz"), Some("4000"));
    assert_eq!(info.line("board"), Some("core"));
    session.command("set mode1.frequency_hz 1.1").unwrap();
    let get = session.command("get mode1.frequency_hz").unwrap();
    assert_eq!(get.lines, ["mode1.frequency_hz = 1 Hz [1] {-} staged 1.1"]);
}

#[test]
fn a_refusal_carries_code_name_and_reason() {
    let mut session = core();
    for (command, code, name, part) in [
        ("set mode1.frequency_hz 0", "range", "mode1.frequency_hz", "outside 0.01"),
        ("set mode1.type zvx", "syntax", "mode1.type", "off, zv, zvd, zvdd, zvddd, ei, ei2, ei3 or mzv"),
        ("set nothing 1", "unknown-name", "nothing", "no such setting"),
        ("fly", "unknown-command", "fly", "no such command"),
        ("move 400", "range", "move", "outside the travel"),
    ] {
        match session.command(command) {
            Err(BoardError::Refused { code: c, name: n, reason, .. }) => {
                assert_eq!((c.as_str(), n.as_str()), (code, name), "{command}");
                assert!(reason.contains(part), "{command}: {reason}");
            }
            other => panic!("{command}: {other:?}"),
        }
    }
    // And the session goes on.
    assert!(session.command("status").is_ok());
}

#[test]
fn telemetry_between_reply_lines_is_sorted_out() {
    let reply = "tick_hz 4000\r\n# 0 10 5 5 rest\r\nshaper on\r\n# 1 14 6 5 moving\r\nok info\r\n";
    let mut session = Session::start(Scripted::new(&[("info", reply)])).unwrap();
    assert_eq!(session.command("info").unwrap().lines, ["tick_hz 4000", "shaper on"]);
}

#[test]
fn a_streamed_move_is_complete_and_ends_at_its_target() {
    let mut session = core();
    for line in ["set mode1.frequency_hz 6.9", "set mode1.damping_ratio 0.006", "set mode1.type zvd", "apply"]
    {
        session.command(line).unwrap();
    }
    let mut reached = 0.0;
    let run = session.run_motion("move 50", 4, 0.1, &mut |done| reached = done).unwrap();
    assert_eq!(reached, 1.0);
    assert_eq!(run.rate_hz(), 1000.0);
    let ticks: Vec<u32> = run.samples.iter().map(|sample| sample.tick).collect();
    assert!(ticks.windows(2).all(|pair| pair[1] - pair[0] == 4));
    let setpoints_m = run.setpoints_m();
    assert_eq!(setpoints_m[0], 0.0);
    assert_eq!(setpoints_m.last(), Some(&0.05));
    // 0.2 s of command, two half periods of shaping, and what was asked for on top.
    let seconds = setpoints_m.len() as f64 / 1000.0;
    assert!((seconds - (0.2 + 1.0 / 6.9 + 0.1)).abs() < 0.01, "{seconds}");
    assert!((setpoints_m[1] - setpoints_m[0]).abs() < 1e-4, "starts where the command starts");
    // The line is quiet again.
    assert_eq!(session.wait_for_rest(Duration::from_secs(1)).unwrap(), 50_000_000);
    assert!(session.run_motion("move 0", 4, 0.0, &mut |_| {}).is_ok());
}

#[test]
fn the_same_run_twice_is_the_same_to_the_bit() {
    let run = || core().run_motion("sweep exponential 1 8 2 1.0", 4, 0.0, &mut |_| {}).unwrap();
    assert_eq!(run(), run());
}

#[test]
fn a_motion_that_is_refused_leaves_the_stream_off() {
    let mut session = core();
    assert!(matches!(session.run_motion("move 9999", 4, 0.0, &mut |_| {}), Err(BoardError::Refused { .. })));
    let status = session.command("status").unwrap().lines;
    assert!(status.iter().all(|line| !line.starts_with('#')), "{status:?}");
    assert_eq!((status.first().map(String::as_str), status.len()), (Some("state rest"), 14));
    assert!(session.run_motion("move 1", 4, 0.0, &mut |_| {}).is_ok());
}

#[test]
fn a_fault_that_comes_up_is_told_apart_from_replies_and_ends_a_motion_with_an_error() {
    let answers = [
        ("info", "tick_hz 4000\r\nok info\r\n"),
        ("status", "state rest\r\ncommand_nm 0\r\nok status\r\n"),
        ("stream on 4 frames", "err syntax stream: usage: stream on [N]|off\r\n"),
        ("stream on 4", "ok stream on decimation=4\r\n# 0 0 0 0 rest\r\n"),
        (
            "move 50",
            "ok move ticks=4 settled_ticks=4\r\n# 1 4 7 7 moving\r\n! fault limit tick=6 drive=enabled\r\n# 2 8 7 7 fault\r\n# 3 12 7 7 fault\r\n",
        ),
    ];
    let mut session = Session::start(Scripted::new(&answers)).unwrap();
    match session.run_motion("move 50", 4, 0.0, &mut |_| {}) {
        Err(BoardError::Fault { fault, .. }) => assert_eq!(fault, "limit tick=6 drive=enabled"),
        other => panic!("{other:?}"),
    }
    let recorded = session.record_motion("move 50", 4, 0.0, &mut |_| {}).unwrap();
    assert_eq!(recorded.faults, ["limit tick=6 drive=enabled"]);

    // On the core the words come with the checksum of the session.
    let mut session = core();
    session.command("emergency").unwrap();
    session.disable_drive().unwrap();
    let faults = session.take_faults();
    // First while it is stopped, then when the drive is off.
    assert!(faults.iter().all(|fault| fault.starts_with("emergency tick=")), "{faults:?}");
    assert!(faults.last().is_some_and(|last| last.ends_with(" drive=disabled")), "{faults:?}");
}

#[test]
fn a_gap_in_the_stream_is_an_error_that_counts() {
    let status = "state rest\r\ncommand_nm 0\r\nok status\r\n";
    let answers = [
        ("info", "tick_hz 4000\r\nok info\r\n"),
        ("status", status),
        ("stream on 4 frames", "err syntax stream: usage: stream on [N]|off\r\n"),
        ("stream on 4", "ok stream on decimation=4\r\n# 0 0 0 0 rest\r\n"),
        ("move 50", "ok move ticks=10 settled_ticks=10\r\n# 1 4 7 7 moving\r\n# 5 20 9 9 moving\r\n"),
    ];
    let mut session = Session::start(Scripted::new(&answers)).unwrap();
    match session.run_motion("move 50", 4, 0.0, &mut |_| {}) {
        Err(BoardError::SamplesLost { lost, tick, .. }) => assert_eq!((lost, tick), (3, 20)),
        other => panic!("{other:?}"),
    }
}

#[test]
fn silence_is_a_timeout_and_nonsense_a_protocol_error() {
    let mute = Box::new(Scripted {
        answers: Vec::new(),
        line: String::new(),
        outgoing: VecDeque::new(),
        clock: Duration::ZERO,
    });
    assert!(matches!(Session::start(mute), Err(BoardError::NoConsole { .. })));
    let answers = [("info", "half a rep"), ("get", "ok status\r\n"), ("set", "err what\r\n")];
    let mut session = Session::start(Scripted::new(&answers)).unwrap();
    assert!(matches!(session.command("get"), Err(BoardError::Protocol { .. })));
    assert!(matches!(session.command("set"), Err(BoardError::Protocol { .. })));
    assert!(matches!(session.command("info"), Err(BoardError::Timeout { .. })));
}

#[test]
fn the_handshake_copes_with_a_board_in_the_middle_of_something() {
    let mut board = InProcessBoard::new();
    // Telemetry is on, half a command is typed, and nobody has read anything yet.
    board.write_all(b"set emergency.input waived\rapply\rposition set 0\renable\r").unwrap();
    board.pause(Duration::from_millis(10));
    board.write_all(b"stream on 4\rsweep linear 1 2 10 1\rset mode1.freq").unwrap();
    board.pause(Duration::from_millis(200));
    let mut session = Session::start(Box::new(board)).unwrap();
    assert_eq!(session.command("status").unwrap().line("state"), Some("sweeping"));
    session.command("stop").unwrap();
    session.wait_for_rest(Duration::from_secs(5)).unwrap();
}

#[test]
fn the_encoder_is_collected_where_the_board_has_one() {
    let mut session = core();
    let without = session.run_motion("move 1", 4, 0.0, &mut |_| {}).unwrap();
    assert_eq!(without.encoder_m(), None);
    session.disable_drive().unwrap();
    for line in ["set encoder.counts_per_mm 100", "apply"] {
        session.command_when_ready(line).unwrap();
    }
    session.enable_drive().unwrap();
    let with = session.run_motion("move 0", 4, 0.0, &mut |_| {}).unwrap();
    let encoder_m = with.encoder_m().unwrap();
    // The in-process board has nothing that turns its encoder, which was taken to be at the setpoint, 1 mm.
    assert!(
        encoder_m.len() == with.setpoints_m().len() && encoder_m.iter().all(|position| *position == 1e-3)
    );
}

/// A board of which fifty seconds pass here in one of its own, as an emulated one does on a busy computer.
struct SlowBoard(InProcessBoard);

const SLOWNESS: u32 = 50;

impl ByteLink for SlowBoard {
    fn name(&self) -> &str {
        self.0.name()
    }

    fn write_all(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.0.write_all(bytes)
    }

    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> std::io::Result<usize> {
        self.0.read(buffer, patience / SLOWNESS)
    }

    fn clock(&self) -> Duration {
        self.0.clock() * SLOWNESS
    }

    fn pause(&mut self, duration: Duration) {
        self.0.pause(duration / SLOWNESS);
    }
}

#[test]
fn a_busy_board_is_waited_for_by_its_own_time_and_not_by_the_clock_on_the_wall() {
    let mut session = Session::start(Box::new(SlowBoard(InProcessBoard::new()))).unwrap();
    for line in ["set mode1.frequency_hz 1", "set mode1.type zvdd", "set move.velocity_mm_s 10", "apply"] {
        session.command_when_ready(line).unwrap();
    }
    session.enable_virtual_drive().unwrap();
    session.command("move 50").unwrap();
    session.command("shaper off").unwrap();
    // The table that was switched off takes one and a half seconds of the board's time to run out.
    assert!(matches!(session.command("shaper on"), Err(BoardError::Refused { code, .. }) if code == "busy"));
    session.command_when_ready("shaper on").unwrap();
}
