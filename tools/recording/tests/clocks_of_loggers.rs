//! Time stamps and rows as loggers write them that nobody watches: counters that overflow, seconds in two
//! columns, days, rows that come twice, names that come again, and one row per axis.

use stillbeam_recording::{Imported, ReadOptions, parse_recording};

const ROWS: u32 = 400;

fn signal(k: u32) -> f64 {
    ((-f64::from(k) / 150.0).exp() * (0.31 * f64::from(k)).cos() * 1e4).round() / 1e4
}

fn read(text: &str) -> Imported {
    parse_recording(text.as_bytes(), "log", &ReadOptions::default())
        .unwrap_or_else(|error| panic!("{error}\n{}", text.get(..200).unwrap_or(text)))
}

/// Reads a log of `ROWS` samples at this interval and checks every stamp and every value.
fn assert_holds(text: &str, column: &str, interval_s: f64) -> Vec<String> {
    let Imported { recording, remarks, .. } = read(text);
    let samples = recording.column(column).unwrap_or_else(|error| panic!("{error}: {remarks:?}"));
    assert_eq!(samples.len(), ROWS as usize, "{remarks:?}");
    for (k, sample) in (0..).zip(samples) {
        assert!((sample - signal(k)).abs() < 1e-9, "row {k}: {sample}");
        let time_s = recording.time_s[k as usize] - recording.time_s[0];
        assert!((time_s - f64::from(k) * interval_s).abs() < 0.01 * interval_s, "row {k}: {time_s}");
    }
    remarks
}

fn log(head: &str, row: impl Fn(u32) -> String) -> String {
    (0..ROWS).fold(format!("{head}\n"), |text, k| text + &row(k) + "\n")
}

#[test]
fn a_counter_that_begins_anew_goes_on() {
    let wide = |bits: u32, at: u64, step: u64| move |k: u32| (at + u64::from(k) * step) % (1_u64 << bits);
    for (head, stamp, interval_s) in [
        ("micros,a_g", wide(32, u64::from(u32::MAX) - 100_000, 2500), 0.0025),
        ("t_ms,a_g", wide(16, 65_000, 5), 0.005),
        ("t_us,a_g", wide(16, 0, 800), 0.0008),
    ] {
        let remarks = assert_holds(&log(head, |k| format!("{},{}", stamp(k), signal(k))), "a_g", interval_s);
        assert!(remarks.iter().any(|remark| remark.contains("begins anew")), "{remarks:?}");
    }
    // A clock that was set back by anything else is refused, with the way out.
    let set = log("t_ms,a_g", |k| format!("{},{}", 5 * k - if k > 200 { 700 } else { 0 }, signal(k)));
    let message = parse_recording(set.as_bytes(), "log", &ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("row 203") && message.contains("--sample-rate HZ"), "{message}");
}

#[test]
fn seconds_and_their_fraction_in_two_columns_are_one_time() {
    for (names, parts) in [
        ("secs,nsecs", 1_000_000_000_u64),
        ("header.stamp.sec,header.stamp.nanosec", 1_000_000_000),
        ("tv_sec,tv_usec", 1_000_000),
        ("stamp [s],stamp [ms]", 1000),
    ] {
        let stamp = |k: u32| 1_764_320_000 * parts + parts * 9 / 10 + u64::from(k) * parts / 250;
        let row = |k: u32| format!("{},{},{}", stamp(k) / parts, stamp(k) % parts, signal(k));
        let remarks = assert_holds(&log(&format!("{names},a_g"), row), "a_g", 0.004);
        assert!(remarks.iter().any(|remark| remark.contains("together")), "{remarks:?}");
        // Beside a time of its own the pair is no signal.
        let row = |k: u32| format!("{},{}", f64::from(k) * 0.004, row(k));
        let text = log(&format!("time_s,{names},a_g"), row);
        assert_holds(&text, "a_g", 0.004);
        assert_eq!(read(&text).recording.columns.len(), 1);
    }
}

#[test]
fn days_of_spreadsheets_are_no_seconds_and_seconds_no_days() {
    for (head, first, interval_s) in
        [("Time;a [g]", 46_354.4, 0.001), ("Zeit;a [g]", 46_354.4, 0.05), ("datenum;a [g]", 740_314.4, 0.004)]
    {
        let row = |k: u32| format!("{:.12};{}", first + f64::from(k) * interval_s / 86_400.0, signal(k));
        let remarks = assert_holds(&log(head, row), "a_g", interval_s);
        assert!(remarks.iter().any(|remark| remark.contains("counts days")), "{remarks:?}");
    }
    for (first, interval_s) in [(46_354.4, 0.001), (46_354.4, 1e-5), (0.0, 1e-7), (740_314.0, 0.5)] {
        let row = |k: u32| format!("{:.9};{}", first + f64::from(k) * interval_s, signal(k));
        assert_holds(&log("Time;a [g]", row), "a_g", interval_s);
    }
}

#[test]
fn rows_that_come_twice_are_taken_once_and_coarse_stamps_lose_none() {
    let row = |k: u32| format!("{:.3},{}\n", f64::from(k) * 0.005, signal(k));
    for every in [7, 50, 399] {
        let twice = |k: u32| if k % every == every - 1 { row(k) + &row(k) } else { row(k) };
        let text = (0..ROWS).fold("t,a_g\n".to_owned(), |text, k| text + &twice(k));
        let remarks = assert_holds(&text, "a_g", 0.005);
        assert!(remarks.iter().any(|remark| remark.contains("rows repeat the one before")), "{remarks:?}");
    }
    // At 400 Hz two to three samples share a stamp of 10 ms, alike where the sensor rests.
    let coarse =
        log("t,a_g", |k| format!("{:.2},{}", f64::from(k) * 0.0025, if k < 100 { 0.0 } else { signal(k) }));
    assert_eq!(read(&coarse).recording.len(), ROWS as usize);
}

#[test]
fn names_that_come_again_are_left_out() {
    for (head, separator) in [("t [s],a [g]", ","), ("Zeit [s];a [g]", ";"), ("t_s\ta_g", "\t")] {
        for every in [5, 130] {
            let row = |k: u32| {
                let again =
                    if k > 0 && k.is_multiple_of(every) { format!("{head}\n") } else { String::new() };
                format!("{again}{:.3}{separator}{}", f64::from(k) * 0.005, signal(k))
            };
            let remarks = assert_holds(&log(head, row), "a_g", 0.005);
            assert!(remarks.iter().any(|remark| remark.contains("row of names")), "{remarks:?}");
        }
    }
}

#[test]
fn one_row_per_axis_is_one_column_per_axis() {
    let stamp = |k: u32| format!("{:.4}", f64::from(k) * 0.005);
    let other = |k: u32, at: usize| signal(k * 7 % ROWS) + at as f64;
    for (head, words) in [
        ("Timestamp,Axis,Value", vec!["x", "y"]),
        ("time [s],sensor,acc [g]", vec!["base", "arm", "tip"]),
        ("t,channel,reading", vec!["A1", "A2", "A3", "A4"]),
    ] {
        let row = |k: u32| {
            let value = |(at, word): (usize, &&str)| {
                format!("{},{word},{}", stamp(k), if at == 0 { signal(k) } else { other(k, at) })
            };
            words.iter().enumerate().map(value).collect::<Vec<_>>().join("\n")
        };
        let text = log(head, row);
        let found = read(&text);
        assert_eq!(found.recording.columns.len(), words.len(), "{:?}", found.remarks);
        let first = found.recording.columns[0].name.clone();
        assert_holds(&text, &first, 0.005);
        let last = &found.recording.columns[words.len() - 1];
        assert!(last.samples.iter().zip(0..).all(|(sample, k)| *sample == other(k, words.len() - 1)));
    }
    // A column of states changes when it likes, and makes no columns.
    let states = log("t,state,a_g", |k| {
        format!("{},{},{}", stamp(k), if k % 50 < 3 { "TRIG" } else { "OK" }, signal(k))
    });
    assert_holds(&states, "a_g", 0.005);
    assert_eq!(read(&states).recording.columns.len(), 1);
}

#[test]
fn a_clock_that_leaves_the_century_out_is_a_clock() {
    for (month_first, day) in [(true, 2), (false, 28)] {
        let row = |k: u32| {
            let (minutes, hundredths) = (58 + (k + 5700) / 6000, (k + 5700) % 6000);
            let date = if month_first { format!("03/{day:02}/25") } else { format!("{day:02}/03/25") };
            let clock = format!("01:{minutes:02}:{:02}.{:02} PM", hundredths / 100, hundredths % 100);
            format!("{},{date} {clock},{}", k + 1, signal(k))
        };
        let head = "\"Plot Title: Mast 3\"\n\"#\",\"Date Time, GMT+01:00\",\"X Accel, g\"";
        assert_holds(&log(head, row), "X_Accel_g", 0.01);
    }
}
