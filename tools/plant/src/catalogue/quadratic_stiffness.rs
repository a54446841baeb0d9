//! A spring that hardens to one side and softens to the other.

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::trial::{Sizes, Trial};

/// `quadratic_stiffness`.
pub struct QuadraticStiffness;

impl Law for QuadraticStiffness {
    fn id(&self) -> &'static str {
        "quadratic_stiffness"
    }

    fn sentence(&self) -> &'static str {
        "A spring force -k2 z^2 beside the linear one, as of a preloaded or curved part: harder to one side than to the other, with a second harmonic and a mean deflection that grow with the square of the amplitude."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Base, Place::Beam, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec::signed(
            "stiffness",
            "{F}/{z}²",
            "force per displacement squared; positive is harder towards positive displacements",
        )];
        PARAMETERS
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("stiffness", sizes.force / sizes.displacement.powi(2))]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Quadratic { stiffness: given.get("stiffness") }))
    }
}

struct Quadratic {
    stiffness: f64,
}

impl ForceLaw for Quadratic {
    fn at(&self, instant: &Instant) -> Option<f64> {
        Some(-self.stiffness * instant.z * instant.z)
    }

    fn force(&self, step: &Step) -> f64 {
        step.settle(|force| {
            let (from, to) = (step.z, step.z_end(force));
            // Minus the difference of the potentials over the way: the energy balance is exact.
            -self.stiffness * (from * from + from * to + to * to) / 3.0
        })
    }
}
