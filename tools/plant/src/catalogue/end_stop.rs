//! Stops at the ends of the travel.

use super::law::{Action, Given, Law, ParameterSpec, Place};
use super::piecewise::Beyond;

/// `end_stop`.
pub struct EndStop;

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

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Beyond {
            stiffness: given.get("stiffness"),
            from: given.get("distance"),
            two_sided: true,
        }))
    }
}
