//! Whole numbers whose thousands a comma groups, and logs of a bus, which are no tables.

use proptest::prelude::*;
use stillbeam_recording::{ReadOptions, parse_recording};

/// A whole number with commas before every three digits.
fn grouped(number: i64) -> String {
    let digits = number.unsigned_abs().to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    if number < 0 { format!("-{text}") } else { text }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn thousands_grouped_by_commas_are_whole_numbers_beside_decimal_points(
        separator in prop::sample::select(vec![";", "\t", " ", "|", ","]),
        numbers in prop::collection::vec(-3_000_000_i64..3_000_000, 20..60),
        decimals in prop::sample::select(vec![2_usize, 3, 4, 6]),
        interval_s in prop::sample::select(vec![0.005, 0.01, 0.25]),
    ) {
        let mut text = format!("time_s{separator}level_raw\n");
        for (k, number) in numbers.iter().enumerate() {
            let cell = if separator == "," { format!("\"{}\"", grouped(*number)) } else { grouped(*number) };
            text.push_str(&format!("{:.decimals$}{separator}{cell}\n", k as f64 * interval_s));
        }
        let of_three = numbers.iter().filter(|number| number.abs() >= 1000).count();
        prop_assume!(of_three >= 3 && !(decimals == 2 && interval_s == 0.005));
        let found = parse_recording(text.as_bytes(), "x.csv", &ReadOptions::default());
        let recording = found.unwrap().recording;
        let wanted: Vec<f64> = numbers.iter().map(|number| *number as f64).collect();
        prop_assert_eq!(recording.column("level_raw").unwrap(), &wanted[..]);
        prop_assert!((recording.time_s[3] - 3.0 * interval_s).abs() < 1e-9);
    }

    #[test]
    fn decimal_commas_stay_what_they_are(
        numbers in prop::collection::vec(-9_000_000_i64..9_000_000, 20..60),
    ) {
        let decimal = |value: f64| format!("{value:.3}").replace('.', ",");
        let mut text = "time_s;tip_mm\n".to_owned();
        for (k, number) in numbers.iter().enumerate() {
            text.push_str(&format!("{};{}\n", decimal(0.005 * k as f64), decimal(*number as f64 * 1e-3)));
        }
        let found = parse_recording(text.as_bytes(), "x.csv", &ReadOptions::default()).unwrap();
        let tip = found.recording.column("tip_mm").unwrap();
        prop_assert!(tip.iter().zip(&numbers).all(|(y, number)| (y - *number as f64 * 1e-3).abs() < 1e-9));
    }

    #[test]
    fn logs_of_a_bus_are_named_as_such(
        frames in prop::collection::vec((0_u32..0x7ff, prop::collection::vec(any::<u8>(), 1..8)), 6..40),
        bus in prop::sample::select(vec!["can0", "vcan1", "slcan0"]),
        layout in 0..4_usize,
    ) {
        let mut text = String::new();
        if layout == 3 {
            text.push_str("date Thu Apr 28 10:44:52.480 am 2022\nbase hex  timestamps absolute\n");
        }
        for (k, (id, bytes)) in frames.iter().enumerate() {
            let stamp = 1_436_509_052.0 + 0.01 * k as f64;
            let pairs: Vec<String> = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
            let (close, apart, count) = (pairs.concat(), pairs.join(" "), bytes.len());
            text.push_str(&match layout {
                0 => format!("({stamp:.6}) {bus} {id:03X}#{close}\n"),
                1 => format!("  {bus}  {id:03X}   [{count}]  {apart}\n"),
                2 => format!(" ({stamp:.6})  {bus}  {id:03X}   [{count}]  {apart}\n"),
                _ => format!("   {:.6} 1  {id:03X}             Rx   d {count} {apart}\n", 0.01 * k as f64),
            });
        }
        let refusal = parse_recording(text.as_bytes(), "x.log", &ReadOptions::default()).unwrap_err().to_string();
        prop_assert!(refusal.contains("CAN frames") && refusal.contains("cantools"), "{}", refusal);
    }
}
