//! A machine for tests: a slide that nothing but its loop holds in place.

use stillbeam_plant::{Model, Physics, simulate};
use stillbeam_recording::Recording;

const AXIS: &str = r#"
    schema = 1
    kind = "lumped"
    body = [{ name = "slider", mass = 95.0 }]
    damper = [{ between = ["slider", "ground"], damping = 200.0 }]
    input = { column = "motor_force_N", body = "slider" }
    output = [{ column = "position_m", body = "slider" }]
    [controller]
    kind = "cascade_pd"
    kp = 60.0
    kv = 6000.0
    sample_s = 0.005
    reference_column = "reference_m"
"#;

pub(crate) fn axis() -> Model {
    Model::from_toml("axis.toml", AXIS).unwrap()
}

/// The same with a law.
pub(crate) fn axis_with(law: Physics) -> Model {
    let mut axis = axis();
    axis.setup_mut().physics = vec![law];
    axis
}

/// A run of 20 s there and back over 0.2 m.
pub(crate) fn run(axis: &Model) -> Recording {
    let time_s: Vec<f64> = (0..4000).map(|k| 0.005 * f64::from(k)).collect();
    let reference = time_s.iter().map(|t| 0.1 * (1.0 - (2.0 * t).cos())).collect();
    let still = vec![0.0; time_s.len()];
    let commanded = Recording::new("run", time_s)
        .with_column("reference_m", reference)
        .with_column("motor_force_N", still);
    simulate(axis, &commanded).unwrap()
}
