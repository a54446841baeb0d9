//! `stillbeam merge`: a camera's and a board's recording on one clock, in one file that `identify` reads.

use crate::support;

use std::fmt::Write as _;

use support::{accepted, refused, stillbeam};

/// A base that sweeps, seen by a board (1 kHz) and, with the tip, by a camera (100 Hz) whose clock is 3.2 s
/// behind and loses 120 parts per million.
struct Laboratory {
    folder: tempfile::TempDir,
}

impl Laboratory {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let phase = |t: f64| std::f64::consts::TAU * (0.5 * t + 0.1 * t * t);
        let mut board = String::from("time_s,setpoint_m,input_1_level\n");
        for k in 0..20_000 {
            let t = 3.0 + f64::from(k) * 1e-3;
            let level = u8::from((0.0..0.004).contains(&(t - 3.2)));
            writeln!(board, "{t},{:.9},{level}", 1e-3 * phase(t - 3.0).sin()).unwrap();
        }
        let mut camera = String::from("time_s,base_mm,tip_mm\n");
        for k in 0..1900 {
            let t = f64::from(k) * 0.01;
            let base = phase(t + 0.2).sin();
            writeln!(camera, "{:.7},{base:.6},{:.6}", t * (1.0 - 120e-6), 2.0 * base).unwrap();
        }
        std::fs::write(folder.path().join("board.csv"), board).unwrap();
        std::fs::write(folder.path().join("camera.csv"), camera).unwrap();
        Self { folder }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    fn merge(&self, more: &[&str]) -> support::Run {
        let (camera, board, out) = (self.path("camera.csv"), self.path("board.csv"), self.path("joined.csv"));
        let mut arguments = vec!["merge", &camera, &board, "--out", &out];
        arguments.extend(more);
        stillbeam(&arguments)
    }
}

/// The number behind a word of a message.
fn number_after(text: &str, word: &str) -> f64 {
    let rest = text.split(word).nth(1).unwrap_or_else(|| panic!("no `{word}` in {text}"));
    rest.split_whitespace()
        .next()
        .unwrap()
        .parse()
        .unwrap_or_else(|_| panic!("no number after `{word}` in {text}"))
}

#[test]
fn a_motion_that_both_saw_gives_offset_and_drift_and_one_file() {
    let laboratory = Laboratory::new();
    let run = laboratory.merge(&["--same", "base_mm=setpoint_m"]);
    assert_eq!(run.code, 0, "{}", run.messages);
    let offset_s = number_after(&run.messages, "board.csv shows");
    let drift_ppm = number_after(&run.messages, "board.csv gains");
    assert!((offset_s - 3.2).abs() < 1e-4, "{}", run.messages);
    assert!((drift_ppm - 120.0).abs() < 10.0, "{}", run.messages);
    let joined = std::fs::read_to_string(laboratory.path("joined.csv")).unwrap();
    assert!(joined.starts_with("time_s,base_mm,tip_mm,setpoint_m,input_1_level\n"), "{}", &joined[..80]);
    // Every sample of either is in it, as it was measured, and the setpoint in every row of a frame.
    let cells: Vec<Vec<&str>> = joined.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let frames: Vec<&Vec<&str>> = cells.iter().filter(|row| !row[2].is_empty()).collect();
    assert_eq!(frames.len(), 1900);
    assert!(frames.iter().all(|row| !row[3].is_empty() && matches!(row[4], "0" | "1")));
    assert!(cells.len() >= 20_000);
    for row in frames.iter().skip(5) {
        let (base_mm, setpoint_m): (f64, f64) = (row[1].parse().unwrap(), row[3].parse().unwrap());
        assert!((base_mm - 1e3 * setpoint_m).abs() < 5e-3, "{row:?}");
    }
    let joined = laboratory.path("joined.csv");
    let found = stillbeam(&["identify", &joined, "--input", "setpoint_m", "--output", "tip_mm"]);
    assert!(!found.messages.contains("there is no column"), "{}", found.messages);
}

#[test]
fn a_trigger_of_the_first_frame_gives_the_offset_and_says_that_the_drift_is_unknown() {
    let laboratory = Laboratory::new();
    let run = laboratory.merge(&["--trigger", "input_1_level"]);
    assert_eq!(run.code, 0, "{}", run.messages);
    assert!((number_after(&run.messages, "board.csv shows") - 3.2).abs() < 1e-3, "{}", run.messages);
    assert!(run.messages.contains("drift: not known"), "{}", run.messages);
}

#[test]
fn what_cannot_be_merged_is_refused_with_what_to_do() {
    let laboratory = Laboratory::new();
    let (camera, board, out) =
        (laboratory.path("camera.csv"), laboratory.path("board.csv"), laboratory.path("joined.csv"));
    let merge = ["merge", &camera, &board, "--out", &out];
    let with =
        |more: &[&'static str]| -> Vec<&str> { merge.iter().copied().chain(more.iter().copied()).collect() };
    refused(&merge, &["--same", "--trigger", "tip_mm", "setpoint_m"]);
    refused(&with(&["--same", "base_mm"]), &["base_m=setpoint_m"]);
    refused(&with(&["--same", "tip_mm=input_1_level"]), &["same motion", "trigger"]);
    refused(&["merge", &camera, &board, "--out", &camera], &["written over"]);
}

#[test]
fn completions_and_manual_pages_name_every_command() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = accepted(&["completions", shell]);
        for word in ["identify", "merge", "sample-rate", "held-out"] {
            assert!(script.contains(word), "{shell}: no {word}");
        }
    }
    refused(&["completions", "cobol"], &["bash", "zsh", "fish"]);
    let folder = tempfile::tempdir().unwrap();
    accepted(&["man", folder.path().to_str().unwrap()]);
    let page = std::fs::read_to_string(folder.path().join("stillbeam-merge.1")).unwrap();
    assert!(page.contains("trigger") && folder.path().join("stillbeam.1").is_file(), "{page}");
}
