//! Damping that differs between the directions.

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::trial::{Sizes, Trial};

/// `bilinear_damping`.
pub struct BilinearDamping;

impl Law for BilinearDamping {
    fn id(&self) -> &'static str {
        "bilinear_damping"
    }

    fn sentence(&self) -> &'static str {
        "Damping that differs with the direction, as a shock absorber's or a check valve's: even harmonics and a mean deflection in proportion to amplitude."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Base, Place::Beam, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec::signed(
            "damping",
            "{F}·s/{z}",
            "added in the positive direction; negative where that is damped less",
        )];
        PARAMETERS
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("damping", sizes.force / sizes.velocity)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Absorber { damping: given.get("damping") }))
    }
}

struct Absorber {
    damping: f64,
}

impl ForceLaw for Absorber {
    fn at(&self, instant: &Instant) -> Option<f64> {
        instant.moves_on().then(|| -self.damping * instant.v.max(0.0))
    }

    fn force(&self, step: &Step) -> f64 {
        step.settle(|force| -self.damping * mean_forward(step.v, step.v_end(force)))
    }
}

/// Mean of the positive part of what goes from one value to another along a straight line.
fn mean_forward(from: f64, to: f64) -> f64 {
    let (low, high) = (from.min(to), from.max(to));
    if low >= 0.0 {
        0.5 * (low + high)
    } else if high <= 0.0 {
        0.0
    } else {
        0.5 * high * high / (high - low)
    }
}
