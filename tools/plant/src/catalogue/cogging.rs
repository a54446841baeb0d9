//! Cogging of a linear motor.

use std::f64::consts::TAU;

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::small_angles::{sine_and_cosine, sine_over_angle};
use super::trial::{Sizes, Trial};

/// `cogging`.
pub struct Cogging;

impl Law for Cogging {
    fn id(&self) -> &'static str {
        "cogging"
    }

    fn sentence(&self) -> &'static str {
        "The magnets of a linear motor pull with the period of their pitch, -A sin(2 pi z/P + phase): a force that belongs to the place, not to the speed or the time."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Base, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            ParameterSpec::size("force", "{F}", "amplitude of the force"),
            ParameterSpec::scale("period", "{z}", 0.03, "pitch of the magnets"),
            ParameterSpec {
                lower: -7.0,
                upper: 7.0,
                ..ParameterSpec::signed("phase", "rad", "phase at displacement zero")
            },
        ];
        PARAMETERS
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        sizes.waves("force", sizes.force)
    }

    fn ranges(&self, sizes: &Sizes<'_>) -> Vec<(&'static str, f64, f64)> {
        sizes.wave_range()
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Cog {
            force: given.get("force"),
            per_displacement: TAU / given.get("period"),
            phase: given.get("phase"),
        }))
    }
}

struct Cog {
    force: f64,
    per_displacement: f64,
    phase: f64,
}

impl ForceLaw for Cog {
    fn at(&self, instant: &Instant) -> Option<f64> {
        Some(-self.force * (self.per_displacement * instant.z + self.phase).sin())
    }

    fn force(&self, step: &Step) -> f64 {
        let half_turn = 0.5 * self.per_displacement;
        let (sine, cosine) = (half_turn * (step.z + step.z_free) + self.phase).sin_cos();
        step.settle(|force| {
            // The force moves the middle of the way by a small angle.
            let (turn_sine, turn_cosine) = sine_and_cosine(half_turn * step.z_gain * force);
            let middle_sine = sine * turn_cosine + cosine * turn_sine;
            -self.force * middle_sine * sine_over_angle(half_turn * (step.z_end(force) - step.z))
        })
    }
}
