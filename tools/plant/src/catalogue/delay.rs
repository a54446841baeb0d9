//! A sensor that reports late.

use super::law::{Action, Given, Law, ParameterSpec, Place, SensorAction};
use super::trial::{Sizes, Trial};

/// `delay`.
pub struct Delay;

impl Law for Delay {
    fn id(&self) -> &'static str {
        "delay"
    }

    fn sentence(&self) -> &'static str {
        "The sensor reports late: phase that falls in proportion to frequency, amplitudes unchanged; told from a dead time of the drive only where the base was recorded."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Sensor]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec {
            lower: -1.0,
            upper: 1.0,
            ..ParameterSpec::signed("delay", "s", "how late it reports")
        }];
        PARAMETERS
    }

    fn is_late(&self) -> bool {
        true
    }

    fn trials(&self, _: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("delay", 1e-3)]
    }

    fn ranges(&self, _: &Sizes<'_>) -> Vec<(&'static str, f64, f64)> {
        vec![("delay", -0.1, 0.1)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Sensor(SensorAction::Timing { scale: 1.0, delay_s: given.get("delay") })
    }
}
