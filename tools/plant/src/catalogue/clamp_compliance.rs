//! A clamp that gives way.

use super::law::{Action, Given, Law, ParameterSpec, Place, Structure};
use super::trial::{Sizes, Trial};
use crate::model::Model;

/// `clamp_compliance`.
pub struct ClampCompliance;

impl Law for ClampCompliance {
    fn id(&self) -> &'static str {
        "clamp_compliance"
    }

    fn sentence(&self) -> &'static str {
        "The clamp gives way under the bending moment: all frequencies fall, whatever the amplitude, and their ratio rises."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Beam]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] =
            &[ParameterSpec::size("compliance", "rad/(N·m)", "angle per moment")];
        PARAMETERS
    }

    fn is_of_the_whole(&self) -> bool {
        true
    }

    fn trials(&self, _: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("compliance", 1e-4)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Structure(Structure::ClampCompliance(given.get("compliance")))
    }

    fn objection(&self, model: &Model, _: &str) -> Option<&'static str> {
        (!matches!(model, Model::BeamOnBase(_)))
            .then_some("only a beam_on_base has a beam; change the mode's frequency instead")
    }
}
