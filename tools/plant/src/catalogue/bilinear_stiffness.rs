//! A stiffness that differs between the sides.

use super::law::{Action, Given, Law, ParameterSpec, Place};
use super::piecewise::Beyond;

/// `bilinear_stiffness`.
pub struct BilinearStiffness;

impl Law for BilinearStiffness {
    fn id(&self) -> &'static str {
        "bilinear_stiffness"
    }

    fn sentence(&self) -> &'static str {
        "Stiffer or softer on one side, as a joint that opens or a one-sided contact: even harmonics and a mean deflection in proportion to amplitude."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Beam, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            ParameterSpec::signed(
                "stiffness",
                "{F}/{z}",
                "added beyond the contact; negative where a joint opens",
            ),
            ParameterSpec::signed("contact", "{z}", "displacement at which it begins"),
        ];
        PARAMETERS
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Beyond {
            stiffness: given.get("stiffness"),
            from: given.get("contact"),
            two_sided: false,
        }))
    }
}
