//! What the commands do when all is well.

use crate::support;

use serde_json::Value;
use support::{accepted, paper_beam, stillbeam};

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn every_subcommand_has_help_with_an_example() {
    let help = accepted(&["--help"]);
    for command in ["identify", "tune", "shape", "apply", "simulate", "model", "console", "flash", "demo"] {
        assert!(help.contains(command), "{command}");
        let help = accepted(&[command, "--help"]);
        assert!(help.contains("Example:") && help.contains(&format!("stillbeam {command}")), "{help}");
    }
}

#[test]
fn shape_writes_the_table_to_standard_output_and_nothing_else() {
    let run = stillbeam(&["shape", "--mode", "1.1,0.0074,zvd", "--mode", "6.9,0.0059,zv", "--json", "-"]);
    assert_eq!(run.code, 0, "{}", run.messages);
    let table = json(&run.out);
    assert_eq!(table["stages"][1]["type"], "zv");
    assert_eq!(table["rate_hz"], 4000.0);
}

#[test]
fn modes_go_from_identification_to_a_table_to_a_still_beam() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let modes = "{\"schema_version\":1,\"modes\":[\
        {\"frequency_hz\":{\"value\":1.09997,\"stderr\":1e-6},\"damping_ratio\":{\"value\":0.0074,\"stderr\":null}},\
        {\"frequency_hz\":{\"value\":6.89995,\"stderr\":1e-6},\"damping_ratio\":{\"value\":0.0033,\"stderr\":1e-6}}]}";
    std::fs::write(path("modes.json"), modes).unwrap();
    let (table, report) = (path("table.json"), path("table.html"));
    let from = path("modes.json");
    accepted(&["shape", "--modes-from", &from, "--type", "zvdd", "--json", &table, "--report", &report]);
    assert!(std::fs::read_to_string(report).unwrap().contains("<svg"));
    let beam = paper_beam();
    let simulate = |extra: &[&str]| {
        let mut arguments = vec!["simulate", &beam, "--command", "move 50mm", "--json", "-"];
        arguments.extend(extra);
        json(&accepted(&arguments))
    };
    let (shaped, unshaped) = (simulate(&["--shaper", &table, "--out", &path("move.csv")]), simulate(&[]));
    let vibration = |numbers: &Value| numbers["percentage_vibration_pct"].as_f64().unwrap();
    assert!((vibration(&unshaped) - 100.0).abs() < 1e-9);
    assert!(vibration(&shaped) < 0.05, "{shaped}");
    let recording = stillbeam_recording::read_csv(&folder.path().join("move.csv")).unwrap();
    assert_eq!(recording.column("setpoint_m").unwrap().last(), Some(&0.05));
    // The same table at another rate is a contradiction.
    let run = stillbeam(&["simulate", &beam, "--command", "move 50mm", "--shaper", &table, "--rate", "1000"]);
    assert_eq!(run.code, 2);
    assert!(run.messages.contains("4000") && run.messages.contains("1000"), "{}", run.messages);
}

#[test]
fn a_damaged_table_does_not_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("table.json");
    let table = accepted(&["shape", "--mode", "1.1,0.0074,zv", "--json", "-"]);
    let weight = json(&table)["stages"][0]["taps"][0]["weight"].to_string();
    let other = (weight.parse::<i64>().unwrap() + 1).to_string();
    std::fs::write(&file, table.replace(&weight, &other)).unwrap();
    let run =
        stillbeam(&["simulate", &paper_beam(), "--command", "move 50mm", "--shaper", file.to_str().unwrap()]);
    assert_eq!(run.code, 2);
    assert!(run.messages.contains("table.json") && run.messages.contains("weight"), "{}", run.messages);
}

#[test]
fn a_simulated_sweep_is_identified_and_its_model_reproduces_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    // A chirp of the base: 0.5 to 9 Hz in 20 s at 1 kHz.
    let mut sweep = "time_s,setpoint_m\n".to_owned();
    for k in 0..20_000 {
        let t = f64::from(k) / 1000.0;
        let phase = std::f64::consts::TAU * (0.5 * t + 0.5 * 8.5 / 20.0 * t * t);
        sweep += &format!("{t},{}\n", 1e-3 * phase.sin());
    }
    std::fs::write(path("input.csv"), sweep).unwrap();
    let beam = paper_beam();
    let simulated = path("simulated.csv");
    accepted(&["simulate", &beam, "--input", &path("input.csv"), "--out", &simulated]);
    let (modes, model, report) = (path("modes.json"), path("modal.toml"), path("modes.html"));
    let run = stillbeam(&[
        "identify",
        &simulated,
        "--input",
        "setpoint_m",
        "--modes",
        "2",
        "--json",
        &modes,
        "--model-out",
        &model,
        "--report",
        &report,
    ]);
    assert_eq!(run.code, 0, "{}", run.messages);
    assert!(run.messages.contains("output tip_deflection_m"), "says what it chose: {}", run.messages);
    let identified = json(&std::fs::read_to_string(modes).unwrap());
    let hz = |mode: usize| identified["modes"][mode]["frequency_hz"]["value"].as_f64().unwrap();
    assert!((hz(0) / 1.1 - 1.0).abs() < 1e-3 && (hz(1) / 6.9 - 1.0).abs() < 1e-3, "{} {}", hz(0), hz(1));
    let again = json(&accepted(&["simulate", &model, "--input", &simulated, "--json", "-"]));
    let nrmse = again["outputs"][0]["nrmse"].as_f64().unwrap();
    assert!(nrmse < 1e-3, "{nrmse}");
    let html = std::fs::read_to_string(report).unwrap();
    assert!(html.contains("<svg") && !html.contains("http://") && !html.contains("https://"));
}

/// What a sweep does does not depend on how densely its input was written down: between the samples lies a
/// cubic.
#[test]
fn a_recorded_input_is_read_between_its_samples() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let swept = |rate_hz: f64, name: &str| {
        let rows = (20.0 * rate_hz) as u32;
        let mut text = "time_s,setpoint_m\n".to_owned();
        for k in 0..=rows {
            let t = f64::from(k) / rate_hz;
            let taper = (0.5 * std::f64::consts::PI * (t / 2.0).min(1.0)).sin().powi(2);
            let phase = std::f64::consts::TAU * (0.5 * t + 0.5 * 0.35 * t * t);
            text += &format!("{t:.6},{:.12}\n", 1e-3 * taper * phase.sin());
        }
        std::fs::write(path(name), text).unwrap();
        accepted(&["simulate", &paper_beam(), "--input", &path(name), "--out", &path("out.csv")]);
        let out = stillbeam_recording::read_csv(&folder.path().join("out.csv")).unwrap();
        out.column("tip_deflection_m").unwrap().to_vec()
    };
    let (dense, coarse) = (swept(2000.0, "dense.csv"), swept(100.0, "coarse.csv"));
    assert_eq!(coarse.len(), 2001);
    let scale = dense.iter().fold(0.0_f64, |most, tip| most.max(tip.abs()));
    // Straight lines between samples at 100 Hz are off by 1.6 % at 7 Hz.
    for (k, tip) in coarse.iter().enumerate() {
        assert!((tip - dense[20 * k]).abs() < 2e-3 * scale, "{k}: {tip} {}", dense[20 * k]);
    }
}

/// The same of modes that ring within a few dozen samples.
#[test]
fn a_fast_input_is_followed_between_its_samples() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let text = "schema = 1\nkind = \"modal\"\n\
        mode = [{ frequency_hz = 40.0, damping_ratio = 0.01, participation = [1.0] },\n\
        { frequency_hz = 150.0, damping_ratio = 0.01, participation = [1.0] }]\n\
        input = { column = \"force_N\" }\noutput = [{ column = \"v_m_s\", quantity = \"velocity\" }]\n";
    std::fs::write(path("modes.toml"), text).unwrap();
    let driven = |rate_hz: f64| {
        let mut text = "time_s,force_N\n".to_owned();
        for k in 0..=(2.0 * rate_hz) as u32 {
            let t = f64::from(k) / rate_hz;
            let tones = [37.0, 81.0, 149.0, 180.0].map(|hz| (std::f64::consts::TAU * hz * t).sin());
            text += &format!("{t:.8},{:.12}\n", t.min(1.0).powi(3) * tones.iter().sum::<f64>());
        }
        std::fs::write(path("in.csv"), text).unwrap();
        let [model, input, out] = ["modes.toml", "in.csv", "out.csv"].map(path);
        accepted(&["simulate", &model, "--input", &input, "--out", &out]);
        stillbeam_recording::read_csv(&folder.path().join("out.csv"))
            .unwrap()
            .column("v_m_s")
            .unwrap()
            .to_vec()
    };
    let (dense, coarse) = (driven(32_000.0), driven(2_000.0));
    let scale = dense.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    let apart = coarse.iter().enumerate().map(|(k, v)| (v - dense[16 * k]).abs()).fold(0.0, f64::max);
    // Two lines to an interval are off by 7e-3.
    assert!(apart < 5e-4 * scale, "{:.1e} of the motion", apart / scale);
}

#[test]
fn a_recorded_input_can_be_shaped() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(path("step.csv"), "time_s,setpoint_m\n0,0\n0.1,0\n0.3,0.02\n4,0.02\n").unwrap();
    let table = path("table.json");
    accepted(&["shape", "--mode", "1.09997,0.0074", "--mode", "6.89995,0.0033", "--json", &table]);
    let out = path("out.csv");
    accepted(&["simulate", &paper_beam(), "--input", &path("step.csv"), "--shaper", &table, "--out", &out]);
    let shaped = stillbeam_recording::read_csv(&folder.path().join("out.csv")).unwrap();
    let tip_m = shaped.column("tip_deflection_m").unwrap();
    let late = shaped.time_s.iter().zip(tip_m).filter(|(time_s, _)| **time_s > 1.6);
    let left_m = late.map(|(_, tip_m)| tip_m.abs()).fold(0.0, f64::max);
    assert!(left_m < 2e-6, "{left_m}");
    assert_eq!(shaped.column("setpoint_m").unwrap().last(), Some(&0.02));
}

#[test]
fn the_model_command_prints_the_paper_frequencies() {
    let modes = json(&accepted(&["model", &paper_beam(), "--json", "-"]));
    let held = |mode: usize| modes["base_held"][mode]["frequency_hz"].as_f64().unwrap();
    assert!((held(0) - 1.1).abs() < 0.005 && (held(1) - 6.9).abs() < 0.005);
    let free = modes["base_free"][0]["frequency_hz"].as_f64().unwrap();
    assert!(free > held(0));
    assert!(accepted(&["model", &paper_beam()]).contains("with the base free"));
}

#[test]
fn console_commands_are_answered_and_refusals_end_in_two() {
    let reply = accepted(&[
        "console",
        "--port",
        "core",
        "--command",
        "set mode1.type zv",
        "--command",
        "get mode1.type",
    ]);
    assert!(reply.ends_with("mode1.type = off [off] {-} staged zv\nok get\n"), "{reply}");
    let run = stillbeam(&["console", "--port", "core", "--command", "set mode1.frequency_hz 0"]);
    assert_eq!(run.code, 2);
    assert!(run.messages.contains("mode1.frequency_hz") && run.messages.contains("0.01"), "{}", run.messages);
}

#[test]
fn flash_without_a_programmer_says_how_to_get_one() {
    let empty = tempfile::tempdir().unwrap();
    let run = std::process::Command::new(env!("CARGO_BIN_EXE_stillbeam"))
        .arg("flash")
        .env("PATH", empty.path())
        .output()
        .unwrap();
    let messages = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(2), "{messages}");
    assert!(messages.contains("cargo install probe-rs-tools"), "{messages}");
}

#[test]
fn a_reader_that_has_enough_is_no_failure() {
    use std::process::{Command, Stdio};
    let mut child = Command::new(env!("CARGO_BIN_EXE_stillbeam"))
        .args(["shape", "--mode", "1.1,0.0074", "--json", "-"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let run = child.wait_with_output().unwrap();
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
}

#[test]
fn a_real_beam_rings_at_its_known_frequencies() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let data = std::env::var_os("STILLBEAM_DATA").map_or(root, std::path::PathBuf::from);
    let file = data.join("cantilever_downey/beam_impulse_ringdown.csv");
    if !file.is_file() {
        println!("not run: {} is not here; set STILLBEAM_DATA to the folder that holds it", file.display());
        return;
    }
    let identified = json(&accepted(&["identify", file.to_str().unwrap(), "--json", "-"]));
    for (mode, hz) in [6.62, 41.4, 117.0].into_iter().enumerate() {
        let found = identified["modes"][mode]["frequency_hz"]["value"].as_f64().unwrap();
        assert!((found / hz - 1.0).abs() < 5e-3, "{found} where {hz} is known");
    }
}

/// Friction in the base shows in the next simulated move: the servo's force cannot move it home.
#[test]
fn a_move_of_an_extended_model_feels_its_friction() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let text = std::fs::read_to_string(paper_beam()).unwrap();
    let controlled = text.replace("column = \"setpoint_m\"", "column = \"force_N\"")
        + "\n[controller]\nkind = \"cascade_pd\"\nkp = 30.0\nkv = 250.0\nsample_s = 0.001\nreference_column = \"setpoint_m\"\n";
    // The controller feeds back the base's position: it comes first.
    let (tip, base) = ("column = \"tip_deflection_m\"", "column = \"base_position_m\"");
    let controlled = controlled.replace(tip, "TIP").replace(base, tip).replace("TIP", base);
    let friction =
        "\n[[physics]]\nid = \"coulomb_friction\"\nlocation = \"base\"\nparameters = { force = 3.0 }\n";
    std::fs::write(path("free.toml"), &controlled).unwrap();
    std::fs::write(path("rubs.toml"), controlled + friction).unwrap();
    let end = |model: &str, out: &str| {
        let (model, out) = (path(model), path(out));
        let arguments =
            ["simulate", &model, "--command", "move 50mm", "--rate", "1000", "--json", "-", "--out", &out];
        let numbers = json(&accepted(&arguments));
        assert!(numbers["residual_peak_m"].as_f64().unwrap() > 1e-3, "{numbers}");
        let recording = stillbeam_recording::read_csv(folder.path().join(&out).as_path()).unwrap();
        *recording.column("base_position_m").unwrap().last().unwrap()
    };
    let (free, rubs) = (end("free.toml", "free.csv"), end("rubs.toml", "rubs.csv"));
    // It sticks within force / (kp kv) = 0.4 mm of the target, and does not creep home.
    assert!((rubs - 0.05).abs() < 3.0 / 7500.0 + 1e-4, "{rubs}");
    assert!((rubs - free).abs() > 2e-5, "{free} {rubs}");
    let modes = json(&accepted(&["model", &path("rubs.toml"), "--json", "-"]));
    assert_eq!(modes["base_held"].as_array().unwrap().len(), 2);
}

#[test]
fn a_lumped_model_has_modes_and_a_simulation() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let model = "schema = 1\nkind = \"lumped\"\n[[body]]\nname = \"slider\"\nmass = 4.0\n\
        [[spring]]\nbetween = [\"slider\", \"ground\"]\nstiffness = 400.0\n\
        [input]\ncolumn = \"motor_force_N\"\nbody = \"slider\"\n[[output]]\ncolumn = \"position_m\"\nbody = \"slider\"\n";
    std::fs::write(path("slider.toml"), model).unwrap();
    let modes = json(&accepted(&["model", &path("slider.toml"), "--json", "-"]));
    let frequency_hz = modes["base_held"][0]["frequency_hz"].as_f64().unwrap();
    assert!((frequency_hz - 10.0 / std::f64::consts::TAU).abs() < 1e-9, "{modes}");
    std::fs::write(path("push.csv"), "time_s,motor_force_N\n0,0\n0.1,4\n0.2,4\n0.3,4\n").unwrap();
    let numbers =
        json(&accepted(&["simulate", &path("slider.toml"), "--input", &path("push.csv"), "--json", "-"]));
    assert_eq!(numbers["outputs"][0]["column"], "position_m");
    assert!(numbers["outputs"][0]["highest"].as_f64().unwrap() > 0.005);
}

#[test]
fn identified_modes_go_onto_a_board_with_their_boxes() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("modes.json").display().to_string();
    let estimate = |value: f64, stderr: f64| serde_json::json!({"value": value, "stderr": stderr});
    let mode = |hz: f64, frequencies: [f64; 2]| {
        serde_json::json!({
            "frequency_hz": estimate(hz, 1e-4), "damping_ratio": estimate(0.0071, 1e-4),
            "uncertainty_box": {"frequency_hz": frequencies, "damping_ratio": [0.006, 0.008]},
        })
    };
    // One mode known well, one that may be anywhere in a band of 20 %.
    let modes = [mode(1.1, [1.0998, 1.1002]), mode(6.9, [6.2, 7.6])];
    std::fs::write(&file, serde_json::json!({"schema_version": 1, "modes": modes}).to_string()).unwrap();
    let applied = json(&accepted(&["apply", &file, "--port", "core", "--json", "-"]));
    assert_eq!(
        applied["modes"][0]["type"], "zvd",
        "a machine moves by more than one recording's standard errors"
    );
    let applied = json(&accepted(&["apply", &file, "--port", "core", "--box-floor", "0%", "--json", "-"]));
    assert_eq!(applied["modes"][0]["type"], "zv");
    let wide = applied["modes"][1]["type"].as_str().unwrap();
    assert!(["zvd", "zvdd", "zvddd"].contains(&wide), "{applied}");
    for mode in applied["modes"].as_array().unwrap() {
        assert!(mode["worst_over_box"].as_f64().unwrap() <= 0.05, "{applied}");
        assert!(mode["uncertainty_box"]["frequency_hz"][0].is_number());
    }
    // The same table as `shape` would design.
    let types = format!("6.9,0.0071,{wide}");
    let table = json(&accepted(&["shape", "--mode", "1.1,0.0071,zv", "--mode", &types, "--json", "-"]));
    assert_eq!(table["crc32"], applied["crc32"]);
    // A type that is not robust enough is set as asked, and said so.
    let run = stillbeam(&["apply", &file, "--port", "core", "--use", "2", "--type", "zv"]);
    assert!(run.code == 0 && run.messages.contains("shape --optimal"), "{}", run.messages);
    for (arguments, part) in
        [(["--use", "3"], "1 to 2"), (["--tolerance", "0"], "--tolerance 0"), (["--type", "zvx"], "zvx")]
    {
        let run = stillbeam(&["apply", &file, "--port", "core", arguments[0], arguments[1]]);
        assert!(run.code == 2 && run.messages.contains(part), "{}", run.messages);
    }
    let unknown =
        serde_json::json!({"modes": [{"frequency_hz": {"value": 1.1}, "damping_ratio": {"value": 0.01}}]});
    std::fs::write(&file, unknown.to_string()).unwrap();
    let run = stillbeam(&["apply", &file, "--port", "core"]);
    assert!(run.code == 2 && run.messages.contains("no standard errors"), "{}", run.messages);
}

/// A loop hides how wrong a friction is; its force as recorded does not. What is written is the model with
/// its controller again.
#[test]
fn a_refit_open_loop_moves_the_laws_that_the_model_has_and_keeps_its_controller() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let axis = |force: f64| {
        format!(
            "schema = 1\nkind = \"lumped\"\n[[body]]\nname = \"slider\"\nmass = 40.0\n\
            [[damper]]\nbetween = [\"slider\", \"ground\"]\ndamping = 200.0\n\
            [input]\ncolumn = \"motor_force_N\"\nbody = \"slider\"\n[[output]]\ncolumn = \"position_m\"\nbody = \"slider\"\n\
            [controller]\nkind = \"cascade_pd\"\nkp = 60.0\nkv = 3000.0\nsample_s = 0.002\nreference_column = \"reference_m\"\n\
            [[physics]]\nid = \"coulomb_friction\"\nlocation = \"slider\"\nparameters = {{ force = {force:?} }}\n"
        )
    };
    std::fs::write(path("true.toml"), axis(12.0)).unwrap();
    std::fs::write(path("given.toml"), axis(9.0)).unwrap();
    for (name, rate) in [("first", 1.3), ("second", 2.1)] {
        let line = |k: u32| {
            let t = 0.002 * f64::from(k);
            format!("{t:.3},{:.6},0\n", 0.1 * (1.0 - (rate * t).cos()))
        };
        let lines: String = (0..4000).map(line).collect();
        std::fs::write(path("asked.csv"), format!("time_s,reference_m,motor_force_N\n{lines}")).unwrap();
        let run = path(&format!("{name}.csv"));
        accepted(&["simulate", &path("true.toml"), "--input", &path("asked.csv"), "--out", &run]);
    }
    let (given, first, second) = (path("given.toml"), path("first.csv"), path("second.csv"));
    let refitted = path("refitted.toml");
    let files = ["diagnose", &given, &first, "--held-out", &second, "--refitted-model", &refitted];
    accepted(&[&files[..], &["--open-loop", "--processor-limit", "1"]].concat());
    let refitted = stillbeam_plant::Model::read(std::path::Path::new(&refitted)).unwrap();
    let force = refitted.setup().physics[0].parameters["force"];
    assert!((force - 12.0).abs() < 0.5, "{force}");
    assert!(refitted.setup().controller.is_some());
}
