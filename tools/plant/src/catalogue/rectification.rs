//! The absolute value in place of the value.

use super::law::{Action, Given, Law, ParameterSpec, Place, SensorAction};
use super::trial::{Sizes, Trial};

/// `rectification`.
pub struct Rectification;

impl Law for Rectification {
    fn id(&self) -> &'static str {
        "rectification"
    }

    fn sentence(&self) -> &'static str {
        "The sensor reads a distance and not a side: |y| in place of y, wholly or in part; everything is there twice per period."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Sensor]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec {
            upper: 1.0,
            is_complete_at_upper: true,
            ..ParameterSpec::size("share", "", "0: signed, 1: absolute value")
        }];
        PARAMETERS
    }

    fn trials(&self, _: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("share", 0.02)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        let share = given.get("share");
        Action::Sensor(SensorAction::Optics(Box::new(move |y, _| (1.0 - share) * y + share * y.abs())))
    }
}
