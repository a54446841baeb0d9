//! A cable that pulls.

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::trial::{Sizes, Trial};

/// `cable_spring`.
pub struct CableSpring;

/// So many times the motion away a cable's rest is another force than a spring's.
const FAR: f64 = 1e3;

impl Law for CableSpring {
    fn id(&self) -> &'static str {
        "cable_spring"
    }

    fn sentence(&self) -> &'static str {
        "A cable or hose that pulls like a weak spring towards where it was laid: the base creeps back, and slow motions need a force in proportion to position."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Base, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            ParameterSpec::signed("stiffness", "{F}/{z}", "force per displacement"),
            ParameterSpec::signed("rest_position", "{z}", "where it does not pull"),
        ];
        PARAMETERS
    }

    fn pulls_by(&self) -> Option<&'static str> {
        Some("stiffness")
    }

    fn richer(&self) -> &'static [&'static str] {
        &["hysteresis", "cogging", "bilinear_stiffness"]
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        let far = FAR * sizes.displacement;
        // A base that nothing holds starts anywhere beside a cable's rest: far away it pulls evenly.
        let pulls = [(sizes.stiffness(), 0.0), (sizes.force / far, far)];
        pulls.map(|(stiffness, rest)| Trial::of("stiffness", stiffness).at("rest_position", rest)).to_vec()
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Cable { stiffness: given.get("stiffness"), rest: given.get("rest_position") }))
    }
}

struct Cable {
    stiffness: f64,
    rest: f64,
}

impl ForceLaw for Cable {
    fn at(&self, instant: &Instant) -> Option<f64> {
        Some(-self.stiffness * (instant.z - self.rest))
    }

    fn force(&self, step: &Step) -> f64 {
        // The mean of both ends is linear in the force.
        let mean = 0.5 * (step.z + step.z_free) - self.rest;
        -self.stiffness * mean / (1.0 + 0.5 * self.stiffness * step.z_gain)
    }
}
