//! What is asked for and cannot be answered is refused, and nothing is answered in its place.

use stillbeam_diagnose::{DiagnoseError, Options, diagnose};
use stillbeam_plant::Model;
use stillbeam_recording::Recording;

const MODEL: &str = r#"
    schema = 1
    kind = "modal"
    [[mode]]
    frequency_hz = 1.1
    damping_ratio = 0.01
    participation = [1.0]
    [input]
    column = "force_N"
    [[output]]
    column = "tip_deflection_m"
"#;

fn recording(phase: f64) -> Recording {
    let time_s: Vec<f64> = (0..400).map(|k| 0.02 * f64::from(k)).collect();
    let force = time_s.iter().map(|t| (3.0 * t + phase).sin()).collect();
    let tip = time_s.iter().map(|t| 0.02 * (3.0 * t + phase).sin()).collect();
    Recording::new("run", time_s).with_column("force_N", force).with_column("tip_deflection_m", tip)
}

fn refused(held_out: &[Recording], options: &Options) -> DiagnoseError {
    let model = Model::from_toml("m.toml", MODEL).expect("a model");
    diagnose(&model, &[recording(0.0)], held_out, options, &mut |_| {}).expect_err("refused")
}

#[test]
fn a_limit_that_is_none_is_refused() {
    for seconds in [-1.0, f64::NAN, f64::INFINITY] {
        for by_clock in [true, false] {
            let mut options = Options::default();
            let limit = if by_clock { &mut options.time_limit_s } else { &mut options.processor_limit_s };
            *limit = Some(seconds);
            assert!(matches!(refused(&[], &options), DiagnoseError::Limit { .. }), "{seconds}");
        }
    }
}

#[test]
fn what_was_trained_on_does_not_judge_whatever_it_is_called() {
    let mut again = recording(0.0);
    again.name = "check".to_owned();
    let error = refused(&[recording(1.0), again], &Options::default());
    assert!(matches!(&error, DiagnoseError::BothRoles { recording } if recording == "check"), "{error}");
}
