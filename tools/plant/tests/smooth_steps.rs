//! Long steps along which forces are smooth, beside very short ones.

use std::f64::consts::TAU;

use stillbeam_plant::{Model, Physics, Rerun, StepLengths};
use stillbeam_recording::Recording;

/// First natural frequency, hertz.
const FREQUENCY_HZ: f64 = 2.0;
/// The fastest that is recorded.
const BAND_HZ: f64 = 5.0 * FREQUENCY_HZ;

/// One body on a spring, or two in a row.
fn machine(bodies: usize, quantity: &str) -> Model {
    let stiffness = (TAU * FREQUENCY_HZ).powi(2);
    let [second, spring, damper] = match bodies {
        1 => [String::new(), String::new(), String::new()],
        _ => [
            ", { name = \"b\", mass = 0.6 }".to_owned(),
            format!(", {{ between = [\"a\", \"b\"], stiffness = {stiffness} }}"),
            ", { between = [\"a\", \"b\"], damping = 0.2 }".to_owned(),
        ],
    };
    let text = format!(
        "schema = 1\nkind = \"lumped\"\nbody = [{{ name = \"a\", mass = 1.0 }}{second}]\n\
         spring = [{{ between = [\"a\", \"ground\"], stiffness = {stiffness} }}{spring}]\n\
         damper = [{{ between = [\"a\", \"ground\"], damping = 0.3 }}{damper}]\n\
         input = {{ column = \"force_N\", body = \"a\" }}\n\
         output = [{{ column = \"y\", body = \"a\", quantity = \"{quantity}\" }}]\n"
    );
    Model::from_toml("machine.toml", &text).unwrap()
}

/// Forty tones between a tenth and twice the natural frequency, 1 N of root mean square.
fn driven(samples_per_period: f64) -> Recording {
    let step_s = 1.0 / (samples_per_period * FREQUENCY_HZ);
    let time_s: Vec<f64> = (0..600).map(|k| step_s * f64::from(k)).collect();
    let tones: Vec<(f64, f64)> =
        (0..40).map(|k| (0.2 + 0.09 * f64::from(k), TAU * (0.618 * f64::from(k * k)).fract())).collect();
    let force = |time_s: &f64| {
        let tone = |(hz, phase): &(f64, f64)| (TAU * hz * time_s + phase).sin();
        0.22 * tones.iter().map(tone).sum::<f64>()
    };
    let samples = time_s.iter().map(force).collect();
    Recording::new("driven", time_s).with_column("force_N", samples)
}

/// Laws of a size that the machine shows clearly.
fn laws() -> Vec<Physics> {
    let (z, v) = (0.03, 0.4);
    let (k, c) = ((TAU * FREQUENCY_HZ).powi(2), 0.3);
    vec![
        Physics::new("cubic_stiffness", "a").with("stiffness", 0.15 * k / (z * z)),
        Physics::new("quadratic_stiffness", "a").with("stiffness", 0.15 * k / z),
        Physics::new("amplitude_damping", "a").with("damping", c / (z * z)),
        Physics::new("quadratic_drag", "a").with("drag", c / v),
        Physics::new("viscous_friction", "a").with("damping", c),
        Physics::new("cable_spring", "a").with("stiffness", 0.1 * k).with("rest_position", z),
        Physics::new("constant_force", "a").with("force", 0.2),
        Physics::new("cogging", "a").with("force", 0.2).with("period", 0.8 * z).with("phase", 1.0),
        Physics::new("force_ripple", "drive").with("ripple", 0.2).with("period", z).with("phase", 1.0),
        Physics::new("bilinear_stiffness", "a").with("stiffness", 0.3 * k).with("contact", 0.5 * z),
        Physics::new("bilinear_damping", "a").with("damping", c),
        Physics::new("end_stop", "a").with("stiffness", 0.5 * k).with("distance", 0.5 * z),
        Physics::new("hysteresis", "a").with("stiffness", 0.4 * k).with("beta", 1.0 / z),
        Physics::new("coulomb_friction", "a").with("force", 0.3),
        Physics::new("stribeck_friction", "a")
            .with("force", 0.2)
            .with("static_force", 0.4)
            .with("velocity", 0.1),
        Physics::new("asymmetric_friction", "a").with("force_forward", 0.2).with("force_backward", 0.4),
        Physics::new("periodic_disturbance", "environment").with("force", 0.2).with("frequency", 3.3),
        Physics::new("parameter_drift", "environment").with("rate", 0.001),
    ]
}

/// Steps of this many radians of the fastest motion, and the usual short ones.
fn long_steps() -> StepLengths {
    StepLengths { short_s: 0.1 / (TAU * BAND_HZ), smooth_s: Some(1.0 / (TAU * BAND_HZ)), halvings: 0 }
}

/// Root mean square difference of the first outputs, in shares of the second's.
fn difference(rerun: &Rerun, model: &Model, steps: [StepLengths; 2]) -> f64 {
    let [one, other] = steps.map(|steps| rerun.outputs(model, Some(steps)).unwrap().swap_remove(0));
    let squares = |samples: &mut dyn Iterator<Item = f64>| samples.map(|value| value * value).sum::<f64>();
    let missed = squares(&mut one.iter().zip(&other).map(|(a, b)| a - b));
    (missed / squares(&mut other.iter().copied())).sqrt()
}

/// What long steps and short ones leave, in shares of the motion in very short ones.
fn errors(model: &Model, recording: &Recording) -> [f64; 2] {
    let exact = StepLengths { short_s: 5e-5, smooth_s: Some(5e-5), halvings: 0 };
    let rerun = Rerun::new(recording, model, 1).unwrap();
    let short = StepLengths { smooth_s: None, ..long_steps() };
    [long_steps(), short].map(|steps| difference(&rerun, model, [steps, exact]))
}

/// Long steps are right to 2e-4 of the motion, or nearly as right as short ones.
fn check(model: &Model, recording: &Recording, told: &str) {
    let [long, short] = errors(model, recording);
    assert!(long < 2e-4 + 2.0 * short, "{told}: {long:.1e} of the motion, {short:.1e} in short steps");
}

#[test]
fn long_steps_follow_every_force_as_very_short_ones_do() {
    for samples_per_period in [12.0, 40.0] {
        let recording = driven(samples_per_period);
        for quantity in ["position", "velocity", "acceleration"] {
            for bodies in [1, 2] {
                for law in laws() {
                    let told = format!("{} {quantity} {bodies} {samples_per_period}", law.id);
                    let mut model = machine(bodies, quantity);
                    model.setup_mut().physics = vec![law];
                    check(&model, &recording, &told);
                }
            }
        }
    }
}

/// They are of fourth order: ten times as long, and nearer to the truth.
#[test]
fn long_steps_along_smooth_forces_make_a_fraction_of_the_error_of_short_ones() {
    let recording = driven(12.0);
    let smooth = [
        "cubic_stiffness",
        "quadratic_stiffness",
        "amplitude_damping",
        "viscous_friction",
        "cable_spring",
        "parameter_drift",
    ];
    for law in laws().into_iter().filter(|law| smooth.contains(&law.id.as_str())) {
        let id = law.id.clone();
        let mut model = machine(1, "position");
        model.setup_mut().physics = vec![law];
        let [long, short] = errors(&model, &recording);
        assert!(long < 0.3 * short, "{id}: {long:.1e} of the motion, {short:.1e} in short steps");
    }
}

/// Half a step leaves a sixteenth of the error where forces are smooth, a quarter where they have kinks: also
/// where samples are closer than the longest step.
#[test]
fn steps_that_are_halved_leave_a_fraction_of_the_error() {
    let not_smooth = ["coulomb_friction", "stribeck_friction", "asymmetric_friction", "hysteresis"];
    for samples_per_period in [12.0, 200.0] {
        let recording = driven(samples_per_period);
        for law in laws() {
            let id = law.id.clone();
            let share = if not_smooth.contains(&id.as_str()) { 0.4 } else { 0.2 };
            let mut model = machine(1, "position");
            model.setup_mut().physics = vec![law];
            let rerun = Rerun::new(&recording, &model, 1).unwrap();
            let halved = |halvings: u32| StepLengths { halvings, ..long_steps() };
            let error = |halvings: u32| difference(&rerun, &model, [halved(halvings), halved(6)]);
            let [whole, half] = [error(0), error(1)];
            assert!(half < share * whole + 1e-7, "{id}: {whole:.1e} of the motion, then {half:.1e}");
        }
    }
}

#[test]
fn long_steps_follow_forces_that_act_at_once() {
    let recording = driven(25.0);
    let [first, second] = [0, 1].map(|skip| laws().into_iter().skip(skip).step_by(3));
    for (law, other) in first.zip(second) {
        let told = format!("{} and {}", law.id, other.id);
        let mut model = machine(2, "position");
        model.setup_mut().physics = vec![law, other];
        check(&model, &recording, &told);
    }
}

#[test]
fn a_gap_that_is_met_within_a_long_step_is_met_where_it_is() {
    let recording = driven(25.0);
    let mut model = machine(2, "position");
    model.setup_mut().physics = vec![Physics::new("backlash", "a-b").with("gap", 2e-3)];
    check(&model, &recording, "backlash");
}
