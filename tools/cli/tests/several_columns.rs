//! Recordings of several columns of which nobody says which responds: the strongest is read, and said to be.

use crate::support;

use std::f64::consts::TAU;
use std::fmt::Write;

use support::{refused, stillbeam};

/// 6 s at 400 Hz.
const SAMPLES: u32 = 2400;

type Signal = Box<dyn Fn(f64) -> f64>;

fn decay(hz: f64, size: f64) -> Signal {
    Box::new(move |t| size * (-0.9 * t).exp() * (TAU * hz * t).cos() + size * noise(t, 0.002))
}

/// Noise without a generator: the digits of a product that no line of the record follows.
fn noise(t: f64, size: f64) -> f64 {
    let digits = (t * 400.0 + 1.0) * 0.618_033_988_749_895 * (t * 7919.0 + 3.0);
    2.0 * size * (digits.fract() - 0.5)
}

fn identified(columns: &[(&str, Signal)]) -> (Vec<f64>, String) {
    let folder = tempfile::tempdir().unwrap();
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let mut text = format!("time_s,{}\n", names.join(","));
    for k in 0..SAMPLES {
        let t = f64::from(k) / 400.0;
        write!(text, "{t}").unwrap();
        columns.iter().for_each(|(_, value)| write!(text, ",{}", value(t)).unwrap());
        text += "\n";
    }
    let path = folder.path().join("record.csv").display().to_string();
    std::fs::write(&path, text).unwrap();
    let run = stillbeam(&["identify", &path, "--json", "-"]);
    assert_eq!(run.code, 0, "{}", run.messages);
    let json: serde_json::Value = serde_json::from_str(&run.out).unwrap();
    let hz = |mode: &serde_json::Value| mode["frequency_hz"]["value"].as_f64().unwrap();
    (json["modes"].as_array().unwrap().iter().map(hz).collect(), run.messages)
}

#[test]
fn the_strongest_of_several_columns_is_read_and_the_others_are_named() {
    let still: fn(f64) -> f64 = |t| noise(t, 0.01);
    let magnitude: Signal = Box::new(|t| 3.0 * (decay(17.0, 1.0)(t)).abs());
    let layouts: [(&str, Vec<(&str, Signal)>); 4] = [
        (
            "acc_y_g",
            vec![
                ("acc_x_g", Box::new(still)),
                ("acc_y_g", decay(17.0, 1.0)),
                ("acc_z_g", Box::new(|t| 1.0 + noise(t, 0.02))),
            ],
        ),
        // Units cannot be compared: a thermometer in thousandths drifts far.
        (
            "acc_g",
            vec![
                ("thermometer_mK", Box::new(|t| 20_000.0 + 90.0 * t * t + 5.0 * noise(t, 1.0))),
                ("acc_g", decay(17.0, 0.01)),
            ],
        ),
        // Counters and clocks only rise; a magnitude rings at twice the frequency.
        (
            "acc_x_g",
            vec![
                ("seq_number", Box::new(|t| (t * 400.0).round())),
                ("acc_x_g", decay(17.0, 1.0)),
                ("absolute_acc_g", magnitude),
            ],
        ),
        ("right_V", vec![("left_V", Box::new(|t| 1.65 + noise(t, 0.3))), ("right_V", decay(17.0, 1.2))]),
    ];
    for (strongest, columns) in layouts {
        let (hz, messages) = identified(&columns);
        assert!(matches!(hz.as_slice(), [one] if (one / 17.0 - 1.0).abs() < 1e-3), "{strongest}: {hz:?}");
        assert!(
            messages.contains(&format!("output {strongest} (the strongest; --output names another:")),
            "{messages}"
        );
        assert!(!messages.contains("is loudest at"), "{messages}");
    }
}

#[test]
fn a_column_that_is_loudest_where_no_mode_was_found_is_pointed_at() {
    for other_hz in [7.0, 31.0, 90.0] {
        let (hz, messages) = identified(&[("acc_x_g", decay(17.0, 1.0)), ("acc_y_g", decay(other_hz, 0.4))]);
        assert!(matches!(hz.as_slice(), [one] if (one / 17.0 - 1.0).abs() < 1e-3), "{hz:?}");
        let said = messages.lines().find(|line| line.contains("acc_y_g is loudest at")).unwrap();
        let found: f64 = said.split(' ').nth(4).unwrap().parse().unwrap();
        assert!((found / other_hz - 1.0).abs() < 0.05 && said.contains("--output acc_y_g"), "{said}");
    }
}

#[test]
fn columns_of_which_none_vibrates_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..200).map(|k| format!("{},{k},{}\n", 0.01 * f64::from(k), 2 * k)).collect();
    let path = folder.path().join("counters.csv").display().to_string();
    std::fs::write(&path, format!("time_s,odometer_m,energy_J\n{rows}")).unwrap();
    refused(&["identify", &path], &["none of the columns odometer_m, energy_J vibrates", "--output"]);
}

/// A move of 100 mm in 0.25 s, seen by a laser beside the machine, in mm, and what the tip does about it.
fn laser_beside_a_move(path: &str, hz: f64) {
    const FINE: u32 = 40;
    let (step, omega) = (1.0 / (400.0 * f64::from(FINE)), TAU * hz);
    let (mut place, mut speed) = (0.0, 0.0);
    let mut text = "time_s,setpoint_mm,laser_mm\n".to_owned();
    for k in 0..SAMPLES * FINE {
        let t = f64::from(k) * step;
        let x = ((t - 0.3) / 0.25).clamp(0.0, 1.0);
        let setpoint = 100.0 * (10.0 * x.powi(3) - 15.0 * x.powi(4) + 6.0 * x.powi(5));
        if k.is_multiple_of(FINE) {
            writeln!(text, "{t},{setpoint},{}", place + noise(t, 0.02)).unwrap();
        }
        speed += step * (omega * omega * (setpoint - place) - 0.026 * omega * speed);
        place += step * speed;
    }
    std::fs::write(path, text).unwrap();
}

#[test]
fn an_output_that_holds_the_base_motion_is_told_and_the_way_out_works() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("move.csv").display().to_string();
    for hz in [5.1, 6.3, 8.2] {
        laser_beside_a_move(&path, hz);
        let run = stillbeam(&["identify", &path, "--input", "setpoint_mm"]);
        let said =
            run.messages.lines().find(|line| line.contains("laser_mm moves as setpoint_mm does")).unwrap();
        let from = said.find("--column").unwrap();
        let options: Vec<&str> = said[from..].split(',').next().unwrap().split(' ').collect();
        let run = stillbeam(&[&["identify", path.as_str(), "--json", "-"], options.as_slice()].concat());
        assert_eq!(run.code, 0, "{options:?}: {}", run.messages);
        assert!(!run.messages.contains("moves as"), "{}", run.messages);
        let json: serde_json::Value = serde_json::from_str(&run.out).unwrap();
        let found = json["modes"][0]["frequency_hz"]["value"].as_f64().unwrap();
        let damping = json["modes"][0]["damping_ratio"]["value"].as_f64().unwrap();
        assert!((found / hz - 1.0).abs() < 1e-3 && (damping / 0.013 - 1.0).abs() < 0.02, "{found} {damping}");
    }
}
