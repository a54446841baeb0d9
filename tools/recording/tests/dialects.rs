//! A table written in any dialect is read back as what was written.

use proptest::prelude::*;
use stillbeam_recording::{ColumnChoice, Imported, ReadOptions, parse_recording};

/// How a table is written.
#[derive(Debug, Clone)]
struct Dialect {
    separator: &'static str,
    decimal_comma: bool,
    quoted: bool,
    comment: &'static str,
    comments_before: usize,
    comment_between: bool,
    preamble: bool,
    commented_header: bool,
    /// 0 in brackets, 1 in a row of their own, 2 behind `_`, 3 in parentheses.
    units: usize,
    states_separator: bool,
    trailing_separator: bool,
    line_end: &'static str,
    /// 0 UTF-8, 1 with mark, 2 and 3 UTF-16 with mark, 4 Latin-1, 5 UTF-16 without mark.
    encoding: usize,
    missing: &'static str,
    last_line_ends: bool,
    exponent: bool,
}

fn dialects() -> impl Strategy<Value = Dialect> {
    let separators = prop::sample::select(vec![",", ";", "\t", "|", " ", "   ", "; ", ", "]);
    let comments = prop::sample::select(vec!["#", "%", "//", "# ", "##"]);
    let missing = prop::sample::select(vec!["", "NaN", "nan", "#N/A", "null", "--"]);
    let flags = prop::collection::vec(any::<bool>(), 9);
    let line_ends = prop::sample::select(vec!["\n", "\r\n"]);
    (separators, comments, missing, flags, line_ends, 0..4_usize, 0..6_usize, 0..4_usize).prop_map(
        |(separator, comment, missing, flags, line_end, units, encoding, comments_before)| {
            let blanks = separator.trim().is_empty() && separator != "\t";
            let quoted = flags[1];
            Dialect {
                separator,
                // Unquoted, a decimal comma cannot be told from a separating one.
                decimal_comma: flags[0] && (quoted || !separator.starts_with(',')),
                quoted,
                comment,
                comments_before,
                comment_between: flags[2],
                preamble: flags[3] && !blanks,
                commented_header: flags[4],
                units,
                states_separator: flags[5] && separator.len() == 1 && !blanks,
                trailing_separator: flags[6] && !blanks,
                line_end,
                encoding,
                missing: if blanks && missing.is_empty() { "NaN" } else { missing },
                last_line_ends: flags[7],
                exponent: flags[8],
            }
        },
    )
}

impl Dialect {
    fn number(&self, value: f64, decimals: usize) -> String {
        let text = if self.exponent { format!("{value:.12e}") } else { format!("{value:.decimals$}") };
        let text = if self.decimal_comma { text.replace('.', ",") } else { text };
        if self.quoted { format!("\"{text}\"") } else { text }
    }

    fn line(&self, cells: &[String]) -> String {
        let end = if self.trailing_separator { self.separator } else { "" };
        format!("{}{end}{}", cells.join(self.separator), self.line_end)
    }

    fn names(&self) -> [[&str; 3]; 2] {
        match self.units {
            0 => [["Zeit[s]", "Weg[µm]", "acc[m/s^2]"], [""; 3]],
            1 => [["Zeit", "Weg", "acc"], ["s", "µm", "m/s²"]],
            2 => [["time_s", "Weg_um", "acc_m_s2"], [""; 3]],
            _ => [["t(s)", "Weg(µm)", "acc(m/s²)"], [""; 3]],
        }
    }

    fn write(&self, rows: &[[Option<f64>; 3]]) -> Vec<u8> {
        let mut text = String::new();
        if self.states_separator {
            text.push_str(&format!("sep={}{}", self.separator, self.line_end));
        }
        for k in 0..self.comments_before {
            text.push_str(&format!("{} sensor {k}, gain 10{}", self.comment, self.line_end));
        }
        if self.preamble {
            for (key, value) in [("Operator", "lab 4"), ("Gain", "10"), ("Datum", "2025-03-02")] {
                text.push_str(&format!("{key}{}{value}{}", self.separator, self.line_end));
            }
            text.push_str(self.line_end);
        }
        let [names, units] = self.names();
        for cells in [names, units] {
            if cells != [""; 3] {
                let cells: Vec<String> = cells.iter().map(|cell| (*cell).to_owned()).collect();
                let sign = if self.commented_header { self.comment } else { "" };
                text.push_str(&format!("{sign}{}", self.line(&cells)));
            }
        }
        for (index, row) in rows.iter().enumerate() {
            if self.comment_between && index == 5 {
                text.push_str(&format!("{} paused{}", self.comment, self.line_end));
            }
            let decimals = [3, 4, 4];
            let cells: Vec<String> = row
                .iter()
                .zip(decimals)
                .map(|(cell, decimals)| {
                    cell.map_or_else(|| self.missing.to_owned(), |cell| self.number(cell, decimals))
                })
                .collect();
            text.push_str(&self.line(&cells));
        }
        if !self.last_line_ends {
            text.truncate(text.trim_end_matches(['\r', '\n']).len());
        }
        self.encode(&text)
    }

    fn encode(&self, text: &str) -> Vec<u8> {
        let wide = |big: bool| {
            text.encode_utf16().flat_map(move |u| if big { u.to_be_bytes() } else { u.to_le_bytes() })
        };
        match self.encoding {
            0 => text.as_bytes().to_vec(),
            1 => [b"\xef\xbb\xbf", text.as_bytes()].concat(),
            2 => b"\xff\xfe".iter().copied().chain(wide(false)).collect(),
            3 => b"\xfe\xff".iter().copied().chain(wide(true)).collect(),
            4 => text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect(),
            _ => wide(false).collect(),
        }
    }
}

fn rows() -> impl Strategy<Value = Vec<[Option<f64>; 3]>> {
    let value = || prop::option::weighted(0.9, (-99_999..99_999_i32).prop_map(|v| f64::from(v) / 1e4));
    prop::collection::vec((value(), value()), 8..40).prop_map(|values| {
        let stamps = (0..).map(|k| f64::from(4 * k) / 1e3);
        let mut rows: Vec<[Option<f64>; 3]> = stamps.zip(values).map(|(t, (a, b))| [Some(t), a, b]).collect();
        // What a dialect is told from is complete; what may be missing comes later.
        for (k, row) in rows.iter_mut().take(3).enumerate() {
            row[1] = row[1].or(Some(0.5 + k as f64));
            row[2] = row[2].or(Some(1.5 + k as f64));
        }
        rows
    })
}

fn read(bytes: &[u8]) -> Imported {
    parse_recording(bytes, "table", &ReadOptions::default()).unwrap_or_else(|error| {
        panic!("{error}\n{}", String::from_utf8_lossy(bytes));
    })
}

fn same(found: &[f64], written: impl Iterator<Item = Option<f64>>) -> bool {
    let written: Vec<Option<f64>> = written.collect();
    found.len() == written.len()
        && found.iter().zip(written).all(|(found, written)| match written {
            Some(written) => *found == written,
            None => found.is_nan(),
        })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_table_in_any_dialect_is_read_as_it_was_written(dialect in dialects(), rows in rows()) {
        let bytes = dialect.write(&rows);
        let found = read(&bytes);
        let names: Vec<&str> = found.recording.columns.iter().map(|column| column.name.as_str()).collect();
        prop_assert_eq!(&names, &["Weg_um", "acc_m_s2"], "{}", String::from_utf8_lossy(&bytes));
        prop_assert!(same(&found.recording.time_s, rows.iter().map(|row| row[0])), "{}", String::from_utf8_lossy(&bytes));
        for (at, column) in found.recording.columns.iter().enumerate() {
            prop_assert!(same(&column.samples, rows.iter().map(|row| row[at + 1])), "{}", String::from_utf8_lossy(&bytes));
        }
    }

    #[test]
    fn a_table_in_any_dialect_that_is_damaged_is_read_or_explained(
        dialect in dialects(),
        rows in rows(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3_u8), 1..8),
    ) {
        let mut bytes = dialect.write(&rows);
        for (place, byte, kind) in edits {
            let at = place.index(bytes.len().max(1));
            match kind {
                0 if at < bytes.len() => bytes[at] = byte,
                1 => bytes.truncate(at),
                _ => bytes.insert(at.min(bytes.len()), byte),
            }
        }
        match parse_recording(&bytes, "damaged", &ReadOptions::default()) {
            Ok(found) => found.recording.check().unwrap(),
            Err(error) => prop_assert!(!error.to_string().contains('\n'), "{error}"),
        }
    }
}

/// Writes the time of a sample.
type Stamp = Box<dyn Fn(u32) -> String>;

/// A decay of 60 samples at 250 Hz.
fn decay(k: u32) -> f64 {
    let t = f64::from(k) / 250.0;
    (2.4 * (-t).exp() * (59.0 * t).cos() * 1e4).round() / 1e4
}

fn table(head: &str, row: impl Fn(u32) -> String) -> String {
    (0..60).fold(head.to_owned(), |text, k| text + &row(k) + "\n")
}

fn assert_reads(text: &str, column: &str) -> Imported {
    let found = read(text.as_bytes());
    let samples = found.recording.column(column).unwrap_or_else(|error| panic!("{error}\n{text}"));
    for (k, sample) in (0..).zip(samples) {
        assert_eq!(*sample, decay(k), "{text}");
        assert!(
            (found.recording.time_s[k as usize] - found.recording.time_s[0] - f64::from(k) / 250.0).abs()
                < 1e-5
        );
    }
    assert_eq!(samples.len(), 60, "{text}");
    found
}

#[test]
fn times_in_every_unit_and_clock_are_seconds() {
    let clock = |k: u32| (7 + 4 * k / 1000, 4 * k % 1000);
    let shapes: [(&str, Stamp); 16] = [
        ("Time [ms],a [g]", Box::new(|k| format!("{}", 51_200 + 4 * k))),
        ("millis,a_g", Box::new(|k| format!("{}", 4 * k))),
        ("micros,a_g", Box::new(|k| format!("{}", 4000 * k))),
        ("t_us,a_g", Box::new(|k| format!("{}", 4000 * k))),
        ("time (ns),a_g", Box::new(|k| format!("{}", 4_000_000 * u64::from(k)))),
        ("Zeit (min),a_g", Box::new(|k| format!("{:.9}", f64::from(k) * 0.004 / 60.0))),
        ("timestamp,a_g", Box::new(|k| format!("{:.3}", 1_740_906_907.0 + f64::from(k) * 0.004))),
        ("timestamp,a_g", Box::new(|k| format!("{}", 1_740_906_907_000 + u64::from(4 * k)))),
        (
            "timestamp_ns,a_g",
            Box::new(|k| format!("{}", 1_740_906_907_000_000_000 + 4_000_000 * u64::from(k))),
        ),
        ("date,a_g", Box::new(move |k| format!("2025-03-02T09:15:{:02}.{:03}", clock(k).0, clock(k).1))),
        ("when,a_g", Box::new(move |k| format!("02.03.2025 09:15:{:02}.{:03}", clock(k).0, clock(k).1))),
        ("time,a_g", Box::new(move |k| format!("09:15:{:02}.{:03}", clock(k).0, clock(k).1))),
        ("Date,Time,a_g", Box::new(move |k| format!("2025/03/02,09:15:{:02}.{:03}", clock(k).0, clock(k).1))),
        (
            "time,a_g",
            Box::new(|k| {
                let ms = 86_399_900 + 4 * k;
                format!(
                    "{:02}:{:02}:{:02}.{:03}",
                    ms / 3_600_000 % 24,
                    ms / 60_000 % 60,
                    ms / 1000 % 60,
                    ms % 1000
                )
            }),
        ),
        ("Sample,Time (s),a (g)", Box::new(|k| format!("{k},{}", f64::from(k) / 250.0))),
        ("X_Value,a_g", Box::new(|k| format!("{}", f64::from(k) / 250.0))),
    ];
    for (header, stamp) in shapes {
        assert_reads(&table(&format!("{header}\n"), |k| format!("{},{}", stamp(k), decay(k))), "a_g");
    }
}

#[test]
fn headers_of_instruments_are_understood() {
    let seconds = |k: u32| format!("{:.3}", f64::from(k) / 250.0);
    let pair = |k: u32| format!("{},{}", seconds(k), decay(k));
    let scope = "Model,DS1000\nRecord Length,60\nSample Interval,0.004\nVertical Units,V\n\nSource,CH1\nSecond,Volt\n";
    assert_reads(&table(scope, pair), "CH1_V");
    assert_reads(&table("x-axis,1\nsecond,Volt\n", pair), "column_2_V");
    let rate = "# logger 3\n# Sample rate: 250 Hz\nacc [g];temp [degC]\n";
    assert_reads(&table(rate, |k| format!("{};20.5", decay(k))), "acc_g");
    let interval = "Delta_X\t4.0E-3\nacc_m_s2\tb_m_s2\n";
    assert_reads(&table(interval, |k| format!("{}\t1", decay(k))), "acc_m_s2");
    let blanks = "  Time [s]   Acc X [m/s^2]   state\n";
    assert_reads(&table(blanks, |k| format!(" {}   {}  {}", seconds(k), decay(k), k % 2)), "Acc_X_m_s2");
}

#[test]
fn columns_without_units_are_taken_and_said_to_have_none() {
    let found = assert_reads(&table("millis,ax\n", |k| format!("{},{}", 4 * k, decay(k))), "ax_raw");
    assert!(found.remarks.join("\n").contains("no column states a unit"), "{:?}", found.remarks);
    let found =
        assert_reads(&table("", |k| format!("{:.3};{}", f64::from(k) / 250.0, decay(k))), "column_2_raw");
    assert!(found.remarks.join("\n").contains("no header"), "{:?}", found.remarks);
    let found = assert_reads(
        &table("time_s,a_g,a_g\n", |k| format!("{:.3},{},1", f64::from(k) / 250.0, decay(k))),
        "a_g",
    );
    assert_eq!(found.recording.columns[1].name, "a_2_g");
}

#[test]
fn ends_that_are_cut_or_followed_by_something_are_set_aside_and_said() {
    let whole =
        table("time_s,a_g,b_g\n", |k| format!("{:.3},{:.4},{:.4}", f64::from(k) / 250.0, decay(k), decay(k)));
    let cuts = ["0.240", "0.240,", "0.240,0.12", "0.240,0.1234", "0.240,0.1234,0.1"];
    for cut in cuts {
        let found = assert_reads_first(&format!("{whole}{cut}"), 60);
        assert!(
            found.remarks.iter().any(|remark| remark.contains("row 62") && remark.contains("cut")),
            "{cut}: {:?}",
            found.remarks
        );
    }
    for end in [
        "Rate 250, overflows 0\n",
        "\nEnd of file\n",
        "stopped by user;;\nat 09:15\n\n",
        ",,\n,,\n",
        "\n\n\n",
    ] {
        let found = assert_reads_first(&format!("{whole}{end}"), 60);
        let said = found.remarks.iter().any(|remark| remark.contains("after"));
        assert_eq!(said, end.contains(char::is_alphabetic), "{end}: {:?}", found.remarks);
    }
}

fn assert_reads_first(text: &str, count: usize) -> Imported {
    let found = read(text.as_bytes());
    assert_eq!(found.recording.len(), count, "{:?}", found.remarks);
    assert!(found.recording.columns[0].samples.iter().zip(0..).all(|(sample, k)| *sample == decay(k)));
    found
}

#[test]
fn a_bad_cell_amid_the_rows_is_named_and_not_stepped_over() {
    for (head, bad, said) in [
        ("time_s,a_g\n", "0.1,oops", ["row 12", "`a_g`", "`oops`"]),
        ("Zeit [ms];Weg [mm]\n", "100;oops", ["row 12", "`Weg [mm]`", "`oops`"]),
        ("# x\nt,a_g\n", "0.1,1,2", ["row 13", "3 cells", "2"]),
    ] {
        let separator = if head.contains(';') { ";" } else { "," };
        let row = |k: u32| if k == 10 { bad.to_owned() } else { format!("{}{separator}{}", k, decay(k)) };
        let message = parse_recording(table(head, row).as_bytes(), "bad", &ReadOptions::default())
            .unwrap_err()
            .to_string();
        assert!(said.iter().all(|part| message.contains(part)), "{message}");
    }
}

#[test]
fn options_overrule_what_is_found() {
    let text = table("garbage;1;2;3\nmore;1;2;3\nt;a_g;b_g\n", |k| format!("{};{};1", k, decay(k)));
    let options = ReadOptions {
        skip_lines: Some(2),
        time: Some("t*0.004".parse().unwrap()),
        separator: Some(";".parse().unwrap()),
        decimal_comma: Some(false),
        ..ReadOptions::default()
    };
    let found = parse_recording(text.as_bytes(), "t", &options).unwrap();
    assert!((found.recording.time_s[59] - 59.0 * 0.004).abs() < 1e-12);
    let starred = table("time_s,moment (N*m)\n", |k| format!("{},{}", f64::from(k) / 250.0, decay(k)));
    let columns: Vec<ColumnChoice> = vec!["m_N_m=moment (N*m)".parse().unwrap()];
    let options = ReadOptions { columns, ..ReadOptions::default() };
    let found = parse_recording(starred.as_bytes(), "t", &options).unwrap();
    assert_eq!(found.recording.columns[0].name, "m_N_m");
    assert_reads(&starred, "moment_N_m");
    let twice: ColumnChoice = "m_N_m=moment (N*m)*2".parse().unwrap();
    assert_eq!((twice.source.as_str(), twice.scale), ("moment (N*m)", 2.0));
}

#[test]
fn a_column_is_found_by_the_name_that_its_file_gives_it() {
    for (header, name) in [
        ("torque_Nm", "torque_N_m"),
        ("torque_command_N.m", "torque_command_N_m"),
        ("Torque (Nm)", "Torque_N_m"),
        ("speed [rad/s]", "speed_rad_s"),
        ("gap µm", "gap_um"),
        ("speed_rad_s", "speed_rad_s"),
    ] {
        let text = format!("time_s,{header}\n0,1\n0.1,2\n0.2,4\n0.3,3\n0.4,5\n");
        let recording = read(text.as_bytes()).recording;
        assert_eq!(recording.column(name).unwrap(), recording.column(header).unwrap(), "{header}");
        assert!(recording.column("pressure_Pa").is_err());
    }
}
