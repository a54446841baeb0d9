//! A sensor with a clock of its own.

use super::law::{Action, Given, Law, ParameterSpec, Place, SensorAction};
use super::trial::{Sizes, Trial};

/// `clock_skew`.
pub struct ClockSkew;

impl Law for ClockSkew {
    fn id(&self) -> &'static str {
        "clock_skew"
    }

    fn sentence(&self) -> &'static str {
        "The sensor stamps with a clock that runs fast or slow, t_stamp = (1 + skew) t: a delay that grows with time."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Sensor]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec {
            lower: -0.01,
            upper: 0.01,
            ..ParameterSpec::signed("skew", "", "relative error of the clock")
        }];
        PARAMETERS
    }

    fn is_late(&self) -> bool {
        true
    }

    fn trials(&self, _: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("skew", 1e-5)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Sensor(SensorAction::Timing { scale: 1.0 / (1.0 + given.get("skew")), delay_s: 0.0 })
    }
}
