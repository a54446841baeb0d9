//! Gravity on an arm that swings wide.

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::small_angles::sine_over_angle;
use super::trial::{Sizes, Trial};
use crate::model::Model;

/// `pendulum`.
pub struct Pendulum;

impl Law for Pendulum {
    fn id(&self) -> &'static str {
        "pendulum"
    }

    fn sentence(&self) -> &'static str {
        "Gravity pulls an arm back by the sine of its angle, k sin z, where the linear spring has k z: the frequency falls with the amplitude, by 1.7 % at 0.5 rad, whatever the arm's mass."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec::signed(
            "stiffness",
            "{F}/{z}",
            "m g l: the part of the linear spring that is gravity; negative on an arm that stands upright",
        )];
        PARAMETERS
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        let z = sizes.displacement;
        // What of the spring's force the sine takes away at the largest angle.
        vec![Trial::of("stiffness", sizes.force / (z - z.sin()).abs().max(f64::MIN_POSITIVE))]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Swing { stiffness: given.get("stiffness") }))
    }

    fn objection(&self, model: &Model, location: &str) -> Option<&'static str> {
        (!model.turns(location))
            .then_some("only what turns is a pendulum; name an output of this body in rad")
    }
}

struct Swing {
    stiffness: f64,
}

impl ForceLaw for Swing {
    fn at(&self, instant: &Instant) -> Option<f64> {
        Some(self.stiffness * (instant.z - instant.z.sin()))
    }

    fn force(&self, step: &Step) -> f64 {
        step.settle(|force| {
            let (middle, half) = (0.5 * (step.z + step.z_end(force)), 0.5 * (step.z_end(force) - step.z));
            // Minus the difference of the potentials over the way: the energy balance is exact.
            self.stiffness * (middle - middle.sin() * sine_over_angle(half))
        })
    }
}
