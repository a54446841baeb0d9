//! Small inputs that do nothing.

use super::law::{Action, Given, Law, ParameterSpec, Place, SignalLaw};
use super::trial::{Sizes, Trial};

/// `dead_zone`.
pub struct DeadZone;

impl Law for DeadZone {
    fn id(&self) -> &'static str {
        "dead_zone"
    }

    fn sentence(&self) -> &'static str {
        "The drive ignores inputs up to a threshold and passes on what exceeds it: small commands do nothing."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Drive]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] =
            &[ParameterSpec::size("threshold", "{u}", "what is ignored, either way")];
        PARAMETERS
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("threshold", 0.02 * sizes.input[0])]
    }

    fn ranges(&self, sizes: &Sizes<'_>) -> Vec<(&'static str, f64, f64)> {
        vec![("threshold", 0.0, sizes.input[1])]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Signal(Box::new(Deaf { threshold: given.get("threshold") }))
    }
}

struct Deaf {
    threshold: f64,
}

impl SignalLaw for Deaf {
    fn pass(&mut self, _: f64, value: f64) -> f64 {
        value.signum() * (value.abs() - self.threshold).max(0.0)
    }
}
