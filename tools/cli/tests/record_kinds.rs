//! Records without an input on the command line: refused with what they need, or read as what they are.

use crate::support;

use std::f64::consts::TAU;
use std::fmt::Write;

use support::{accepted, refused};

/// A file of these columns over 40 s at 100 Hz.
fn file(folder: &std::path::Path, name: &str, columns: &[(&str, &dyn Fn(f64) -> f64)]) -> String {
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let mut text = format!("time_s,{}\n", names.join(","));
    for k in 0..4000 {
        let t = 0.01 * f64::from(k);
        write!(text, "{t}").unwrap();
        columns.iter().for_each(|(_, value)| write!(text, ",{}", value(t)).unwrap());
        text += "\n";
    }
    let path = folder.join(name).display().to_string();
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn a_sweep_without_an_input_is_refused_with_the_column_that_drives_it() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = |t: f64| (TAU * (0.5 * t + 0.5 * 0.4 * t * t)).sin();
    let answer = |t: f64| 1.7 * sweep(t - 0.05);
    let both = file(folder.path(), "both.csv", &[("setpoint_m", &sweep), ("acc_m_s2", &answer)]);
    refused(&["identify", &both], &["sweep", "linearly", "--input setpoint_m"]);
    let alone = file(folder.path(), "alone.csv", &[("acc_m_s2", &answer)]);
    refused(&["identify", &alone], &["sweep", "name that with `--input`"]);
}

#[test]
fn a_decay_says_that_it_is_one_and_ends_where_it_is_told_to() {
    let folder = tempfile::tempdir().unwrap();
    let decay = |t: f64| (-0.2 * t).exp() * (TAU * 3.0 * t).cos();
    let path = file(folder.path(), "decay.csv", &[("tip_m", &decay)]);
    let json: serde_json::Value =
        serde_json::from_str(&accepted(&["identify", &path, "--end", "9.5", "--json", "-"])).unwrap();
    assert_eq!(json["kind"], "free_decay");
    assert!(json["window_s"][1].as_f64().unwrap() <= 9.5, "{}", json["window_s"]);
}
