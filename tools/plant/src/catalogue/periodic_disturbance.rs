//! A periodic force from outside.

use std::f64::consts::TAU;

use std::f64::consts::FRAC_PI_2;

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::small_angles::sine_over_angle;
use super::trial::{Sizes, Trial};

/// `periodic_disturbance`.
pub struct PeriodicDisturbance;

impl Law for PeriodicDisturbance {
    fn id(&self) -> &'static str {
        "periodic_disturbance"
    }

    fn sentence(&self) -> &'static str {
        "Something else shakes the plant with a frequency of its own, A sin(2 pi f t + phase): a line in the residual that follows no order of the command."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Environment]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            ParameterSpec::size("force", "{F}", "amplitude"),
            ParameterSpec::scale("frequency", "Hz", 10.0, "its frequency"),
            ParameterSpec {
                lower: -7.0,
                upper: 7.0,
                ..ParameterSpec::signed("phase", "rad", "phase at time zero")
            },
        ];
        PARAMETERS
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        let wave = |hz: &f64| {
            [0.0, FRAC_PI_2]
                .map(|phase| Trial::of("force", sizes.force).at("frequency", *hz).at("phase", phase))
        };
        sizes.peaks_hz.iter().flat_map(wave).collect()
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Shaker {
            force: given.get("force"),
            omega_rad_s: TAU * given.get("frequency"),
            phase: given.get("phase"),
        }))
    }
}

struct Shaker {
    force: f64,
    omega_rad_s: f64,
    phase: f64,
}

impl ForceLaw for Shaker {
    fn at(&self, instant: &Instant) -> Option<f64> {
        Some(self.force * (self.omega_rad_s * instant.time_s + self.phase).sin())
    }

    fn force(&self, step: &Step) -> f64 {
        let half = 0.5 * self.omega_rad_s * step.step_s;
        let middle = self.omega_rad_s * (step.time_s + 0.5 * step.step_s) + self.phase;
        // Mean of the sine over the step.
        self.force * middle.sin() * sine_over_angle(half)
    }
}
