//! A motor force that varies with place.

use std::f64::consts::TAU;

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::small_angles::sine_and_cosine;
use super::trial::{Sizes, Trial};

/// `force_ripple`.
pub struct ForceRipple;

impl Law for ForceRipple {
    fn id(&self) -> &'static str {
        "force_ripple"
    }

    fn sentence(&self) -> &'static str {
        "The motor pushes with a force that varies with place, F (1 + r sin(2 pi z/P + phase)): harmonics that grow with the force and stand still in space."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Drive]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            ParameterSpec::size("ripple", "", "relative amplitude"),
            ParameterSpec::scale("period", "{z}", 0.03, "length of a period"),
            ParameterSpec {
                lower: -7.0,
                upper: 7.0,
                ..ParameterSpec::signed("phase", "rad", "phase at displacement zero")
            },
        ];
        PARAMETERS
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        sizes.waves("ripple", 0.01)
    }

    fn ranges(&self, sizes: &Sizes<'_>) -> Vec<(&'static str, f64, f64)> {
        sizes.wave_range()
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Ripple {
            ripple: given.get("ripple"),
            per_displacement: TAU / given.get("period"),
            phase: given.get("phase"),
        }))
    }
}

struct Ripple {
    ripple: f64,
    per_displacement: f64,
    phase: f64,
}

impl ForceLaw for Ripple {
    fn at(&self, instant: &Instant) -> Option<f64> {
        Some(self.ripple * instant.effort * (self.per_displacement * instant.z + self.phase).sin())
    }

    fn force(&self, step: &Step) -> f64 {
        let half_turn = 0.5 * self.per_displacement;
        let (sine, cosine) = (half_turn * (step.z + step.z_free) + self.phase).sin_cos();
        step.settle(|force| {
            // The force moves the middle of the way by a small angle.
            let (turn_sine, turn_cosine) = sine_and_cosine(half_turn * step.z_gain * force);
            let effort = step.effort + step.effort_gain * force;
            self.ripple * effort * (sine * turn_cosine + cosine * turn_sine)
        })
    }
}
