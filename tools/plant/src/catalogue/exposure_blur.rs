//! The blur of a long exposure.

use super::law::{Action, Given, Law, ParameterSpec, Place, SensorAction};
use super::trial::{Sizes, Trial};

/// `exposure_blur`.
pub struct ExposureBlur;

impl Law for ExposureBlur {
    fn id(&self) -> &'static str {
        "exposure_blur"
    }

    fn sentence(&self) -> &'static str {
        "A frame is the mean over its exposure, stamped at read-out: fast motions are weakened, sin(x)/x with x = pi f T, and late by half the exposure."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Sensor]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec::size("exposure", "s", "length of the mean")];
        PARAMETERS
    }

    fn is_late(&self) -> bool {
        true
    }

    fn trials(&self, _: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("exposure", 2e-3)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Sensor(SensorAction::Exposure(given.get("exposure")))
    }
}
