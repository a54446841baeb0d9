//! Steps of the unmodified release image, counted edge by edge by the drive's side of the step timer, and the
//! lines of drive and brake beside them: through moves, applies, stops, an emergency, a drive that is enabled
//! again and another tick rate.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use stillbeam::board::serial::SerialBoard;
use stillbeam::board::{ByteLink as _, Session};
use stillbeam_firmware::real_time::RealTimeByte;
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions, REST_LIMIT};
use stillbeam_host_tests::machine_side::{MachineSide, Mishaps, TickRecord};

const STEPS_PER_MM: f64 = 200.0;
/// Every tick is streamed, and the tick is slow enough that a person's commands come in the middle of a
/// motion.
const TICK_HZ: f64 = 1000.0;
/// A move of 20 mm lasts 1000 s of the board's time. That runs on while this machine has not yet sent or
/// heard what it waits for, a hundred seconds of it in a few seconds of the clock where other work is going
/// on.
const SLOW: &str = "set move.velocity_mm_s 0.02";
const PATIENCE: Duration = Duration::from_secs(60);

/// The board, its console, and the machine behind its pins.
struct Board {
    session: Session,
    /// For bytes that work at once.
    second: SerialBoard,
    machine: Arc<Mutex<MachineSide>>,
    counts_per_mm: f64,
    _emulator: Emulator,
}

impl Board {
    /// A board whose steps are `kind` and whose drive is enabled.
    fn boot(kind: &str) -> Option<Self> {
        let Some(image) = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from) else {
            println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
            return None;
        };
        let machine = Arc::new(Mutex::new(MachineSide::new(TICK_HZ)));
        let heard = Arc::clone(&machine);
        let options = EmulatorOptions { shift: 0, ..EmulatorOptions::default() };
        // A test that has panicked with the machine in its hands has said all there is to say.
        let listener = Box::new(move |access| _ = heard.lock().map(|mut machine| machine.hear(access)));
        let emulator = Emulator::boot_heard_by(&image, &options, listener).expect("the image boots");
        let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
        let port = SerialBoard::open(&path).expect("the port opens");
        let second = port.try_clone().expect("a second handle");
        let session = Session::start_within(Box::new(port), PATIENCE).expect("the console answers");
        // A step of quadrature is one edge of A and one of B.
        let counts_per_mm = if kind == "quadrature" { 2.0 * STEPS_PER_MM } else { STEPS_PER_MM };
        let mut board = Self { session, second, machine, counts_per_mm, _emulator: emulator };
        board.say(&[
            &format!("set tick.rate_hz {TICK_HZ}"),
            &format!("set pulses.kind {kind}"),
            &format!("set pulses.steps_per_mm {STEPS_PER_MM}"),
            "set move.velocity_mm_s 60",
            "set move.acceleration_mm_s2 2000",
            "set emergency.input waived",
            "apply",
        ]);
        board.session.enable_virtual_drive().expect("enabled");
        Some(board)
    }

    fn say(&mut self, lines: &[&str]) {
        for line in lines {
            self.session.command_when_ready(line).expect(line);
        }
    }

    /// What `status` says under this word.
    fn status(&mut self, key: &str) -> String {
        let status = self.session.command("status").expect("status");
        status.line(key).expect(key).to_owned()
    }

    /// The machine, when it has seen all that the board has done until now.
    fn machine(&mut self) -> MutexGuard<'_, MachineSide> {
        let tick: usize = self.status("tick").parse().expect("a number");
        let deadline = Instant::now() + PATIENCE;
        loop {
            let machine = self.machine.lock().expect("no panic");
            if machine.ticks().len() > tick {
                break;
            }
            drop(machine);
            assert!(Instant::now() < deadline, "the emulator tells nothing any more");
            std::thread::sleep(Duration::from_millis(5));
        }
        self.machine.lock().expect("no panic")
    }

    fn last_tick(&mut self) -> TickRecord {
        *self.machine().ticks().last().expect("it has ticked")
    }

    /// Waits until the setpoint is some steps from where it was.
    fn wait_for_motion(&mut self) {
        let mut setpoint_nm = || self.status("setpoint_nm").parse::<i32>().expect("a number");
        let before = setpoint_nm();
        while (setpoint_nm() - before).abs() < 20_000 {}
    }

    fn rest_nm(&mut self) -> i32 {
        self.session.wait_for_rest(REST_LIMIT).expect("rest")
    }

    /// Does `work`, which moves one way, and checks that every edge of it was one that way, up to the
    /// count that belongs to the setpoint at its end.
    fn one_way(&mut self, what: &str, work: impl FnOnce(&mut Self)) {
        let before = self.machine().counted();
        work(self);
        let setpoint_nm: f64 = self.status("setpoint_nm").parse().expect("a number");
        let wanted = (setpoint_nm * 1e-6 * self.counts_per_mm / 2.0).round() as i64 * 2;
        let after = self.machine().counted();
        assert!((after.counts - wanted).abs() <= 2, "{what}: {after:?} for {setpoint_nm} nm");
        let moved = (after.counts - before.counts).unsigned_abs();
        assert!(moved > 0, "{what}: nothing moved");
        assert_eq!(after.edges - before.edges, moved, "{what}: edges, none of which goes back");
        let machine = self.machine();
        assert_eq!(machine.mishaps(), Mishaps::default(), "{what}");
        let [a, b] = machine.step_outputs();
        assert_eq!(a, b, "{what}: A and B, or the step, at rest");
    }
}

/// Ticks of a machine that a fault holds.
const HELD: usize = 20;

/// The count of every tick is that of the tick's setpoint, and so is the code of the analog output.
fn every_tick_is_the_setpoints(board: &mut Board) {
    let motion = board.session.run_motion("move 12", 1, 0.0, &mut |_| {}).expect("streamed");
    let counts_per_mm = board.counts_per_mm;
    let steps = board.counts_per_mm / STEPS_PER_MM;
    let machine = board.machine();
    let mut moving = 0;
    for sample in &motion.samples {
        let record = machine.ticks()[sample.tick as usize];
        let mm = f64::from(sample.setpoint.0) * 1e-6;
        // To half a step, and to half a code of 1799 for 250 mm.
        let short = record.counts as f64 - mm * counts_per_mm;
        assert!(short.abs() <= 0.5001 * steps, "{short} counts in tick {}", sample.tick);
        let code = 2048.0 + mm * 1799.0 / 250.0;
        assert!((f64::from(record.analog) - code).abs() <= 0.5001, "{record:?} for {code}");
        assert!(record.enabled && record.brake_open);
        assert_eq!(record.in_position, sample.activity.name() == "rest", "in tick {}", sample.tick);
        assert_eq!(record.charge_pump, sample.tick % 2 == 0, "it changes with every tick");
        moving += usize::from(sample.activity.name() == "moving");
    }
    assert!(moving > 200, "{moving} ticks of a motion");
}

fn every_edge_is_the_setpoints(kind: &str) {
    let Some(mut board) = Board::boot(kind) else { return };
    board.one_way("a move", every_tick_is_the_setpoints);

    board.one_way("settings applied in a move", |board| {
        board.say(&[
            "set move.velocity_mm_s 0.25",
            "apply",
            "move 20",
            "set fault.limit category_0",
            "apply",
        ]);
        assert_eq!(board.status("state"), "moving");
        board.say(&["set mode1.type zvd", "set mode1.frequency_hz 30", "apply"]);
        assert_eq!(board.rest_nm(), 20_000_000);
    });

    board.one_way("a stop", |board| {
        board.say(&[SLOW, "set mode1.type off", "apply", "move 0"]);
        board.wait_for_motion();
        board.second.write_all(&[RealTimeByte::STOP]).expect("written");
        let rest_nm = board.rest_nm();
        assert!((1..20_000_000).contains(&rest_nm), "stopped on the way: {rest_nm}");
    });

    board.one_way("an emergency", |board| {
        board.say(&["move 40"]);
        board.wait_for_motion();
        board.say(&["emergency"]);
        while board.status("drive") != "fault" {}
        // The ticks before the fault are none that a fault held.
        let seen = board.machine().ticks().len();
        while board.machine().ticks().len() < seen + HELD {
            board.status("drive");
        }
        let last = board.last_tick();
        assert!(!last.enabled && !last.brake_open && !last.in_position, "{last:?}");
        let held: Vec<bool> =
            board.machine().ticks().iter().rev().take(HELD).map(|t| t.charge_pump).collect();
        assert_eq!(held, [false; HELD], "it stands still while a fault holds the machine");
    });

    board.one_way("enabled again", |board| {
        board.say(&["clear"]);
        board.session.enable_virtual_drive().expect("enabled");
        let last = board.last_tick();
        assert!(last.enabled && last.brake_open, "{last:?}");
        board.say(&["set move.velocity_mm_s 60", "apply", "move 45"]);
        assert_eq!(board.rest_nm(), 45_000_000);
    });

    board.session.disable_drive().expect("off");
    board.machine().set_tick_rate(500.0);
    board.say(&["set tick.rate_hz 500", "set pulses.width_us 3", "apply"]);
    board.one_way("another tick rate and another pulse", |board| {
        board.session.enable_virtual_drive().expect("enabled");
        board.say(&["move 14"]);
        assert_eq!(board.rest_nm(), 14_000_000);
    });
    assert_eq!(board.status("fault"), "none");
}

#[test]
fn every_edge_of_step_and_direction_is_the_setpoints() {
    every_edge_is_the_setpoints("step");
}

#[test]
fn every_edge_of_quadrature_is_the_setpoints() {
    every_edge_is_the_setpoints("quadrature");
}
