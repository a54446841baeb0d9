//! What `identify` hands on: a model that simulates what was recorded, and several recordings in one.

use crate::support;

use support::{accepted, paper_beam, stillbeam};

/// A sweep of the setpoint in a file, and what the paper's beam makes of it.
fn recording(folder: &std::path::Path, name: &str, seconds: f64, low_hz: f64) -> String {
    recording_of(&paper_beam(), folder, (name, "setpoint_m"), seconds, low_hz)
}

/// The same of another model.
fn recording_of(
    model: &str,
    folder: &std::path::Path,
    (name, column): (&str, &str),
    seconds: f64,
    low_hz: f64,
) -> String {
    let path = |name: String| folder.join(name).display().to_string();
    let mut sweep = format!("time_s,{column}\n");
    for k in 0..(500.0 * seconds) as u32 {
        let t = f64::from(k) / 500.0;
        let phase = std::f64::consts::TAU * (low_hz * t + 0.5 * (8.0 - low_hz) / seconds * t * t);
        sweep += &format!("{t},{}\n", 1e-3 * phase.sin());
    }
    let input = path(format!("{name}_input.csv"));
    std::fs::write(&input, sweep).unwrap();
    let out = path(format!("{name}.csv"));
    accepted(&["simulate", model, "--input", &input, "--out", &out]);
    out
}

#[test]
fn recordings_together_give_one_model_that_simulates_them_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (first, second) =
        (recording(folder.path(), "a", 25.0, 0.3), recording(folder.path(), "b", 18.0, 0.6));
    let (modes, model, page, again) = (path("m.json"), path("m.toml"), path("m.html"), path("again.csv"));
    let run = stillbeam(&[
        "identify",
        &first,
        &second,
        "--input",
        "setpoint_m",
        "--json",
        &modes,
        "--model-out",
        &model,
        "--report",
        &page,
    ]);
    assert_eq!(run.code, 0, "{}", run.messages);
    let found: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&modes).unwrap()).unwrap();
    assert_eq!(found["recordings"].as_array().unwrap().len(), 2);
    assert_eq!(found["together"]["records"].as_array().unwrap().len(), 2);
    let held = |mode: usize, hz: f64| {
        let range = &found["modes"][mode]["uncertainty_box"]["frequency_hz"];
        range[0].as_f64().unwrap() < hz * 1.001 && range[1].as_f64().unwrap() > hz * 0.999
    };
    assert!(held(0, 1.1) && held(1, 6.9), "{}", found["modes"]);

    accepted(&["simulate", &model, "--input", &first, "--out", &again]);
    let share = apart(&first, &again);
    assert!(share < 0.01, "{share}");
}

#[test]
fn a_machine_that_was_recorded_in_millimetres_has_a_model_in_metres() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let recorded = recording(folder.path(), "a", 25.0, 0.3);
    let (millimetres, model) = (path("mm.csv"), path("m.toml"));
    let scaled = ["--column", "ref_mm=setpoint_m*1000", "--column", "tip_mm=tip_deflection_m*1000"];
    accepted(&[&["convert", &recorded, &millimetres], scaled.as_slice()].concat());
    let run = stillbeam(&[
        "identify",
        &millimetres,
        "--input",
        "ref_mm",
        "--output",
        "tip_mm",
        "--modes",
        "2",
        "--model-out",
        &model,
    ]);
    assert_eq!(run.code, 0, "{}", run.messages);
    assert!(run.messages.contains("--column base_position_m=ref_mm*0.001"), "{}", run.messages);
    let (metres, again) = (path("metres.csv"), path("again.csv"));
    let read = ["--column", "base_position_m=ref_mm*0.001", "--column", "tip_mm=tip_mm"];
    accepted(&[&["convert", &millimetres, &metres], read.as_slice()].concat());
    accepted(&["simulate", &model, "--input", &metres, "--out", &again]);
    let share = columns_apart(&metres, &again, "tip_mm");
    assert!(share < 0.01, "{share}");
    // The motion as it was called would be taken for a force.
    let text = std::fs::read_to_string(&model).unwrap().replace("base_position_m", "ref_mm");
    std::fs::write(path("force.toml"), text).unwrap();
    let refused = stillbeam(&["simulate", &path("force.toml"), "--input", &millimetres]);
    assert_eq!(refused.code, 2);
    assert!(refused.messages.contains("base_position_m=ref_mm*0.001"), "{}", refused.messages);
}

#[test]
fn the_real_pole_of_a_base_with_friction_travels_with_the_model() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let beam = std::fs::read_to_string(paper_beam()).unwrap();
    let pushed = beam
        .replace("viscous_N_s_m = 0.0", "viscous_N_s_m = 4.0")
        .replace("column = \"setpoint_m\"", "column = \"force_N\"");
    std::fs::write(path("truth.toml"), pushed).unwrap();
    let first = recording_of(&path("truth.toml"), folder.path(), ("pushed", "force_N"), 40.0, 0.1);
    let (modes, model) = (path("m.json"), path("m.toml"));
    let columns = ["--input", "force_N", "--output", "tip_deflection_m"];
    let mut arguments = vec!["identify", &first, "--json", &modes, "--model-out", &model];
    arguments.extend(columns);
    let told = accepted(&arguments);
    assert!(told.contains("real pole, time constant 0.6"), "{told}");
    let found: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&modes).unwrap()).unwrap();
    assert_eq!(found["modes"].as_array().unwrap().len(), 2, "{}", found["modes"]);
    accepted(&["simulate", &model, "--input", &first, "--out", &path("again.csv")]);
    let share = apart(&first, &path("again.csv"));
    assert!(share < 1e-3, "{share}");
    // Without it the model would be off by some percent.
    let text = std::fs::read_to_string(&model).unwrap();
    let without: Vec<&str> = text
        .lines()
        .filter(|line| !line.starts_with("rate_participation") && !line.starts_with("time_constant_s"))
        .collect();
    let (before, after) = without.split_at(without.iter().position(|line| *line == "[real_pole]").unwrap());
    std::fs::write(path("phased.toml"), [before, &after[2..]].concat().join("\n")).unwrap();
    accepted(&["simulate", &path("phased.toml"), "--input", &first, "--out", &path("phased.csv")]);
    let share = apart(&first, &path("phased.csv"));
    assert!(share > 0.02, "{share}");
    // The diagnosis takes it as it is, and where it starts from rest leaves the noise alone.
    std::fs::write(path("noisy.csv"), noisy(&first, 1e-7)).unwrap();
    accepted(&["diagnose", &model, &path("noisy.csv"), "--json", &path("d.json")]);
    let judged: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(path("d.json")).unwrap()).unwrap();
    let left = judged["fit"]["recordings"][0]["given"]["rms"].as_f64().unwrap();
    assert!((left / 1e-7 - 1.0).abs() < 0.05, "{left}");
}

/// A file with noise of this rms on its tip: sums of twelve even numbers from a small generator.
fn noisy(file: &str, rms: f64) -> String {
    let text = std::fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let at = header.split(',').position(|name| name == "tip_deflection_m").unwrap();
    let mut state = 1_u64;
    let mut even = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let rows = lines.map(|line| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        let noise: f64 = (0..12).map(|_| even()).sum();
        cells[at] = (cells[at].parse::<f64>().unwrap() + rms * noise).to_string();
        cells.join(",")
    });
    std::iter::once(header.to_owned()).chain(rows).collect::<Vec<_>>().join("\n")
}

/// The rms of the difference of two files' tips over the rms of the first.
fn apart(first: &str, second: &str) -> f64 {
    columns_apart(first, second, "tip_deflection_m")
}

/// How far apart two recordings of a column are, as a share of the first.
fn columns_apart(first: &str, second: &str, column: &str) -> f64 {
    let tip = |file: &str| {
        let text = std::fs::read_to_string(file).unwrap();
        let at = text.lines().next().unwrap().split(',').position(|name| name == column).unwrap();
        let cell = |line: &str| line.split(',').nth(at).unwrap().parse::<f64>().unwrap();
        text.lines().skip(1).map(cell).collect::<Vec<f64>>()
    };
    let (recorded, simulated) = (tip(first), tip(second));
    assert_eq!(recorded.len(), simulated.len());
    let power = |values: &[f64]| values.iter().map(|y| y * y).sum::<f64>();
    let apart: Vec<f64> = recorded.iter().zip(&simulated).map(|(a, b)| a - b).collect();
    (power(&apart) / power(&recorded)).sqrt()
}

#[test]
fn the_delay_and_the_static_share_travel_with_the_model() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let truth = r#"
        schema = 1
        kind = "modal"
        mode = [
            { frequency_hz = 1.1, damping_ratio = 0.02, participation = [1.5] },
            { frequency_hz = 5.0, damping_ratio = 0.02, participation = [-0.9] },
            { frequency_hz = 70.0, damping_ratio = 0.01, participation = [900.0] },
        ]
        input = { column = "force_N" }
        output = [{ column = "tip_deflection_m", quantity = "position" }]
        sensor = [{ column = "tip_deflection_m", delay_s = 0.013 }]
    "#;
    std::fs::write(path("truth.toml"), truth).unwrap();
    let first = recording_of(&path("truth.toml"), folder.path(), ("delayed", "force_N"), 25.0, 0.3);
    let (modes, model) = (path("m.json"), path("m.toml"));
    let columns = ["--input", "force_N", "--output", "tip_deflection_m"];
    let mut arguments = vec!["identify", &first, "--modes", "2", "--json", &modes, "--model-out", &model];
    arguments.extend(columns);
    accepted(&arguments);
    let found: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&modes).unwrap()).unwrap();
    let delay_s = found["delay_s"]["value"].as_f64().unwrap();
    assert!((delay_s - 0.013).abs() < 2e-4, "{delay_s}");
    let direct = found["direct"]["value"].as_f64().unwrap();
    let compliance = 900.0 / (std::f64::consts::TAU * 70.0).powi(2);
    assert!((direct / compliance - 1.0).abs() < 0.05, "{direct} {compliance}");
    let text = std::fs::read_to_string(&model).unwrap();
    assert!(text.contains("delay_s") && text.contains("mode.3.participation"), "{text}");
    accepted(&["simulate", &model, "--input", &first, "--out", &path("again.csv")]);
    let share = apart(&first, &path("again.csv"));
    assert!(share < 0.005, "{share}");
    // The diagnosis reads every format: it gets as far as the column that this recording lacks.
    std::fs::write(path("other.toml"), text.replace("force_N", "current_A")).unwrap();
    accepted(&["convert", &first, &path("delayed.uff")]);
    let run = stillbeam(&["diagnose", &path("other.toml"), &path("delayed.uff")]);
    assert!(run.code == 2 && run.messages.contains("read as uff58"), "{}", run.messages);
    assert!(run.messages.contains("current_A"), "{}", run.messages);
}
