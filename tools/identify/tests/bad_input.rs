//! Input from which no modes can be had gets an error that names what and where; and the JSON shape.

use crate::synthetic;

use stillbeam_identify::{
    ForcedOptions, FreeDecayOptions, IdentifiedModes, IdentifyError, RecordKind, WarningKind,
    identify_forced, identify_free_decay,
};
use stillbeam_recording::Recording;
use synthetic::{Mode, Noise, Sweep, ring_down, sweep_record};

fn modes() -> [Mode; 1] {
    [Mode { frequency_hz: 4.0, damping_ratio: 0.02, participation: 0.7 }]
}

fn sweep() -> Recording {
    sweep_record(Sweep::Linear, &modes(), 1, 50e-6, 1)
}

fn options() -> ForcedOptions {
    ForcedOptions::new("base_position_m", "tip_deflection_m")
}

fn with(mut record: Recording, column: usize, change: impl Fn(usize, f64) -> f64) -> Recording {
    for (k, value) in record.columns[column].samples.iter_mut().enumerate() {
        *value = change(k, *value);
    }
    record
}

#[test]
fn a_missing_column_lists_those_there_are() {
    for options in
        [ForcedOptions::new("force_N", "tip_deflection_m"), ForcedOptions::new("base_position_m", "tip_m")]
    {
        let message = identify_forced(&sweep(), &options).unwrap_err().to_string();
        assert!(message.contains("`base_position_m`, `tip_deflection_m`"), "{message}");
    }
    let error = identify_free_decay(&sweep(), &FreeDecayOptions::new("tip_m")).unwrap_err();
    assert!(matches!(error, IdentifyError::Recording(_)));
}

#[test]
fn constant_and_empty_columns_are_named() {
    let still = with(sweep(), 0, |_, _| 0.25);
    assert!(matches!(
        identify_forced(&still, &options()),
        Err(IdentifyError::NoExcitation { value: 0.25, .. })
    ));
    let dead = with(sweep(), 1, |_, _| 0.5);
    assert!(matches!(identify_forced(&dead, &options()), Err(IdentifyError::NoResponse { value: 0.5, .. })));
    let decay = FreeDecayOptions::new("tip_deflection_m");
    assert!(matches!(identify_free_decay(&dead, &decay), Err(IdentifyError::NoResponse { .. })));
    let sparse = with(sweep(), 1, |k, y| if k < 15 { y } else { f64::NAN });
    let error = identify_forced(&sparse, &options()).unwrap_err();
    assert!(matches!(error, IdentifyError::TooFewSamples { found: 15, required: 16, .. }), "{error}");
    // Plenty of both, but never while the other is recorded.
    let apart = with(with(sweep(), 0, |k, x| if k < 4000 { x } else { f64::NAN }), 1, |k, y| {
        if k > 4000 { y } else { f64::NAN }
    });
    let error = identify_forced(&apart, &options()).unwrap_err();
    assert!(matches!(error, IdentifyError::TooFewSamples { found: 0, .. }), "{error}");
}

#[test]
fn more_modes_than_stand_out_is_refused_with_those_found() {
    let error = identify_forced(&sweep(), &options().with_modes(3)).unwrap_err();
    match &error {
        IdentifyError::TooFewPeaks { requested: 3, found: 1, frequencies_hz, .. } => {
            assert!((frequencies_hz[0] - 4.0).abs() < 0.01);
        }
        other => panic!("{other}"),
    }
    let mut noise = Noise(1);
    let e: Vec<f64> = (0..4000).map(|_| 1e-5 * noise.normal()).collect();
    let record = ring_down(&modes(), 100.0, 4000, 0.0, |k| e[k]);
    let error =
        identify_free_decay(&record, &FreeDecayOptions::new("tip_deflection_m").with_modes(4)).unwrap_err();
    assert!(matches!(error, IdentifyError::TooFewPeaks { requested: 4, found: 1, .. }), "{error}");
}

#[test]
fn noise_alone_holds_no_modes() {
    for seed in 0..10 {
        let mut noise = Noise(seed);
        let still = with(sweep(), 1, |_, _| 0.0);
        let tip = still.time_s.iter().map(|_| noise.normal()).collect();
        let record = Recording { columns: vec![still.columns[0].clone()], ..still }
            .with_column("tip_deflection_m", tip);
        let error = identify_forced(&record, &options()).unwrap_err();
        assert!(matches!(error, IdentifyError::NoPeaks { .. }), "seed {seed}: {error}");
        let error = identify_free_decay(&record, &FreeDecayOptions::new("tip_deflection_m")).unwrap_err();
        // It goes on, so that it is no decay in the first place.
        let reason =
            matches!(&error, IdentifyError::NoDecay { found, .. } if found.kind == RecordKind::Random);
        assert!(reason, "seed {seed}: {error}");
    }
}

#[test]
fn options_out_of_range_are_refused() {
    for modes in [0, 13, usize::MAX] {
        let error = identify_forced(&sweep(), &options().with_modes(modes)).unwrap_err();
        assert!(matches!(error, IdentifyError::BadOption { option: "modes", .. }), "{error}");
    }
    for max_delay_s in [-1.0, f64::NAN, f64::INFINITY] {
        let error = identify_forced(&sweep(), &ForcedOptions { max_delay_s, ..options() }).unwrap_err();
        assert!(matches!(error, IdentifyError::BadOption { option: "max_delay_s", .. }), "{error}");
    }
    let error = identify_forced(&sweep(), &ForcedOptions { max_delay_s: 100.0, ..options() }).unwrap_err();
    assert!(matches!(error, IdentifyError::TooFewSamples { .. }), "{error}");
    let late = FreeDecayOptions { start_s: Some(1e9), ..FreeDecayOptions::new("tip_deflection_m") };
    assert!(matches!(
        identify_free_decay(&sweep(), &late),
        Err(IdentifyError::TooFewSamples { found: 0, .. })
    ));
    let nowhere = FreeDecayOptions { start_s: Some(f64::NAN), ..FreeDecayOptions::new("tip_deflection_m") };
    assert!(identify_free_decay(&sweep(), &nowhere).is_err());
}

#[test]
fn units_that_do_not_say_what_they_are_need_to_be_told() {
    let time = ForcedOptions::new("time_s", "tip_deflection_m");
    assert!(matches!(identify_forced(&sweep(), &time), Err(IdentifyError::AmbiguousUnit { .. })));
    let same = ForcedOptions::new("base_position_m", "time_s");
    let refusal = identify_forced(&sweep(), &same).unwrap_err();
    assert!(matches!(refusal, IdentifyError::AmbiguousUnit { .. }));
    assert!(refusal.to_string().contains("--output-quantity position"), "{refusal}");
}

#[test]
fn a_column_cannot_be_both_input_and_output() {
    let same = ForcedOptions::new("tip_deflection_m", "tip_deflection_m");
    let refusal = identify_forced(&sweep(), &same).unwrap_err();
    assert!(matches!(refusal, IdentifyError::SameColumn { .. }), "{refusal}");
}

#[test]
fn stamps_in_milliseconds_are_refused_and_doubtful_ones_told() {
    let scaled = |factor: f64| {
        let record = sweep();
        let time_s = record.time_s.iter().map(|t| factor * t).collect();
        Recording { time_s, ..record }
    };
    // Of a 100 Hz recording.
    let milliseconds = scaled(1000.0);
    let decay = FreeDecayOptions::new("tip_deflection_m");
    for refusal in [
        identify_forced(&milliseconds, &options()).unwrap_err(),
        identify_free_decay(&milliseconds, &decay).unwrap_err(),
    ] {
        assert!(matches!(refusal, IdentifyError::StampsNotSeconds { .. }), "{refusal}");
        assert!(refusal.to_string().contains("divide"), "{refusal}");
    }
    // Of one at 1000 Hz, they could be a slow machine's seconds.
    let doubtful = |found: IdentifiedModes| {
        let told =
            |w: &stillbeam_identify::Warning| matches!(w.kind, WarningKind::StampsMayNotBeSeconds { .. });
        found.warnings.iter().any(told)
    };
    assert!(doubtful(identify_forced(&scaled(100.0), &options()).unwrap()));
    assert!(!doubtful(identify_forced(&scaled(1.0), &options()).unwrap()));
    assert!(!doubtful(identify_forced(&scaled(20.0), &options()).unwrap()));
}

#[test]
fn short_and_absurd_records_never_panic() {
    let mut noise = Noise(77);
    for round in 0..200 {
        let n = 4 + round % 40;
        let scale = 10.0_f64.powi((round % 13) as i32 * 50 - 300);
        let mut time_s = vec![0.0];
        for k in 1..n {
            let step = if round % 3 == 0 {
                0.01
            } else {
                0.01 + noise.normal().abs() * 10.0_f64.powi((k % 9) as i32 - 6)
            };
            time_s.push(time_s[k - 1] + step);
        }
        let mut column = || -> Vec<f64> {
            (0..n).map(|k| if k % 11 == 5 { f64::NAN } else { scale * noise.normal() }).collect()
        };
        let record = Recording::new("absurd", time_s)
            .with_column("base_position_m", column())
            .with_column("tip_deflection_m", column());
        for modes in [None, Some(1), Some(12)] {
            let forced = ForcedOptions { modes, ..options() };
            let free = FreeDecayOptions { modes, ..FreeDecayOptions::new("tip_deflection_m") };
            let results = [identify_forced(&record, &forced), identify_free_decay(&record, &free)];
            for mode in results.iter().flatten().flat_map(|found| &found.modes) {
                assert!(mode.frequency_hz.value > 0.0 && mode.damping_ratio.value > 0.0);
                assert!(mode.frequency_hz.stderr.is_finite() && mode.damping_ratio.stderr.is_finite());
            }
        }
    }
}

#[test]
fn the_json_has_the_agreed_shape_and_reads_back() {
    let forced = identify_forced(&sweep(), &options()).unwrap();
    let decay = identify_free_decay(
        &ring_down(&modes(), 100.0, 3000, 0.0, |_| 0.0),
        &FreeDecayOptions::new("tip_deflection_m"),
    )
    .unwrap();
    for found in [forced, decay] {
        let json = serde_json::to_value(&found).unwrap();
        assert_eq!(json["schema_version"], 1);
        let mode = &json["modes"][0];
        for quantity in ["frequency_hz", "damping_ratio", "amplitude"] {
            assert!(
                mode[quantity]["value"].is_f64() && mode[quantity]["stderr"].is_f64(),
                "{quantity}: {mode}"
            );
        }
        assert!(mode["method"].is_string());
        assert!(
            json["warnings"]
                .as_array()
                .unwrap()
                .iter()
                .all(|w| w["message"].is_string() && w["kind"].is_string())
        );
        if found.input.is_some() {
            for part in ["frequency_hz", "real", "imag", "coherence"] {
                assert!(json["frf"][part].as_array().unwrap().len() > 100);
            }
        }
        let text = serde_json::to_string(&found).unwrap();
        let mut again: IdentifiedModes = serde_json::from_str(&text).unwrap();
        again.fit = found.fit.clone();
        assert_eq!(serde_json::to_string(&again).unwrap(), text);
    }
}

#[test]
fn an_undetermined_standard_error_is_null_in_json_and_infinite_again() {
    let text = r#"{"value": 1.5, "stderr": null}"#;
    let estimate: stillbeam_identify::Estimate = serde_json::from_str(text).unwrap();
    assert!(estimate.stderr.is_infinite());
    assert_eq!(serde_json::to_string(&estimate).unwrap(), r#"{"value":1.5,"stderr":null}"#);
}
