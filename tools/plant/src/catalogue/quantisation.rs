//! Readings in steps.

use super::law::{Action, Given, Law, ParameterSpec, Place, SensorAction};

/// `quantisation`.
pub struct Quantisation;

impl Law for Quantisation {
    fn id(&self) -> &'static str {
        "quantisation"
    }

    fn sentence(&self) -> &'static str {
        "Readings are multiples of a step: the residual is spread evenly within half a step, and small motions vanish."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Sensor]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] =
            &[ParameterSpec::size("step", "{y}", "distance of neighbouring readings")];
        PARAMETERS
    }

    fn action(&self, given: &Given<'_>) -> Action {
        let step = given.get("step");
        Action::Sensor(SensorAction::Electronics(Box::new(move |reading| {
            if step > 0.0 { (reading / step).round() * step } else { reading }
        })))
    }
}
