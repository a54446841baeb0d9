//! A real steel cantilever, knocked once (Downey lab, CC BY-SA 4.0; not part of this repository).

use std::path::PathBuf;

use stillbeam_identify::{FreeDecayOptions, Quantity, WarningKind, identify_free_decay};

/// The folder of recordings beside the workspace, or wherever `STILLBEAM_DATA` says.
fn data() -> PathBuf {
    match std::env::var_os("STILLBEAM_DATA") {
        Some(folder) => folder.into(),
        None => PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
    }
}

#[test]
fn the_knocked_cantilever_has_its_published_modes_and_its_damping_rises() {
    let path = data().join("cantilever_downey/beam_impulse_ringdown.csv");
    if !path.exists() {
        println!("not run: {} is not there; set STILLBEAM_DATA to the folder of recordings", path.display());
        return;
    }
    let record = stillbeam_recording::read_csv(&path).unwrap();
    let started = std::time::Instant::now();
    let found = identify_free_decay(&record, &FreeDecayOptions::new("acceleration_g")).unwrap();
    println!(
        "{} samples, {} modes, {:.2} s",
        record.len(),
        found.modes.len(),
        started.elapsed().as_secs_f64()
    );
    for mode in &found.modes {
        println!("{:.4} Hz, {:.4} %", mode.frequency_hz.value, 100.0 * mode.damping_ratio.value);
    }
    for published_hz in [6.62, 41.4, 117.0] {
        let near = |f: f64| (f / published_hz - 1.0).abs() < 0.005;
        assert_eq!(
            found.modes.iter().filter(|mode| near(mode.frequency_hz.value)).count(),
            1,
            "{published_hz} Hz"
        );
    }
    // Asked for three, one wants those that move the beam most, not those that an accelerometer sees best.
    let three = identify_free_decay(&record, &FreeDecayOptions::new("acceleration_g").with_modes(3)).unwrap();
    let three_hz: Vec<f64> = three.modes.iter().map(|mode| mode.frequency_hz.value).collect();
    for (found_hz, published_hz) in three_hz.iter().zip([6.62, 41.4, 117.0]) {
        assert!((found_hz / published_hz - 1.0).abs() < 0.005, "{three_hz:?}");
    }
    let first = &found.modes[0];
    let check = |method: &str| {
        let check = first.cross_checks.iter().find(|check| check.method == method).unwrap();
        check.damping_ratio.unwrap().value
    };
    assert!((0.0031..0.0037).contains(&check("early_decay")), "{}", check("early_decay"));
    assert!((0.009..0.03).contains(&check("late_decay")), "{}", check("late_decay"));
    let rises = |kind: &WarningKind| {
        matches!(kind, WarningKind::ChangesDuringDecay { mode_hz, quantity: Quantity::DampingRatio, early, late, .. }
            if *mode_hz < 7.0 && late > early)
    };
    assert!(found.warnings.iter().any(|warning| rises(&warning.kind)));
}
