//! Tables that other programs wrote, through the command line: read at once, and said how.

use crate::support;

use support::{accepted, refused, stillbeam};

fn file(folder: &tempfile::TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn what_was_made_of_a_table_is_said_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let rows = "0,0;1,5\n4,0;2,5\n8,0;NaN\n12,0;4,5\n16,0;inf\n";
    let semicolons = file(&folder, "a.csv", &format!("# lab 4\nZeit [ms];Weg [mm]\n{rows}"));
    let run = stillbeam(&["convert", &semicolons, "-"]);
    assert!(
        run.out.starts_with("time_s,Weg_mm\n0,1.5\n0.004,2.5\n0.008,\n0.012,4.5\n0.016,\n"),
        "{}",
        run.out
    );
    for said in
        ["separated by `;`", "decimal comma", "names in row 2", "is in ms", "1 values beyond the range"]
    {
        assert!(run.messages.contains(said), "{}", run.messages);
    }
    let bare = file(&folder, "b.csv", "0,1\n0.1,2\n0.2,3\n0.35,4\n");
    let run = stillbeam(&["convert", &bare, "-"]);
    assert!(run.out.starts_with("time_s,column_2_raw\n0,1\n"), "{}", run.out);
    assert!(
        run.messages.contains("no header") && run.messages.contains("no column states a unit"),
        "{}",
        run.messages
    );
}

#[test]
fn options_state_what_a_table_leaves_open() {
    let folder = tempfile::tempdir().unwrap();
    let log = file(&folder, "log.txt", "noise 1 2\nnoise 3\nn;x\n10;1,5\n20;2,5\n30;3,5\n40;4,5\n");
    let common =
        ["convert", log.as_str(), "-", "--skip-lines", "2", "--separator", "semicolon", "--decimal", "comma"];
    let csv = accepted(&[&common[..], &["--time", "n*0.001", "--column", "tip_m=x*2"]].concat());
    assert!(csv.starts_with("time_s,tip_m\n0.01,3\n0.02,5\n"), "{csv}");
    let csv = accepted(&[&common[..], &["--sample-rate", "100", "--column", "tip_m=x"]].concat());
    assert!(csv.starts_with("time_s,tip_m\n0,1.5\n0.01,2.5\n"), "{csv}");
    refused(&common, &["no column is a time", "--time", "--sample-rate"]);
    refused(&["convert", &log, "-", "--separator", "x"], &["`x` is no separator"]);
    let spectrum = file(&folder, "s.csv", "freq,psd_x\n0,1\n1,2\n2,3\n3,4\n");
    refused(&["convert", &spectrum, "-"], &["power spectral density", "raw_data"]);
}
