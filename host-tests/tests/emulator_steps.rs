//! Steps of the unmodified release image, counted edge by edge by the drive's side of the step timer, and the lines of drive
//! and brake beside them: through moves, applies, stops, an emergency and a drive that is enabled again.

use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Duration;

use stillbeam::board::serial::SerialBoard;
use stillbeam::board::{ByteLink, Session};
use stillbeam_firmware::real_time::RealTimeByte;
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions, REST_LIMIT};
use stillbeam_host_tests::machine_side::MachineSide;

const STEPS_PER_MM: f64 = 200.0;

/// A port that is in no hurry: each access of the image to what is stood in for stops it.
struct Unhurried(SerialBoard);

impl ByteLink for Unhurried {
    fn name(&self) -> &str {
        self.0.name()
    }

    fn write_all(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.0.write_all(bytes)
    }

    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> std::io::Result<usize> {
        self.0.read(buffer, patience)
    }

    fn clock(&self) -> Duration {
        self.0.clock() / 10
    }

    fn pause(&mut self, duration: Duration) {
        self.0.pause(duration);
    }
}

fn port(emulator: &Emulator) -> SerialBoard {
    let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
    SerialBoard::open(&path).expect("the port opens")
}

/// Boots the image and does `work` with its console and its machine.
fn with_machine(work: impl FnOnce(&mut Session, &mut SerialBoard, &Mutex<MachineSide>)) {
    let Some(image) = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from) else {
        println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
        return;
    };
    let mut emulator = Emulator::boot(&image, &EmulatorOptions::default()).expect("the image boots");
    let first = port(&emulator);
    let mut second = first.try_clone().expect("a second handle");
    let mut session = Session::start(Box::new(Unhurried(first))).expect("the console answers");
    let machine = Mutex::new(MachineSide::default());
    emulator
        .standing_in(&MachineSide::REGIONS, &machine, || work(&mut session, &mut second, &machine))
        .expect("every access is served");
}

/// The drive's count, and all edges that made it.
fn counted(machine: &Mutex<MachineSide>) -> (i64, u64) {
    let counted = machine.lock().expect("no panic").counted();
    (counted.counts, counted.edges)
}

/// The count that belongs to the setpoint that `status` says, at rest.
fn wanted(session: &mut Session, counts_per_mm: f64) -> i64 {
    let status = session.command("status").expect("status");
    let nm: f64 = status.line("setpoint_nm").expect("a setpoint").parse().expect("a number");
    (nm * 1e-6 * counts_per_mm).round() as i64
}

fn send_all(session: &mut Session, lines: &[&str]) {
    for line in lines {
        session.command_when_ready(line).expect(line);
    }
}

/// What every train of steps has to be, at any time.
fn assert_clean(machine: &Mutex<MachineSide>, what: &str) {
    let machine = machine.lock().expect("no panic");
    let counted = machine.counted();
    assert_eq!((counted.cut, counted.ambiguous), (0, 0), "{what}: trains cut, edges without a meaning");
    assert_eq!(machine.turned_in_train(), 0, "{what}: the direction changed within a train");
    assert_eq!(machine.edges_while_off(), 0, "{what}: edges while the drive is off");
}

/// Does `work`, which moves one way, and checks that every edge since was one that way.
fn one_way(
    session: &mut Session,
    machine: &Mutex<MachineSide>,
    counts_per_mm: f64,
    what: &str,
    work: impl FnOnce(&mut Session),
) -> i64 {
    let (count, edges) = counted(machine);
    work(session);
    let rest = wanted(session, counts_per_mm);
    let (count_after, edges_after) = counted(machine);
    assert_eq!(count_after, rest, "{what}: the drive's count, and the setpoint's");
    let moved = (count_after - count).unsigned_abs();
    assert_eq!(edges_after - edges, moved, "{what}: edges, of which none goes back");
    assert_clean(machine, what);
    moved as i64
}

fn every_edge_is_the_setpoints(kind: &str) {
    // A step of quadrature is one edge of A and one of B.
    let counts_per_mm = if kind == "quadrature" { 2.0 * STEPS_PER_MM } else { STEPS_PER_MM };
    with_machine(|session, second, machine| {
        let kind = format!("set pulses.kind {kind}");
        send_all(
            session,
            &[
                "set tick.rate_hz 1000",
                &kind,
                "set pulses.steps_per_mm 200",
                "set move.velocity_mm_s 60",
                "set move.acceleration_mm_s2 2000",
                "set emergency.input waived",
                "apply",
            ],
        );
        session.enable_virtual_drive().expect("enabled");
        assert!(machine.lock().expect("no panic").is_enabled());

        let moved = one_way(session, machine, counts_per_mm, "settings applied in a move", |session| {
            send_all(session, &["move 12", "set fault.limit category_0", "apply"]);
            assert_eq!(session.command("status").expect("status").line("state"), Some("moving"));
            send_all(session, &["set mode1.type zvd", "set mode1.frequency_hz 30", "apply"]);
            assert_eq!(session.wait_for_rest(REST_LIMIT).expect("rest"), 12_000_000);
        });
        assert_eq!(moved, (12.0 * counts_per_mm) as i64);

        one_way(session, machine, counts_per_mm, "a stop", |session| {
            send_all(session, &["set mode1.type off", "apply", "move 0"]);
            second.write_all(&[RealTimeByte::STOP]).expect("written");
            let rest_nm = session.wait_for_rest(REST_LIMIT).expect("rest");
            assert!((1..12_000_000).contains(&rest_nm), "stopped on the way: {rest_nm}");
        });

        one_way(session, machine, counts_per_mm, "an emergency", |session| {
            send_all(session, &["move 15", "emergency"]);
            session.disable_drive().expect("off");
            assert!(!machine.lock().expect("no panic").is_enabled(), "the drive's line");
        });

        one_way(session, machine, counts_per_mm, "enabled again", |session| {
            session.command_when_ready("clear").expect("cleared");
            session.enable_virtual_drive().expect("enabled");
            send_all(session, &["move 20"]);
            assert_eq!(session.wait_for_rest(REST_LIMIT).expect("rest"), 20_000_000);
        });
        assert_eq!(machine.lock().expect("no panic").enables(), 2);

        // At another timing from the same place on.
        session.disable_drive().expect("off");
        send_all(session, &["set tick.rate_hz 500", "set pulses.width_us 3", "apply"]);
        one_way(session, machine, counts_per_mm, "at another tick rate", |session| {
            session.enable_virtual_drive().expect("enabled");
            send_all(session, &["move 14"]);
            assert_eq!(session.wait_for_rest(REST_LIMIT).expect("rest"), 14_000_000);
        });
    });
}

#[test]
fn every_edge_of_step_and_direction_is_the_setpoints() {
    every_edge_is_the_setpoints("step");
}

#[test]
fn every_edge_of_quadrature_is_the_setpoints() {
    every_edge_is_the_setpoints("quadrature");
}

/// The encoder's timer gets what the step timer makes: steps out, counts in.
#[test]
fn an_encoder_wired_to_the_steps_reads_the_setpoint() {
    with_machine(|session, _, machine| {
        send_all(
            session,
            &[
                "set tick.rate_hz 1000",
                "set pulses.kind quadrature",
                "set pulses.steps_per_mm 200",
                "set encoder.counts_per_mm 400",
                "set encoder.window_mm 1",
                "set emergency.input waived",
                "apply",
            ],
        );
        session.enable_virtual_drive().expect("enabled");
        for to_mm in [3.0, -2.0] {
            send_all(session, &[&format!("move {to_mm}")]);
            session.wait_for_rest(REST_LIMIT).expect("rest");
            let status = session.command("status").expect("status");
            let encoder_nm: f64 = status.line("encoder_nm").expect("an encoder").parse().expect("a number");
            assert!((encoder_nm * 1e-6 - to_mm).abs() <= 0.0026, "{encoder_nm} nm at {to_mm} mm");
            assert_clean(machine, "with an encoder");
        }
    });
}

/// The table of `selftest` with jumpers, and without.
#[test]
fn the_board_tests_itself_and_says_in_a_table_what_it_found() {
    with_machine(|session, _, machine| {
        session.command("position set 0").expect("said");
        let reply = session.command("selftest").expect("tested");
        println!("{}", reply.lines.join("\n"));
        assert_eq!(reply.ok_line, "ok selftest passed=8 failed=0");
        let rows: Vec<Vec<&str>> =
            reply.lines.iter().map(|line| line.split_ascii_whitespace().collect()).collect();
        assert_eq!(rows[0], ["test", "name", "least", "most", "found", "verdict"]);
        assert_eq!(rows[2], ["test", "train_up_counts", "400", "400", "400", "ok"]);
        assert_eq!(rows[5], ["test", "step_down_counts", "-2", "-2", "-2", "ok"]);
        let counted = machine.lock().expect("no panic").counted();
        assert_eq!((counted.counts, counted.cut, counted.ambiguous), (0, 0, 0), "there and back");

        machine.lock().expect("no panic").jumpers_missing = true;
        let reply = session.command("selftest").expect("tested");
        assert_eq!(reply.ok_line, "ok selftest passed=4 failed=4");
        assert!(reply.lines.iter().any(|line| line.ends_with("0 FAILED")), "{:?}", reply.lines);
        // It is not for a drive that runs.
        machine.lock().expect("no panic").jumpers_missing = false;
        session.enable_virtual_drive().expect("enabled");
        session.command("selftest").expect_err("refused");
    });
}

/// Others are told that the machine stands, and that all is well.
#[test]
fn the_lines_in_position_and_charge_pump_follow_the_machine() {
    with_machine(|session, _, machine| {
        let pump = || {
            machine.lock().expect("no panic").take_pump_edges();
            std::thread::sleep(Duration::from_millis(300));
            machine.lock().expect("no panic").take_pump_edges()
        };
        let in_position = || machine.lock().expect("no panic").is_in_position();
        send_all(session, &["set move.velocity_mm_s 0.01", "set emergency.input waived", "apply"]);
        assert!(!in_position(), "the drive is off");
        let (edges, ticks) = pump();
        assert!(ticks > 20 && edges == ticks, "{edges} edges in {ticks} ticks");
        session.enable_virtual_drive().expect("enabled");
        assert!(in_position());
        send_all(session, &["move 1"]);
        assert!(!in_position(), "it moves");
        send_all(session, &["stop"]);
        session.wait_for_rest(REST_LIMIT).expect("rest");
        assert!(in_position());
        send_all(session, &["emergency"]);
        session.disable_drive().expect("off");
        assert!(!in_position(), "a fault");
        assert_eq!(pump().0, 0, "no edge while a fault holds the machine");
    });
}
