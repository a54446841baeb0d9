//! A sensor that is not linear.

use super::law::{Action, Given, Law, ParameterSpec, Place, SensorAction};
use super::trial::{Sizes, Trial};

/// `nonlinearity`.
pub struct SensorNonlinearity;

impl Law for SensorNonlinearity {
    fn id(&self) -> &'static str {
        "nonlinearity"
    }

    fn sentence(&self) -> &'static str {
        "The sensor does not read in proportion, y (1 + a y + b y^2), as a lens that is not calibrated: harmonics without dynamics, in the same ratio at every frequency."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Sensor]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            ParameterSpec::signed("quadratic", "1/{y}", "a: differs with the sign"),
            ParameterSpec::signed("cubic", "1/{y}²", "b: the same both ways"),
        ];
        PARAMETERS
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        let y = sizes.output[0];
        vec![Trial::of("quadratic", 0.01 / y), Trial::of("cubic", 0.01 / (y * y))]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        let (quadratic, cubic) = (given.get("quadratic"), given.get("cubic"));
        Action::Sensor(SensorAction::Optics(Box::new(move |y, _| y * (1.0 + y * (quadratic + y * cubic)))))
    }
}
