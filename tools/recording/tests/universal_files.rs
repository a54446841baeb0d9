//! Universal files as programs write them: labels in any encoding, axes in any unit, functions alike, ends
//! that lack.

use stillbeam_recording::{Imported, ReadOptions, RecordingError, parse_recording};

/// One function of time, as data set 58 has it.
struct Function {
    title: &'static str,
    node: u32,
    direction: u32,
    time_unit: &'static str,
    label: &'static str,
    unit: &'static str,
    step: f64,
}

const FUNCTION: Function = Function {
    title: "arm",
    node: 3,
    direction: 1,
    time_unit: "s",
    label: "Acc",
    unit: "m/s^2",
    step: 0.004,
};

fn value(k: u32) -> f64 {
    f64::from(k % 17) - 8.0
}

/// The text of functions of 60 values; `bytes_count` pads labels as a writer does that counts bytes.
fn text(functions: &[Function], bytes_count: bool) -> String {
    let pad = |text: &str| {
        let length = if bytes_count { text.len() } else { text.chars().count() };
        format!("{text}{}", " ".repeat(20_usize.saturating_sub(length)))
    };
    let mut text = String::new();
    for f in functions {
        text += &format!("    -1\n    58\n{}\nNONE\nNONE\nNONE\nNONE\n", f.title);
        text += &format!(
            "    1         0    0         0 NONE      {:>10}{:>4} NONE               0   0\n",
            f.node, f.direction
        );
        text += &format!("         2        60         1{:>13.5e}{:>13.5e}  0.00000e+00\n", 0.0, f.step);
        text += &format!("        17    0    0    0 {} {}\n", pad("Time"), pad(f.time_unit));
        text += &format!("        12    0    0    0 {} {}\n", pad(f.label), pad(f.unit));
        for _ in 0..2 {
            text += &format!("         0    0    0    0 {} {}\n", pad("NONE"), pad("NONE"));
        }
        for k in 0..60 {
            text += &format!("{:>13.5e}{}", value(k), if k % 6 == 5 { "\n" } else { "" });
        }
        text += "    -1\n";
    }
    text
}

fn read(bytes: &[u8]) -> Result<Imported, RecordingError> {
    parse_recording(bytes, "u.uff", &ReadOptions::default())
}

fn latin1(text: &str) -> Vec<u8> {
    text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect()
}

#[test]
fn no_character_of_a_unit_is_dropped_in_any_encoding_or_counting() {
    for (label, unit, name) in [
        ("Weg", "µm", "acceleration_3_x_um"),
        ("Länge über Grund", "µm", "acceleration_3_x_um"),
        ("Beschleunigung µµµµµ", "m/s²", "acceleration_3_x_m_s2"),
        ("Drehrate", "°/s", "acceleration_3_x_deg_s"),
    ] {
        let function = || Function { label, unit, ..FUNCTION };
        for bytes in [
            text(&[function()], false).into_bytes(),
            text(&[function()], true).into_bytes(),
            latin1(&text(&[function()], false)),
        ] {
            let found = read(&bytes).unwrap();
            assert_eq!(found.recording.columns[0].name, name, "{}", String::from_utf8_lossy(&bytes));
        }
    }
}

#[test]
fn the_unit_of_the_time_axis_is_applied() {
    for (time_unit, step) in [
        ("s", 0.004),
        ("ms", 4.0),
        ("us", 4000.0),
        ("µs", 4000.0),
        ("sec", 0.004),
        ("NONE", 0.004),
        ("min", 0.004 / 60.0),
    ] {
        let found = read(text(&[Function { time_unit, step, ..FUNCTION }], false).as_bytes()).unwrap();
        assert!(
            (found.recording.duration_s() - 59.0 * 0.004).abs() < 1e-5,
            "{time_unit} {}",
            found.recording.duration_s()
        );
    }
    let odd = read(text(&[Function { time_unit: "ticks", ..FUNCTION }], false).as_bytes()).unwrap();
    assert!(odd.remarks.iter().any(|remark| remark.contains("`ticks`")), "{:?}", odd.remarks);
}

#[test]
fn functions_alike_are_told_apart_by_their_titles_or_numbers() {
    let at_zero = |title| Function { title, node: 0, direction: 0, ..FUNCTION };
    let names = |functions: &[Function]| -> Vec<String> {
        let found = read(text(functions, false).as_bytes()).unwrap();
        found.recording.columns.iter().map(|column| column.name.clone()).collect()
    };
    assert_eq!(
        names(&[at_zero("arm x"), at_zero("arm y")]),
        ["acceleration_arm_x_m_s2", "acceleration_arm_y_m_s2"]
    );
    assert_eq!(
        names(&[at_zero("NONE"), at_zero("NONE")]),
        ["acceleration_function_1_m_s2", "acceleration_function_2_m_s2"]
    );
    assert_eq!(
        names(&[at_zero("a"), at_zero("a"), at_zero("b")]),
        ["acceleration_function_1_m_s2", "acceleration_function_2_m_s2", "acceleration_b_m_s2"]
    );
    assert_eq!(names(&[FUNCTION, at_zero("a")]), ["acceleration_3_x_m_s2", "acceleration_0_m_s2"]);
}

#[test]
fn what_is_there_of_a_file_that_ends_early_is_read_and_said() {
    let whole = text(&[FUNCTION, Function { node: 4, ..FUNCTION }], false);
    let without_end = whole.strip_suffix("    -1\n").unwrap();
    let found = read(without_end.as_bytes()).unwrap();
    assert_eq!((found.recording.len(), found.recording.columns.len()), (60, 2));
    // The second function ends after 24 whole values and part of another.
    let second = whole.rfind("    58\n").unwrap();
    let values = whole[second..].match_indices('\n').nth(11).unwrap().0 + second + 1;
    let found = read(&whole.as_bytes()[..values + 4 * 79 + 5]).unwrap();
    let cut = &found.recording.columns[1].samples;
    let present = cut.iter().filter(|value| value.is_finite()).count();
    assert_eq!((present, cut.len()), (24, 60));
    assert!(cut.iter().take(24).zip(0..).all(|(found, k)| *found == value(k)));
    assert!(found.remarks.iter().any(|remark| remark.contains("24 of 60")), "{:?}", found.remarks);
}
