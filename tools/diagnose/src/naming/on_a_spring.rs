//! A machine for tests of the search: one body on a spring, pushed.

use stillbeam_plant::{Model, simulate};
use stillbeam_recording::Recording;

const MACHINE: &str = r#"
    schema = 1
    kind = "lumped"
    [[body]]
    name = "mass"
    mass = 2.0
    [[spring]]
    between = ["mass", "ground"]
    stiffness = 300.0
    [[damper]]
    between = ["mass", "ground"]
    damping = 3.0
    [input]
    column = "force_N"
    body = "mass"
    [[output]]
    column = "position_m"
    body = "mass"
"#;

pub(crate) fn machine() -> Model {
    Model::from_toml("machine.toml", MACHINE).unwrap()
}

/// Runs of such a machine at these amplitudes, from 0.5 to 5 Hz, without noise.
pub(crate) fn runs(machine: &Model, amplitudes: &[f64]) -> Vec<Recording> {
    let time_s: Vec<f64> = (0..2000).map(|k| 0.01 * f64::from(k)).collect();
    let sweep = |t: f64| (std::f64::consts::TAU * (0.5 * t + 0.1125 * t * t)).sin();
    let run = |(k, amplitude): (usize, &f64)| {
        let force = time_s.iter().map(|t| amplitude * sweep(*t)).collect();
        let commanded = Recording::new(format!("run {k}"), time_s.clone()).with_column("force_N", force);
        simulate(machine, &commanded).unwrap()
    };
    amplitudes.iter().enumerate().map(run).collect()
}
