//! Clipping, of the drive or of the sensor.

use super::law::{Action, Given, Law, ParameterSpec, Place, SensorAction, SignalLaw};

/// `saturation` at the drive.
pub struct DriveSaturation;

/// `saturation` at the sensor.
pub struct SensorSaturation;

impl Law for DriveSaturation {
    fn id(&self) -> &'static str {
        "saturation"
    }

    fn sentence(&self) -> &'static str {
        "The drive gives no more than a limit, however much it is told: large commands are clipped, small ones untouched."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Drive]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec {
            default: f64::INFINITY,
            ..ParameterSpec::size("limit", "{u}", "the most it gives, either way")
        }];
        PARAMETERS
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Signal(Box::new(Clip { limit: given.get("limit") }))
    }
}

impl Law for SensorSaturation {
    fn id(&self) -> &'static str {
        "saturation"
    }

    fn sentence(&self) -> &'static str {
        "The sensor reads no more than a limit: recorded peaks have flat tops of one and the same height."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Sensor]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec {
            default: f64::INFINITY,
            ..ParameterSpec::size("limit", "{y}", "the most it reads, either way")
        }];
        PARAMETERS
    }

    fn action(&self, given: &Given<'_>) -> Action {
        let limit = given.get("limit");
        Action::Sensor(SensorAction::Electronics(Box::new(move |reading| reading.clamp(-limit, limit))))
    }
}

/// Clips to `±limit`.
pub(crate) struct Clip {
    pub(crate) limit: f64,
}

impl SignalLaw for Clip {
    fn pass(&mut self, _: f64, value: f64) -> f64 {
        value.clamp(-self.limit, self.limit)
    }
}
