//! A further mode.

use super::law::{Action, Given, Law, ParameterSpec, Place, Structure};
use super::trial::{Sizes, Trial};
use crate::model::Model;
use crate::modes::Mode;

/// `extra_mode`.
pub struct ExtraMode;

/// What swings less often during the longest recording is a drift and no mode.
const FEWEST_PERIODS: f64 = 2.0;

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

    fn is_of_the_whole(&self) -> bool {
        true
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        let rings =
            |hz: &f64| Trial::of("participation", 0.01).at("frequency", *hz).at("damping_ratio", 0.01);
        sizes.peaks_hz.iter().map(rings).collect()
    }

    fn ranges(&self, sizes: &Sizes<'_>) -> Vec<(&'static str, f64, f64)> {
        vec![("frequency", FEWEST_PERIODS / sizes.longest_s, f64::INFINITY), ("damping_ratio", 1e-5, 0.5)]
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_swings_less_than_twice_in_the_longest_recording_is_no_mode() {
        let ranges = ExtraMode.ranges(&Sizes { longest_s: 20.0, ..Sizes::default() });
        let (name, least_hz, _) = ranges[0];
        assert_eq!(name, "frequency");
        assert!((least_hz * 20.0 - 2.0).abs() < 1e-9, "{least_hz} Hz in 20 s");
    }
}
