//! What is taken for noise and may hide a force.
//!
//! Where the excitation never changes its character, all that a model leaves counts as noise. Nothing tells a
//! force that acts all the time from a noisy sensor then, but that a sensor's noise goes to the end of the
//! spectrum and a machine's motion does not. Where some part of the spectrum is far quieter than the floor,
//! laws are looked for before it is said that nothing is missing.

use stillbeam_recording::Role;

use super::Adequacy;

/// A floor with so many times the power that noise has may hide a force.
const FAR_ABOVE: f64 = 9.0;

/// Whether the floor of any series may hide a force.
pub(crate) fn may_hide_a_force(tests: &[(Role, Adequacy)]) -> bool {
    tests.iter().any(|(_, test)| test.bound_ratio > FAR_ABOVE)
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;
    use stillbeam_plant::{Model, Physics, SimulateOptions, simulate_with};
    use stillbeam_recording::Recording;

    use super::*;
    use crate::comparison::compare;
    use crate::simulation::Hypothesis;
    use crate::study::Study;
    use crate::{Options, diagnose};

    const PUSHED: &str = r#"
        schema = 1
        kind = "lumped"
        body = [{ name = "mass", mass = 1.0 }]
        spring = [{ between = ["mass", "ground"], stiffness = 400.0 }]
        damper = [{ between = ["mass", "ground"], damping = 0.8 }]
        input = { column = "force_N", body = "mass", hold = "first" }
        output = [{ column = "acceleration_m_s2", body = "mass", quantity = "acceleration" }]
    "#;

    fn noise(count: usize, seed: u64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        (0..count).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    /// A run under a random force that never changes its character, read by an accelerometer.
    fn run(machine: &Model, seed: u64) -> Recording {
        let mut state = [0.0; 2];
        let force: Vec<f64> = noise(4000, seed)
            .into_iter()
            .map(|push| {
                state[0] += 0.15 * (push - state[0]);
                state[1] += 0.15 * (state[0] - state[1]);
                state[1]
            })
            .collect();
        let time_s = (0..force.len()).map(|k| 0.01 * k as f64).collect();
        let commanded = Recording::new(format!("run {seed}"), time_s).with_column("force_N", force.clone());
        let options = SimulateOptions { longest_step_s: Some(1e-3), ..SimulateOptions::default() };
        let moved = simulate_with(machine, &commanded, &options).unwrap();
        let read = moved.column("acceleration_m_s2").unwrap().iter();
        let read = read.zip(noise(force.len(), seed + 100)).map(|(a, noise)| a + 3e-3 * noise).collect();
        Recording::new(moved.name.clone(), moved.time_s.clone())
            .with_column("force_N", force)
            .with_column("acceleration_m_s2", read)
    }

    /// The machine as drawn, and runs of one that has a law besides.
    fn runs(law: Option<Physics>) -> (Model, [Recording; 3]) {
        let drawn = Model::from_toml("pushed.toml", PUSHED).unwrap();
        let mut truth = drawn.clone();
        truth.setup_mut().physics.extend(law);
        (drawn, [1, 2, 3].map(|seed| run(&truth, seed)))
    }

    fn cogging() -> Physics {
        Physics::new("cogging", "mass").with("force", 0.05).with("period", 2e-3).with("phase", 1.0)
    }

    fn hides(law: Option<Physics>) -> bool {
        let (drawn, [first, second, held_out]) = runs(law);
        let mut study = Study::new(&drawn, &[first, second], &[held_out]).unwrap();
        let compared = compare(&mut study, &Hypothesis::given(&drawn)).unwrap();
        may_hide_a_force(&study.adequacies(&compared.refitted_on_all, &compared.floors))
    }

    #[test]
    fn a_force_that_acts_all_the_time_may_hide_in_what_is_taken_for_noise() {
        assert!(hides(Some(cogging())));
        assert!(!hides(None), "a sensor's own noise");
    }

    #[test]
    fn a_law_that_hides_in_what_is_taken_for_noise_is_named() {
        let (drawn, [first, second, held_out]) = runs(Some(cogging()));
        let found =
            diagnose(&drawn, &[first, second], &[held_out], &Options::default(), &mut |_| {}).unwrap();
        let named: Vec<&str> = found.effects.iter().map(|effect| effect.id.as_str()).collect();
        assert_eq!(named, ["cogging"], "{}", found.sentence);
    }
}
