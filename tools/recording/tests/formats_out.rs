//! What is written in another format reads back the same, and what a format cannot hold is refused.

use stillbeam_recording::{
    Format, Problem, ReadOptions, Recording, UffProblem, parse_recording, read_recording, to_format,
    write_recording,
};

fn sample(interval_s: f64) -> Recording {
    let time_s = (0..500).map(|k| 0.25 + f64::from(k) * interval_s).collect::<Vec<_>>();
    let tip = time_s.iter().map(|t| 1e-3 * (6.9 * t).sin() / 3.0).collect();
    let speed = time_s.iter().map(|t| -7e4 * (2.0 * t).cos()).collect();
    Recording::new("sample", time_s)
        .with_column("tip_deflection_m", tip)
        .with_column("motor_speed_rpm", speed)
}

fn round_trip(recording: &Recording, format: Format) -> Recording {
    let mut bytes = Vec::new();
    to_format(&mut bytes, recording, format).unwrap();
    let found = parse_recording(&bytes, "sample", &ReadOptions::default()).unwrap();
    assert_eq!(found.format, format);
    found.recording
}

fn assert_same(read: &Recording, written: &Recording, relative: f64) {
    assert_eq!(read.column_names(), written.column_names());
    let interval = written.mean_interval_s();
    for (a, b) in read.time_s.iter().zip(&written.time_s) {
        assert!((a - b).abs() <= 0.01 * interval, "{a} for {b}");
    }
    for (a, b) in read.columns.iter().zip(&written.columns) {
        assert_eq!(a.samples.len(), b.samples.len());
        for (x, y) in a.samples.iter().zip(&b.samples) {
            assert!((x - y).abs() <= relative * y.abs(), "{}: {x} for {y}", a.name);
        }
    }
}

#[test]
fn universal_files_keep_names_times_and_values() {
    for interval_s in [0.01, 1.0 / 1651.6129, 1.0 / 3.0, 2e-5] {
        let recording = sample(interval_s);
        assert_same(&round_trip(&recording, Format::Uff58), &recording, 1e-12);
        assert_same(&round_trip(&recording, Format::Uff58b), &recording, 0.0);
    }
}

#[test]
fn uneven_stamps_are_written_one_by_one() {
    let mut recording = sample(0.01);
    for (k, time_s) in recording.time_s.iter_mut().enumerate() {
        *time_s += 1e-3 * (k % 3) as f64;
    }
    assert_same(&round_trip(&recording, Format::Uff58), &recording, 1e-12);
    let exact = round_trip(&recording, Format::Uff58b);
    assert_eq!(exact.time_s, recording.time_s);
}

#[test]
fn what_data_set_58_cannot_hold_is_refused_before_anything_is_written() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("out.uff");
    let mut missing = sample(0.01);
    missing.columns[1].samples[7] = f64::NAN;
    let error = write_recording(&path, &missing, None).unwrap_err();
    let Problem::Uff(problem) = &error.problem else { panic!("{error}") };
    assert!(matches!(**problem, UffProblem::MissingValues { missing: 1, .. }), "{error}");
    // Microseconds of jitter after a million seconds need more digits than a field has.
    let mut late = sample(0.01);
    for (k, time_s) in late.time_s.iter_mut().enumerate() {
        *time_s += 1e8 + 3e-3 * (k % 3) as f64;
    }
    let error = write_recording(&path, &late, None).unwrap_err();
    let Problem::Uff(problem) = &error.problem else { panic!("{error}") };
    assert!(matches!(**problem, UffProblem::TimeDigits { .. }), "{error}");
    assert!(!path.exists());
}

#[test]
fn the_extension_decides_the_format_and_the_side_file_goes_along() {
    let directory = tempfile::tempdir().unwrap();
    let mut recording = sample(0.01);
    recording.notes.insert("operator".into(), "A. Person".into());
    for (name, format) in [("a.csv", Format::Csv), ("b.UNV", Format::Uff58), ("c.json", Format::Json)] {
        let path = directory.path().join(name);
        assert_eq!(write_recording(&path, &recording, None).unwrap(), format);
        if format != Format::Json {
            let found = read_recording(&path, &ReadOptions::default()).unwrap();
            assert_eq!((found.format, &found.recording.notes), (format, &recording.notes));
        }
    }
    for (name, said) in
        [("d.xyz", ".csv, .uff or .json"), ("e", "means no format"), ("f.wav", "read and not written")]
    {
        let error = write_recording(&directory.path().join(name), &recording, None).unwrap_err();
        assert!(error.to_string().contains(said), "{error}");
    }
}

#[test]
fn json_has_every_column_and_null_for_what_is_missing() {
    let mut recording = sample(0.5);
    recording.columns[0].samples[1] = f64::NAN;
    let mut bytes = Vec::new();
    to_format(&mut bytes, &recording, Format::Json).unwrap();
    let read: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
    let tip = read["columns"]["tip_deflection_m"].as_array().unwrap();
    assert_eq!(tip.len(), 500);
    assert!(tip[1].is_null());
    assert_eq!(tip[2].as_f64().unwrap(), recording.columns[0].samples[2]);
    assert_eq!(read["columns"]["time_s"][3].as_f64().unwrap(), recording.time_s[3]);
    assert_eq!(read["schema_version"], 1);
}
