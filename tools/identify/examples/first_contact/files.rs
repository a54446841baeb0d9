//! One decay in every kind of file.

use std::fmt::Write;

use stillbeam_recording::{Format, ReadOptions, Recording, TimeBase, parse_recording, to_format};

use crate::synthetic::{Mode, Noise, ring_down};
use crate::{cell, decay_cell};

const RATE_HZ: f64 = 250.0;
const ROWS: usize = 900;
const MODE: Mode = Mode { frequency_hz: 8.7, damping_ratio: 0.015, participation: 3.0 };

/// A file and how it is read.
struct File {
    what: &'static str,
    bytes: Vec<u8>,
    options: ReadOptions,
}

impl File {
    fn new(what: &'static str, text: impl Into<Vec<u8>>) -> Self {
        Self { what, bytes: text.into(), options: ReadOptions::default() }
    }
}

/// The table of all files.
pub fn section() -> String {
    let mut text = format!(
        "## Files\n\nOne free decay of {} m/s² ({} rows at {RATE_HZ} Hz, 0.3 % noise) in every kind of file; truth in Hz / damping ratio: {}.\n\n\
| file | format | what is said of it | found, Hz / damping ratio |\n|---|---|---|---|\n",
        MODE.participation,
        ROWS,
        cell(std::iter::once((MODE.frequency_hz, MODE.damping_ratio)))
    );
    for file in files() {
        let row = match parse_recording(&file.bytes, "file", &file.options) {
            Ok(read) => {
                let output = read.recording.columns.first().map_or("", |column| column.name.as_str());
                let said: Vec<String> =
                    read.remarks.iter().map(|remark| remark.replace('|', "\\|")).collect();
                let found = decay_cell(&read.recording, output);
                format!("| {} | {} | {} | {found} |", file.what, read.format, said.join("; "))
            }
            Err(refusal) => format!("| {} | | {refusal} | |", file.what),
        };
        text += &row;
        text += "\n";
    }
    text
}

fn decay() -> Recording {
    let mut noise = Noise(11);
    let errors: Vec<f64> = (0..ROWS).map(|_| 0.003 * MODE.participation * noise.normal()).collect();
    let made = ring_down(&[MODE], RATE_HZ, ROWS, 0.0, |k| errors[k]);
    Recording::new("decay", made.time_s.clone()).with_column("tip_m_s2", made.columns[0].samples.clone())
}

/// Rows of stamp and value, written by `line`.
fn rows(line: impl Fn(usize, f64, f64) -> String) -> String {
    let decay = decay();
    let pairs = decay.time_s.iter().zip(&decay.columns[0].samples).enumerate();
    pairs.map(|(k, (t, y))| line(k, *t, *y) + "\n").collect()
}

fn plain(separator: &str) -> String {
    rows(|_, t, y| format!("{t:.4}{separator}{y:.6}"))
}

fn comma(text: &str) -> String {
    text.replace('.', ",")
}

fn utf16(text: &str) -> Vec<u8> {
    let units = std::iter::once(0xfeff).chain(text.encode_utf16());
    units.flat_map(u16::to_le_bytes).collect()
}

fn tables() -> Vec<File> {
    let named = |separator: &str| format!("time_s{separator}tip_m_s2\n{}", plain(separator));
    let without_header =
        ReadOptions { time: Some(TimeBase::IntervalS(1.0 / RATE_HZ)), ..ReadOptions::default() };
    let values = rows(|_, _, y| format!("{y:.6}"));
    let mut cut = named(",");
    cut.truncate(cut.len() - 6);
    vec![
        File::new("comma-separated", named(",")),
        File::new("semicolons, decimal commas", comma(&named(";"))),
        File::new("tabs", named("\t")),
        File::new("blanks", named("  ")),
        File::new("UTF-16 with a byte order mark", utf16(&named("\t"))),
        File::new("`sep=` line of a spreadsheet", format!("sep=;\n{}", named(";"))),
        File::new(
            "comment lines before the header",
            format!("# rig 4\n% second run\n// by hand\n{}", named(",")),
        ),
        File::new(
            "preamble of keys and values",
            format!("Device: logger\nSerial: 0815\nChannels: 1\n\n{}", named(",")),
        ),
        File::new("a row of units", format!("time,tip\ns,m/s^2\n{}", plain(","))),
        File::new(
            "stamps in ms",
            format!("time (ms),tip (m/s^2)\n{}", rows(|_, t, y| format!("{:.1},{y:.6}", 1e3 * t))),
        ),
        File::new(
            "stamps rounded to hundredths of a second",
            format!("time_s,tip_m_s2\n{}", rows(|_, t, y| format!("{t:.2},{y:.6}"))),
        ),
        File::new(
            "dates and clock times",
            format!(
                "date,tip (m/s^2)\n{}",
                rows(|_, t, y| format!("2025-03-02T09:15:{:06.3},{y:.6}", 7.0 + t))
            ),
        ),
        File::new(
            "quoted numbers, trailing comma",
            format!("\"time_s\",\"tip_m_s2\",\n{}", rows(|_, t, y| format!("\"{t:.4}\",\"{y:.6}\","))),
        ),
        File {
            options: without_header.clone(),
            ..File::new("values alone, rate given (`--sample-rate`)", format!("tip_m_s2\n{values}"))
        },
        File::new("last row cut", cut),
    ]
}

fn machines() -> Vec<File> {
    let mut lvm = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\nX_Columns\tNo\n***End_of_Header***\t\n\t\nChannels\t1\t\nSamples\t900\t\nY_Unit_Label\tm/s^2\t\nX_Dimension\tTime\t\nX0\t0,0E+0\t\nDelta_X\t4,000000E-3\t\n***End_of_Header***\t\t\nX_Value\tTip\tComment\n".to_owned();
    lvm += &comma(&rows(|_, _, y| format!("\t{y:.6}")));
    let g = 9.80665;
    let rrf = format!(
        "Sample,X,Y,Z\n{}Rate 250, overflows 0\n",
        rows(|k, _, y| format!("{k},{:.3},{:.3},1.000", y / g, 0.3 * y / g))
    );
    let klipper = format!(
        "#time,accel_x,accel_y,accel_z\n{}",
        rows(|_, t, y| format!("{:.6},{:.3},{:.3},9807.0", 77.25 + t, 1e3 * y, 300.0 * y))
    );
    vec![
        File::new("LabVIEW measurement file, decimal commas", lvm),
        File::new("RepRapFirmware M956", rrf),
        File::new("Klipper raw accelerometer data", klipper),
        File::new("UFF 58, abscissa in ms", uff("Time", "ms", 1e3)),
        File::new("UFF 58 in Latin-1, unit µ", {
            let text = uff("Time", "s", 1.0).replace("m/s^2", "\u{b5}m/s^2");
            text.chars().map(|c| u8::try_from(u32::from(c)).unwrap_or(b'?')).collect::<Vec<u8>>()
        }),
    ]
}

fn uff(axis: &str, unit: &str, scale: f64) -> String {
    let step = scale / RATE_HZ;
    let mut text = format!(
        "    -1\n    58\narm\nNONE\nNONE\nNONE\nNONE\n    1         0    0         0 NONE               3   1 NONE               0   0\n{:>10}{:>10}{:>10}{:>13}{:>13}{:>13}\n",
        2,
        ROWS,
        1,
        "0.00000e+00",
        format!("{step:.5e}").replace("e0", "e+00").replace("e-3", "e-03"),
        "0.00000e+00"
    );
    let axes = [(17, axis, unit), (12, "Acc", "m/s^2"), (0, "NONE", "NONE"), (0, "NONE", "NONE")];
    for (code, label, unit) in axes {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{code:>10}{:>5}{:>5}{:>5} {label:<20} {unit:<20}", 0, 0, 0);
    }
    for six in decay().columns[0].samples.chunks(6) {
        for y in six {
            let _ = write!(text, "{:>13}", exponent(*y));
        }
        text += "\n";
    }
    text + "    -1\n"
}

/// A number as Fortran writes it.
fn exponent(value: f64) -> String {
    let text = format!("{value:.5e}");
    let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
    let power: i32 = power.parse().unwrap_or(0);
    format!("{digits}e{}{:02}", if power < 0 { '-' } else { '+' }, power.abs())
}

/// 24 valid bits, left-justified in 32, of a length that the header does not know, as a pipe writes it.
fn wav() -> Vec<u8> {
    let rate_hz = RATE_HZ as u32;
    let mut bytes = b"RIFF\xff\xff\xff\xffWAVEfmt ".to_vec();
    bytes.extend(40_u32.to_le_bytes());
    bytes.extend([0xfe, 0xff, 1, 0]);
    bytes.extend(rate_hz.to_le_bytes());
    bytes.extend((4 * rate_hz).to_le_bytes());
    bytes.extend([4, 0, 32, 0, 22, 0, 24, 0, 4, 0, 0, 0]);
    bytes.extend(b"\x01\0\0\0\0\0\x10\0\x80\0\0\xaa\0\x38\x9b\x71");
    bytes.extend(b"data\xff\xff\xff\xff");
    let full = f64::from(1 << 23) / 4.0;
    for y in &decay().columns[0].samples {
        bytes.extend((((full * y) as i32) << 8).to_le_bytes());
    }
    bytes
}

fn files() -> Vec<File> {
    let mut all = tables();
    all.extend(machines());
    all.push(File::new("WAV of 24 bits in 32, length unknown", wav()));
    for (what, format) in
        [("written by `convert` as UFF 58b", Format::Uff58b), ("written by `convert` as JSON", Format::Json)]
    {
        let mut bytes = Vec::new();
        if to_format(&mut bytes, &decay(), format).is_ok() {
            all.push(File::new(what, bytes));
        }
    }
    all
}
