//! Functions of frequency are recognised, and refused where a recording is needed.

use stillbeam_recording::{
    ImportedSpectra, Measurement, Problem, ReadOptions, SpectrumKind, SpectrumValues, parse_measurement,
    parse_recording,
};

fn spectra(text: &str) -> ImportedSpectra {
    let message = parse_recording(text.as_bytes(), "s", &ReadOptions::default()).unwrap_err();
    assert!(matches!(message.problem, Problem::Spectrum { .. }), "{message}");
    match parse_measurement(text.as_bytes(), "s", &ReadOptions::default()).unwrap() {
        Measurement::Spectra(spectra) => spectra,
        Measurement::Recording(recording) => panic!("{recording:?}"),
    }
}

fn table(head: &str, row: impl Fn(f64) -> String) -> String {
    (0..40).fold(head.to_owned(), |text, k| text + &row(1.5 * f64::from(k)) + "\n")
}

/// One mode at 20 Hz.
fn response(f: f64) -> (f64, f64) {
    let (r, z) = (f / 20.0, 0.03);
    let (a, b) = (1.0 - r * r, 2.0 * z * r);
    (a / (a * a + b * b), -b / (a * a + b * b))
}

#[test]
fn power_spectra_of_klipper_keep_every_axis() {
    let found = spectra(&table("freq,psd_x,psd_y,psd_z,psd_xyz\n", |f| format!("{f:.1},1e1,2e1,3e1,6e1")));
    let names: Vec<&str> = found.spectra.iter().map(|spectrum| spectrum.name.as_str()).collect();
    assert_eq!(names, ["psd_x", "psd_y", "psd_z", "psd_xyz"]);
    for (spectrum, level) in found.spectra.iter().zip([10.0, 20.0, 30.0, 60.0]) {
        assert_eq!((spectrum.kind, spectrum.frequency_hz[2]), (SpectrumKind::PowerDensity, 3.0));
        assert_eq!(spectrum.values, SpectrumValues::Real(vec![level; 40]));
    }
}

#[test]
fn frequency_responses_are_complex_however_they_are_written() {
    let parts = |f| response(f);
    let polar = |f| (parts(f).0.hypot(parts(f).1), parts(f).1.atan2(parts(f).0));
    let texts = [
        table("frequency [Hz],H real [g/N],H imag [g/N]\n", |f| format!("{f},{},{}", parts(f).0, parts(f).1)),
        table("freq;re;im\n", |f| format!("{f};{};{}", parts(f).0, parts(f).1)),
        table("f [kHz]\tmag\tphase [deg]\n", |f| {
            format!("{}\t{}\t{}", f / 1e3, polar(f).0, polar(f).1.to_degrees())
        }),
        table("Frequency,Magnitude [dB],Phase [rad]\n", |f| {
            format!("{f},{},{}", 20.0 * polar(f).0.log10(), polar(f).1)
        }),
    ];
    for text in texts {
        let found = spectra(&text);
        assert_eq!(found.spectra.len(), 1, "{text}");
        let spectrum = &found.spectra[0];
        assert_eq!(spectrum.kind, SpectrumKind::FrequencyResponse);
        let SpectrumValues::Complex { real, imaginary } = &spectrum.values else { panic!("{text}") };
        for ((f, re), im) in spectrum.frequency_hz.iter().zip(real).zip(imaginary) {
            assert!((re - response(*f).0).abs() < 1e-9 && (im - response(*f).1).abs() < 1e-9, "{text}");
        }
    }
}

/// A data set 58 of complex values over frequency.
fn universal(kind: i32, unit: &str, scale: f64) -> String {
    let mut text = format!(
        "    -1\n    58\nbeam\nNONE\nNONE\nNONE\nNONE\n{kind:>5}         0    0         0 NONE               3   1 NONE               7  -3\n"
    );
    text += &format!("         6        40         1{:>13.5e}{:>13.5e}  0.00000e+00\n", 0.0, 1.5 * scale);
    text += &format!("{:>10}{:>5}{:>5}{:>5} {:<20} {:<20}\n", 18, 0, 0, 0, "Frequency", unit);
    text += &format!("{:>10}{:>5}{:>5}{:>5} {:<20} {:<20}\n", 12, 0, 0, 0, "Acc", "m/s^2");
    text += &format!("{:>10}{:>5}{:>5}{:>5} {:<20} {:<20}\n", 13, 0, 0, 0, "Force", "N");
    text += &format!("{:>10}{:>5}{:>5}{:>5} {:<20} {:<20}\n", 0, 0, 0, 0, "NONE", "NONE");
    for k in 0..40 {
        let (re, im) = response(1.5 * f64::from(k));
        text += &format!("{re:>20.12e}{im:>20.12e}");
        if k % 2 == 1 {
            text.push('\n');
        }
    }
    text + "    -1\n"
}

#[test]
fn frequency_responses_and_spectra_of_universal_files_keep_units_and_axes() {
    for (kind, unit, scale, wanted) in [
        (4, "Hz", 1.0, SpectrumKind::FrequencyResponse),
        (4, "kHz", 1e-3, SpectrumKind::FrequencyResponse),
        (9, "Hz", 1.0, SpectrumKind::PowerDensity),
        (2, "NONE", 1.0, SpectrumKind::Power),
    ] {
        let found = spectra(&universal(kind, unit, scale));
        let spectrum = &found.spectra[0];
        assert_eq!(
            (spectrum.kind, spectrum.unit.as_deref(), spectrum.per_unit.as_deref()),
            (wanted, Some("m_s2"), Some("N"))
        );
        assert!((spectrum.frequency_hz[39] - 58.5).abs() < 1e-9);
        let SpectrumValues::Complex { real, imaginary } = &spectrum.values else { panic!("{spectrum:?}") };
        assert!(
            (real[9] - response(13.5).0).abs() < 1e-11 && (imaginary[9] - response(13.5).1).abs() < 1e-11
        );
        if kind == 4 {
            assert_eq!(spectrum.name, "acceleration_3_x_over_force_7_z_neg");
        }
    }
}
