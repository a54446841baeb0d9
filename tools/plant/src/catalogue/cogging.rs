//! Cogging of a linear motor.

use std::f64::consts::TAU;

use super::law::{Action, ForceLaw, Given, Law, ParameterSpec, Place, Step};

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
    fn force(&self, step: &Step) -> f64 {
        step.settle(|force| {
            let middle = self.per_displacement * 0.5 * (step.z + step.z_end(force)) + self.phase;
            let half = self.per_displacement * 0.5 * (step.z_end(force) - step.z);
            // Mean of the sine along the way: that at its middle times sin(x)/x.
            let share = if half.abs() < 1e-6 { 1.0 } else { half.sin() / half };
            -self.force * middle.sin() * share
        })
    }
}
