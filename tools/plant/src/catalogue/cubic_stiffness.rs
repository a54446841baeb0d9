//! Hardening or softening.

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::trial::{Sizes, Trial};

/// `cubic_stiffness`.
pub struct CubicStiffness;

impl Law for CubicStiffness {
    fn id(&self) -> &'static str {
        "cubic_stiffness"
    }

    fn sentence(&self) -> &'static str {
        "A spring force -k3 z^3 beside the linear one: the frequency rises (k3 > 0, hardening) or falls with the square of the amplitude, with a third harmonic."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Base, Place::Beam, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec::signed(
            "stiffness",
            "{F}/{z}³",
            "force per displacement cubed; negative is softening",
        )];
        PARAMETERS
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("stiffness", sizes.force / sizes.displacement.powi(3))]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Cubic { stiffness: given.get("stiffness") }))
    }
}

struct Cubic {
    stiffness: f64,
}

impl ForceLaw for Cubic {
    fn at(&self, instant: &Instant) -> Option<f64> {
        Some(-self.stiffness * instant.z.powi(3))
    }

    fn force(&self, step: &Step) -> f64 {
        step.settle(|force| {
            let (from, to) = (step.z, step.z_end(force));
            // Minus the difference of the potentials over the way: the energy balance is exact.
            -0.25 * self.stiffness * (from + to) * (from * from + to * to)
        })
    }
}
