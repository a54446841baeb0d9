//! Friction that differs with the direction.

use super::dry::{dry_force, sliding_force};
use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::trial::{Sizes, Trial};

/// `asymmetric_friction`.
pub struct AsymmetricFriction;

impl Law for AsymmetricFriction {
    fn id(&self) -> &'static str {
        "asymmetric_friction"
    }

    fn sentence(&self) -> &'static str {
        "Friction that differs with the direction, dry and viscous: strokes there and back need different forces, and even orders appear."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Base, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            ParameterSpec::size(
                "force_forward",
                "{F}",
                "dry friction against motion in the positive direction",
            ),
            ParameterSpec::size(
                "force_backward",
                "{F}",
                "dry friction against motion in the negative direction",
            ),
            ParameterSpec::size("viscous_forward", "{F}·s/{z}", "viscous friction in the positive direction"),
            ParameterSpec::size(
                "viscous_backward",
                "{F}·s/{z}",
                "viscous friction in the negative direction",
            ),
        ];
        PARAMETERS
    }

    fn is_dissipative(&self) -> bool {
        true
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        let without_viscous = |trial: Trial| trial.at("viscous_forward", 0.0).at("viscous_backward", 0.0);
        let one_way = |name: &'static str, other: &'static str| {
            without_viscous(Trial::of(name, sizes.force).at(other, 0.0))
        };
        let both = Trial {
            amplitudes: vec![("force_forward", sizes.force), ("force_backward", 0.7 * sizes.force)],
            shapes: Vec::new(),
        };
        vec![
            one_way("force_forward", "force_backward"),
            one_way("force_backward", "force_forward"),
            without_viscous(both),
        ]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Asymmetric {
            dry: [given.get("force_backward"), given.get("force_forward")],
            viscous: [given.get("viscous_backward"), given.get("viscous_forward")],
        }))
    }
}

/// Backward, forward.
struct Asymmetric {
    dry: [f64; 2],
    viscous: [f64; 2],
}

impl Asymmetric {
    /// Friction of sliding in a direction (±1) at a speed.
    fn kinetic(&self, direction: f64, speed: f64) -> f64 {
        let side = usize::from(direction > 0.0);
        self.dry[side] + self.viscous[side] * speed
    }

    /// What holds against a motion in a direction.
    fn holding(&self, direction: f64) -> f64 {
        self.dry[usize::from(direction > 0.0)]
    }
}

impl ForceLaw for Asymmetric {
    fn at(&self, instant: &Instant) -> Option<f64> {
        sliding_force(
            instant,
            |direction, speed| self.kinetic(direction, speed),
            |direction| self.holding(direction),
        )
    }

    fn force(&self, step: &Step) -> f64 {
        dry_force(
            step,
            |direction, speed| self.kinetic(direction, speed),
            |direction| self.holding(direction),
        )
    }
}
