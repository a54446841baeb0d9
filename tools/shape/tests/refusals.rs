//! Modes and designs that must be refused, and what the messages say.

use stillbeam_firmware::machine::HISTORY_SAMPLES;
use stillbeam_firmware::shaper::ShaperType;
use stillbeam_shape::{DesignOptions, ShaperDesign, parse_mode};

#[test]
fn good_specifications_are_read() {
    for (spec, hz, zeta, kind) in [
        ("1.1,0.0074", 1.1, 0.0074, ShaperType::Zvd),
        (" 6.9 , 0 , ZVDD ", 6.9, 0.0, ShaperType::Zvdd),
        ("1e1,5e-3,zv", 10.0, 0.005, ShaperType::Zv),
    ] {
        let mode = parse_mode(spec).unwrap();
        assert_eq!((mode.frequency_hz(), mode.damping_ratio(), mode.shaper()), (hz, zeta, kind), "{spec}");
    }
}

#[test]
fn bad_specifications_name_the_part_and_the_remedy() {
    for (spec, parts) in [
        ("", &["1 part(s)", "F_HZ,ZETA"][..]),
        ("1.1", &["1 part(s)"]),
        ("1.1,0.01,zv,4", &["4 part(s)"]),
        ("one,0.01", &["frequency", "`one`", "not a number"]),
        ("1.1,low", &["damping ratio", "`low`", "not a number"]),
        ("1.1 Hz,0.01", &["frequency", "`1.1 Hz`"]),
        (",0.01", &["frequency", "``"]),
        ("1.1,0.01,ei4", &["`ei4`", "zv, zvd, zvdd, zvddd, ei, ei2, ei3 or mzv"]),
        ("1.1,0.01,", &["unknown shaper type ``", "zv, zvd, zvdd, zvddd, ei, ei2, ei3 or mzv"]),
        ("0,0.01", &["frequency 0 Hz", "at least"]),
        ("-1,0.01", &["frequency -1 Hz"]),
        ("NaN,0.01", &["frequency NaN Hz"]),
        ("inf,0.01", &["frequency inf Hz"]),
        ("1.1,1", &["damping ratio 1", "from 0 to 0.9"]),
        ("1.1,-0.1", &["damping ratio -0.1"]),
        ("1.1,NaN", &["damping ratio NaN"]),
    ] {
        let message = parse_mode(spec).unwrap_err().to_string();
        assert!(message.contains(&format!("`{spec}`")), "{spec}: {message}");
        for part in parts {
            assert!(message.contains(part), "{spec}: {message} lacks {part}");
        }
    }
}

#[test]
fn designs_the_board_cannot_run_are_refused() {
    let design = |specs: &[&str], rate_hz: f64, frequency_box: f64| {
        let modes: Vec<_> = specs.iter().map(|spec| parse_mode(spec).unwrap()).collect();
        ShaperDesign::new(&modes, rate_hz, &DesignOptions { frequency_box }).unwrap_err().to_string()
    };
    let many = ["1,0", "2,0", "3,0", "4,0", "5,0"];
    let history = HISTORY_SAMPLES.to_string();
    for (message, parts) in [
        (design(&[], 4000.0, 0.05), &["no mode"][..]),
        (design(&many, 4000.0, 0.05), &["5 modes", "at most 4"]),
        (design(&["1.1,0", "2000,0"], 4000.0, 0.05), &["mode 2", "2000 Hz", "half the tick rate"]),
        (design(&["0.1,0,zvdd"], 4000.0, 0.05), &["history", &history, "lower the rate"]),
        (design(&["1.1,0"], 100.0, 0.05), &["100 Hz", "200..20000 Hz"]),
        (design(&["1.1,0"], f64::NAN, 0.05), &["tick rate NaN"]),
        (design(&["1.1,0"], 4000.0, 1.0), &["100 %", "below 1"]),
        (design(&["1.1,0"], 4000.0, -0.1), &["-10 %"]),
    ] {
        for part in parts {
            assert!(message.contains(part), "{message} lacks {part}");
        }
    }
}
