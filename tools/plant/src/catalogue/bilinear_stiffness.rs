//! A stiffness that differs between the sides.

use super::law::{Action, Given, Law, ParameterSpec, Place};
use super::piecewise::Beyond;
use super::trial::{Sizes, Trial};

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

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        let at = |share: f64| Trial::of("stiffness", sizes.stiffness()).at("contact", share * sizes.reach);
        // Close enough that a contact between two of them is seen from one: at 0 and 0.4 of the reach alone,
        // one at 0.2 looked like a cubic.
        [0.0, 0.2, -0.2, 0.4, -0.4, 0.7, -0.7].map(at).to_vec()
    }

    fn ranges(&self, sizes: &Sizes<'_>) -> Vec<(&'static str, f64, f64)> {
        vec![("contact", -0.95 * sizes.reach, 0.95 * sizes.reach)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Beyond {
            stiffness: given.get("stiffness"),
            from: given.get("contact"),
            two_sided: false,
        }))
    }
}
