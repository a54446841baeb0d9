//! What commands write, and what they must not write over.

use crate::support;

use support::{accepted, paper_beam, refused};

#[test]
fn nothing_is_written_over_what_is_read_or_over_another_output() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (model, recording, table) = (path("beam.toml"), path("move.csv"), path("table.json"));
    std::fs::copy(paper_beam(), &model).unwrap();
    accepted(&["record", "--port", "core", "--out", &recording, "move", "5"]);
    accepted(&["shape", "--mode", "1.1,0.0074", "--json", &table]);
    let before = [&model, &recording, &table].map(|file| std::fs::read(file).unwrap());
    // The same file by another name.
    let detour = format!("{}/./move.csv", folder.path().to_str().unwrap());
    for arguments in [
        vec!["identify", &recording, "--json", &recording],
        vec!["identify", &recording, "--report", &detour],
        vec!["simulate", &model, "--command", "move 50mm", "--out", &model],
        vec!["simulate", &model, "--command", "move 50mm", "--shaper", &table, "--json", &table],
        vec!["simulate", &model, "--input", &recording, "--out", &recording],
        vec!["model", &model, "--json", &model],
        vec!["shape", "--modes-from", &table, "--json", &table],
    ] {
        refused(&arguments, &["written over"]);
    }
    let same = path("same");
    refused(&["shape", "--mode", "1.1,0", "--json", &same, "--report", &same], &["two outputs"]);
    assert_eq!([&model, &recording, &table].map(|file| std::fs::read(file).unwrap()), before);
}

#[test]
fn an_output_that_cannot_be_written_is_refused_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (absent, there) = (path("absent/found.json"), path("there.json"));
    // No recording of that name is there either: that would be found later.
    refused(&["diagnose", &paper_beam(), "absent.csv", "--json", &absent], &["cannot be written", &absent]);
    refused(&["shape", "--mode", "1.1,0", "--json", &path("")], &["cannot be written"]);
    refused(&["diagnose", &paper_beam(), "absent.csv", "--json", &there], &["absent.csv"]);
    assert!(!std::path::Path::new(&there).exists(), "the trial left a file behind");
}

#[test]
fn a_recording_cannot_be_trained_on_and_held_out() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("move.csv").to_str().unwrap().to_owned();
    accepted(&["record", "--port", "core", "--out", &file, "move", "5"]);
    let detour = format!("{}/./move.csv", folder.path().to_str().unwrap());
    refused(&["diagnose", &paper_beam(), &file, "--held-out", &detour], &["both trained on and held out"]);
}

#[test]
fn a_recorded_move_has_command_and_setpoint_to_the_nanometre() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("move.csv");
    accepted(&[
        "record",
        "--port",
        "core",
        "--out",
        file.to_str().unwrap(),
        "--decimation",
        "1",
        "move",
        "50",
    ]);
    let recording = stillbeam_recording::read_csv(&file).unwrap();
    let setpoint_m = recording.column("setpoint_m").unwrap();
    // Without a shaper the setpoint is the command.
    assert_eq!(recording.column("command_m").unwrap(), setpoint_m);
    assert_eq!((setpoint_m[0], setpoint_m[setpoint_m.len() - 1]), (0.0, 0.05));
    assert!(setpoint_m[1] > 0.0, "time zero is the last tick at rest");
    assert!((recording.median_interval_s() - 1.0 / 4000.0).abs() < 1e-12);
    refused(&["record", "--port", "core", "--out", "x.csv", "jump", "5"], &["jump", "move", "sweep"]);
    refused(&["record", "--port", "core", "--out", "x.csv", "move", "5000"], &["travel"]);
    assert!(!std::path::Path::new("x.csv").exists());
}

/// 333 Hz is not 84 MHz divided by a whole number.
#[test]
fn host_and_board_agree_on_the_table_at_rates_the_timer_cannot_make() {
    let shaped = accepted(&["shape", "--mode", "1,0.001,zvd", "--rate", "333", "--json", "-"]);
    let shaped: serde_json::Value = serde_json::from_str(&shaped).unwrap();
    let applied = accepted(&[
        "console",
        "--port",
        "core",
        "--command",
        "set tick.rate_hz 333",
        "--command",
        "set mode1.damping_ratio 0.001",
        "--command",
        "set mode1.type zvd",
        "--command",
        "apply",
    ]);
    let crc32 = shaped["crc32"].as_str().unwrap();
    assert!(applied.contains(&format!("crc32={crc32}")), "{crc32} in {applied}");
}

#[test]
fn commands_are_one_line_each_and_wait_waits() {
    for command in ["", "  ", "move 5\rstatus", "info\n"] {
        refused(&["console", "--port", "core", "--command", command], &["one line"]);
    }
    let said = accepted(&[
        "console",
        "--port",
        "core",
        "--command",
        "set emergency.input waived",
        "--command",
        "apply",
        "--command",
        "position set 0",
        "--command",
        "enable",
        "--command",
        "wait",
        "--command",
        "move 5",
        "--command",
        "wait",
        "--command",
        "status",
    ]);
    assert!(said.contains("state rest") && said.contains("setpoint_nm 5000000"), "{said}");
}

#[test]
fn modes_of_a_file_can_be_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("modes.json");
    let modes: Vec<serde_json::Value> = [1.1, 6.9, 19.0, 40.0, 70.0]
        .iter()
        .map(|hz| serde_json::json!({"frequency_hz": {"value": hz}, "damping_ratio": {"value": 0.01}}))
        .collect();
    std::fs::write(&file, serde_json::json!({ "modes": modes }).to_string()).unwrap();
    let file = file.to_str().unwrap();
    refused(&["shape", "--modes-from", file], &["5 modes", "--use"]);
    refused(&["shape", "--modes-from", file, "--use", "6"], &["--use 6", "1 to 5"]);
    refused(&["shape", "--modes-from", file, "--use", "0"], &["--use 0"]);
    let design = accepted(&["shape", "--modes-from", file, "--use", "2,1", "--json", "-"]);
    let design: serde_json::Value = serde_json::from_str(&design).unwrap();
    let frequencies: Vec<f64> = design["stages"]
        .as_array()
        .unwrap()
        .iter()
        .map(|stage| stage["frequency_hz"].as_f64().unwrap())
        .collect();
    assert_eq!(frequencies, [6.9, 1.1]);
}
