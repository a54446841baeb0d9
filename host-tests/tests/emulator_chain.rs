//! The unmodified release image on an emulated board, spoken to over its serial port with the command line's
//! own serial code: what a person would do, from two modes to a still beam.
//!
//! The image is named by STILLBEAM_IMAGE; `cargo xtask test` builds it and sets the variable.

use std::path::{Path, PathBuf};

use stillbeam::board::serial::SerialBoard;
use stillbeam::board::{BoardError, Session, StreamedMotion};
use stillbeam_firmware::telemetry::Activity;
use stillbeam_host_tests::bench::Bench;
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions, REST_LIMIT};
use stillbeam_plant::modes::clamped_modes;
use stillbeam_plant::{Mode, Model, PrescribedBase, ResidualVibration};

const TICK_RATE_HZ: f64 = 4000.0;

/// Slow enough that the emulated core can send a line of text per tick: 21 000 instructions each.
const EVERY_TICK_SHIFT: u8 = 0;

fn image() -> Option<PathBuf> {
    let image = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from);
    if image.is_none() {
        println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
    }
    image
}

fn boot(image: &Path, shift: u8) -> (Emulator, Session) {
    let options = EmulatorOptions { shift, ..EmulatorOptions::default() };
    let emulator = Emulator::boot(image, &options).expect("the image boots");
    let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
    let port = SerialBoard::open(&path).expect("the port opens");
    let session = Session::start(Box::new(port)).expect("the console answers");
    (emulator, session)
}

/// The beam that the shapers are for: the modes of the paper's testbed.
fn beam_modes() -> Vec<Mode> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/paper_beam.toml");
    let Model::BeamOnBase(model) = Model::read(&path).expect("the model file is read") else {
        panic!("the paper's testbed is a beam on a base");
    };
    clamped_modes(&model).expect("modes").iter().map(|mode| mode.to_mode()).collect()
}

fn shaper_settings(modes: &[Mode], shaper: &str) -> Vec<String> {
    let mut lines = Vec::new();
    for (number, mode) in modes.iter().enumerate() {
        let number = number + 1;
        lines.push(format!("set mode{number}.frequency_hz {}", mode.frequency_hz));
        lines.push(format!("set mode{number}.damping_ratio {}", mode.damping_ratio));
        lines.push(format!("set mode{number}.type {shaper}"));
    }
    lines.push("apply".to_owned());
    lines
}

/// Command and setpoint of every tick of a motion under std, in nanometres, from the tick before the command
/// changes to that of rest.
fn under_std(settings: &[String], motion: &str) -> Vec<(i32, i32)> {
    let mut bench = Bench::new();
    for line in settings {
        bench.accept(line);
    }
    bench.run_to_rest();
    bench.enable();
    bench.accept("stream on 1");
    bench.samples();
    bench.tick();
    bench.accept(motion);
    let mut pairs = Vec::new();
    loop {
        pairs.extend(bench.samples().iter().map(|sample| (sample.command.0, sample.setpoint.0)));
        if bench.activity() == Activity::Rest {
            let resting = pairs.iter().take_while(|(command_nm, _)| *command_nm == 0).count();
            return pairs.split_off(resting - 1);
        }
        bench.tick();
    }
}

/// The same of the board's samples; `start` is the last sample before the command changes.
fn of_board(motion: &StreamedMotion) -> Vec<(i32, i32)> {
    motion.samples[motion.start..].iter().map(|sample| (sample.command.0, sample.setpoint.0)).collect()
}

#[test]
fn two_modes_set_over_the_serial_port_leave_the_beam_still() {
    let Some(image) = image() else { return };
    let (_emulator, mut session) = boot(&image, EVERY_TICK_SHIFT);
    let modes = beam_modes();
    let unshaped = under_std(&[], "move 50");
    for shaper in ["zv", "zvd", "zvdd"] {
        let settings = shaper_settings(&modes, shaper);
        let mut applied = String::new();
        for line in &settings {
            applied = session.command_when_ready(line).expect(line).ok_line;
        }
        let mut bench = Bench::new();
        let mut expected = String::new();
        for line in &settings {
            expected = bench.accept(line);
        }
        assert_eq!(applied, expected, "the board runs the table that the host computes");

        session.enable_virtual_drive().expect("enabled");
        // An emulator on a busy computer comes to rest later than a board, for which a motion waits 20 s.
        session.wait_for_rest(REST_LIMIT).expect("rest before the move");
        let motion = session.run_motion("move 50", 1, 0.0, &mut |_| {}).expect("the move is streamed");
        let (board, host) = (of_board(&motion), under_std(&settings, "move 50"));
        assert!(host.len() > 1000 && board.len() >= host.len());
        assert_eq!(&board[..host.len()], host, "{shaper}: setpoints of the image and of the host");
        assert!(board[host.len()..].iter().all(|pair| *pair == (50_000_000, 50_000_000)));

        let left = percentage_vibration(&modes, &board, &unshaped);
        println!("{shaper} on the image: {:.1e} % and {:.1e} %", left[0], left[1]);
        assert!(left.iter().all(|percent| *percent < 0.05), "{shaper}: {left:?} %");
        session.wait_for_rest(REST_LIMIT).expect("rest before the way back");
        session.run_motion("move 0", 4, 0.0, &mut |_| {}).expect("and back");
    }
}

fn percentage_vibration(modes: &[Mode], shaped: &[(i32, i32)], unshaped: &[(i32, i32)]) -> Vec<f64> {
    let residual = |pairs: &[(i32, i32)]| {
        let setpoints_m: Vec<f64> =
            pairs.iter().map(|(_, setpoint_nm)| f64::from(*setpoint_nm) * 1e-9).collect();
        let plant = PrescribedBase::from_modes(modes.to_vec(), None, TICK_RATE_HZ, 0.0).expect("a plant");
        ResidualVibration::after(plant, &setpoints_m).expect("a residual")
    };
    residual(shaped).relative_to(&residual(unshaped)).modes_pct
}

/// Sines in single precision, tapers and phases: the parts that could differ between processors.
#[test]
fn sweeps_and_stops_are_those_of_the_host_bit_for_bit() {
    let Some(image) = image() else { return };
    let (_emulator, mut session) = boot(&image, EVERY_TICK_SHIFT);
    session.enable_virtual_drive().expect("enabled");
    for motion in ["sweep exponential 0.5 40 2 0.05", "sweep linear 20 1 1.5 0.2", "move -33.3"] {
        let streamed = session.run_motion(motion, 1, 0.0, &mut |_| {}).expect("streamed");
        let (board, host) = (of_board(&streamed), under_std(&[], motion));
        assert!(host.len() > 100 && board.len() >= host.len());
        assert_eq!(&board[..host.len()], host, "{motion}");
    }
}

/// The timer's period at other rates than the default, and everything that is computed from it: profile,
/// table, outputs. At 20 kHz and this shift the processor has 4200 instructions per tick, too few to send a
/// sample of each; the board has 8400 cycles.
#[test]
fn at_other_tick_rates_a_shaped_move_is_the_hosts_bit_for_bit() {
    let Some(image) = image() else { return };
    let (_emulator, mut session) = boot(&image, EVERY_TICK_SHIFT);
    for (rate_hz, decimation) in [(500.0, 1), (10_000.0, 1), (20_000.0, 2)] {
        let begun = std::time::Instant::now();
        let mut settings = vec![format!("set tick.rate_hz {rate_hz}")];
        settings.extend(["set move.profile s_curve".to_owned(), "set mode2.type off".to_owned()]);
        settings.extend(shaper_settings(&[Mode { frequency_hz: 13.0, ..beam_modes()[0].clone() }], "zvdd"));
        session.disable_drive().expect("disabled");
        for line in &settings {
            session.command_when_ready(line).expect(line);
        }
        session.enable_virtual_drive().expect("enabled");
        assert_eq!(session.tick_hz().expect("info"), rate_hz);
        let motion = session.run_motion("move 5", decimation, 0.0, &mut |_| {}).expect("streamed");
        let (board, host) = (of_board(&motion), under_std(&settings, "move 5"));
        let decimation = decimation as usize;
        assert!(host.len() > 80 && board.len() * decimation >= host.len());
        // Where between two samples the command began to change.
        let phases = (0..decimation).filter(|phase| {
            board.iter().enumerate().all(|(index, pair)| {
                let tick = (index * decimation).saturating_sub(*phase);
                *pair == host.get(tick).copied().unwrap_or((5_000_000, 5_000_000))
            })
        });
        assert_eq!(phases.count(), 1, "{rate_hz} Hz: setpoints of the image and of the host");
        let status = session.command("status").expect("status");
        println!(
            "{rate_hz} Hz: {} ticks in {:.1} s, {:?}",
            host.len(),
            begun.elapsed().as_secs_f64(),
            status.line("counters")
        );
        for none in ["missed_tick=0", "late_tick=0", "sample_lost=0"] {
            assert!(status.line("counters").is_some_and(|counters| counters.contains(none)), "{status:?}");
        }
        session.command_when_ready("move 0").expect("accepted");
        session.wait_for_rest(REST_LIMIT).expect("comes to rest");
    }
}

#[test]
fn refusals_come_over_the_wire_and_change_nothing() {
    let Some(image) = image() else { return };
    let (_emulator, mut session) = boot(&image, EmulatorOptions::default().shift);
    session.enable_virtual_drive().expect("enabled");
    let before = session.command("get").expect("get").lines;
    for (line, code, name) in [
        ("set mode1.frequency_hz 0", "range", "mode1.frequency_hz"),
        ("set mode1.damping_ratio 1", "range", "mode1.damping_ratio"),
        ("set mode1.type boxcar", "syntax", "mode1.type"),
        ("set mode9.type zv", "unknown-name", "mode9.type"),
        ("move 1e6", "range", "move"),
        ("jump", "unknown-command", "jump"),
    ] {
        match session.command(line) {
            Err(BoardError::Refused { code: found_code, name: found_name, .. }) => {
                assert_eq!((found_code.as_str(), found_name.as_str()), (code, name), "{line}");
            }
            answer => panic!("{line}: {answer:?}"),
        }
    }
    assert_eq!(session.command("get").expect("get").lines, before);

    for line in ["set mode1.frequency_hz 0.05", "set mode1.type zvd"] {
        session.command(line).expect(line);
    }
    let Err(BoardError::Refused { code, name, .. }) = session.command("apply") else {
        panic!("a delay longer than the memory was accepted");
    };
    assert_eq!((code.as_str(), name.as_str()), ("memory", "shaper"));
    assert_eq!(session.command("info").expect("info").line("shaper_modes"), Some("0"));
}

#[test]
fn a_table_changed_in_the_middle_of_a_move_neither_jumps_nor_misses() {
    let Some(image) = image() else { return };
    let (_emulator, mut session) = boot(&image, EmulatorOptions::default().shift);
    for line in shaper_settings(&beam_modes(), "zvdd") {
        session.command_when_ready(&line).expect("accepted");
    }
    for line in ["set move.velocity_mm_s 4", "apply"] {
        session.command_when_ready(line).expect("accepted");
    }
    session.enable_virtual_drive().expect("enabled");
    session.command_when_ready("move 50").expect("accepted");
    session.command("shaper off").expect("taken while moving");
    assert_eq!(session.command("status").expect("status").line("state"), Some("moving"));
    session.command_when_ready("shaper on").expect("taken when the first has run out");
    let position_nm = session.wait_for_rest(REST_LIMIT).expect("comes to rest");
    assert_eq!(position_nm, 50_000_000);
    let status = session.command("status").expect("status");
    assert_eq!(status.line("setpoint_nm"), Some("50000000"));
}

/// The UART driver's handling of "transmission complete" once lost a received byte in a few hundred commands,
/// when one came just as a reply ended.
#[test]
fn no_byte_is_lost_when_commands_follow_replies_at_once() {
    let Some(image) = image() else { return };
    let (_emulator, mut session) = boot(&image, EmulatorOptions::default().shift);
    for streaming in ["stream off", "stream on 40"] {
        session.command(streaming).expect(streaming);
        for number in 0..1500 {
            let value = f64::from(number) / 8.0 + 1.0;
            let reply = session.command(&format!("set mode1.frequency_hz {value}"));
            let reply = reply.unwrap_or_else(|error| panic!("command {number}, {streaming}: {error}"));
            assert_eq!(reply.ok_line, format!("ok set mode1.frequency_hz = {value}; 'apply' to use it"));
        }
    }
}

/// The emulator has no flash controller: what is written vanishes. A `save` that said `ok` would be a lie
/// there.
#[test]
fn a_save_that_the_flash_does_not_keep_is_reported_and_the_machine_goes_on() {
    let Some(image) = image() else { return };
    let (_emulator, mut session) = boot(&image, EmulatorOptions::default().shift);
    let info = session.command("info").expect("info");
    assert_eq!(info.line("settings_loaded"), Some("0"));
    let store = info.line("settings_store").unwrap_or_default().to_owned();
    assert!(store.starts_with("the settings region cannot be read"), "{store}");
    for line in ["set move.velocity_mm_s 100", "apply"] {
        session.command(line).expect(line);
    }
    session.command("settings confirm").expect("what runs is what is wanted");
    match session.command("save") {
        Err(BoardError::Refused { code, name, reason, .. }) => {
            assert_eq!((code.as_str(), name.as_str()), ("flash", "save"));
            assert!(reason.starts_with("what was written does not read back"), "{reason}");
        }
        answer => panic!("{answer:?}"),
    }
    session.enable_virtual_drive().expect("enabled");
    session.command("move 1").expect("accepted");
    assert_eq!(session.wait_for_rest(REST_LIMIT).expect("rest"), 1_000_000);
}

/// Every tick at 4 kHz. At this shift the processor has 5250 instructions per tick; the board's has 42 000
/// cycles. What the line has room for is another matter, and a matter of arithmetic:
/// tests/property_frames.rs.
#[test]
fn every_tick_can_be_streamed_in_frames() {
    let Some(image) = image() else { return };
    let (_emulator, mut session) = boot(&image, 2);
    for line in shaper_settings(&beam_modes(), "zvdd") {
        session.command_when_ready(&line).expect("accepted");
    }
    session.enable_virtual_drive().expect("enabled");
    let motion = session.record_motion("move 20", 1, 0.2, &mut |_| {}).expect("streamed");
    assert_eq!(motion.gaps, [], "of {} samples from tick {}", motion.samples.len(), motion.samples[0].tick);
    assert!(motion.samples.len() > 6000, "{} samples", motion.samples.len());
    let ticks: Vec<u32> = motion.samples.iter().map(|sample| sample.tick).collect();
    assert!(ticks.windows(2).all(|pair| pair[1] == pair[0].wrapping_add(1)));
    assert_eq!(motion.damaged_frames, 0);
    let activities: Vec<Activity> = motion.samples.iter().map(|sample| sample.activity).collect();
    for activity in [Activity::Rest, Activity::Moving, Activity::Settling] {
        assert!(activities.contains(&activity), "{activity:?}");
    }
    let status = session.command("status").expect("status");
    assert_eq!(status.line("dropped_samples"), Some("0"));
}
