//! Files of firmware, loggers and other programs are read as what was recorded.

use stillbeam_recording::{
    Format, Imported, ReadOptions, Recording, Role, TimeBase, parse_recording, to_json,
};

fn signal(k: u32) -> f64 {
    (0.9 * (-f64::from(k) / 300.0).exp() * (0.23 * f64::from(k)).cos() * 1e3).round() / 1e3
}

fn read(text: &str) -> Imported {
    parse_recording(text.as_bytes(), "log", &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn assert_holds(found: &Imported, format: Format, column: &str, scale: f64) {
    assert_eq!(found.format, format);
    let recording = &found.recording;
    assert_eq!(recording.len(), 200);
    for (k, sample) in (0..).zip(recording.column(column).unwrap()) {
        assert!((sample - scale * signal(k)).abs() < 1e-9 * scale, "{sample} for {}", scale * signal(k));
        assert!((recording.time_s[k as usize] - f64::from(k) * 0.004).abs() < 1e-6);
    }
}

fn rows(head: &str, row: impl Fn(u32) -> String, tail: &str) -> String {
    (0..200).fold(head.to_owned(), |text, k| text + &row(k) + "\n") + tail
}

#[test]
fn klipper_logs_of_every_age_are_read() {
    let row = |k: u32| format!("{:.6},{:.6},0.5,9806.65", 512.25 + f64::from(k) * 0.004, 1e3 * signal(k));
    for head in [
        "#time,accel_x,accel_y,accel_z\n",
        "##drops=0,overflows=0,time_per_sample=0.004\n#time,accel_x,accel_y,accel_z\n",
        "# kalico\n#\n#time, accel_x, accel_y, accel_z\n",
        "\u{feff}#time,accel_x,accel_y,accel_z\n",
    ] {
        for tail in ["", "513.1,2"] {
            let found = read(&rows(head, row, tail));
            assert_holds(&found, Format::Klipper, "acceleration_x_mm_s2", 1e3);
            assert_eq!(found.recording.columns.len(), 3);
        }
    }
}

#[test]
fn the_rate_of_a_reprap_log_comes_from_its_last_line() {
    let three = |k: u32| format!("{k},{:.3},0.010,1.000", signal(k));
    let found = read(&rows("Sample,X,Y,Z\n", three, "Rate 250, overflows 0\n"));
    assert_holds(&found, Format::RepRap, "acceleration_x_g", 1.0);
    assert_eq!(found.recording.columns.len(), 3);
    let found = read(&rows("Sample,X\n", |k| format!("{k},{:.3}", signal(k)), "Rate 250, overflows 2\n"));
    assert_holds(&found, Format::RepRap, "acceleration_x_g", 1.0);
    assert!(found.remarks.iter().any(|remark| remark.contains("overflowed 2 times")), "{:?}", found.remarks);
    let cut = rows("Sample,X,Y,Z\n", three, "");
    let message = parse_recording(cut.as_bytes(), "log", &ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("--sample-rate"), "{message}");
    let options = ReadOptions { time: Some(TimeBase::IntervalS(0.004)), ..ReadOptions::default() };
    assert_holds(
        &parse_recording(cut.as_bytes(), "log", &options).unwrap(),
        Format::RepRap,
        "acceleration_x_g",
        1.0,
    );
}

#[test]
fn labview_files_of_every_layout_are_read() {
    for (separator, decimal, x_columns) in [
        ("Tab", ",", "No"),
        ("Tab", ".", "One"),
        ("Comma", ".", "Multi"),
        ("Tab", ",", "Multi"),
        ("Comma", ".", "No"),
    ] {
        let s = if separator == "Tab" { "\t" } else { "," };
        let number = |v: f64| format!("{v:.6}").replace('.', decimal);
        let mut head = format!(
            "LabVIEW Measurement{s}\nWriter_Version{s}2\nSeparator{s}{separator}\nDecimal_Separator{s}{decimal}\nMulti_Headings{s}No\nX_Columns{s}{x_columns}\n***End_of_Header***{s}\n{s}\n"
        );
        head += &format!(
            "Channels{s}2{s}{s}\nSamples{s}200{s}200{s}\nY_Unit_Label{s}m/s^2{s}µm{s}\nX0{s}{}{s}{}\n",
            number(0.0),
            number(0.0)
        );
        head += &format!("Delta_X{s}{}{s}{}\n***End_of_Header***{s}{s}\n", number(0.004), number(0.004));
        head += &match x_columns {
            "Multi" => format!("X_Value{s}Tip{s}X_Value{s}Weg{s}Comment\n"),
            _ => format!("X_Value{s}Tip{s}Weg{s}Comment\n"),
        };
        let row = |k: u32| {
            let (x, tip, way) = (number(f64::from(k) * 0.004), number(signal(k)), number(1.5));
            match x_columns {
                "No" => format!("{s}{tip}{s}{way}"),
                "One" => format!("{x}{s}{tip}{s}{way}"),
                _ => format!("{x}{s}{tip}{s}{x}{s}{way}"),
            }
        };
        let found = read(&rows(&head, row, ""));
        assert_holds(&found, Format::Lvm, "Tip_m_s2", 1.0);
        let names: Vec<&str> = found.recording.columns.iter().map(|column| column.name.as_str()).collect();
        assert_eq!(names, ["Tip_m_s2", "Weg_um"]);
    }
}

#[test]
fn octave_text_is_read_as_matlab_variables_are() {
    let head = "# Created by Octave 8.4.0, Sun Mar 02 09:15:07 2025 UTC <lab@pc>\n# name: rate_hz\n# type: scalar\n250\n\n\n";
    let head = format!(
        "{head}# name: note\n# type: string\n# elements: 1\n# length: 2\nhi\n\n\n# name: tip_m\n# type: matrix\n# rows: 200\n# columns: 1\n"
    );
    assert_holds(&read(&rows(&head, |k| format!(" {}", signal(k)), "\n\n")), Format::Octave, "tip_m", 1.0);
}

#[test]
fn json_is_read_as_it_is_written_and_as_others_write_it() {
    let stamps: Vec<f64> = (0..200).map(|k| f64::from(k) * 0.004).collect();
    let values: Vec<f64> = (0..200).map(signal).collect();
    let recording = Recording::new("r", stamps.clone()).with_column("tip_m", values.clone());
    let mut own = Vec::new();
    to_json(&mut own, &recording).unwrap();
    assert_holds(&read(&String::from_utf8(own).unwrap()), Format::Json, "tip_m", 1.0);
    let columns = format!("{{\"time\": {stamps:?}, \"acc [m/s^2]\": {values:?}, \"name\": \"x\"}}");
    assert_holds(&read(&columns), Format::Json, "acc_m_s2", 1.0);
    let rate = format!("{{\"sample_rate\": 250, \"data\": {{\"tip_m\": {values:?}}}}}");
    assert_holds(&read(&rate), Format::Json, "tip_m", 1.0);
    let records: Vec<String> =
        (0..200).map(|k| format!("{{\"t_ms\": {}, \"tip_m\": {}}}", 4 * k, signal(k))).collect();
    assert_holds(&read(&format!("[\n{}\n]", records.join(",\n"))), Format::Json, "tip_m", 1.0);
    for text in ["{\"a\": 1}", "{\"columns\": {}}", "[{\"a\": \"b\"}]", "{\"time\": [1, 2"] {
        assert!(parse_recording(text.as_bytes(), "log", &ReadOptions::default()).is_err());
    }
}

#[test]
fn json_of_stillbeam_keeps_its_role_and_notes() {
    let mut recording = Recording::new("r", vec![0.0, 0.1, 0.2, 0.3])
        .with_column("tip_m", vec![0.0; 4])
        .with_role(Role::HeldOut);
    recording.notes.insert("payload_kg".to_owned(), 1.5.into());
    let mut text = Vec::new();
    to_json(&mut text, &recording).unwrap();
    let read = parse_recording(&text, "r", &ReadOptions::default()).unwrap().recording;
    assert_eq!((read.role, &read.notes), (recording.role, &recording.notes));
    let text = String::from_utf8(text).unwrap().replace("held_out", "holdout");
    let refused = parse_recording(text.as_bytes(), "r", &ReadOptions::default()).unwrap_err().to_string();
    assert!(refused.contains("held_out"), "{refused}");
    // A member of that name in somebody else's file is none of ours.
    let other = text.replace("schema_version", "version");
    assert_eq!(parse_recording(other.as_bytes(), "r", &ReadOptions::default()).unwrap().recording.role, None);
}

#[test]
fn json_that_packs_its_rows_with_what_it_says_about_them_is_read() {
    let rows: Vec<String> = (0..200).map(|k| format!("[{}, 0.5]", signal(k))).collect();
    let values = rows.join(",");
    for names in [
        r#""sensors": [{"name": "ax", "units": "g"}, {"name": "ay", "units": "g"}]"#,
        r#""columns_of": ["ax_g", "ay_g"]"#,
        r#""channels": [{"label": "ax_g"}, {"label": "ay_g"}]"#,
    ] {
        let inner = format!(r#"{{"interval_ms": 4, {names}, "values": [{values}]}}"#);
        for text in [
            inner.clone(),
            format!(r#"{{"protected": {{"ver": "v1"}}, "payload": {inner}}}"#),
            format!(r#"{{"sampleRate": 250, "a": {{"b": {}}}}}"#, inner.replace(r#""interval_ms": 4,"#, "")),
        ] {
            assert_holds(&read(&text), Format::Json, "ax_g", 1.0);
        }
    }
}

#[test]
fn a_rate_that_is_given_overrules_every_stamp() {
    let options = ReadOptions { time: Some(TimeBase::IntervalS(0.004)), ..ReadOptions::default() };
    let texts = [
        rows("time_s,tip_m\n", |k| format!("{},{}", f64::from(k) * 0.1, signal(k)), ""),
        rows("tip [m]\n", |k| signal(k).to_string(), ""),
        rows("n;tip [m]\n", |k| format!("{k};{}", signal(k)), ""),
    ];
    for text in texts {
        let found = parse_recording(text.as_bytes(), "log", &options).unwrap();
        assert_holds(&found, Format::Csv, "tip_m", 1.0);
        assert_eq!(found.recording.columns.len(), 1);
    }
}

#[test]
fn other_formats_are_named_with_the_way_out() {
    for (start, said) in [
        (b"\x1f\x8b\x08\x00rest".as_slice(), "gunzip"),
        (b"PK\x03\x04rest", "CSV"),
        (b"PAR1rest", "Parquet"),
        (b"\x89HDF\r\n\x1a\nrest", "HDF5"),
        (b"TDSm\x0e\x00\x00\x00", "TDMS"),
        (b"%PDF-1.7\n", "PDF"),
        (b"\x89PNG\r\n\x1a\n", "picture"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "sheet"),
        (b"\x28\xb5\x2f\xfd\x04", "zstd"),
        (b"<!DOCTYPE html><html>", "HTML"),
        (b"SQLite format 3\x00", "sqlite3"),
        (b"\x80\x04\x95\x00", "pickle"),
        (b"fLaC\x00\x00", "WAV"),
    ] {
        let message = parse_recording(start, "log", &ReadOptions::default()).unwrap_err().to_string();
        assert!(message.contains(said), "{message}");
    }
}
