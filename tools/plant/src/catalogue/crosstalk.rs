//! Base motion in the tip signal.

use super::law::{Action, Given, Law, ParameterSpec, Place, SensorAction};
use super::trial::{Sizes, Trial};

/// `crosstalk`.
pub struct Crosstalk;

impl Law for Crosstalk {
    fn id(&self) -> &'static str {
        "crosstalk"
    }

    fn sentence(&self) -> &'static str {
        "A share of the motion of the base shows in the reading of the tip: it follows the base at once, with no resonance of its own."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Sensor]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec::signed(
            "share",
            "{y} per unit of the base (or input)",
            "how much of the base shows",
        )];
        PARAMETERS
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("share", 0.01 * sizes.output[0] / sizes.input[0])]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        let share = given.get("share");
        Action::Sensor(SensorAction::Optics(Box::new(move |y, base| y + share * base)))
    }
}
