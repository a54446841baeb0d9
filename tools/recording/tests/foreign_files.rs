//! Files that other programs wrote (`files/make.py`) are read as what was written.

use std::path::PathBuf;

use stillbeam_recording::{
    ColumnChoice, Format, Imported, ReadOptions, RecordingError, TimeBase, read_recording,
};

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/files").join(name)
}

fn read(name: &str, options: &ReadOptions) -> Result<Imported, RecordingError> {
    read_recording(&file(name), options)
}

fn column(name: &str) -> ColumnChoice {
    name.parse().unwrap()
}

fn times() -> Vec<f64> {
    (0..40).map(|k| f64::from(k) * 0.01).collect()
}

fn tip(t: f64) -> f64 {
    1e-3 * (-0.5 * t).exp() * (6.9 * t).cos()
}

fn force(t: f64) -> f64 {
    2.0 * (3.0 * t).sin()
}

/// Compares a column and its times with what was written.
fn assert_holds(found: &Imported, name: &str, signal: impl Fn(f64) -> f64, tolerance: f64) {
    let recording = &found.recording;
    let samples = recording.column(name).unwrap();
    assert_eq!(samples.len(), 40);
    let uneven = |k: usize| if recording.is_uniform(1e-3) { 0.0 } else { 1e-4 * (k % 3) as f64 };
    for (k, (t, sample)) in times().into_iter().zip(samples).enumerate() {
        assert!((recording.time_s[k] - t - uneven(k)).abs() < 1e-6, "{} {t}", recording.time_s[k]);
        assert!((sample - signal(t)).abs() <= tolerance, "{name} at {t}: {sample} for {}", signal(t));
    }
}

#[test]
fn matlab_variables_named_by_the_convention_are_columns() {
    for name in ["conventional_v6.mat", "conventional_v7.mat"] {
        let found = read(name, &ReadOptions::default()).unwrap();
        assert_eq!(found.format, Format::Mat);
        assert_eq!(found.recording.columns.len(), 2);
        assert_holds(&found, "tip_deflection_m", tip, 1e-18);
        assert_holds(&found, "force_N", force, 1e-15);
        let remarks = found.remarks.join("\n");
        assert!(remarks.contains("`note`") && remarks.contains("`spare` (2 x 2)"), "{remarks}");
    }
}

#[test]
fn matlab_variables_of_any_name_are_chosen_by_the_options() {
    let options = ReadOptions {
        time: Some("run1.t".parse().unwrap()),
        columns: vec![column("tip_deflection_m=run1.Y:1*0.001"), column("force_N = raw * 1e-3")],
        ..ReadOptions::default()
    };
    let found = read("foreign_v7.mat", &options).unwrap();
    assert_holds(&found, "tip_deflection_m", tip, 1e-18);
    assert_holds(&found, "force_N", |t| (force(t) * 1000.0).trunc() / 1000.0, 1e-12);
}

#[test]
fn matlab_variables_without_units_are_taken_by_their_names_and_what_is_no_signal_is_named() {
    let found = read("foreign_v7.mat", &ReadOptions::default()).unwrap();
    assert_holds(&found, "run1_Y_1_raw", |t| tip(t) * 1000.0, 1e-12);
    assert_holds(&found, "raw_raw", |t| (force(t) * 1000.0).trunc(), 1e-12);
    let said = found.remarks.join("\n");
    for part in ["`z` (2 x 1 complex)", "no column states a unit", "--column"] {
        assert!(said.contains(part), "{said}");
    }
    let options = ReadOptions { time: Some("run1.t".parse().unwrap()), ..ReadOptions::default() };
    let options = ReadOptions { columns: vec![column("tip_m=run1.X")], ..options };
    let message = read("foreign_v7.mat", &options).unwrap_err().to_string();
    assert!(message.contains("no signal `run1.X`") && message.contains("`run1.Y:1`"), "{message}");
}

#[test]
fn a_matlab_rate_and_a_matrix_of_rows_are_understood() {
    let found = read("rows_with_rate.mat", &ReadOptions::default()).unwrap();
    assert_holds(&found, "accel_1_m_s2", tip, 1e-18);
    assert_holds(&found, "accel_2_m_s2", force, 1e-15);
    let options = ReadOptions { time: Some(TimeBase::IntervalS(0.01)), ..ReadOptions::default() };
    assert_holds(&read("rows_with_rate.mat", &options).unwrap(), "accel_1_m_s2", tip, 1e-18);
}

#[test]
fn universal_files_in_text_are_read_in_both_precisions_and_spacings() {
    for (name, tolerance) in [("text.uff", 1e-11), ("single.uff", 1e-5), ("uneven.uff", 1e-11)] {
        let found = read(name, &ReadOptions::default()).unwrap();
        assert_eq!(found.format, Format::Uff58);
        assert_holds(&found, "displacement_1_z_m", tip, tolerance);
        assert_holds(&found, "force_2_z_N", force, tolerance);
    }
}

#[test]
fn binary_universal_files_are_read_bit_by_bit() {
    for name in ["binary.uff", "uneven_binary.uff"] {
        let found = read(name, &ReadOptions::default()).unwrap();
        assert_eq!(found.format, Format::Uff58b);
        assert_holds(&found, "displacement_1_z_m", tip, 1e-18);
        assert_holds(&found, "force_2_z_N", force, 1e-15);
    }
}

#[test]
fn the_unit_code_stands_in_for_a_missing_label_and_spectra_are_left_out() {
    let found = read("units_and_spectrum.uff", &ReadOptions::default()).unwrap();
    assert_holds(&found, "displacement_1_z_m", tip, 1e-11);
    assert_eq!(found.recording.columns.len(), 1);
    assert!(found.remarks.iter().any(|remark| remark.contains("no time responses")));
    let message = read("spectrum_only.uff", &ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("holds a frequency response, not a recording"), "{message}");
}

#[test]
fn sound_files_are_fractions_of_full_scale_unless_told_otherwise() {
    let found = read("pcm16.wav", &ReadOptions::default()).unwrap();
    assert_eq!(found.format, Format::Wav);
    assert_eq!(found.recording.mean_interval_s(), 1.0 / 8000.0);
    let second = found.recording.column("channel_2_fullscale").unwrap();
    for (t, sample) in times().into_iter().zip(second) {
        assert!((sample - 0.5 * t.sin()).abs() < 2e-5);
    }
    let options = ReadOptions { columns: vec![column("acceleration_m_s2=1*50")], ..ReadOptions::default() };
    let found = read("float.wav", &options).unwrap();
    for (t, sample) in times().into_iter().zip(found.recording.column("acceleration_m_s2").unwrap()) {
        assert!((sample - 50.0 * t.cos()).abs() < 1e-5);
    }
}

#[test]
fn a_forced_format_is_named_when_it_does_not_fit() {
    let forced = |format| ReadOptions { format: Some(format), ..ReadOptions::default() };
    for (name, format, said) in [
        ("text.uff", Format::Mat, "read as a MATLAB file: byte 126"),
        ("pcm16.wav", Format::Uff58, "read as a universal file: there is no data set 58"),
        ("text.uff", Format::Wav, "read as a WAV file"),
        ("binary.uff", Format::Csv, "row 14 has 2 cells"),
        ("text.uff", Format::Json, "read as JSON"),
        ("text.uff", Format::Lvm, "read as a LabVIEW measurement file"),
        ("text.uff", Format::Npy, "read as a NumPy array"),
    ] {
        let message = read(name, &forced(format)).unwrap_err().to_string();
        assert!(message.contains(said), "{message}");
    }
}

#[test]
fn recordings_as_published_load() {
    let data = std::env::var_os("STILLBEAM_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    );
    let folder = data.join("klipper_raw_belt_printer");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("not run: no recordings at ../shared/data (set STILLBEAM_DATA)");
        return;
    };
    let files = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let files: Vec<PathBuf> = files.filter(|path| path.extension().is_some_and(|end| end == "csv")).collect();
    assert!(files.len() >= 10);
    for path in files {
        let found = read_recording(&path, &ReadOptions::default()).unwrap();
        assert_eq!(found.format, Format::Klipper);
        assert_eq!(found.recording.time_s[0], 0.0);
        assert!((found.recording.mean_interval_s() - 1.0 / 3212.0).abs() < 2e-6);
        let gravity = found.recording.column("acceleration_z_mm_s2").unwrap();
        let mean = gravity.iter().sum::<f64>() / gravity.len() as f64;
        assert!((9500.0..11000.0).contains(&mean), "{mean}");
    }
    for name in [
        "cantilever_downey/beam_impulse_ringdown.csv",
        "emps/emps_estimation.csv",
        "silverbox/silverbox_SNLS80mV.csv",
        "leadscrew_drives/leadscrew_steady_state_10.csv",
    ] {
        let found = read_recording(&data.join(name), &ReadOptions::default()).unwrap();
        assert_eq!(found.format, Format::Csv, "{name}");
    }
}
