//! What `identify` hands on: a model that simulates what was recorded, and several recordings in one.

mod support;

use support::{accepted, paper_beam, stillbeam};

/// A sweep of the setpoint in a file, and what the paper's beam makes of it.
fn recording(folder: &std::path::Path, name: &str, seconds: f64, low_hz: f64) -> String {
    let path = |name: String| folder.join(name).display().to_string();
    let mut sweep = "time_s,setpoint_m\n".to_owned();
    for k in 0..(500.0 * seconds) as u32 {
        let t = f64::from(k) / 500.0;
        let phase = std::f64::consts::TAU * (low_hz * t + 0.5 * (8.0 - low_hz) / seconds * t * t);
        sweep += &format!("{t},{}\n", 1e-3 * phase.sin());
    }
    let input = path(format!("{name}_input.csv"));
    std::fs::write(&input, sweep).unwrap();
    let out = path(format!("{name}.csv"));
    accepted(&["simulate", &paper_beam(), "--input", &input, "--out", &out]);
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
    let tip = |file: &str| {
        let text = std::fs::read_to_string(file).unwrap();
        let at = text.lines().next().unwrap().split(',').position(|name| name == "tip_deflection_m").unwrap();
        let cell = |line: &str| line.split(',').nth(at).unwrap().parse::<f64>().unwrap();
        text.lines().skip(1).map(cell).collect::<Vec<f64>>()
    };
    let (recorded, simulated) = (tip(&first), tip(&again));
    let power = |values: &[f64]| values.iter().map(|y| y * y).sum::<f64>();
    let apart: Vec<f64> = recorded.iter().zip(&simulated).map(|(a, b)| a - b).collect();
    let share = (power(&apart) / power(&recorded)).sqrt();
    assert!(recorded.len() == simulated.len() && share < 0.01, "{share}");
}
