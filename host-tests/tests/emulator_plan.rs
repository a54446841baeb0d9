//! The shortest move for the paper's beam: solved on the host, sent to the unmodified image over its serial
//! port, played there, and felt by modes at the edges of their boxes.

use std::path::{Path, PathBuf};

use stillbeam::board::serial::SerialBoard;
use stillbeam::board::{BoardError, Session};
use stillbeam_firmware::console::upload::MAX_FRAME_BYTES;
use stillbeam_firmware::motion::pieces::MAX_PIECES;
use stillbeam_firmware::telemetry::Activity;
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions, REST_LIMIT};
use stillbeam_host_tests::played_plans::{begin, frame};
use stillbeam_plant::modes::clamped_modes;
use stillbeam_plant::{Mode, Model, PrescribedBase, ResidualVibration};
use stillbeam_shape::{BoardPlan, ModeBox, MoveBounds, MoveRequest, PlayedMove};

const RATE_HZ: f64 = 4000.0;
const TOLERANCE: f64 = 0.02;
const BOX: f64 = 0.05;

fn boot() -> Option<(Emulator, Session)> {
    let Some(image) = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from) else {
        println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
        return None;
    };
    // Slow enough that the emulated core can send a line of text per tick.
    let options = EmulatorOptions { shift: 0, ..EmulatorOptions::default() };
    let emulator = Emulator::boot(&image, &options).expect("the image boots");
    let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
    let port = SerialBoard::open(&path).expect("the port opens");
    let mut session = Session::start(Box::new(port)).expect("the console answers");
    session.enable_virtual_drive().expect("enabled");
    Some((emulator, session))
}

fn boxes() -> Vec<ModeBox> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/paper_beam.toml");
    let Model::BeamOnBase(model) = Model::read(&path).expect("the model file is read") else {
        panic!("the paper's testbed is a beam on a base");
    };
    let modes = clamped_modes(&model).expect("modes");
    let around =
        |mode: Mode| ModeBox::around(mode.frequency_hz, mode.damping_ratio, BOX, BOX).expect("a box");
    modes.iter().map(|mode| around(mode.to_mode())).collect()
}

/// 50 mm within the limits that the board comes with.
fn planned(reversing: bool) -> PlayedMove {
    let bounds = MoveBounds { velocity_m_s: 0.5, acceleration_m_s2: 5.0, jerk_m_s3: 1000.0 };
    let request = MoveRequest {
        distance_m: 0.05,
        bounds,
        reversing,
        modes: boxes(),
        tolerance: TOLERANCE,
        rate_hz: RATE_HZ,
    };
    request.solve().expect("solved")
}

/// Every tick of `play`, from the tick before the command changes.
fn played(session: &mut Session, play: &str) -> Vec<(i64, i64)> {
    let motion = session.run_motion(play, 1, 0.0, &mut |_| {}).expect("streamed");
    assert!(motion.samples.iter().any(|sample| sample.activity == Activity::Playing));
    let pair = |nm: (i32, i32)| (i64::from(nm.0), i64::from(nm.1));
    motion.samples[motion.start..].iter().map(|sample| pair((sample.command.0, sample.setpoint.0))).collect()
}

/// The largest residual of a mode at the corners and edges of its box, as a fraction of a step's, simulated.
fn worst(setpoints_nm: &[i64], area: &ModeBox) -> f64 {
    let end = *setpoints_nm.last().expect("an end");
    let left = |positions_nm: &[i64], mode: &Mode| {
        let setpoints_m: Vec<f64> = positions_nm.iter().map(|nm| *nm as f64 * 1e-9).collect();
        let plant = PrescribedBase::from_modes(vec![mode.clone()], None, RATE_HZ, 0.0).expect("a plant");
        ResidualVibration::after(plant, &setpoints_m).expect("a residual")
    };
    let along =
        |[low, high]: [f64; 2], place: u32, of: u32| low + (high - low) * f64::from(place) / f64::from(of);
    let mut worst: f64 = 0.0;
    for place in 0..3 * 9 {
        let mode = Mode {
            frequency_hz: along(area.frequency_hz(), place % 9, 8),
            damping_ratio: along(area.damping_ratio(), place / 9, 2),
            participation: vec![1.0],
        };
        // The step comes in the same last tick, so that both are seen after the same time.
        let mut step = vec![0; setpoints_nm.len() - 1];
        step.push(end);
        let step = left(&step, &mode);
        let relative = left(setpoints_nm, &mode).relative_to(&step);
        worst = relative.modes_pct.iter().fold(worst, |worst, percent| worst.max(percent / 100.0));
    }
    worst
}

#[test]
fn the_shortest_move_is_played_to_the_bit_and_leaves_perturbed_modes_still() {
    let Some((_emulator, mut session)) = boot() else { return };
    for reversing in [false, true] {
        let planned = planned(reversing);
        assert_eq!(session.upload_plan(&planned.plan).expect("taken"), planned.plan.crc32());
        let board = played(&mut session, "play");
        let host: Vec<(i64, i64)> = planned.positions_nm.iter().map(|nm| (*nm, *nm)).collect();
        assert!(host.len() > 2000 && board.len() >= host.len(), "{} {}", host.len(), board.len());
        assert_eq!(&board[..host.len()], host, "setpoints of the image and of the host");
        assert!(board[host.len()..].iter().all(|pair| *pair == (50_000_000, 50_000_000)));
        let setpoints_nm: Vec<i64> =
            board[..host.len()].iter().map(|(_, setpoint_nm)| *setpoint_nm).collect();
        let left: Vec<f64> = boxes().iter().map(|area| worst(&setpoints_nm, area)).collect();
        println!("{:.4} s, residuals {left:?}", planned.duration_s());
        assert!(left.iter().all(|left| *left <= TOLERANCE), "{left:?}");
        assert!(left.iter().any(|left| *left > 0.5 * TOLERANCE), "the tolerance is used: {left:?}");
        let back = played(&mut session, "play back");
        assert_eq!(back[host.len() - 1], (0, 0));
    }
}

#[test]
fn a_stop_ends_it_within_the_travel_and_without_a_fault() {
    let Some((_emulator, mut session)) = boot() else { return };
    session.upload_plan(&planned(true).plan).expect("taken");
    session.command_when_ready("play").expect("accepted");
    while session.command("status").expect("status").line("state") != Some("playing") {}
    session.command("stop").expect("accepted");
    let position_nm = session.wait_for_rest(REST_LIMIT).expect("rest");
    assert!((0..50_000_000).contains(&position_nm), "{position_nm}");
    assert_eq!(session.command("status").expect("status").line("fault"), Some("none"));
    session.command_when_ready("play").expect("accepted again");
    let end_nm = session.wait_for_rest(REST_LIMIT).expect("rest");
    assert_eq!(end_nm, position_nm + 50_000_000);
}

#[test]
fn what_goes_wrong_on_the_way_is_refused_and_nothing_is_played() {
    let Some((_emulator, mut session)) = boot() else { return };
    let planned = planned(false);
    let bytes = planned.plan.bytes();
    let frames: Vec<String> =
        bytes.chunks(MAX_FRAME_BYTES).enumerate().map(|(number, part)| frame(number, part)).collect();
    let refused = |session: &mut Session, line: &str, code: &str, part: &str| match session.command(line) {
        Err(BoardError::Refused { code: found, reason, .. }) => {
            assert!(found == code && reason.contains(part), "{line}: {found} {reason}");
        }
        answer => panic!("{line}: {answer:?}"),
    };
    refused(&mut session, "play", "range", "no plan was uploaded");
    refused(&mut session, &begin(&bytes, 1000.0), "range", "made for 1000 Hz, the board ticks at 4000 Hz");
    let long = format!("plan begin {} 00000000 4000", 12 * (MAX_PIECES + 1));
    refused(&mut session, &long, "memory", "513 pieces of 12 bytes, there is room for 512");
    session.command(&begin(&bytes, RATE_HZ)).expect("begun");
    session.command(&frames[0]).expect("taken");
    // Frame 1 is lost.
    refused(&mut session, &frames[2], "frame", "frame 1 is next, not 2");
    let wrong = format!("{}0", &frames[1][..frames[1].len() - 1]);
    let wrong = if wrong == frames[1] { format!("{}1", &frames[1][..frames[1].len() - 1]) } else { wrong };
    refused(&mut session, &wrong, "crc", "the frame's CRC does not match");
    refused(&mut session, "plan commit", "frame", "56 of");
    refused(&mut session, "play", "range", "no plan was uploaded");
    for line in &frames[1..] {
        session.command(line).expect("taken");
    }
    session.command("plan commit").expect("whole");
    // Longer than the board goes through: 131 073 ticks.
    let mut long = planned.plan.clone();
    long.pieces
        .insert(0, stillbeam_firmware::motion::Piece { ticks: 131_073 - planned.plan.ticks(), jerk: 0 });
    match session.upload_plan(&BoardPlan { ..long }) {
        Err(BoardError::Refused { code, reason, .. }) => {
            assert_eq!(code, "range");
            assert!(reason.contains("131073 ticks, 131072 at most"), "{reason}");
        }
        answer => panic!("{answer:?}"),
    }
    session.disable_drive().expect("off");
    for line in ["set tick.rate_hz 2000", "apply"] {
        session.command_when_ready(line).expect(line);
    }
    session.enable_drive().expect("enabled");
    refused(&mut session, "play", "range", "the plan is for 4000 Hz, the board ticks at 2000 Hz");
    session.disable_drive().expect("off");
    for line in ["set tick.rate_hz 4000", "apply"] {
        session.command_when_ready(line).expect(line);
    }
    session.enable_drive().expect("enabled");
    session.command_when_ready("play").expect("the one that was committed");
    let end_nm = session.wait_for_rest(REST_LIMIT).expect("rest");
    assert_eq!(end_nm, 50_000_000);
}
