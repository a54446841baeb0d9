//! Texts that are tables only after something was taken off: keys beside the rows, labels before every value,
//! stamps of a terminal before every line.

use stillbeam_recording::{Imported, ReadOptions, parse_recording};

const ROWS: u32 = 300;

fn signal(k: u32) -> f64 {
    ((-f64::from(k) / 120.0).exp() * (0.27 * f64::from(k)).cos() * 1e4).round() / 1e4
}

fn parse(bytes: &[u8]) -> Imported {
    parse_recording(bytes, "log", &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Reads rows that begin with the signal's row `first`.
fn assert_holds(bytes: &[u8], column: &str, first: u32) -> Imported {
    let found = parse(bytes);
    let samples =
        found.recording.column(column).unwrap_or_else(|error| panic!("{error}: {:?}", found.remarks));
    assert_eq!(samples.len(), (ROWS - first) as usize, "{:?}", found.remarks);
    for (k, sample) in (first..).zip(samples) {
        assert!((sample - signal(k)).abs() < 1e-9, "row {k}: {sample}");
        let time_s = found.recording.time_s[(k - first) as usize] - found.recording.time_s[0];
        assert!((time_s - f64::from(k - first) * 0.004).abs() < 1e-6, "row {k}: {time_s}");
    }
    found
}

fn rows(head: &str, row: impl Fn(u32) -> String) -> String {
    (0..ROWS).fold(head.to_owned(), |text, k| text + &row(k) + "\n")
}

#[test]
fn keys_beside_the_first_rows_are_no_rows_and_cost_none() {
    let keys = [
        ("Record Length", "3.0e+02"),
        ("Sample Interval", "4.0e-03"),
        ("", ""),
        ("", ""),
        ("Source", "CH1"),
        ("Vertical Units", "V"),
        ("Firmware Version", "FV:v22.01"),
    ];
    for (separator, end) in [(",", ","), (";", ""), ("\t", "\t")] {
        for gap in ["", separator] {
            let row = |k: u32| {
                let (key, text) = keys.get(k as usize).copied().unwrap_or(("", ""));
                format!(
                    "{key}{separator}{text}{separator}{gap}  {:.3}{separator}{}{end}",
                    f64::from(k) * 0.004,
                    signal(k)
                )
            };
            let found = assert_holds(rows("", row).as_bytes(), "column_2_raw", 0);
            assert!(found.remarks.iter().any(|remark| remark.contains("beside")), "{:?}", found.remarks);
        }
    }
    // A channel that was switched on late is a column.
    let late = |k: u32| {
        let early = if k < 9 { "1.5" } else { "" };
        format!("{early},{:.3},{}", f64::from(k) * 0.004, signal(k))
    };
    assert_holds(rows("other_g,time_s,acc_g\n", late).as_bytes(), "acc_g", 0);
}

#[test]
fn values_with_labels_are_a_table_of_them() {
    for (before, between, after) in
        [(":", " ", ""), ("=", ", ", ""), (": ", "  ", " "), (":", ",", "\r"), (" = ", "; ", ";")]
    {
        let row = |k: u32| {
            format!("t_ms{before}{}{between}ax{before}{}{between}ay{before}0.5{after}", 4 * k, signal(k))
        };
        for head in ["", "MPU6050 ready\n", "\n\nCalibrating...\ndone: ok\n"] {
            let found = assert_holds(rows(head, row).as_bytes(), "ax_raw", 0);
            assert_eq!(found.recording.columns.len(), 2);
            // What a board says between its values is no row.
            let chatty = |k: u32| if k % 90 == 80 { format!("battery low\n{}", row(k)) } else { row(k) };
            assert_holds(rows(head, chatty).as_bytes(), "ax_raw", 0);
        }
    }
}

#[test]
fn the_time_of_day_that_a_terminal_puts_before_a_line_is_the_time() {
    let stamp = |k: u32| {
        let ms = 86_399_700 + 4 * k;
        format!("{:02}:{:02}:{:02}.{:03}", ms / 3_600_000 % 24, ms / 60_000 % 60, ms / 1000 % 60, ms % 1000)
    };
    for (row, column) in [
        (Box::new(|k| format!("{},0.5", signal(k))) as Box<dyn Fn(u32) -> String>, "column_2_raw"),
        (Box::new(|k| signal(k).to_string()), "column_2_raw"),
        (Box::new(|k| format!("0.5\t{}", signal(k))), "column_3_raw"),
        (Box::new(|k| format!("ax:{} ay:0.5", signal(k))), "ax_raw"),
    ] {
        let text = rows("", |k| format!("{} -> {}", stamp(k), row(k)));
        assert_holds(text.as_bytes(), column, 0);
        // The line that the board was in when the terminal opened, and what the line carried before.
        let mut noisy = b"\x00\xff\xfe\x8012,\n".to_vec();
        noisy.extend(text.as_bytes());
        assert_holds(&noisy, column, 0);
    }
}

#[test]
fn binary_data_with_a_line_end_in_it_is_still_no_text() {
    for step in [1_u32, 7, 250] {
        let bytes: Vec<u8> = (0..2000).flat_map(|k| (k * step % 3000).to_le_bytes()).collect();
        let message = parse_recording(&bytes, "log", &ReadOptions::default()).unwrap_err().to_string();
        assert!(message.contains("binary"), "{message}");
    }
}

#[test]
fn what_loggers_of_boards_and_terminals_put_before_a_line_is_the_time() {
    let of_day = |k: u32| {
        let ms = 600_100 + 4 * k;
        format!("{:02}:{:02}:{:02}.{:03}", ms / 3_600_000, ms / 60_000 % 60, ms / 1000 % 60, ms % 1000)
    };
    type Before = Box<dyn Fn(u32) -> String>;
    let stamps: [Before; 7] = [
        Box::new(|k| format!("I ({}) imu: ", 400 + 4 * k)),
        Box::new(|k| format!("D ({}) app: ", 400 + 4 * k)),
        Box::new(|k| format!("\u{1b}[0;32mI ({}) imu: ", 400 + 4 * k)),
        Box::new(move |k| format!("[{},000] <inf> imu: ", of_day(k))),
        Box::new(move |k| format!("2026-11-28 {} ", of_day(k))),
        Box::new(move |k| format!("[2026-11-28 {}] ", of_day(k))),
        Box::new(move |k| format!("2026-11-28 {} - INFO - imu: ", of_day(k))),
    ];
    for (kind, stamp) in stamps.iter().enumerate() {
        for head in ["", "Booting 1.2\n\n"] {
            let labelled = rows(head, |k| format!("{}ax={} ay=0.5", stamp(k), signal(k)));
            assert_holds(labelled.as_bytes(), "ax_raw", 0);
            // Without labels only what is no usual table by itself needs a reader of its own.
            if kind < 4 {
                for between in [" ", ", ", "\t"] {
                    let plain = rows(head, |k| format!("{}{}{between}0.5", stamp(k), signal(k)));
                    assert_holds(plain.as_bytes(), "column_2_raw", 0);
                }
            }
        }
    }
}

#[test]
fn messages_about_a_log_name_its_own_lines() {
    let log = rows("", |k| format!("t:{} ax:{}", if k == 9 { 0.0 } else { f64::from(k) * 0.004 }, signal(k)));
    let message = parse_recording(log.as_bytes(), "log", &ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("row 10,"), "{message}");
}

#[test]
fn rows_in_the_brackets_of_python_are_rows() {
    for (open, close) in [("(", ")"), ("[", "]"), ("[", "],")] {
        for between in [", ", ","] {
            let row = |k: u32| format!("{open}{}{between}{}{close}", f64::from(k) * 0.004, signal(k));
            assert_holds(rows("", row).as_bytes(), "column_2_raw", 0);
        }
    }
    for rest in ["'ay': None", "'ay': 0.5", "'ok': True"] {
        let row = |k: u32| format!("{{'time_s': {}, 'ax_g': {}, {rest}}}", f64::from(k) * 0.004, signal(k));
        assert_holds(rows("", row).as_bytes(), "ax_g", 0);
    }
}

#[test]
fn one_row_per_channel_is_turned() {
    for separator in [",", ";", "\t", " "] {
        for end in ["", separator] {
            let line = |name: &str, cell: &dyn Fn(u32) -> String| {
                let cells: Vec<String> = (0..300).map(cell).collect();
                format!("{name}{separator}{}{end}\n", cells.join(separator))
            };
            let text = line("time_s", &|k| format!("{}", f64::from(k) * 0.004))
                + &line("ax_g", &|k| signal(k).to_string())
                + &line("ay_g", &|_| "0.5".to_owned());
            assert_holds(text.as_bytes(), "ax_g", 0);
        }
    }
}

#[test]
fn what_stands_alone_was_measured_whatever_it_is_called() {
    for head in ["Waveform Data\n", "# X: s actual [mm]\n", "time\n", "Time,28-Nov-26,\nWaveform Data,,\n"] {
        for (key, comma) in [("Sampling Period,4.000E-03,\n", ",,"), ("# Sample time: 4 ms\n", "")] {
            let text = rows(&format!("{key}{head}"), |k| format!("{}{comma}", signal(k)));
            let found = parse(text.as_bytes());
            assert_eq!(found.recording.columns.len(), 1, "{text:.80}");
            let samples = &found.recording.columns[0].samples;
            assert!((0..200).all(|k| samples[k as usize] == signal(k)), "{text:.80}");
            assert!((found.recording.time_s[100] - 0.4).abs() < 1e-9);
        }
    }
}

/// A clock of whole milliseconds counts by one, as the number of a row does.
#[test]
fn a_clock_that_counts_by_one_is_a_clock_where_it_states_its_unit() {
    for step in [1, 2, 5] {
        for before in [|k| format!("I ({k}) imu: "), |k: u32| format!("{k} ms\t")] {
            let text = rows("", |k| format!("{}{}\t0.5", before(700 + step * k), signal(k)));
            let found = parse(text.as_bytes()).recording;
            assert_eq!(found.columns.len(), 2);
            let last_s = found.time_s[100] - found.time_s[0];
            assert!((last_s - 0.1 * f64::from(step)).abs() < 1e-9, "{last_s}");
        }
    }
}

#[test]
fn a_signal_that_goes_on_from_line_to_line_is_one_signal() {
    let heads = [
        "PEER STRONG MOTION DATABASE RECORD\nDeck, 3/14/2025, 090\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS=  300, DT=   .0040 SEC\n",
        "A BRIDGE\nACCELERATION TIME HISTORY IN UNITS OF G\n  300    0.0040   NPTS, DT\n",
        "acceleration in units of g\n300 points of data equally spaced at .004 sec\n",
    ];
    for head in heads {
        for width in [2, 5, 7, 8] {
            for end in ["\n", "\r\n"] {
                let mut text = head.replace('\n', end);
                for k in 0..ROWS {
                    text += &format!("  {:.7E}", signal(k));
                    if (k + 1) % width == 0 || k + 1 == ROWS {
                        text += end;
                    }
                }
                let found = assert_holds(text.as_bytes(), "acceleration_g", 0);
                assert!(
                    found.remarks.iter().any(|remark| remark.contains("one signal")),
                    "{:?}",
                    found.remarks
                );
            }
        }
    }
}

/// A table's head may state a number too: that of its rows.
#[test]
fn a_table_whose_head_counts_its_rows_stays_a_table() {
    let head = "points 300, DT= .004 sec\n";
    let row = |k: u32| format!("{:.3} {} {}", f64::from(k) * 0.004, signal(k), 2.0 * signal(k));
    let found = parse(rows(head, row).as_bytes());
    assert!(found.recording.len() == ROWS as usize, "{:?}", found.remarks);
    assert!(!found.remarks.iter().any(|remark| remark.contains("one signal")), "{:?}", found.remarks);
}
