//! Homing of the unmodified release image: an axis that its step pulses move has a limit switch, which the
//! image sees at its pin.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use stillbeam::board::Session;
use stillbeam::board::serial::SerialBoard;
use stillbeam_host_tests::emulator::clock_cover::Region;
use stillbeam_host_tests::emulator::stand_in::{Moment, Registers};
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions};
use stillbeam_host_tests::machine_side::{Abreast, MachineSide, Mishaps};

const PATIENCE: Duration = Duration::from_secs(60);
/// The levels of port B, and the first general input's.
const LEVELS: Region = Region { base: 0x4002_0410, length: 4 };
const INPUT_1: u32 = 1 << 12;
const TICK_HZ: f64 = 4000.0;

const STEPS_PER_MM: f64 = 1000.0;
const EDGE_MM: f64 = -3.0;
const POSITION_MM: f64 = -40.0;
const APPROACH_MM_S: f64 = 50.0;
const CREEP_MM_S: f64 = 5.0;
const ACCELERATION_MM_S2: f64 = 4000.0;
const BACKOFF_MM: f64 = 0.5;

/// The axis, and the pin of its switch.
struct Axis {
    machine: Abreast,
    now: u64,
    lowest_mm: f64,
}

impl Registers for Axis {
    const OBSERVES: bool = true;

    fn read(&mut self, _: u32) -> u32 {
        let at_mm = self.machine.counts(self.now) as f64 / STEPS_PER_MM;
        self.lowest_mm = self.lowest_mm.min(at_mm);
        if at_mm <= EDGE_MM { INPUT_1 } else { 0 }
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

#[test]
fn the_image_finds_the_edge_of_its_limit_switch_and_counts_from_there() {
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

    let axis = Mutex::new(Axis { machine: Abreast::new(Arc::clone(&machine)), now: 0, lowest_mm: 0.0 });
    let setpoint_mm = emulator
        .standing_in(&[LEVELS], &axis, || {
            for line in [
                // What the emulator's flash holds is no settings.
                "settings confirm",
                "set move.velocity_mm_s 100",
                &format!("set move.acceleration_mm_s2 {ACCELERATION_MM_S2}"),
                "set pulses.kind step",
                &format!("set pulses.steps_per_mm {STEPS_PER_MM}"),
                "set input1.role limit_min",
                "set input1.active high",
                "set home.method limit_min",
                &format!("set home.approach_mm_s {APPROACH_MM_S}"),
                &format!("set home.creep_mm_s {CREEP_MM_S}"),
                &format!("set home.backoff_mm {BACKOFF_MM}"),
                &format!("set home.position_mm {POSITION_MM}"),
                "set emergency.input waived",
                "apply",
                "enable",
                "home",
            ] {
                session.command_when_ready(line).expect(line);
            }
            while line(&mut session, "reference") != "known" {
                assert_eq!(line(&mut session, "fault"), "none");
            }
            assert_eq!(line(&mut session, "state"), "rest");
            line(&mut session, "setpoint_nm").parse::<f64>().expect("a number") / 1e6
        })
        .expect("every access is served");
    let counted_mm = looked_at(&machine).counted().counts as f64 / STEPS_PER_MM;
    assert_eq!(looked_at(&machine).mishaps(), Mishaps::default());
    let expected_mm = counted_mm - EDGE_MM + POSITION_MM;
    let tolerance_mm = CREEP_MM_S / TICK_HZ + 2.0 / STEPS_PER_MM;
    println!("at {setpoint_mm} mm, by the steps at {expected_mm} mm");
    assert!((setpoint_mm - expected_mm).abs() <= tolerance_mm, "{setpoint_mm} {expected_mm}");
    assert!(counted_mm - EDGE_MM >= BACKOFF_MM - tolerance_mm, "{counted_mm}");
    let lowest_mm = looked_at(&axis).lowest_mm;
    let braking_mm =
        APPROACH_MM_S * APPROACH_MM_S / (2.0 * ACCELERATION_MM_S2) + 4.0 * APPROACH_MM_S / TICK_HZ;
    assert!(lowest_mm >= EDGE_MM - braking_mm, "as far as {lowest_mm}");
}
