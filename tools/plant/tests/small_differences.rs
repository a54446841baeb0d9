//! How outputs follow a small change of a parameter: in proportion, down to the smallest that a fit takes.

use stillbeam_plant::{Model, Physics, Rerun, StepLengths};
use stillbeam_recording::Recording;

const PAIR: &str = r#"
    schema = 1
    kind = "lumped"
    body = [{ name = "motor", mass = 2.1 }, { name = "load", mass = 0.8 }]
    spring = [
        { between = ["motor", "ground"], stiffness = 300.0 },
        { between = ["motor", "load"], stiffness = 1500.0 },
    ]
    damper = [
        { between = ["motor", "ground"], damping = 7.7 },
        { between = ["motor", "load"], damping = 0.5 },
    ]
    input = { column = "force_N", body = "motor" }
    output = [
        { column = "motor_m", body = "motor" },
        { column = "load_m_s", body = "load", quantity = "velocity" },
    ]
"#;
/// As a fit of recordings at 100 Hz takes them.
const STEPS: StepLengths = StepLengths { short_s: 2e-3, smooth_s: Some(2e-2), halvings: 0 };

/// Laws beside which the motion does not depend on every blow of the past, as it does beside stops and play.
fn laws() -> Vec<Physics> {
    let at = |id: &str, place: &str| Physics::new(id, place);
    vec![
        at("coulomb_friction", "motor-load").with("force", 5.5),
        at("coulomb_friction", "motor").with("force", 5.5),
        at("stribeck_friction", "load").with("force", 1.0).with("static_force", 2.0).with("velocity", 0.1),
        at("asymmetric_friction", "load").with("force_forward", 1.0).with("force_backward", 3.0),
        at("hysteresis", "motor-load").with("stiffness", 300.0).with("beta", 100.0).with("gamma", 50.0),
        at("bilinear_damping", "motor-load").with("damping", 2.0),
        at("bilinear_stiffness", "motor-load").with("stiffness", 500.0),
        at("cubic_stiffness", "load").with("stiffness", 3e5),
        at("quadratic_drag", "load").with("drag", 3.0),
        at("cogging", "motor").with("force", 2.0).with("period", 0.02),
        at("dead_zone", "drive").with("threshold", 2.0),
        at("saturation", "drive").with("limit", 15.0),
    ]
}

fn rerun() -> Rerun {
    let time_s: Vec<f64> = (0..3000).map(|k| 0.01 * f64::from(k)).collect();
    let push = |t: &f64| 12.0 * (2.3 * t).sin() + 9.0 * (9.1 * t).sin() + 6.0 * (31.0 * t).sin();
    let force = time_s.iter().map(push).collect();
    let recording = Recording::new("run", time_s).with_column("force_N", force);
    Rerun::new(&recording, &Model::from_toml("pair.toml", PAIR).unwrap(), 1).unwrap()
}

/// Change of the outputs per relative change of a parameter.
fn slope(model: &Model, path: &str, share: f64) -> Vec<f64> {
    let value = model.parameter(path).unwrap();
    let mut moved = model.clone();
    moved.set_parameter(path, value * (1.0 + share)).unwrap();
    let outputs = |model: &Model| rerun().outputs(model, Some(STEPS)).unwrap().concat();
    outputs(&moved).iter().zip(&outputs(model)).map(|(a, b)| (a - b) / share).collect()
}

fn apart(first: &[f64], second: &[f64]) -> f64 {
    let square = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>();
    let difference = square(&mut first.iter().zip(second).map(|(a, b)| a - b));
    (difference / square(&mut second.iter().copied())).sqrt()
}

#[test]
fn small_changes_of_parameters_change_outputs_in_proportion_beside_every_law() {
    for law in laws() {
        let mut model = Model::from_toml("pair.toml", PAIR).unwrap();
        let own = format!("physics.1.{}", law.parameters.keys().next().unwrap());
        model.setup_mut().physics = vec![law.clone()];
        for path in [own.as_str(), "spring.motor-load.stiffness", "body.load.mass"] {
            let apart = apart(&slope(&model, path, 1e-7), &slope(&model, path, 1e-5));
            assert!(apart < 0.01, "{} at {}, {path}: {apart:.3}", law.id, law.location);
        }
    }
}
