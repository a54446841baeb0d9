//! A drive that is not linear.

use super::law::{Action, Given, Law, ParameterSpec, Place, SignalLaw};
use super::trial::{Sizes, Trial};

/// `gain_nonlinearity`.
pub struct GainNonlinearity;

impl Law for GainNonlinearity {
    fn id(&self) -> &'static str {
        "gain_nonlinearity"
    }

    fn sentence(&self) -> &'static str {
        "The drive gives not quite in proportion to its input, u (1 + a u + b u^2): harmonics in the drive itself, the same at every frequency."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Drive]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            ParameterSpec::signed("quadratic", "1/{u}", "a: differs with the sign"),
            ParameterSpec::signed("cubic", "1/{u}²", "b: the same both ways"),
        ];
        PARAMETERS
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        let u = sizes.input[0];
        vec![Trial::of("quadratic", 0.01 / u), Trial::of("cubic", 0.01 / (u * u))]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Signal(Box::new(Bent { quadratic: given.get("quadratic"), cubic: given.get("cubic") }))
    }
}

struct Bent {
    quadratic: f64,
    cubic: f64,
}

impl SignalLaw for Bent {
    fn pass(&mut self, _: f64, value: f64) -> f64 {
        value * (1.0 + value * (self.quadratic + value * self.cubic))
    }
}
