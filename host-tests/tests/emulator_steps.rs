//! Step pulses of the unmodified release image, counted edge by edge by a model of the timer that makes them.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use stillbeam::board::Session;
use stillbeam::board::serial::SerialBoard;
use stillbeam_host_tests::emulator::step_cover::{self, Covered};
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions, REST_LIMIT};
use stillbeam_host_tests::step_timer::StepTimer;

const PATIENCE: Duration = Duration::from_secs(60);

fn image() -> Option<PathBuf> {
    let image = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from);
    if image.is_none() {
        println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
    }
    image
}

/// Runs the lines with every pulse counted; the timer at the end and the setpoint in steps.
fn count(kind: &str, lines: &[&str]) -> Option<(StepTimer, f64)> {
    let image = image()?;
    let mut emulator = Emulator::boot(&image, &EmulatorOptions::default()).expect("the image boots");
    let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
    let port = SerialBoard::open(&path).expect("the port opens");
    let mut session = Session::start_within(Box::new(port), PATIENCE).expect("the console answers");
    for line in [
        &format!("set pulses.kind {kind}"),
        "set pulses.steps_per_mm 1000",
        "set move.velocity_mm_s 100",
        "set move.acceleration_mm_s2 2000",
        "apply",
    ] {
        session.command_when_ready(line).expect(line);
    }
    session.enable_virtual_drive().expect("enabled");
    let end = Arc::new(AtomicBool::new(false));
    let client = emulator.debug().expect("a link");
    let server = std::thread::spawn({
        let end = Arc::clone(&end);
        let covered = Covered { quadrature: kind == "quadrature", clocks_per_tick: 42_000 };
        move || step_cover::serve(client, covered, &end)
    });
    for line in lines {
        session.command_when_ready(line).expect(line);
    }
    let setpoint_nm = session.wait_for_rest(REST_LIMIT).expect("rest");
    // What the last tick asked for is made.
    session.command("status").expect("status");
    end.store(true, Ordering::Relaxed);
    let timer = server.join().expect("no panic").expect("served");
    Some((timer, f64::from(setpoint_nm) * 1e-3))
}

#[test]
fn every_step_of_a_move_and_a_stop_is_made_and_harmless_settings_cut_no_train() {
    for kind in ["step", "quadrature"] {
        let counted = count(
            kind,
            &[
                "move 30",
                "set fault.limit category_0",
                "apply",
                "set fault.limit category_2",
                "apply",
                "set stream.decimation 9",
                "apply",
                "stop",
                "move 5",
                "move 0.5",
            ],
        );
        let Some((timer, setpoint)) = counted else { return };
        let counted = timer.counted();
        println!("{kind}: {counted:?}, setpoint {setpoint} steps");
        assert_eq!((counted.cut, counted.ambiguous), (0, 0), "{kind}");
        let per_step = if kind == "quadrature" { 2 } else { 1 };
        assert_eq!(counted.counts, per_step * setpoint.round() as i64, "{kind}");
        assert!(counted.edges > 5000, "it went there and back: {counted:?}");
        let [a, b] = timer.outputs();
        assert!(a == b || kind == "step", "A is B at rest");
    }
}
