//! What `simulate` says of strong laws, against a Runge-Kutta integration of the same equations that knows
//! nothing of steps, ports and laws.

use std::f64::consts::TAU;

use stillbeam_plant::{Model, Physics, simulate};
use stillbeam_recording::Recording;

const RATE_HZ: f64 = 200.0;
/// Steps of the reference between two samples.
const STEPS: usize = 100;

/// Two masses: kilograms, newtons per metre, newton seconds per metre.
const MASSES: [f64; 2] = [2.0, 0.5];
const STIFFNESSES: [f64; 2] = [400.0, 900.0];
const DAMPINGS: [f64; 2] = [3.0, 0.6];

fn pair(law: Physics) -> Model {
    let [m1, m2] = MASSES;
    let [k1, k2] = STIFFNESSES;
    let [d1, d2] = DAMPINGS;
    let text = format!(
        "schema = 1\nkind = \"lumped\"\n\
         body = [{{ name = \"base\", mass = {m1} }}, {{ name = \"tip\", mass = {m2} }}]\n\
         spring = [{{ between = [\"ground\", \"base\"], stiffness = {k1} }}, {{ between = [\"base\", \"tip\"], stiffness = {k2} }}]\n\
         damper = [{{ between = [\"ground\", \"base\"], damping = {d1} }}, {{ between = [\"base\", \"tip\"], damping = {d2} }}]\n\
         input = {{ body = \"base\", column = \"force_N\" }}\n\
         output = [{{ body = \"base\", column = \"base_m\" }}, {{ body = \"tip\", column = \"tip_m\" }}]\n"
    );
    let mut model = Model::from_toml("pair.toml", &text).unwrap();
    model.setup_mut().physics = vec![law];
    model
}

fn sweep() -> Recording {
    let time_s: Vec<f64> = (0..3000).map(|k| f64::from(k) / RATE_HZ).collect();
    let force = |t: f64| 60.0 * t.min(1.0) * (TAU * (0.5 + 0.28 * t) * t).sin();
    let samples = time_s.iter().map(|&t| force(t)).collect();
    Recording::new("sweep", time_s).with_column("force_N", samples)
}

/// Positions of both masses at the samples; `link` is the force of the law that pulls the tip back, by the
/// spring's deflection and its rate, `mount` that on the base, by its position and velocity.
fn reference(
    recording: &Recording,
    link: impl Fn(f64, f64) -> f64,
    mount: impl Fn(f64, f64) -> f64,
) -> [Vec<f64>; 2] {
    let force = recording.column("force_N").unwrap();
    let slope = |x: [f64; 4], f: f64| {
        let [x1, v1, x2, v2] = x;
        let (z, rate) = (x2 - x1, v2 - v1);
        let pull = STIFFNESSES[1] * z + DAMPINGS[1] * rate + link(z, rate);
        let held = STIFFNESSES[0] * x1 + DAMPINGS[0] * v1 + mount(x1, v1);
        [v1, (f - held + pull) / MASSES[0], v2, -pull / MASSES[1]]
    };
    let along = |x: [f64; 4], d: [f64; 4], h: f64| std::array::from_fn(|i| x[i] + h * d[i]);
    let h = 1.0 / RATE_HZ / STEPS as f64;
    let mut x = [0.0; 4];
    let mut positions = [vec![0.0], vec![0.0]];
    for pair in force.windows(2) {
        for step in 0..STEPS {
            let at = |part: f64| pair[0] + (pair[1] - pair[0]) * (step as f64 + part) / STEPS as f64;
            let a = slope(x, at(0.0));
            let b = slope(along(x, a, 0.5 * h), at(0.5));
            let c = slope(along(x, b, 0.5 * h), at(0.5));
            let d = slope(along(x, c, h), at(1.0));
            x = std::array::from_fn(|i| x[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        }
        positions[0].push(x[0]);
        positions[1].push(x[2]);
    }
    positions
}

/// The largest difference of any position, in shares of the largest position.
fn worst(model: &Model, recording: &Recording, reference: [Vec<f64>; 2]) -> f64 {
    let run = simulate(model, recording).unwrap();
    let columns = ["base_m", "tip_m"].into_iter().zip(&reference);
    columns
        .map(|(column, reference)| {
            let largest = reference.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
            let apart = run.column(column).unwrap().iter().zip(reference).map(|(a, b)| (a - b).abs());
            apart.fold(0.0, f64::max) / largest
        })
        .fold(0.0, f64::max)
}

#[test]
fn a_strong_hardening_spring_is_followed_to_a_millionth() {
    let recording = sweep();
    for stiffness in [4e4, 4e5, 4e6] {
        let model = pair(Physics::new("cubic_stiffness", "base-tip").with("stiffness", stiffness));
        let reference = reference(&recording, |z, _| stiffness * z.powi(3), |_, _| 0.0);
        let worst = worst(&model, &recording, reference);
        assert!(worst < 2e-6, "{stiffness} N/m³: {worst:.1e} of the motion");
    }
}

#[test]
fn a_strong_drag_is_followed_to_a_millionth() {
    let recording = sweep();
    let model = pair(Physics::new("quadratic_drag", "base").with("drag", 20.0));
    let reference = reference(&recording, |_, _| 0.0, |_, v| 20.0 * v * v.abs());
    let worst = worst(&model, &recording, reference);
    assert!(worst < 2e-6, "{worst:.1e} of the motion");
}
