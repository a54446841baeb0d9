//! What other programs call times, rates, units and channels.

use std::io::Write;

use flate2::{Compression, write::GzEncoder};
use stillbeam_recording::{Imported, ReadOptions, parse_recording};

const ROWS: u32 = 300;

fn signal(k: u32) -> f64 {
    ((-f64::from(k) / 120.0).exp() * (0.27 * f64::from(k)).cos() * 1e4).round() / 1e4
}

fn read(bytes: &[u8]) -> Imported {
    parse_recording(bytes, "log", &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn assert_holds(bytes: &[u8], column: &str) -> Imported {
    let found = read(bytes);
    let samples =
        found.recording.column(column).unwrap_or_else(|error| panic!("{error}: {:?}", found.remarks));
    assert_eq!(samples.len(), ROWS as usize);
    for (k, sample) in (0..).zip(samples) {
        assert!((sample - signal(k)).abs() < 1e-9, "row {k}: {sample}");
        let time_s = found.recording.time_s[k as usize] - found.recording.time_s[0];
        assert!((time_s - f64::from(k) * 0.004).abs() < 1e-6, "row {k}: {time_s}");
    }
    found
}

fn rows(head: &str, row: impl Fn(u32) -> String) -> String {
    (0..ROWS).fold(head.to_owned(), |text, k| text + &row(k) + "\n")
}

fn pair(k: u32, separator: &str) -> String {
    format!("{:.3}{separator}{}", f64::from(k) * 0.004, signal(k))
}

#[test]
fn rows_between_the_names_and_the_values_do_not_hide_the_names() {
    let tabs = |k: u32| pair(k, "\t");
    let catman = "Time  1 - default sample rate [s]\tDMS_1 [µm/m]\n\tSG 3 wire\n250 Hz\t250 Hz\n\"made by\"\t\"channel 1\"\n";
    assert_holds(rows(catman, tabs).as_bytes(), "DMS_1_um_m");
    let gains = "t [s]\ttip [mm]\ngain\t10\nfilter\tnone\n";
    assert_holds(rows(gains, tabs).as_bytes(), "tip_mm");
    // Units of which not all are known: the time's stands below the time.
    let units = "\"Time\",\"G Force Vert\",\"Speed\"\n\"s\",\"G\",\"furlong\"\n\n\n";
    let found =
        assert_holds(rows(units, |k| format!("\"{}\",3", pair(k, "\",\""))).as_bytes(), "G_Force_Vert_G");
    assert_eq!(found.recording.columns.len(), 2);
    let increment = "X,CH1,Start,Increment,\nSequence,Volt,-1.2e-01,4.0e-03\n";
    assert_holds(rows(increment, |k| format!("{k},{},,", signal(k))).as_bytes(), "column_2_V");
}

#[test]
fn a_guess_at_a_unit_leaves_no_column_out() {
    let row = |k: u32| {
        format!("{},{:.3},{},0.5", 1_764_320_000_000_u64 + u64::from(4 * k), f64::from(k) * 0.004, signal(k))
    };
    let found = assert_holds(rows("time,seconds_elapsed,z,y\n", row).as_bytes(), "z_raw");
    assert!(found.recording.column("y_raw").is_ok(), "{:?}", found.remarks);
    // Units that are known make the others no signals, as before.
    let found = assert_holds(rows("time_s,tip_mm,state\n", |k| pair(k, ",") + ",1").as_bytes(), "tip_mm");
    assert_eq!(found.recording.columns.len(), 1);
}

#[test]
fn letters_of_channels_are_no_units() {
    for (head, first) in [
        ("t,Channel A,Channel B\n", "Channel_A_raw"),
        ("t,Sensor_A,Sensor_B\n", "Sensor_A_raw"),
        ("t;Kanal C;Kanal D\ns;mV;V\n", "Kanal_C_mV"),
    ] {
        let separator = if head.contains(';') { ";" } else { "," };
        let row = |k: u32| format!("{}{separator}0.5", pair(k, separator));
        let found = assert_holds(rows(head, row).as_bytes(), first);
        assert_eq!(found.recording.columns.len(), 2, "{:?}", found.remarks);
    }
    for (head, name) in [("t,Motor A\n", "Motor_A"), ("t,Force N\n", "Force_N")] {
        assert_holds(rows(head, |k| pair(k, ",")).as_bytes(), name);
    }
}

#[test]
fn rates_and_times_of_other_programs_are_known_in_structures() {
    let values: Vec<String> = (0..ROWS).map(|k| signal(k).to_string()).collect();
    let stamps: Vec<String> = (0..ROWS).map(|k| format!("{:.3}", f64::from(k) * 0.004)).collect();
    let vector = |name: &str, numbers: &[String]| {
        format!(
            "# name: {name}\n# type: matrix\n# rows: {ROWS}\n# columns: 1\n {}\n\n\n",
            numbers.join("\n ")
        )
    };
    let scalar = |name: &str, number: &str| format!("# name: {name}\n# type: scalar\n{number}\n\n\n");
    let head = "# Created by Octave 8.4.0, Sun Mar 02 09:15:07 2025 UTC <lab@pc>\n";
    for clock in [
        vector("time", &stamps),
        vector("t", &stamps),
        vector("Zeit_s", &stamps),
        scalar("Fs", "250"),
        scalar("samplingRate", "250"),
        scalar("dt", "0.004"),
        scalar("sample_time", "0.004"),
    ] {
        assert_holds(format!("{head}{clock}{}", vector("acc", &values)).as_bytes(), "acc_raw");
        assert_holds(format!("{head}{}{clock}", vector("acc_m_s2", &values)).as_bytes(), "acc_m_s2");
    }
    for clock in
        ["\"sampleRate\": 250", "\"Fs\": 250", "\"interval_ms\": 4", "\"rate_hz\": 250", "\"dt\": 0.004"]
    {
        assert_holds(format!("{{{clock}, \"values\": [{}]}}", values.join(", ")).as_bytes(), "values_raw");
    }
}

#[test]
fn json_lines_are_read_with_what_lies_one_level_down() {
    let ms = |k: u32| 1_764_320_000_000_u64 + u64::from(4 * k);
    let whole = rows("", |k| format!("{{\"ts\": {}, \"ax\": {}}}", ms(k), signal(k)));
    assert_holds(whole.as_bytes(), "ax_raw");
    let found = assert_holds(format!("{whole}{{\"ts\": 17643").as_bytes(), "ax_raw");
    assert!(found.remarks.iter().any(|remark| remark.contains("last line is cut")), "{:?}", found.remarks);
    let nested =
        rows("", |k| format!("{{\"ts\": {}, \"acc\": {{\"x\": {}, \"y\": 0.5}}}}", ms(k), signal(k)));
    assert_holds(nested.as_bytes(), "acc_x");
    let arrays = rows("", |k| format!("{{\"ts\": {}, \"acc\": [0.5, {}]}}", ms(k), signal(k)));
    assert_holds(arrays.as_bytes(), "acc_1");
    let dates = rows("", |k| {
        format!(
            "{{\"time\": \"2026-11-28T09:15:{:02}.{:03}Z\", \"ax\": {}}}",
            4 * k / 1000,
            4 * k % 1000,
            signal(k)
        )
    });
    assert_holds(dates.as_bytes(), "ax_raw");
    let broken = whole.replacen("{\"ts\"", "{ts", 50).replacen("{ts", "{\"ts\"", 20);
    assert!(parse_recording(broken.as_bytes(), "log", &ReadOptions::default()).is_err());
}

#[test]
fn what_gzip_packed_is_unpacked_whatever_is_in_it() {
    let packed = |bytes: &[u8]| {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    };
    let csv = rows("time_s,acc_g\n", |k| pair(k, ","));
    let json = rows("", |k| format!("{{\"t_ms\": {}, \"acc_g\": {}}}", 4 * k, signal(k)));
    for text in [&csv, &json] {
        let found = assert_holds(&packed(text.as_bytes()), "acc_g");
        assert!(found.remarks[0].contains("unpacked from gzip"), "{:?}", found.remarks);
    }
    let mut cut = packed(csv.as_bytes());
    cut.truncate(cut.len() - 40);
    let found = read(&cut);
    assert!(found.remarks[0].contains("cut or damaged") && found.recording.len() > 20, "{:?}", found.remarks);
}

#[test]
fn units_behind_every_number_are_those_of_the_column() {
    for (unit, per_second, separator) in [("sec", 1.0, ","), ("ms", 1e3, ";"), ("µs", 1e6, "\t")] {
        let row = |k: u32| {
            let time = f64::from(k) * 0.004 * per_second;
            format!("{:.3} {unit}{separator}{} mV", time, signal(k))
        };
        let head = format!("Time{separator}acc\n");
        assert_holds(rows(&head, row).as_bytes(), "acc_mV");
        // Another unit amid the rows would be another scale.
        let mixed = |k: u32| if k == 70 { row(k).replace("mV", "V") } else { row(k) };
        let message = parse_recording(rows(&head, mixed).as_bytes(), "log", &ReadOptions::default());
        let message = message.unwrap_err().to_string();
        assert!(message.contains("row 72") && message.contains(" V`"), "{message}");
    }
}
