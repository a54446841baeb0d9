//! Dry friction with the Stribeck effect.

use super::dry::{dry_force, sliding_force};
use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::trial::{Sizes, Trial};

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

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        let at = |share: f64| {
            let force = Trial::of("force", sizes.force).at("velocity", share * sizes.velocity);
            let static_force = ("static_force", 1.5 * sizes.force);
            Trial { amplitudes: [force.amplitudes, vec![static_force]].concat(), shapes: force.shapes }
        };
        [0.1, 0.3].map(at).to_vec()
    }

    fn ranges(&self, sizes: &Sizes<'_>) -> Vec<(&'static str, f64, f64)> {
        vec![("velocity", 1e-3 * sizes.velocity, 3.0 * sizes.velocity)]
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
