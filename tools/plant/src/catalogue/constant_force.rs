//! A constant force.

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::trial::{Sizes, Trial};

/// `constant_force`.
pub struct ConstantForce;

impl Law for ConstantForce {
    fn id(&self) -> &'static str {
        "constant_force"
    }

    fn sentence(&self) -> &'static str {
        "A force that is always there, from a tilt or gravity: the base drifts to one side, or rests off zero."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Base, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec::signed("force", "{F}", "the force")];
        PARAMETERS
    }

    fn richer(&self) -> &'static [&'static str] {
        &["asymmetric_friction", "cogging"]
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("force", sizes.force)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Constant { force: given.get("force") }))
    }
}

struct Constant {
    force: f64,
}

impl ForceLaw for Constant {
    fn at(&self, instant: &Instant) -> Option<f64> {
        let _ = instant;
        Some(self.force)
    }

    fn force(&self, _: &Step) -> f64 {
        self.force
    }
}
