//! Damping that grows with amplitude.

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::trial::{Sizes, Trial};

/// `amplitude_damping`.
pub struct AmplitudeDamping;

impl Law for AmplitudeDamping {
    fn id(&self) -> &'static str {
        "amplitude_damping"
    }

    fn sentence(&self) -> &'static str {
        "Damping that grows with the square of the deflection, -c z^2 v, whatever its cause: the damping ratio rises with the square of the amplitude."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Beam, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] =
            &[ParameterSpec::size("damping", "{F}·s/{z}³", "force per velocity and deflection squared")];
        PARAMETERS
    }

    fn is_dissipative(&self) -> bool {
        true
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("damping", sizes.force / (sizes.velocity * sizes.displacement.powi(2)))]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(AmplitudeDamped { damping: given.get("damping") }))
    }
}

struct AmplitudeDamped {
    damping: f64,
}

impl ForceLaw for AmplitudeDamped {
    fn at(&self, instant: &Instant) -> Option<f64> {
        Some(-self.damping * instant.z * instant.z * instant.v)
    }

    fn force(&self, step: &Step) -> f64 {
        step.settle(|force| {
            let (from, to) = (step.z, step.z_end(force));
            // Mean of z² along the way.
            let squared = (from * from + from * to + to * to) / 3.0;
            -self.damping * squared * step.v_mean(force)
        })
    }
}
