//! Lost motion.

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, SignalLaw, Step};
use super::piecewise::Beyond;
use super::trial::{Sizes, Trial};
use crate::model::Model;

/// `backlash`.
pub struct Backlash;

impl Law for Backlash {
    fn id(&self) -> &'static str {
        "backlash"
    }

    fn sentence(&self) -> &'static str {
        "Lost motion: after every reversal the driven side stays until the gap is crossed; what is lost does not depend on speed and matters most at small amplitudes."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Base, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] =
            &[ParameterSpec::size("gap", "{z}", "total lost motion between the two flanks")];
        PARAMETERS
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("gap", 0.02 * sizes.displacement)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        let half = 0.5 * given.get("gap");
        if given.moves_base {
            return Action::Motion(Box::new(Play { half, position: None }));
        }
        let beyond = Beyond { stiffness: given.stiffness, from: half, two_sided: true };
        Action::Force(Box::new(Gap { beyond }))
    }

    fn objection(&self, model: &Model, location: &str) -> Option<&'static str> {
        let motion_of_base = location == "base" && model.input_is_motion();
        let needs_spring = !motion_of_base
            && !matches!(model, Model::Lumped(lumped) if location.split_once('-').is_some_and(|(a, b)| lumped.stiffness_between(a, b) != 0.0));
        needs_spring.then_some(
            "the gap lies in the spring of a pair of bodies, or between a prescribed motion and the base; name such a pair",
        )
    }
}

/// The play operator: where the driven side is when the driver is at `value`.
struct Play {
    half: f64,
    position: Option<f64>,
}

impl SignalLaw for Play {
    fn pass(&mut self, _: f64, value: f64) -> f64 {
        // It starts in the middle of the gap.
        let before = self.position.unwrap_or(value);
        let position = before.clamp(value - self.half, value + self.half);
        self.position = Some(position);
        position
    }
}

/// Where a body rattles between two flanks, an error made when one is met grows with every rebound. A quarter
/// of the sub-step makes a sixteenth of it.
const SHORTER_STEPS: f64 = 4.0;

/// A spring that has a gap: the model's own spring is taken back inside the gap, and its offset beyond it.
struct Gap {
    beyond: Beyond,
}

impl ForceLaw for Gap {
    fn at(&self, instant: &Instant) -> Option<f64> {
        let force = || self.beyond.stiffness * instant.z + self.beyond.force_at(instant.z);
        self.beyond.stays(instant).then(force)
    }

    fn shorter_steps(&self) -> f64 {
        SHORTER_STEPS
    }

    fn force(&self, step: &Step) -> f64 {
        step.settle(|force| {
            let (from, to) = (step.z, step.z_end(force));
            self.beyond.stiffness * 0.5 * (from + to) + self.beyond.between(from, to)
        })
    }
}
