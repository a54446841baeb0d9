//! Clipping, of the drive or of the sensor.

use super::law::{Action, Given, Law, ParameterSpec, Place, SensorAction, SignalLaw};
use super::trial::{Sizes, Trial};

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

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        limits(sizes.input[1])
    }

    fn ranges(&self, sizes: &Sizes<'_>) -> Vec<(&'static str, f64, f64)> {
        // A command is known exactly, and a limit above all that was asked for limits nothing.
        limit_range(sizes.input[1])
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

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        limits(sizes.output[1])
    }

    fn ranges(&self, sizes: &Sizes<'_>) -> Vec<(&'static str, f64, f64)> {
        // The largest reading of a sensor that saturates is its limit, noise and an unknown zero put aside:
        // the limit lies about there and not below.
        limit_range(ABOVE_READINGS * sizes.output[1])
    }

    fn action(&self, given: &Given<'_>) -> Action {
        let limit = given.get("limit");
        Action::Sensor(SensorAction::Electronics(Box::new(move |reading| reading.clamp(-limit, limit))))
    }
}

/// A sensor's limit is looked for up to this many times its largest reading.
const ABOVE_READINGS: f64 = 1.5;

fn limits(most: f64) -> Vec<Trial> {
    [0.95, 0.8, 0.6].map(|share| Trial::default().at("limit", share * most)).to_vec()
}

fn limit_range(most: f64) -> Vec<(&'static str, f64, f64)> {
    vec![("limit", 0.05 * most, most)]
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_of_a_saturating_sensor_may_be_its_largest_reading() {
        let sizes = Sizes { input: [0.5, 1.0], output: [0.02, 0.03], ..Sizes::default() };
        let most = |ranges: Vec<(&str, f64, f64)>| ranges[0].2;
        assert!(most(SensorSaturation.ranges(&sizes)) > 1.1 * 0.03);
        assert!(most(DriveSaturation.ranges(&sizes)) < 1.0 + 1e-9, "a command is known exactly");
    }
}
