//! Dry friction with the Stribeck effect.

use super::dry::{dry_force, sliding_force};
use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};

/// `stribeck_friction`.
pub struct StribeckFriction;

impl Law for StribeckFriction {
    fn id(&self) -> &'static str {
        "stribeck_friction"
    }

    fn sentence(&self) -> &'static str {
        "Dry friction that is greater at rest and falls with speed, F(v) = Fc + (Fs - Fc) exp(-(v/vs)^2): motion starts with a jump and sticks at low speed."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Base, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            ParameterSpec::size("force", "{F}", "sliding force at high speed"),
            ParameterSpec::size(
                "static_force",
                "{F}",
                "force that holds at rest; the sliding force if it is less",
            ),
            ParameterSpec::scale("velocity", "{z}/s", 0.01, "speed at which the excess has fallen to 37 %"),
        ];
        PARAMETERS
    }

    fn is_dissipative(&self) -> bool {
        true
    }

    fn action(&self, given: &Given<'_>) -> Action {
        let force = given.get("force");
        Action::Force(Box::new(Stribeck {
            force,
            holding: given.get("static_force").max(force),
            velocity: given.get("velocity"),
        }))
    }
}

struct Stribeck {
    force: f64,
    holding: f64,
    velocity: f64,
}

impl Stribeck {
    /// Friction of sliding at a speed.
    fn kinetic(&self, speed: f64) -> f64 {
        self.force + (self.holding - self.force) * (-(speed / self.velocity).powi(2)).exp()
    }
}

impl ForceLaw for Stribeck {
    fn at(&self, instant: &Instant) -> Option<f64> {
        sliding_force(instant, |_, speed| self.kinetic(speed), |_| self.holding)
    }

    fn force(&self, step: &Step) -> f64 {
        dry_force(step, |_, speed| self.kinetic(speed), |_| self.holding)
    }
}
