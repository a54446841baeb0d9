//! A pendulum against its closed form: the period by the complete elliptic integral.

use std::f64::consts::PI;

use stillbeam_plant::{Model, simulate};
use stillbeam_recording::Recording;

const INERTIA: f64 = 3.3e-3;
const GRAVITY: f64 = 0.21;

/// An arm let go at an angle.
fn arm(angle_rad: f64) -> Model {
    let text = format!(
        "schema = 1\nkind = \"lumped\"\n\
         body = [{{ name = \"arm\", mass = {INERTIA} }}]\n\
         spring = [{{ between = [\"arm\", \"ground\"], stiffness = {GRAVITY} }}]\n\
         input = {{ column = \"torque_N_m\", body = \"arm\" }}\n\
         output = [{{ column = \"arm_rad\", body = \"arm\", quantity = \"position\" }}]\n\
         physics = [{{ id = \"pendulum\", location = \"arm\", parameters = {{ stiffness = {GRAVITY} }} }}]\n\
         [initial.arm]\ndisplacement = {angle_rad}\n"
    );
    Model::from_toml("arm.toml", &text).unwrap()
}

/// Period over that of small angles: 1 / agm(1, cos(angle / 2)).
fn longer(angle_rad: f64) -> f64 {
    let (mut a, mut g) = (1.0, (0.5 * angle_rad).cos());
    for _ in 0..8 {
        (a, g) = (0.5 * (a + g), f64::sqrt(a * g));
    }
    1.0 / a
}

#[test]
fn an_arm_swings_as_slowly_as_the_elliptic_integral_says() {
    for angle_rad in [0.05, 0.5, 1.6, 2.8] {
        let time_s: Vec<f64> = (0..8000).map(|k| 0.002 * f64::from(k)).collect();
        let torque = vec![0.0; time_s.len()];
        let untouched = Recording::new("r", time_s.clone()).with_column("torque_N_m", torque);
        let run = simulate(&arm(angle_rad), &untouched).unwrap();
        let angle = run.column("arm_rad").unwrap();
        let crossings: Vec<f64> = (1..angle.len())
            .filter(|&k| angle[k - 1] < 0.0 && angle[k] >= 0.0)
            .map(|k| time_s[k] - 0.002 * angle[k] / (angle[k] - angle[k - 1]))
            .collect();
        let found = (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
        let expected = 2.0 * PI * (INERTIA / GRAVITY).sqrt() * longer(angle_rad);
        assert!((found / expected - 1.0).abs() < 5e-5, "{angle_rad} rad: {found} s, not {expected} s");
    }
}

#[test]
fn only_a_body_that_turns_is_a_pendulum() {
    let slides = arm(0.1).to_toml().unwrap().replace("arm_rad", "arm_m");
    let refused = Model::from_toml("arm.toml", &slides).unwrap_err().to_string();
    assert!(refused.contains("only what turns is a pendulum"), "{refused}");
}
