//! A machine for tests: a slide that nothing but its loop holds in place.

use rand_distr::{Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
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
    run_over(axis, 0.2, 2.0)
}

/// A run of 20 s there and back over a travel, `fast_rad_s` radians of a cosine a second.
pub(crate) fn run_over(axis: &Model, travel_m: f64, fast_rad_s: f64) -> Recording {
    let time_s: Vec<f64> = (0..4000).map(|k| 0.005 * f64::from(k)).collect();
    let reference = time_s.iter().map(|t| 0.5 * travel_m * (1.0 - (fast_rad_s * t).cos())).collect();
    let still = vec![0.0; time_s.len()];
    let commanded = Recording::new("run", time_s)
        .with_column("reference_m", reference)
        .with_column("motor_force_N", still);
    simulate(axis, &commanded).unwrap()
}

/// Runs over several travels, a radian of the cosine a second, with white noise of this size on the position.
pub(crate) fn noisy_runs_over(axis: &Model, travels_m: &[f64], noise_m: f64) -> Vec<Recording> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let noise = Normal::new(0.0, noise_m).unwrap();
    let mut noisy = |(number, travel_m): (usize, &f64)| {
        let run = run_over(axis, *travel_m, 1.0);
        let column = |name: &str| run.column(name).unwrap().to_vec();
        let read = column("position_m").iter().map(|x| x + noise.sample(&mut random)).collect();
        Recording::new(format!("run {number}"), run.time_s.clone())
            .with_column("reference_m", column("reference_m"))
            .with_column("motor_force_N", column("motor_force_N"))
            .with_column("position_m", read)
    };
    travels_m.iter().enumerate().map(&mut noisy).collect()
}
