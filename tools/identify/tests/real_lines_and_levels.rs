//! Real recordings that are no part of this repository: forced tones that look like modes, and a plant that
//! hardens.

use std::path::PathBuf;

use stillbeam_identify::{
    ForcedOptions, FreeDecayOptions, IdentifyError, InputKind, LinearityVerdict, OutputQuantity, Rejected,
    identify_forced, identify_free_decay,
};
use stillbeam_recording::{ReadOptions, Recording, read_recording};

/// A recording from the folder beside the workspace, or wherever `STILLBEAM_DATA` says.
fn read(file: &str) -> Option<Recording> {
    let folder = match std::env::var_os("STILLBEAM_DATA") {
        Some(folder) => folder.into(),
        None => PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
    };
    let path = folder.join(file);
    if !path.is_file() {
        println!("not run: {} is not there; set STILLBEAM_DATA to the folder of recordings", path.display());
        return None;
    }
    Some(read_recording(&path, &ReadOptions::default()).unwrap().recording)
}

/// Steppers that shake a printer's gantry drive a line near 350 Hz while they run (MIT, O. Shimrony): never a
/// mode.
#[test]
fn a_line_that_steppers_drive_is_called_a_forced_tone() {
    for name in ["shake_a_oscillation", "shake_a_quick", "shake_b_oscillation"] {
        let Some(record) = read(&format!("klipper_raw_belt_printer/adxl345-{name}.csv")) else { return };
        let result = identify_free_decay(&record, &FreeDecayOptions::new("acceleration_x_mm_s2"));
        match result {
            Err(IdentifyError::OnlyTones { tones, .. }) => {
                assert!(tones.iter().any(|(hz, _)| (338.0..356.0).contains(hz)), "{name}: {tones:?}");
            }
            other => panic!("{name}: {other:?}"),
        }
    }
}

/// Each of these is one pluck of a belt tuned to about 110 Hz, or several: an impact that rings the gantry
/// above 600 Hz for some 50 ms, up to a hundred times louder than the belt, and then the belt alone.
#[test]
fn a_plucked_belt_rings_at_its_tuning() {
    for name in ["belt_A_1", "belt_A_2", "belt_A_test", "belt_B_1", "belt_B_2", "calibration_A_1"] {
        let Some(record) = read(&format!("klipper_raw_belt_printer/adxl345-{name}.csv")) else { return };
        let found = identify_free_decay(&record, &FreeDecayOptions::new("acceleration_y_mm_s2")).unwrap();
        let strongest = found.modes.iter().max_by(|a, b| a.energy().total_cmp(&b.energy())).unwrap();
        let hz = strongest.frequency_hz.value;
        assert!((107.5..115.5).contains(&hz), "{name}: {hz}");
        // The impact is not part of the decay.
        let loudest = found.rejected.iter().find_map(|entry| match entry {
            Rejected::Samples { last_s, reason, .. } if reason.contains("before") => Some(*last_s),
            _ => None,
        });
        assert!(loudest.is_some(), "{name}: {:?}", found.rejected);
    }
}

/// The Silverbox, an electronic oscillator with a hardening spring (Wigren and Schoukens 2013).
#[test]
fn an_oscillator_that_hardens_shows_it_as_its_level_grows() {
    let Some(record) = read("silverbox/silverbox_SNLS80mV.csv") else { return };
    let part = |rows: std::ops::Range<usize>| {
        record
            .columns
            .iter()
            .fold(Recording::new("part", record.time_s[rows.clone()].to_vec()), |part, column| {
                part.with_column(column.name.clone(), column.samples[rows.clone()].to_vec())
            })
    };
    let options = ForcedOptions {
        input_kind: Some(InputKind::Force),
        output_quantity: Some(OutputQuantity::Position),
        ..ForcedOptions::new("input_force_V", "output_displacement_V").with_modes(1)
    };
    let multisine = identify_forced(&part(41_000..49_192), &options).unwrap();
    let mode = &multisine.modes[0];
    assert!((68.0..70.0).contains(&mode.frequency_hz.value), "{mode:?}");
    assert!((mode.damping_ratio.value - 0.049).abs() < 0.001, "{mode:?}");
    let growing = identify_forced(&part(0..40_600), &options).unwrap();
    assert_eq!(growing.linearity.verdict, LinearityVerdict::NotLinear);
    let backbone = &growing.modes[0].by_amplitude;
    let (small, large) = (backbone.first().unwrap(), backbone.last().unwrap());
    assert!((small.frequency_hz.value - 68.2).abs() < 0.2 && large.frequency_hz.value > 70.0, "{backbone:?}");
}
