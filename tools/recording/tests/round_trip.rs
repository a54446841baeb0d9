//! What is written reads back the same, side file included.

use stillbeam_recording::{Problem, Recording, Role, parse_csv, read_csv, to_csv, write_csv};

fn sample() -> Recording {
    let time_s = vec![0.0, 0.1, 0.30000000000000004, 0.4, 1e5];
    Recording::new("sample", time_s)
        .with_column("force_N", vec![1.0 / 3.0, f64::MIN_POSITIVE, -1e300, 0.1 + 0.2, 5e-324])
        .with_column("tip_deflection_m", vec![f64::NAN, 1e-6, f64::NAN, -0.0, 3.0])
}

#[test]
fn every_float_reads_back_as_the_same_bits() {
    let mut text = Vec::new();
    to_csv(&mut text, &sample()).unwrap();
    let again = parse_csv(text.as_slice(), "sample").unwrap();
    assert_eq!(again.time_s, sample().time_s);
    for (written, read) in sample().columns.iter().zip(&again.columns) {
        assert_eq!(written.name, read.name);
        for (w, r) in written.samples.iter().zip(&read.samples) {
            assert!(w.to_bits() == r.to_bits() || (w.is_nan() && r.is_nan()), "{w} became {r}");
        }
    }
}

#[test]
fn role_and_notes_travel_in_the_side_file() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run.csv");
    let mut recording = sample().with_role(Role::HeldOut);
    recording.notes.insert("operator".into(), "A. Person".into());
    write_csv(&path, &recording).unwrap();
    let again = read_csv(&path).unwrap();
    assert_eq!(again.role, Some(Role::HeldOut));
    assert_eq!(again.notes, recording.notes);
    assert!(again.name.ends_with("run.csv"));
}

#[test]
fn an_unknown_role_is_refused_with_the_two_it_may_be() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run.csv");
    write_csv(&path, &sample()).unwrap();
    std::fs::write(directory.path().join("run.toml"), "role = \"holdout\"\n").unwrap();
    let error = read_csv(&path).unwrap_err();
    assert!(matches!(error.problem, Problem::SideFile { .. }));
    let message = error.to_string();
    assert!(message.contains("train") && message.contains("held_out") && message.contains("run.toml"));
}

#[test]
fn a_broken_side_file_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run.csv");
    write_csv(&path, &sample()).unwrap();
    std::fs::write(directory.path().join("run.toml"), "role = = 3").unwrap();
    assert!(matches!(read_csv(&path).unwrap_err().problem, Problem::SideFile { .. }));
}

#[test]
fn windows_line_ends_spaces_and_a_byte_order_mark_are_read() {
    let text = "\u{feff}time_s, force_N \r\n0, 1\r\n1 ,2\r\n2,\r\n3,4\r\n";
    let recording = parse_csv(text.as_bytes(), "spreadsheet.csv").unwrap();
    assert_eq!(recording.time_s, [0.0, 1.0, 2.0, 3.0]);
    assert_eq!(recording.column("force_N").unwrap()[1], 2.0);
    assert!(recording.column("force_N").unwrap()[2].is_nan());
}

#[test]
fn units_are_the_end_of_the_name() {
    let grid = [
        ("force_N", "N"),
        ("tip_deflection_m", "m"),
        ("speed_m_s", "m_s"),
        ("tip_acceleration_m_s2", "m_s2"),
        ("torque_N_m", "N_m"),
        ("m_s", "s"),
        ("nothing", ""),
    ];
    let recording =
        grid.iter().fold(Recording::new("u", vec![]), |r, (name, _)| r.with_column(*name, vec![]));
    for (column, (name, unit)) in recording.columns.iter().zip(grid) {
        assert_eq!(column.unit(), unit, "{name}");
    }
}

#[test]
fn intervals_are_measured() {
    let r = Recording::new("i", vec![0.0, 0.1, 0.2, 0.35, 0.5]);
    assert_eq!(r.duration_s(), 0.5);
    assert!((r.median_interval_s() - 0.15).abs() < 1e-12);
    assert!((r.mean_interval_s() - 0.125).abs() < 1e-12);
    assert!(!r.is_uniform(0.1) && r.is_uniform(0.25));
    assert_eq!(Recording::new("none", vec![]).median_interval_s(), 0.0);
    assert_eq!(Recording::new("one", vec![3.0]).duration_s(), 0.0);
}

#[test]
fn nothing_is_written_that_could_not_be_read() {
    let time = || vec![0.0, 1.0, 2.0, 3.0];
    let bad = [
        Recording::new("no columns", time()),
        Recording::new("length", time()).with_column("a_m", vec![0.0; 3]),
        Recording::new("infinite", time()).with_column("a_m", vec![0.0, f64::INFINITY, 0.0, 0.0]),
        Recording::new("unit", time()).with_column("a", vec![0.0; 4]),
        Recording::new("comma", time()).with_column("a,b_m", vec![0.0; 4]),
        Recording::new("time", vec![0.0, 1.0, f64::NAN, 3.0]).with_column("a_m", vec![0.0; 4]),
        Recording::new("order", vec![0.0, 1.0, 1.0, 3.0]).with_column("a_m", vec![0.0; 4]),
        Recording::new("short", vec![0.0, 1.0]).with_column("a_m", vec![0.0; 2]),
    ];
    for recording in bad {
        let mut sink = Vec::new();
        assert!(to_csv(&mut sink, &recording).is_err(), "{}", recording.name);
        assert!(sink.is_empty());
    }
}
