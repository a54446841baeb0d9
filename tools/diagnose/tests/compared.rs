//! Given, refitted, noise: the three numbers that come before any physics.

use crate::truth;

use stillbeam_diagnose::{DiagnoseError, Diagnosis, Options, ParameterChange, Verdict, diagnose};
use stillbeam_plant::Physics;
use stillbeam_recording::Recording;
use truth::{Bench, NOISE_M};

fn run(bench: Bench, all: &[Recording]) -> Diagnosis {
    diagnose(&bench.wrong_model(), &all[..3], &all[3..], &Options::default(), &mut |_| {}).unwrap()
}

#[test]
fn a_model_with_wrong_parameters_is_adequate_once_refitted() {
    for (seed, rho) in [(1, 0.0), (2, 0.8)] {
        let bench = Bench::MovedBase;
        let found = run(bench, &bench.recordings(&[], rho, seed));
        assert_eq!(found.verdict, Verdict::Adequate, "{} {:?}", found.sentence, found.residual_tests);
        assert!(found.effects.is_empty(), "{:?}", found.effects);
        assert_eq!(found.sentence.contains("noise is not white"), rho > 0.0, "{}", found.sentence);
        for pooled in &found.fit.pooled {
            assert!((pooled.fits.refitted_linear.rms / NOISE_M - 1.0).abs() < 0.05, "{pooled:?}");
            assert!((pooled.fits.given.noise_floor / NOISE_M - 1.0).abs() < 0.15, "{pooled:?}");
            assert!(pooled.fits.given.rms > 5.0 * NOISE_M, "{pooled:?}");
        }
        let of_damping = |change: &&ParameterChange| change.path == "beam.damping_ratio.1";
        let damping = found.parameter_changes.iter().find(of_damping).unwrap();
        assert!((damping.to - 0.012).abs() < 4.0 * damping.stderr, "{damping:?}");
    }
}

/// Stiffness, width and thickness make up for each other along a narrow valley; the machine lies far down it.
#[test]
fn a_machine_far_from_its_drawing_is_found_down_to_the_noise() {
    let bench = Bench::ForcedBase;
    let mut machine = bench.model();
    for (path, value) in [
        ("beam.young_Pa", 130e9),
        ("beam.width_m.1", 0.0074),
        ("beam.thickness_m.1", 0.001_886),
        ("beam.thickness_m.2", 0.000_976),
    ] {
        machine.set_parameter(path, value).unwrap();
    }
    let all = bench.recordings_of(&machine, 5);
    let found = run(bench, &all);
    assert_eq!(found.verdict, Verdict::Adequate, "{} {:?}", found.sentence, found.residual_tests);
    for pooled in &found.fit.pooled {
        assert!((pooled.fits.refitted_linear.rms / NOISE_M - 1.0).abs() < 0.02, "{pooled:?}");
    }
    // What is determined makes up for what is not and stays as drawn: it is known as well as that.
    assert!(!found.undetermined_parameters.is_empty() && !found.parameter_changes.is_empty());
    for change in &found.parameter_changes {
        let off = (change.to - machine.parameter(&change.path).unwrap()).abs() / change.stderr;
        assert!(off < 4.0, "{off:.1} standard errors: {change:?}");
    }
}

#[test]
fn recordings_that_do_not_fit_the_model_are_refused_with_a_remedy() {
    let good = &Bench::MovedBase.recordings(&[], 0.0, 4)[0];
    let zeros = vec![0.0; good.len()];
    let tip = good.column("tip_deflection_m").unwrap().to_vec();
    let base = good.column("base_position_m").unwrap().to_vec();
    let of = |columns: &[(&str, &Vec<f64>)]| {
        let start = Recording::new("bad.csv", good.time_s.clone());
        columns
            .iter()
            .fold(start, |recording, (name, samples)| recording.with_column(*name, (*samples).clone()))
    };
    let refused = |recording: &Recording| -> DiagnoseError {
        let model = Bench::MovedBase.wrong_model();
        let alone = std::slice::from_ref(recording);
        match diagnose(&model, alone, &[], &Options::default(), &mut |_| {}) {
            Err(error) => error,
            // Not `unwrap_err`: it would print whole recordings.
            Ok(found) => panic!("accepted: {}", found.sentence),
        }
    };
    let no_input = refused(&of(&[("force_N", &base), ("tip_deflection_m", &tip)]));
    assert!(matches!(no_input, DiagnoseError::Column { .. }), "{no_input}");
    let no_output = refused(&of(&[("base_position_m", &base), ("tip_mm", &tip)]));
    assert!(matches!(no_output, DiagnoseError::NoOutput { .. }), "{no_output}");
    let flat = refused(&of(&[("base_position_m", &zeros), ("tip_deflection_m", &tip)]));
    assert!(matches!(flat, DiagnoseError::FlatInput { .. }), "{flat}");
    let dead = refused(&of(&[("base_position_m", &base), ("tip_deflection_m", &zeros)]));
    assert!(matches!(dead, DiagnoseError::FlatOutput { .. }), "{dead}");
    let millimetres: Vec<f64> = tip.iter().map(|value| 1000.0 * value).collect();
    let unit = refused(&of(&[("base_position_m", &base), ("tip_deflection_m", &millimetres)]));
    assert!(matches!(unit, DiagnoseError::Unit { .. }), "{unit}");
    let mut short = good.clone();
    short.time_s.truncate(60);
    short.columns.iter_mut().for_each(|column| column.samples.truncate(60));
    let short = refused(&short);
    assert!(matches!(short, DiagnoseError::TooShort { .. }), "{short}");
    for error in [no_input, no_output, flat, dead, unit, short] {
        assert!(error.to_string().contains("bad.csv") || error.to_string().contains("run 4"), "{error}");
    }
}

/// Friction holds the base fast in the quiet run and not in the loud ones: that is no error of a unit.
#[test]
fn a_base_that_stands_still_in_one_recording_is_not_refused() {
    let bench = Bench::ForcedBase;
    let law = Physics::new("coulomb_friction", "base").with("force", 4.5);
    let all = bench.short_recordings(&[law], 0.0, 6);
    let still = all[0].column("base_position_m").unwrap();
    assert!(still.iter().all(|value| value.abs() < 10.0 * NOISE_M), "the base is not held");
    let found = diagnose(&bench.wrong_model(), &all[..2], &all[2..], &Options::default(), &mut |_| {});
    assert!(found.is_ok_and(|found| found.verdict != Verdict::Adequate));
}
