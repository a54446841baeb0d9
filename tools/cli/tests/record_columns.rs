//! The columns of a recording: the encoder, the general inputs and the state, tick by tick.

use crate::support;

use stillbeam::board::Session;
use stillbeam::board::in_process::InProcessBoard;
use stillbeam::board_recording::{INPUTS, STATE, recording};
use stillbeam_firmware::control::{Inputs, TickOutput};
use stillbeam_firmware::telemetry::{Activity, Flags};
use stillbeam_recording::{Recording, read_csv, write_csv};
use support::{accepted, stillbeam};

const COUNTS_PER_MM: f64 = 1000.0;
/// The trigger of another instrument: high from this tick on, for so many ticks, again and again.
const TRIGGER_TICKS: (u32, u32) = (300, 100);

/// The level of general input `number` (from 0) in a tick: a trigger, its opposite, and a switch at 4 mm.
fn level(number: usize, tick: u32, setpoint_nm: i32) -> bool {
    let triggered = tick % TRIGGER_TICKS.0 < TRIGGER_TICKS.1;
    match number {
        0 => triggered,
        1 => !triggered,
        _ => setpoint_nm >= 4_000_000,
    }
}

/// Counts of an encoder on a drive that is one tick behind its setpoint.
fn counts(setpoint_nm: i32) -> i32 {
    (f64::from(setpoint_nm) * 1e-6 * COUNTS_PER_MM).round() as i32
}

/// A board whose machine follows, and its session.
fn wired() -> Session {
    let mut tick = 0;
    let board = InProcessBoard::wired(Box::new(move |last: Option<&TickOutput>| {
        let setpoint_nm = last.map_or(0, |output| output.setpoint.0);
        let levels = Flags::INPUTS.iter().enumerate();
        let high = levels.filter(|(number, _)| level(*number, tick, setpoint_nm));
        let contacts = Flags(high.fold(0, |flags, (_, input)| flags | input.0));
        tick += 1;
        // The counter has 16 bits.
        Inputs { encoder_counter: counts(setpoint_nm) as u16, contacts, ..Inputs::default() }
    }));
    Session::start(Box::new(board)).expect("a session")
}

/// 10 mm with a shaper, every tick, written and read again.
fn recorded() -> (Recording, u32) {
    let mut session = wired();
    for line in ["set mode1.frequency_hz 10", "set mode1.type zvd", "apply"] {
        session.command_when_ready(line).expect(line);
    }
    for line in [&format!("set encoder.counts_per_mm {COUNTS_PER_MM}"), "apply"] {
        session.command_when_ready(line).expect(line);
    }
    session.enable_virtual_drive().expect("enabled");
    let streamed = session.record_motion("move 10", 1, 0.05, &mut |_| {}).expect("recorded");
    assert_eq!((streamed.gaps.len(), streamed.faults.len()), (0, 0));
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("move.csv");
    write_csv(&file, &recording("move.csv", "move 10", &streamed)).expect("written");
    (read_csv(&file).expect("read"), streamed.samples[streamed.start].tick)
}

#[test]
fn a_moving_encoder_changing_inputs_and_the_state_are_written_in_their_own_tick() {
    let (recording, first_tick) = recorded();
    assert_eq!(
        recording.column_names(),
        [
            "time_s",
            "command_m",
            "setpoint_m",
            "encoder_m",
            "input_1_level",
            "input_2_level",
            "input_3_level",
            "state_number"
        ]
    );
    let column = |name: &str| recording.column(name).expect(name).to_vec();
    let (command_m, setpoint_m, encoder_m) = (column("command_m"), column("setpoint_m"), column("encoder_m"));
    let (inputs, state) = (INPUTS.map(column), column(STATE));
    let nanometres = |metres: f64| (metres * 1e9).round() as i32;

    // What the wiring made of the tick before.
    let mut changes = [0; 3];
    for row in 1..recording.len() {
        let (tick, before_nm) = (first_tick + row as u32, nanometres(setpoint_m[row - 1]));
        let expected_m = f64::from(counts(before_nm)) / COUNTS_PER_MM * 1e-3;
        assert!((encoder_m[row] - expected_m).abs() < 1.5e-9, "row {row}: {} {expected_m}", encoder_m[row]);
        for (number, levels) in inputs.iter().enumerate() {
            let expected = f64::from(u8::from(level(number, tick, before_nm)));
            assert_eq!(levels[row], expected, "input {} in row {row}", number + 1);
            changes[number] += u32::from(levels[row] != levels[row - 1]);
        }
    }
    assert!(encoder_m.windows(2).filter(|pair| pair[0] != pair[1]).count() > 500, "it moves");
    assert!((encoder_m[encoder_m.len() - 1] - 0.01).abs() < 1e-9);
    assert!(changes[0] > 5 && changes[1] == changes[0] && changes[2] == 1, "{changes:?}");

    // Rest, moving while the command changes, settling while only the setpoint does, and rest again.
    let mut states = state.clone();
    states.dedup();
    let expected = [Activity::Rest, Activity::Moving, Activity::Settling, Activity::Rest];
    assert_eq!(states, expected.map(|activity| f64::from(activity as u8)));
    for row in 1..recording.len() {
        if command_m[row] != command_m[row - 1] {
            assert_eq!(state[row], 1.0, "row {row}");
        } else if setpoint_m[row] != setpoint_m[row - 1] {
            // The last steps of a move are smaller than a nanometre.
            assert!(state[row] == 4.0 || state[row] == 1.0, "row {row}: {}", state[row]);
        }
    }
}

/// A camera saw the tip: what the board adds is neither in the way nor taken for a response.
#[test]
fn identify_and_diagnose_take_a_recording_with_the_columns_of_the_board() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let model = "schema = 1\nkind = \"modal\"\n[[mode]]\nfrequency_hz = 5.0\ndamping_ratio = 0.02\nparticipation = [1.0]\n\
                 [input]\ncolumn = \"setpoint_m\"\n[[output]]\ncolumn = \"angle_rad\"\nquantity = \"position\"\n";
    std::fs::write(path("model.toml"), model).expect("written");
    let sweep = "sweep linear 1 12 20s 0.5mm";
    accepted(&[
        "simulate",
        &path("model.toml"),
        "--command",
        sweep,
        "--rate",
        "200",
        "--out",
        &path("plain.csv"),
    ]);
    let plain = read_csv(path("plain.csv").as_ref()).expect("read");
    let rows = plain.len();
    let mut with = Recording::new("with", plain.time_s.clone());
    for name in ["setpoint_m", "angle_rad"] {
        with = with.with_column(name, plain.column(name).expect(name).to_vec());
    }
    std::fs::remove_file(path("plain.csv")).expect("removed");
    write_csv(path("plain.csv").as_ref(), &with).expect("written");
    for (number, name) in INPUTS.into_iter().enumerate() {
        with = with.with_column(
            name,
            (0..rows).map(|row| f64::from(row as u32 / 50 % (number as u32 + 2))).collect(),
        );
    }
    let state = (0..rows).map(|row| if row == 7 { f64::NAN } else { 2.0 }).collect();
    write_csv(path("with.csv").as_ref(), &with.with_column(STATE, state)).expect("written");
    for arguments in [&["identify", "--input", "setpoint_m"][..], &["diagnose", &path("model.toml")][..]] {
        let run = |file: &str| {
            let run = stillbeam(&[arguments, &[path(file).as_str()]].concat());
            assert_eq!(run.code, 0, "{file}: {}", run.messages);
            run.out.replace("plain.csv", "with.csv")
        };
        assert_eq!(run("with.csv"), run("plain.csv"), "{arguments:?}");
    }
}
