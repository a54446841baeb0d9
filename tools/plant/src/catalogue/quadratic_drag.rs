//! Drag that grows with the square of the velocity.

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::trial::{Sizes, Trial};

/// `quadratic_drag`.
pub struct QuadraticDrag;

impl Law for QuadraticDrag {
    fn id(&self) -> &'static str {
        "quadratic_drag"
    }

    fn sentence(&self) -> &'static str {
        "Drag of air or water, -c v |v|: the equivalent damping ratio of a resonance rises in proportion to its amplitude."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Base, Place::Beam, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] =
            &[ParameterSpec::size("drag", "{F}·s²/{z}²", "force per velocity squared")];
        PARAMETERS
    }

    fn is_dissipative(&self) -> bool {
        true
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("drag", sizes.force / sizes.velocity.powi(2))]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Drag { drag: given.get("drag") }))
    }
}

struct Drag {
    drag: f64,
}

impl ForceLaw for Drag {
    fn at(&self, instant: &Instant) -> Option<f64> {
        Some(-self.drag * instant.v * instant.v.abs())
    }

    fn force(&self, step: &Step) -> f64 {
        step.settle(|force| {
            let v = step.v_mean(force);
            -self.drag * v * v.abs()
        })
    }
}
