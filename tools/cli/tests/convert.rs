//! `stillbeam convert`, and other formats where recordings are read.

use crate::support;

use support::{accepted, refused, stillbeam};

fn sample(name: &str) -> String {
    format!("{}/../recording/tests/files/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn every_format_goes_in_and_out_of_the_command() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    accepted(&["convert", &sample("conventional_v7.mat"), &path("a.csv")]);
    accepted(&["convert", &path("a.csv"), &path("b.uff")]);
    accepted(&["convert", &path("b.uff"), &path("c.unv"), "--to", "uff58b"]);
    accepted(&["convert", &path("c.unv"), &path("d.json")]);
    let csv = accepted(&["convert", &path("c.unv"), "-"]);
    assert!(csv.starts_with("time_s,tip_deflection_m,force_N\n0,0.001"), "{csv}");
    assert_eq!(csv.lines().count(), 41);
    let json = std::fs::read_to_string(path("d.json")).unwrap();
    assert!(json.contains("\"tip_deflection_m\":[0.001"), "{json}");
}

#[test]
fn what_a_file_leaves_open_is_said_on_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.csv").to_str().unwrap().to_owned();
    let foreign = sample("foreign_v7.mat");
    let timeless = folder.path().join("timeless.txt").to_str().unwrap().to_owned();
    let vector = "# name: Y\n# type: matrix\n# rows: 4\n# columns: 1\n 1\n 2\n 4\n 3\n\n\n";
    std::fs::write(
        &timeless,
        format!("# Created by Octave 8.4.0, Sun Mar 02 09:15:07 2025 UTC <lab@pc>\n{vector}"),
    )
    .unwrap();
    refused(&["convert", &timeless, &out], &["timeless.txt", "`Y` (4 x 1)", "--time"]);
    refused(&["convert", &foreign, &out, "--column", "tip=run1.Y:1"], &["unit"]);
    refused(&["convert", &foreign, &out, "--sample-rate", "-5"], &["--sample-rate -5"]);
    refused(&["convert", &foreign, &out, "--format", "xls"], &["xls", "uff58"]);
    refused(&["convert", &foreign, &foreign], &["written over"]);
    let column = "tip_deflection_m=run1.Y:1*0.001";
    accepted(&["convert", &foreign, &out, "--time", "run1.t", "--column", column]);
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.starts_with("time_s,tip_deflection_m\n0,0.001\n"), "{text}");
    refused(&["convert", &out, &sample("nowhere.xyz")], &[".xyz", ".uff"]);
}

#[test]
fn a_csv_with_other_names_is_read_by_saying_which_is_which() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("logger.csv").to_str().unwrap().to_owned();
    std::fs::write(&file, "Count,acc,Zeit\n1,2,0\n2,4,0.5\n3,6,1\n4,8,1.5\n").unwrap();
    let csv = accepted(&["convert", &file, "-", "--time", "Zeit", "--column", "accel_m_s2=acc*9.81"]);
    assert!(csv.starts_with("time_s,accel_m_s2\n0,19.62\n0.5,39.24\n"), "{csv}");
    // A count of the rows and a time by its name need no options.
    let csv = accepted(&["convert", &file, "-"]);
    assert!(csv.starts_with("time_s,acc_raw\n0,2\n0.5,4\n"), "{csv}");
    refused(&["convert", &file, "-", "--time", "Zeit", "--column", "a_m=x"], &["`x`", "`acc`"]);
}

#[test]
fn identify_reads_other_formats_too() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("decay.csv").to_str().unwrap().to_owned();
    let uff = folder.path().join("decay.uff").to_str().unwrap().to_owned();
    let mut text = "time_s,tip_deflection_m\n".to_owned();
    for k in 0..2000 {
        let t = f64::from(k) * 0.01;
        text.push_str(&format!("{t},{}\n", (-0.1 * t).exp() * (9.0 * t).cos()));
    }
    std::fs::write(&csv, text).unwrap();
    accepted(&["convert", &csv, &uff]);
    let run = stillbeam(&["identify", &uff, "--modes", "1"]);
    assert_eq!(run.code, 0, "{}", run.messages);
    assert!(run.messages.contains("read as uff58"), "{}", run.messages);
    assert!(run.out.contains("1.432"), "{}", run.out);
}
