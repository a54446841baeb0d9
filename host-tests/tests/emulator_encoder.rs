//! The encoder of the unmodified release image: an axis that its step pulses move is counted by the timer
//! that the image reads, gets stuck, and is pushed.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use stillbeam::board::Session;
use stillbeam::board::serial::SerialBoard;
use stillbeam_host_tests::emulator::clock_cover::Region;
use stillbeam_host_tests::emulator::stand_in::{Moment, Registers};
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions};
use stillbeam_host_tests::machine_side::{Abreast, MachineSide};

const PATIENCE: Duration = Duration::from_secs(60);
/// The counter of TIM8.
const COUNTER: Region = Region { base: 0x4001_0424, length: 4 };
const TICK_HZ: f64 = 4000.0;
/// Of steps and encoder alike.
const COUNTS_PER_MM: f64 = 1000.0;
const WINDOW_MM: f64 = 0.4;
const VELOCITY_MM_S: f64 = 20.0;
const ACCELERATION_MM_S2: f64 = 1000.0;
/// The counter begins here, so that it wraps on the way.
const BEGINNING: i64 = 65_500;

/// The axis, as the steps move it and the encoder sees it.
struct Axis {
    machine: Abreast,
    now: u64,
    /// Counts of the drive that were seen, and of the axis.
    followed: i64,
    at: i64,
    stuck: bool,
}

impl Registers for Axis {
    const OBSERVES: bool = true;

    fn read(&mut self, _: u32) -> u32 {
        let counts = self.machine.counts(self.now);
        if !self.stuck {
            self.at += counts - self.followed;
        }
        self.followed = counts;
        // Sixteen bits.
        ((BEGINNING + self.at) & 0xffff) as u32
    }

    fn write(&mut self, _: u32, _: u32) {}

    fn observe(&mut self, moment: Moment) {
        self.now = moment.clocks;
    }
}

fn looked_at<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().expect("no panic")
}

fn line(session: &mut Session, key: &str) -> String {
    session.command("status").expect("status").line(key).expect(key).to_owned()
}

fn millimetres(session: &mut Session, key: &str) -> f64 {
    line(session, key).parse::<f64>().expect("a number") / 1e6
}

fn wait_for(session: &mut Session, key: &str, value: &str) {
    while line(session, key) != value {}
}

/// What happens to the axis while somebody speaks to the board.
fn story(session: &mut Session, axis: &Mutex<Axis>) {
    for line in [
        "settings confirm",
        &format!("set move.velocity_mm_s {VELOCITY_MM_S}"),
        &format!("set move.acceleration_mm_s2 {ACCELERATION_MM_S2}"),
        "set pulses.kind step",
        &format!("set pulses.steps_per_mm {COUNTS_PER_MM}"),
        &format!("set encoder.counts_per_mm {COUNTS_PER_MM}"),
        &format!("set encoder.window_mm {WINDOW_MM}"),
        "set emergency.input waived",
        "apply",
        "enable",
        "move 2",
    ] {
        session.command_when_ready(line).expect(line);
    }
    let count_mm = 1.0 / COUNTS_PER_MM;
    wait_for(session, "state", "rest");
    assert_eq!(line(session, "fault"), "none");
    let encoder_mm = millimetres(session, "encoder_nm");
    assert!((encoder_mm - 2.0).abs() <= 2.0 * count_mm, "past the end of the counter: {encoder_mm}");

    looked_at(axis).stuck = true;
    session.command_when_ready("move 6").expect("it sets off");
    wait_for(session, "drive", "fault");
    assert_eq!(line(session, "fault"), "encoder");
    let behind_mm = millimetres(session, "setpoint_nm") - millimetres(session, "encoder_nm");
    let braking_mm = VELOCITY_MM_S * VELOCITY_MM_S / (2.0 * ACCELERATION_MM_S2);
    let most_mm = WINDOW_MM + braking_mm + 4.0 * VELOCITY_MM_S / TICK_HZ;
    assert!((WINDOW_MM..most_mm).contains(&behind_mm), "{behind_mm}, at most {most_mm}");

    // Free again, and pushed by hand while the drive is off.
    let mut pushed = looked_at(axis);
    pushed.stuck = false;
    pushed.at -= 700;
    let (at_mm, steps) = (pushed.at as f64 / COUNTS_PER_MM, pushed.followed);
    drop(pushed);
    session.command_when_ready("clear").expect("cleared");
    session.command_when_ready("enable").expect("enabled");
    wait_for(session, "drive", "enabled");
    let setpoint_mm = millimetres(session, "setpoint_nm");
    assert!((setpoint_mm - at_mm).abs() <= count_mm, "{setpoint_mm} for {at_mm}");
    assert_eq!(looked_at(axis).followed, steps, "it goes on from there, without a step");
    session.command_when_ready("move 0").expect("it goes back");
    wait_for(session, "state", "rest");
    assert_eq!(line(session, "fault"), "none");
    let encoder_mm = millimetres(session, "encoder_nm");
    let at_mm = looked_at(axis).at as f64 / COUNTS_PER_MM;
    assert!(at_mm.abs() <= 2.0 * count_mm && encoder_mm.abs() <= 2.0 * count_mm, "{at_mm} {encoder_mm}");
}

#[test]
fn the_image_follows_its_encoder_stops_when_that_does_not_and_begins_where_it_is() {
    let Some(image) = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from) else {
        println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
        return;
    };
    let machine = Arc::new(Mutex::new(MachineSide::new(TICK_HZ)));
    let heard = Arc::clone(&machine);
    let listener = Box::new(move |access| {
        let _a_test_that_has_panicked = heard.lock().map(|mut machine| machine.hear(access));
    });
    let options = EmulatorOptions { shift: 0, ..EmulatorOptions::default() };
    let mut emulator = Emulator::boot_heard_by(&image, &options, listener).expect("the image boots");
    let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
    let port = SerialBoard::open(&path).expect("the port opens");
    let mut session = Session::start_within(Box::new(port), PATIENCE).expect("the console answers");
    let axis = Mutex::new(Axis { machine: Abreast::new(machine), now: 0, followed: 0, at: 0, stuck: false });
    emulator.standing_in(&[COUNTER], &axis, || story(&mut session, &axis)).expect("every access is served");
}
