//! What `tune` recommends, from recordings of simulated machines to a table that a board runs.

use crate::support;

use std::f64::consts::TAU;
use std::path::Path;

use serde_json::Value;
use support::{accepted, paper_beam, refused, stillbeam};

/// A name within a folder.
fn within(folder: &Path, name: &str) -> String {
    folder.join(name).display().to_string()
}

/// The paper's beam with both frequencies this many times as high, in a file.
fn machine(folder: &Path, times: f64) -> String {
    let text = std::fs::read_to_string(paper_beam()).unwrap();
    let line = text.lines().find(|line| line.starts_with("young_Pa")).unwrap();
    let young_pa: f64 = line.split('=').nth(1).unwrap().split('#').next().unwrap().trim().parse().unwrap();
    let path = within(folder, &format!("machine_{times}.toml"));
    std::fs::write(&path, text.replace(line, &format!("young_Pa = {:e}", young_pa * times * times))).unwrap();
    path
}

/// What a camera sees of the machine while a sweep shakes it.
fn sweep_of(model: &str, folder: &Path, name: &str) -> String {
    let seconds = 20.0;
    let mut sweep = "time_s,setpoint_m\n".to_owned();
    for k in 0..(500.0 * seconds) as u32 {
        let t = f64::from(k) / 500.0;
        let phase = TAU * (0.4 * t + 0.5 * (8.5 - 0.4) / seconds * t * t);
        sweep += &format!("{t},{}\n", 1e-3 * phase.sin());
    }
    let input = within(folder, &format!("{name}_input.csv"));
    std::fs::write(&input, sweep).unwrap();
    let out = within(folder, &format!("{name}.csv"));
    accepted(&["simulate", model, "--input", &input, "--out", &out]);
    out
}

fn json_of(path: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The words of the printed command that begins like this, with a port for `PORT`.
fn printed_command(printed: &str, begins: &str, port: &str) -> Vec<String> {
    let line = printed.lines().map(str::trim).find(|line| line.starts_with(begins)).unwrap();
    line.split(' ').skip(1).map(|word| word.replace("PORT", port)).collect()
}

fn run_words(words: &[String]) -> String {
    accepted(&words.iter().map(String::as_str).collect::<Vec<_>>())
}

/// The vibration that a move of the machine leaves of its loudest mode, per cent of what the unshaped move
/// leaves of it.
fn left_percent(model: &str, table: &str) -> f64 {
    let told = accepted(&["simulate", model, "--command", "move 50mm", "--shaper", table, "--json", "-"]);
    let told: Value = serde_json::from_str(&told).unwrap();
    let modes = told["mode_vibration_pct"].as_array().unwrap();
    assert_eq!(modes.len(), 2, "{told}");
    modes.iter().map(|percent| percent.as_f64().unwrap()).fold(0.0, f64::max)
}

#[test]
fn two_sweeps_become_a_table_that_keeps_the_machine_still_over_the_box_and_runs_on_a_board() {
    let folder = tempfile::tempdir().unwrap();
    let model = machine(folder.path(), 1.0);
    let (first, second) = (sweep_of(&model, folder.path(), "a"), sweep_of(&model, folder.path(), "b"));
    let out = within(folder.path(), "new/folder");
    let told = accepted(&["tune", &first, &second, "--input", "setpoint_m", "--out", &out]);
    assert!(told.starts_with("Take the shortest possible shaper for both modes (optimal)."), "{told}");
    assert!(told.contains("The next shorter one is the two-mode ZV."), "{told}");
    assert!(told.contains("did not move between the recordings"), "{told}");
    for name in ["modes.html", "shaper.html"] {
        let page = std::fs::read_to_string(format!("{out}/{name}")).unwrap();
        assert!(page.contains("<svg"), "{name}");
    }

    // What it promises, on the machine itself and on those at the ends of the box of ±5 %.
    let table = format!("{out}/table.json");
    for times in [0.95, 0.975, 1.0, 1.025, 1.05] {
        let left = left_percent(&machine(folder.path(), times), &table);
        assert!(left <= 5.05, "{times}: {left} %");
    }
    // The shorter one that it advises against leaves more.
    let zv = within(folder.path(), "zv.json");
    accepted(&["shape", "--box", &format!("{out}/modes.json"), "--type", "zv", "--json", &zv]);
    assert!(left_percent(&machine(folder.path(), 1.05), &zv) > 5.5);

    let sent = run_words(&printed_command(&told, "stillbeam upload", "core"));
    assert!(sent.contains(json_of(&table)["crc32"].as_str().unwrap()), "{sent}");
    // The command for another one writes the table that the list promises.
    run_words(&printed_command(&told, "stillbeam shape", ""));
    let other = json_of(&table);
    let kind = other["stages"][0]["type"].as_str().unwrap();
    let row = told.lines().find(|line| line.starts_with(&format!("{kind} "))).unwrap();
    assert!(row.contains(&format!(" {:.4} ", other["duration_s"].as_f64().unwrap())), "{row}");
}

#[test]
fn recordings_that_differ_by_more_than_the_floor_widen_the_boxes() {
    let folder = tempfile::tempdir().unwrap();
    let (soft, stiff) = (machine(folder.path(), 0.98), machine(folder.path(), 1.02));
    let recordings = [sweep_of(&soft, folder.path(), "soft"), sweep_of(&stiff, folder.path(), "stiff")];
    let out = within(folder.path(), "out");
    let arguments = |extra: &[&'static str]| -> Value {
        let mut all = vec!["tune", &recordings[0], &recordings[1], "--input", "setpoint_m", "--out", &out];
        all.extend(["--json", "-"].iter().chain(extra));
        serde_json::from_str(&accepted(&all)).unwrap()
    };
    let told = arguments(&["--box-floor", "2%"]);
    for (mode, hz) in [(0, 1.1), (1, 6.9)] {
        let mode = &told["modes"][mode];
        assert_eq!(mode["box_from"], "between_recordings", "{mode}");
        let ends = &mode["uncertainty_box"]["frequency_hz"];
        assert!(ends[0].as_f64().unwrap() < hz * 0.9805 && ends[1].as_f64().unwrap() > hz * 1.0195, "{mode}");
        assert!((mode["moved"]["fraction"].as_f64().unwrap() - 0.0408).abs() < 2e-3, "{mode}");
        assert_eq!(mode["moved"]["highest"]["recording"], recordings[1].as_str());
        // A fit of both with one frequency would take the difference for damping.
        assert!(mode["damping_ratio"].as_f64().unwrap() < 0.01, "{mode}");
    }
    let reasons = told["reasons"].to_string();
    assert!(reasons.contains("moved by 4.") && reasons.contains("soft.csv"), "{reasons}");
    for model in [soft, stiff] {
        assert!(left_percent(&model, &format!("{out}/table.json")) <= 5.05);
    }
    // A floor that is wider than that is the box.
    assert_eq!(arguments(&["--box-floor", "6%"])["modes"][0]["box_from"], "floor");
}

/// A decay of lines, each with its frequency, damping ratio and amplitude, in noise from a small generator.
fn decay_of(lines: &[[f64; 3]], seconds: f64) -> String {
    let mut state = 7_u64;
    let mut even = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut text = "time_s,tip_deflection_m\n".to_owned();
    for k in 0..(100.0 * seconds) as u32 {
        let t = f64::from(k) / 100.0;
        let line = |[hz, zeta, amplitude]: &[f64; 3]| {
            amplitude * (-zeta * TAU * hz * t).exp() * (TAU * hz * t).cos()
        };
        let noise: f64 = 2e-5 * (0..12).map(|_| even()).sum::<f64>();
        text += &format!("{t},{:.9}\n", lines.iter().map(line).sum::<f64>() + noise);
    }
    text
}

const RINGS: [f64; 3] = [12.0, 0.01, 4e-3];
/// Of this a record of three seconds cannot tell that it decays.
const STAYS: [f64; 3] = [5.3, 5e-6, 5e-3];

#[test]
fn a_line_that_is_no_mode_is_left_out_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (within(folder.path(), "knock.csv"), within(folder.path(), "out"));
    std::fs::write(&file, decay_of(&[RINGS, STAYS], 3.0)).unwrap();
    let told = accepted(&["tune", &file, "--out", &out]);
    assert!(told.contains("Take the specified-insensitivity shaper (si:0.05)."), "{told}");
    assert!(told.contains("There is one recording"), "{told}");
    let (_, left_out) = told.split_once("Left out, and not shaped for:\n").unwrap();
    assert!(left_out.starts_with("- the line at 5.3") && left_out.contains("tone"), "{told}");
    let numbers = json_of(&format!("{out}/modes.json"));
    assert_eq!(numbers["modes"].as_array().unwrap().len(), 2, "{}", numbers["modes"]);
    // The command for another shaper leaves it out as well.
    let command = printed_command(&told, "stillbeam shape", "");
    assert!(command.join(" ").contains("--use 2 "), "{command:?}");
    run_words(&command);
}

/// A short, faint recording knows nothing of the damping; that the frequency has moved it does know.
#[test]
fn a_recording_too_short_for_the_damping_widens_the_box_of_the_frequency() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| within(folder.path(), name);
    std::fs::write(path("long.csv"), decay_of(&[[12.0, 0.004, 4e-3]], 6.0)).unwrap();
    std::fs::write(path("short.csv"), decay_of(&[[12.6, 0.004, 1e-4]], 0.6)).unwrap();
    let files = [path("long.csv"), path("short.csv")];
    let told =
        accepted(&["tune", &files[0], &files[1], "--box-floor", "2%", "--out", &path("out"), "--json", "-"]);
    let found = json_of(&path("out/modes.json"));
    let damping_ratio = &found["recordings"][1]["modes"][0]["damping_ratio"];
    assert!(damping_ratio["stderr"].as_f64() > damping_ratio["value"].as_f64(), "{damping_ratio}");
    let mode = &serde_json::from_str::<Value>(&told).unwrap()["modes"][0];
    let ends = &mode["uncertainty_box"]["frequency_hz"];
    assert!(ends[0].as_f64().unwrap() < 12.0 && ends[1].as_f64().unwrap() > 12.59, "{mode}");
    assert!(mode["uncertainty_box"]["damping_ratio"][1].as_f64().unwrap() < 0.005, "{mode}");
}

#[test]
fn one_recording_is_enough() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (within(folder.path(), "knock.csv"), within(folder.path(), "out"));
    std::fs::write(&file, decay_of(&[RINGS], 6.0)).unwrap();
    let told: Value =
        serde_json::from_str(&accepted(&["tune", &file, "--out", &out, "--json", "-"])).unwrap();
    assert_eq!(told["modes"][0]["moved"], Value::Null);
    assert_eq!(told["modes"][0]["box_from"], "floor");
    assert_eq!(told["recommended"]["type"], "si:0.05");
    let worst = told["recommended"]["worst_over_box"][0].as_f64().unwrap();
    assert!(worst > 0.03 && worst < 0.0501, "{worst}");
    // Nothing shorter is within the tolerance.
    for shaper in told["shapers"].as_array().unwrap() {
        let is_shorter = shaper["duration_s"].as_f64() < told["recommended"]["duration_s"].as_f64();
        assert!(!is_shorter || shaper["within_tolerance"] == false, "{shaper}");
    }
}

#[test]
fn what_gives_no_recommendation_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| within(folder.path(), name);
    let out = path("out");
    std::fs::write(path("quiet.csv"), decay_of(&[], 6.0)).unwrap();
    refused(&["tune", &path("quiet.csv"), "--out", &out], &["quiet.csv", "mode"]);
    std::fs::write(path("hum.csv"), decay_of(&[STAYS], 3.0)).unwrap();
    refused(&["tune", &path("hum.csv"), "--out", &out], &["no mode is left to shape for", "5.3", "--use"]);
    std::fs::write(path("knock.csv"), decay_of(&[RINGS], 6.0)).unwrap();
    let knock = path("knock.csv");
    refused(&["tune", &knock, "--use", "2", "--out", &out], &["--use 2", "modes 1 to 1"]);
    refused(&["tune", &knock, "--tolerance", "5", "--out", &out], &["--tolerance 5", "below 1"]);
    refused(&["tune", &knock, "--out", &knock], &["knock.csv"]);
    assert!(!Path::new(&out).join("table.json").exists());
    // A recording that a file of the folder would overwrite.
    std::fs::rename(&knock, path("out/table.json")).unwrap();
    let run = stillbeam(&["tune", &path("out/table.json"), "--format", "csv", "--out", &out]);
    assert!(run.code == 2 && run.messages.contains("would be written over"), "{}", run.messages);
}
