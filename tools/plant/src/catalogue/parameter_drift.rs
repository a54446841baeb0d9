//! A stiffness that moves with time.

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::trial::{Sizes, Trial};

/// `parameter_drift`.
pub struct ParameterDrift;

impl Law for ParameterDrift {
    fn id(&self) -> &'static str {
        "parameter_drift"
    }

    fn sentence(&self) -> &'static str {
        "A frequency moves with time, f (1 + rate t), as a clamp creeps or a room warms up: the same run later gives another resonance."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Environment]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec {
            lower: -0.01,
            upper: 0.01,
            ..ParameterSpec::signed("rate", "1/s", "relative change of the frequency per second")
        }];
        PARAMETERS
    }

    fn trials(&self, _: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("rate", 1e-5)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Drift { stiffness: given.stiffness, rate_per_s: given.get("rate") }))
    }
}

struct Drift {
    stiffness: f64,
    rate_per_s: f64,
}

impl ForceLaw for Drift {
    fn at(&self, instant: &Instant) -> Option<f64> {
        let factor = 1.0 + self.rate_per_s * instant.time_s;
        Some(-self.stiffness * (factor * factor - 1.0) * instant.z)
    }

    fn force(&self, step: &Step) -> f64 {
        let factor = 1.0 + self.rate_per_s * (step.time_s + 0.5 * step.step_s);
        let added = self.stiffness * (factor * factor - 1.0);
        let mean = 0.5 * (step.z + step.z_free);
        -added * mean / (1.0 + 0.5 * added * step.z_gain)
    }
}
