//! Viscous friction.

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::trial::{Sizes, Trial};
use crate::model::{GROUND, Model};

/// `viscous_friction`.
pub struct ViscousFriction;

impl Law for ViscousFriction {
    fn id(&self) -> &'static str {
        "viscous_friction"
    }

    fn sentence(&self) -> &'static str {
        "Friction in proportion to velocity that the model has no parameter for: damping independent of amplitude."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Base, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] =
            &[ParameterSpec::size("damping", "{F}·s/{z}", "force per velocity")];
        PARAMETERS
    }

    fn is_dissipative(&self) -> bool {
        true
    }

    fn own_parameter(&self, model: &Model, location: &str) -> Option<String> {
        match model {
            Model::Lumped(lumped) => {
                let (first, second) = location.split_once('-').unwrap_or((location, GROUND));
                lumped.damper_between(first, second)
            }
            Model::BeamOnBase(_) if location == "base" => Some("base.viscous_N_s_m".to_owned()),
            Model::BeamOnBase(_) => None,
            Model::Modal(_) => Some(format!("mode.{}.damping_ratio", location.strip_prefix("mode ")?)),
        }
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("damping", sizes.force / sizes.velocity)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Viscous { damping: given.get("damping") }))
    }
}

struct Viscous {
    damping: f64,
}

impl ForceLaw for Viscous {
    fn at(&self, instant: &Instant) -> Option<f64> {
        Some(-self.damping * instant.v)
    }

    fn force(&self, step: &Step) -> f64 {
        // The mean velocity is linear in the force.
        let per_force = self.damping / step.step_s * step.z_gain;
        -self.damping * step.v_mean(0.0) / (1.0 + per_force)
    }
}
