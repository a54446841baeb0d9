//! A further mode.

use super::law::{Action, Given, Law, ParameterSpec, Place, Structure};
use crate::model::Model;
use crate::modes::Mode;

/// `extra_mode`.
pub struct ExtraMode;

impl Law for ExtraMode {
    fn id(&self) -> &'static str {
        "extra_mode"
    }

    fn sentence(&self) -> &'static str {
        "A mode that the model does not have, of a stand, a twist or a cable: ringing at a frequency of its own that no other parameter can make."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Beam, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            ParameterSpec::scale("frequency", "Hz", 20.0, "undamped natural frequency"),
            ParameterSpec {
                upper: 0.999,
                default: 0.01,
                ..ParameterSpec::size("damping_ratio", "", "its damping ratio")
            },
            ParameterSpec::signed("participation", "", "what the first output sees of it"),
        ];
        PARAMETERS
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Structure(Structure::Mode(Mode {
            frequency_hz: given.get("frequency"),
            damping_ratio: given.get("damping_ratio"),
            participation: vec![given.get("participation")],
        }))
    }

    fn objection(&self, model: &Model, _: &str) -> Option<&'static str> {
        matches!(model, Model::Lumped(_))
            .then_some("in a lumped model a further mode is a further body; add one")
    }
}
