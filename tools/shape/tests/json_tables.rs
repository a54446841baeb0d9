//! The JSON of a table: round trip, CRC, and files that must be refused.

use proptest::prelude::*;
use serde_json::Value;
use stillbeam_firmware::shaper::{Mode, ShaperTable, ShaperType};
use stillbeam_firmware::units::TickRate;
use stillbeam_shape::{Crc32, DesignOptions, ShaperDesign, TableProblem, impulse_sequence, parse_mode};

fn paper_design(kind: &str, rate_hz: f64) -> ShaperDesign {
    let modes = [format!("1.1,0.0074,{kind}"), format!("6.9,0.0059,{kind}")];
    let modes = modes.map(|spec| parse_mode(&spec).unwrap());
    ShaperDesign::new(&modes, rate_hz, &DesignOptions::default()).unwrap()
}

fn any_mode() -> impl Strategy<Value = Mode> {
    (0.8_f64..80.0, 0.0_f64..0.3, 0..ShaperType::ALL.len())
        .prop_map(|(hz, zeta, kind)| Mode::new(hz, zeta, ShaperType::ALL[kind]).unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_table_survives_the_trip_through_json(
        modes in prop::collection::vec(any_mode(), 1..=3),
        rate_hz in 200.0_f64..1500.0,
    ) {
        prop_assume!(modes.iter().all(|mode| mode.frequency_hz() < 0.49 * rate_hz));
        let design = ShaperDesign::new(&modes, rate_hz, &DesignOptions::default()).unwrap();
        let read = ShaperDesign::from_json("table.json", &design.to_json()).unwrap();
        prop_assert_eq!(&read, &design);
        // What the board would build from the same modes, and report.
        let table = ShaperTable::design(&modes, TickRate::from_hz(rate_hz).unwrap()).unwrap();
        prop_assert_eq!(read.crc32, Crc32(table.crc32()));
        prop_assert_eq!(read.table().unwrap(), table);
    }

    #[test]
    fn impulses_sum_to_one_and_come_in_order(modes in prop::collection::vec(any_mode(), 1..=3)) {
        let impulses = impulse_sequence(&modes);
        let sum: f64 = impulses.iter().map(|impulse| impulse.amplitude).sum();
        prop_assert!((sum - 1.0).abs() < 1e-12);
        prop_assert!(impulses.windows(2).all(|pair| pair[0].time_s < pair[1].time_s));
    }

    #[test]
    fn any_changed_tap_is_noticed(stage in 0..2_usize, tap in 0..6_usize, change in 1..1000_i32) {
        let mut design = paper_design("zvd", 4000.0);
        let taps = &mut design.stages[stage].taps;
        let tap = tap % taps.len();
        taps[tap].weight += change;
        let refused = matches!(design.check(), Err(TableProblem::Stage { .. }));
        prop_assert!(refused);
        // With the sum kept, the CRC is what tells.
        let other = (tap + 1) % design.stages[stage].taps.len();
        design.stages[stage].taps[other].weight -= change;
        let refused = matches!(design.check(), Err(TableProblem::Checksum { .. }));
        prop_assert!(refused);
    }
}

#[test]
fn the_json_has_exactly_the_agreed_fields() {
    let json: Value = serde_json::from_str(&paper_design("zvd", 4000.0).to_json()).unwrap();
    let keys = |value: &Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    let mut top = keys(&json);
    top.sort();
    let mut agreed =
        ["schema_version", "rate_hz", "duration_s", "delay_s", "crc32", "impulses", "stages", "residual"];
    agreed.sort_unstable();
    assert_eq!(top, agreed);
    assert_eq!(json["schema_version"], 1);
    let crc = json["crc32"].as_str().unwrap();
    assert!(crc.len() == 10 && crc.starts_with("0x"), "{crc}");
    assert_eq!(json["stages"][0]["type"], "zvd");
    assert_eq!(json["stages"][0]["weight_one"], 1_073_741_824);
    assert_eq!(json["stages"][0]["taps"][0]["delay_ticks"], 0);
    assert_eq!(json["impulses"].as_array().unwrap().len(), 9);
    assert_eq!(json["residual"]["nominal"].as_array().unwrap().len(), 2);
    // Two damped periods: 1/1.1 s and 1/6.9 s.
    let duration_s = json["duration_s"].as_f64().unwrap();
    assert!((duration_s - 1.054).abs() < 0.001, "{duration_s}");
}

#[test]
fn equal_times_are_one_impulse() {
    let mode = |kind| Mode::new(2.0, 0.0, kind).unwrap();
    // ZV convolved with itself is ZVD.
    let twice = impulse_sequence(&[mode(ShaperType::Zv), mode(ShaperType::Zv)]);
    let once = impulse_sequence(&[mode(ShaperType::Zvd)]);
    assert_eq!(twice.len(), 3);
    for (a, b) in twice.iter().zip(&once) {
        assert!((a.amplitude - b.amplitude).abs() < 1e-15 && (a.time_s - b.time_s).abs() < 1e-12);
    }
}

#[test]
fn the_paper_modes_meet_the_published_robustness() {
    // Worst over ±5 % of each mode's frequency, by the closed form (first order, undamped): ZV πε/2 and its
    // powers.
    for (kind, order) in [("zv", 1), ("zvd", 2), ("zvdd", 3), ("zvddd", 4)] {
        let design = paper_design(kind, 4000.0);
        let bound = (0.5 * std::f64::consts::PI * 0.05_f64).powi(order);
        for (nominal, worst) in design.residual.nominal.iter().zip(&design.residual.worst_over_box) {
            assert!(*nominal < 1e-6, "{kind}: {nominal}");
            assert!(*worst < bound && *worst > 0.0, "{kind}: {worst} against {bound}");
        }
        // The first mode's stage alone sets its worst case; the second mode's stage can only lower it.
        assert!(design.residual.worst_over_box[0] > 0.5 * bound);
    }
}

/// Widths for 5 % published for a damping ratio of 0.0074, here of the integer taps.
#[test]
fn the_insensitive_types_hold_five_per_cent_over_their_published_widths() {
    for (kind, width) in [("ei", 0.2), ("ei2", 0.362), ("ei3", 0.481)] {
        let modes = [parse_mode(&format!("1.1,0.0074,{kind}")).unwrap()];
        let worst = |frequency_box| {
            let design = ShaperDesign::new(&modes, 4000.0, &DesignOptions { frequency_box }).unwrap();
            design.residual.worst_over_box[0]
        };
        assert!((0.045..0.0501).contains(&worst(width)), "{kind}: {}", worst(width));
        assert!(worst(width + 0.01) > 0.052, "{kind}: {}", worst(width + 0.01));
    }
}

#[test]
fn a_wider_box_is_never_better() {
    let modes = [parse_mode("1.1,0.0074,zv").unwrap()];
    let worst = |frequency_box| {
        let design = ShaperDesign::new(&modes, 4000.0, &DesignOptions { frequency_box }).unwrap();
        design.residual.worst_over_box[0]
    };
    let boxes = [0.0, 0.01, 0.05, 0.1, 0.3];
    assert!(boxes.windows(2).all(|pair| worst(pair[0]) < worst(pair[1])));
    assert!(worst(0.0) < 1e-6);
}

#[test]
fn files_that_are_no_tables_are_refused_with_their_name() {
    let good = paper_design("zv", 4000.0).to_json();
    let cases = [
        (String::new(), "not a shaper table"),
        ("{}".to_owned(), "not a shaper table"),
        (good[..good.len() / 2].to_owned(), "not a shaper table"),
        (good.replace("\"schema_version\": 1", "\"schema_version\": 2"), "schema_version 2"),
        (good.replace("\"zv\"", "\"zz\""), "zv, zvd, zvdd, zvddd, ei, ei2, ei3 or mzv"),
        (good.replace("1073741824", "1000"), "weight_one"),
        (good.replacen("\"crc32\": \"0x", "\"crc32\": \"0y", 1), "hexadecimal"),
    ];
    for (text, expected) in cases {
        let message = ShaperDesign::from_json("bad.json", &text).unwrap_err().to_string();
        assert!(message.starts_with("bad.json: ") && message.contains(expected), "{message}");
    }
}

#[test]
fn a_table_with_another_frequency_than_its_taps_does_not_run() {
    let mut design = paper_design("zv", 4000.0);
    design.stages[0].frequency_hz = Some(1.2);
    assert!(design.check().is_ok(), "the taps are untouched");
    assert!(matches!(design.table(), Err(TableProblem::OtherDesign { .. })));
}
