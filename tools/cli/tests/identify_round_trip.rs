//! What `identify` hands on: a model that simulates what was recorded, and several recordings in one.

mod support;

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

/// The rms of the difference of two files' tips over the rms of the first.
fn apart(first: &str, second: &str) -> f64 {
    let tip = |file: &str| {
        let text = std::fs::read_to_string(file).unwrap();
        let at = text.lines().next().unwrap().split(',').position(|name| name == "tip_deflection_m").unwrap();
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
