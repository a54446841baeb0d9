//! `shape --optimal`: from the boxes that `identify` wrote to a table that the firmware's core and a board
//! take.

use crate::support;

use serde_json::Value;
use support::{accepted, paper_beam, refused, stillbeam};

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

/// Two modes as `identify` writes them, the second with a box that is not about its middle.
const MODES: &str = "{\"schema_version\":1,\"modes\":[\
    {\"frequency_hz\":{\"value\":1.1,\"stderr\":0.01},\"damping_ratio\":{\"value\":0.0074,\"stderr\":1e-4},\
     \"uncertainty_box\":{\"frequency_hz\":[1.05,1.12],\"damping_ratio\":[0.006,0.009]}},\
    {\"frequency_hz\":{\"value\":6.9,\"stderr\":0.01},\"damping_ratio\":{\"value\":0.0033,\"stderr\":1e-4}}]}";

#[test]
fn the_boxes_of_a_file_are_what_is_solved_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(path("modes.json"), MODES).unwrap();
    let (modes, table, report) = (path("modes.json"), path("table.json"), path("table.html"));
    let measured_alone = ["--box", &modes, "--box-floor", "0%"];
    let solve = ["shape", "--optimal", "--json", &table, "--report", &report];
    let printed = accepted(&[&solve[..], &measured_alone].concat());
    assert!(printed.contains("2 standard errors") && printed.contains("proof"), "{printed}");
    let design = json(&std::fs::read_to_string(&table).unwrap());
    let page = std::fs::read_to_string(&report).unwrap();
    for part in
        ["Residual against duration", "Beside the others", "zvddd", "si:0.02", "Taps of zvd", "instructions"]
    {
        assert!(page.contains(part), "{part}");
    }
    let boxes = &design["optimal"]["modes"];
    assert_eq!(boxes[0]["frequency_hz"], json("[1.05, 1.12]"));
    // Without a box in the file, two standard errors either way.
    assert!((boxes[1]["frequency_hz"][0].as_f64().unwrap() - 6.88).abs() < 1e-9, "{boxes}");
    assert_eq!(design["stages"].as_array().unwrap().len(), 1);
    for worst in design["residual"]["worst_over_box"].as_array().unwrap() {
        assert!(worst.as_f64().unwrap() <= 0.02, "{design}");
    }
    // The firmware's integers leave the simulated beam still: its second mode's damping is another.
    let simulated =
        accepted(&["simulate", &paper_beam(), "--command", "move 50mm", "--shaper", &table, "--json", "-"]);
    let vibration = json(&simulated)["percentage_vibration_pct"].as_f64().unwrap();
    assert!(vibration < 2.2, "{vibration} %");
    // A board takes it as it is.
    let uploaded = accepted(&["upload", &table, "--port", "core"]);
    assert!(uploaded.contains(design["crc32"].as_str().unwrap()), "{uploaded}");
    refused(
        &["shape", "--optimal", "--mode", "2,0.01", "--box", &modes],
        &["2,0.01", "lies in no box", "--mode out"],
    );
    let one = accepted(&["shape", "--optimal", "--box", &modes, "--use", "2", "--json", "-"]);
    assert_eq!(json(&one)["optimal"]["modes"].as_array().unwrap().len(), 1);
}

/// One good recording gives a frequency to a millionth, and payload and temperature move it by hundredths: a
/// shaper for the statistical error alone leaves a third of the vibration on the machine of the next day.
#[test]
fn a_measured_box_is_no_narrower_than_the_floor() {
    let folder = tempfile::tempdir().unwrap();
    let modes = folder.path().join("modes.json").display().to_string();
    let sharp = MODES.replace("\"stderr\":0.01", "\"stderr\":1e-6").replace("[1.05,1.12]", "[0.95,1.1]");
    std::fs::write(&modes, sharp).unwrap();
    let boxes = |extra: &[&str]| {
        let solved = accepted(&[&["shape", "--optimal", "--box", &modes, "--json", "-"][..], extra].concat());
        let design = json(&solved);
        let range = |mode: usize, of: &str| {
            let range = &design["optimal"]["modes"][mode][of];
            [range[0].as_f64().unwrap(), range[1].as_f64().unwrap()]
        };
        [range(0, "frequency_hz"), range(1, "frequency_hz"), range(1, "damping_ratio")]
    };
    let close = |found: [[f64; 2]; 3], asked: [[f64; 2]; 3]| {
        let worst = found.iter().flatten().zip(asked.iter().flatten());
        assert!(worst.into_iter().all(|(a, b)| (a - b).abs() < 1e-5), "{found:?}");
    };
    // Of the first mode the lower end was measured to be farther away than the floor.
    close(boxes(&[]), [[0.95, 1.155], [6.555, 7.245], [0.0031, 0.0035]]);
    close(boxes(&["--box-floor", "1%,50%"]), [[0.95, 1.111], [6.831, 6.969], [0.00165, 0.00495]]);
    close(boxes(&["--box-floor", "0"]), [[0.95, 1.1], [6.899998, 6.900002], [0.0031, 0.0035]]);
    let printed = accepted(&["shape", "--optimal", "--box", &modes]);
    assert!(printed.contains("the floor (frequency ±5 %, damping ratio ±5 %; --box-floor)"), "{printed}");
    refused(
        &["shape", "--optimal", "--box", &modes, "--box-floor", "150%"],
        &["--box-floor 150%", "below 100"],
    );
    let applied = json(&accepted(&["apply", &modes, "--port", "core", "--json", "-"]));
    let range = &applied["modes"][1]["uncertainty_box"]["frequency_hz"];
    assert!((range[0].as_f64().unwrap() - 6.555).abs() < 1e-9, "{applied}");
}

#[test]
fn negative_weights_are_checked_against_the_machine() {
    let modes = ["--mode", "1.1,0.0074", "--mode", "6.9,0.0033"];
    let shape = |extra: &[&str]| stillbeam(&[&["shape", "--optimal"][..], &modes, extra].concat());
    let (positive, negative) = (shape(&["--json", "-"]), shape(&["--allow-negative", "0.2", "--json", "-"]));
    let duration = |text: &str| json(text)["duration_s"].as_f64().unwrap();
    assert!(duration(&negative.out) < duration(&positive.out) - 0.02);
    assert!(
        negative.messages.contains("1.4000") && negative.messages.contains("mm/s²"),
        "{}",
        negative.messages
    );
    let within = ["--allow-negative", "0.2", "--machine-limits", "500,5000", "--command-limits"];
    assert_eq!(shape(&[&within[..], &["350,3500"]].concat()).code, 0);
    let beyond = shape(&[&within[..], &["400,3500"]].concat());
    assert_eq!(beyond.code, 2);
    assert!(beyond.messages.contains("560.0 mm/s") && beyond.messages.contains("--allow-negative 0.125"));
}

#[test]
fn a_planned_move_is_a_recording_that_simulate_takes() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (out, report) = (path("move.csv"), path("move.html"));
    let plan = |extra: &[&str]| {
        let arguments =
            ["plan", "--distance", "50", "--mode", "1.1,0.0074", "--mode", "6.9,0.0033", "--json", "-"];
        json(&accepted(&[&arguments[..], extra].concat()))
    };
    let numbers = plan(&["--out", &out, "--report", &report, "--reversing", "--upload", "core"]);
    let file = path("plan.json");
    std::fs::write(&file, numbers.to_string()).unwrap();
    let sent = stillbeam(&["upload", &file, "--port", "core"]);
    assert_eq!(sent.code, 0, "{}", sent.messages);
    let crc32 = numbers["plan"]["crc32"].as_str().unwrap();
    assert!(sent.messages.contains(crc32) && sent.messages.contains("50000000 nm"), "{}", sent.messages);
    std::fs::write(&file, numbers.to_string().replace(crc32, "0x00000000")).unwrap();
    refused(&["upload", &file, "--port", "core"], &["plan.json", "crc32 is 0x00000000"]);
    refused(&["upload", &path("none.json"), "--port", "core"], &["none.json"]);
    let moves = numbers["moves"].as_array().unwrap();
    assert_eq!(moves.len(), 6);
    for planned in &moves[4..] {
        for worst in planned["worst_over_box"].as_array().unwrap() {
            assert!(worst.as_f64().unwrap() <= 0.02, "{planned}");
        }
    }
    // The quickest move within the limits is the firmware's own S-curve.
    let duration = |index: usize| moves[index]["duration_s"].as_f64().unwrap();
    assert!((duration(0) - duration(1)).abs() < 0.003 * duration(1), "{moves:?}");
    assert!(std::fs::read_to_string(&report).unwrap().contains("<svg"));
    let recording = stillbeam_recording::read_csv(std::path::Path::new(&out)).unwrap();
    let setpoints_m = recording.column("setpoint_m").unwrap();
    assert_eq!((setpoints_m.first(), setpoints_m.last()), (Some(&0.0), Some(&0.05)));
    refused(&["plan", "--distance", "0", "--mode", "1,0"], &["a distance of 0"]);
    refused(&["plan", "--distance", "50"], &["no mode"]);
    refused(&["plan", "--distance", "50", "--mode", "1,0", "--limits", "5"], &["--limits 5", "mm/s³"]);
}
