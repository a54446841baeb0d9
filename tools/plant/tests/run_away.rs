//! A motion that grows without bounds is an error that says so, not a file of numbers that are not finite.

use stillbeam_plant::{Model, PlantError, Rerun, simulate};
use stillbeam_recording::Recording;

/// A loop whose sign is wrong, with a force that depends on where the slider is: the sine of a position of
/// 10³⁰⁰ m takes long to find.
const AXIS: &str = r#"
schema = 1
kind = "lumped"
[[body]]
name = "slider"
mass = 95.0
[[damper]]
between = ["slider", "ground"]
damping = 203.0
[input]
column = "control_voltage_V"
body = "slider"
gain = -35.0
[[output]]
column = "position_m"
body = "slider"
[controller]
kind = "cascade_pd"
kp = 160.0
kv = 243.0
sample_s = 0.001
reference_column = "ref_position_m"
[[physics]]
id = "cogging"
location = "slider"
[physics.parameters]
force = 1.0
period = 0.02
"#;

#[test]
fn a_loop_that_runs_away_is_an_error_with_its_time() {
    let model = Model::from_toml("axis.toml", AXIS).unwrap();
    let time_s: Vec<f64> = (0..2000).map(|k| f64::from(k) * 0.01).collect();
    let reference = time_s.iter().map(|t| 0.1 * t.sin()).collect();
    let recording = Recording::new("loop", time_s.clone())
        .with_column("ref_position_m", reference)
        .with_column("control_voltage_V", vec![0.0; time_s.len()])
        .with_column("position_m", vec![0.0; time_s.len()]);
    let is_early = |error: &PlantError| matches!(error, PlantError::RanAway { time_s } if *time_s < 5.0);
    let error = simulate(&model, &recording).unwrap_err();
    assert!(is_early(&error), "{error}");
    let error = Rerun::new(&recording, &model, 1).unwrap().outputs(&model, None).unwrap_err();
    assert!(is_early(&error), "{error}");
}
