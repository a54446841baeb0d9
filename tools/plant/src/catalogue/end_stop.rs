//! Stops at the ends of the travel.

use super::law::{Action, Given, Law, ParameterSpec, Place};
use super::piecewise::Beyond;
use super::trial::{Sizes, Trial};

/// `end_stop`.
pub struct EndStop;

/// A stop is looked for up to this many times as far as the model goes without it.
pub const BEYOND_REACH: f64 = 2.0;

impl Law for EndStop {
    fn id(&self) -> &'static str {
        "end_stop"
    }

    fn sentence(&self) -> &'static str {
        "Stops at both ends of the travel: free in between, a stiff spring beyond; displacements have flat tops and the motion rebounds."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Base, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            ParameterSpec {
                default: f64::INFINITY,
                ..ParameterSpec::size("distance", "{z}", "from zero to either stop")
            },
            ParameterSpec::size("stiffness", "{F}/{z}", "of the stop"),
        ];
        PARAMETERS
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        let at = |share: f64| Trial::of("stiffness", sizes.stiffness()).at("distance", share * sizes.reach);
        [0.95, 0.9, 0.8, 0.7, 0.6, 0.5].map(at).to_vec()
    }

    fn ranges(&self, sizes: &Sizes<'_>) -> Vec<(&'static str, f64, f64)> {
        // How far a model without the stop goes is a guess of how far it is.
        vec![("distance", 0.1 * sizes.reach, BEYOND_REACH * sizes.reach)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Beyond {
            stiffness: given.get("stiffness"),
            from: given.get("distance"),
            two_sided: true,
        }))
    }
}
