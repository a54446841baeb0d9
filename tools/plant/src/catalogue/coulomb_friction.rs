//! Dry friction of constant size.

use super::dry::{dry_force, sliding_force};
use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::trial::{Sizes, Trial};

/// `coulomb_friction`.
pub struct CoulombFriction;

impl Law for CoulombFriction {
    fn id(&self) -> &'static str {
        "coulomb_friction"
    }

    fn sentence(&self) -> &'static str {
        "Dry friction: a force of constant size against the motion, holding at rest; small motions are damped most, and the equivalent damping ratio falls as 1/amplitude."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Base, Place::Beam, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec::size("force", "{F}", "size of the force")];
        PARAMETERS
    }

    fn is_dissipative(&self) -> bool {
        true
    }

    fn richer(&self) -> &'static [&'static str] {
        &["stribeck_friction", "asymmetric_friction", "hysteresis"]
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("force", sizes.force)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Coulomb { force: given.get("force") }))
    }
}

struct Coulomb {
    force: f64,
}

impl ForceLaw for Coulomb {
    fn at(&self, instant: &Instant) -> Option<f64> {
        sliding_force(instant, |_, _| self.force, |_| self.force)
    }

    fn force(&self, step: &Step) -> f64 {
        dry_force(step, |_, _| self.force, |_| self.force)
    }
}
