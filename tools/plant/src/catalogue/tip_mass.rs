//! A mass at the tip.

use super::law::{Action, Given, Law, ParameterSpec, Place, Structure};
use super::trial::{Sizes, Trial};
use crate::model::Model;

/// `tip_mass`.
pub struct TipMass;

impl Law for TipMass {
    fn id(&self) -> &'static str {
        "tip_mass"
    }

    fn sentence(&self) -> &'static str {
        "Something heavy sits at the tip: all frequencies fall, whatever the amplitude, the first one most in proportion to what it moves."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Beam]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec::size("mass", "kg", "the mass")];
        PARAMETERS
    }

    fn is_of_the_whole(&self) -> bool {
        true
    }

    fn trials(&self, _: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("mass", 1e-3)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Structure(Structure::TipMass(given.get("mass")))
    }

    fn objection(&self, model: &Model, _: &str) -> Option<&'static str> {
        (!matches!(model, Model::BeamOnBase(_)))
            .then_some("only a beam_on_base has a beam; change the mode's frequency instead")
    }
}
