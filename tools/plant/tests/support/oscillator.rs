//! One body on a spring, for closed forms.

use stillbeam_plant::{Model, Physics, simulate};
use stillbeam_recording::Recording;

/// Mass, stiffness and damping, laws at `body`, and where it starts.
pub fn oscillator(mass: f64, k: f64, c: f64, physics: Vec<Physics>, z: f64, v: f64) -> Model {
    let text = format!(
        "schema = 1\nkind = \"lumped\"\n[[body]]\nname = \"body\"\nmass = {mass:?}\n\
         [[spring]]\nbetween = [\"body\", \"ground\"]\nstiffness = {k:?}\n\
         [[damper]]\nbetween = [\"body\", \"ground\"]\ndamping = {c:?}\n\
         [input]\ncolumn = \"force_N\"\nbody = \"body\"\n\
         [[output]]\ncolumn = \"z_m\"\nbody = \"body\"\n\
         [[output]]\ncolumn = \"v_m_s\"\nbody = \"body\"\nquantity = \"velocity\"\n\
         [initial.body]\ndisplacement = {z:?}\nvelocity = {v:?}\n"
    );
    let mut model = Model::from_toml("oscillator.toml", &text).unwrap();
    model.setup_mut().physics = physics;
    model
}

pub fn run(model: &Model, time_s: &[f64], force: impl Fn(f64) -> f64) -> Recording {
    let samples = time_s.iter().map(|t| force(*t)).collect();
    let recording = Recording::new("r", time_s.to_vec()).with_column("force_N", samples);
    simulate(model, &recording).unwrap()
}

/// Without force.
pub fn free(model: &Model, count: usize, rate_hz: f64) -> Recording {
    run(model, &super::ticks(count, rate_hz), |_| 0.0)
}

/// Kinetic energy and that of the linear spring.
pub fn energy(recording: &Recording, mass: f64, k: f64) -> Vec<f64> {
    let (z, v) = (recording.column("z_m").unwrap(), recording.column("v_m_s").unwrap());
    z.iter().zip(v).map(|(z, v)| 0.5 * (mass * v * v + k * z * z)).collect()
}

/// Times at which the displacement rises through zero, between samples by a straight line.
pub fn upward_crossings_s(recording: &Recording) -> Vec<f64> {
    let (t, z) = (&recording.time_s, recording.column("z_m").unwrap());
    (1..z.len())
        .filter(|&i| z[i - 1] < 0.0 && z[i] >= 0.0)
        .map(|i| t[i - 1] + (t[i] - t[i - 1]) * z[i - 1] / (z[i - 1] - z[i]))
        .collect()
}
