//! Readings in steps.

use std::f64::consts::PI;

use super::law::{Action, Given, Law, ParameterSpec, Place, SensorAction};
use super::trial::{Sizes, Trial};

/// `quantisation`.
pub struct Quantisation;

impl Law for Quantisation {
    fn id(&self) -> &'static str {
        "quantisation"
    }

    fn sentence(&self) -> &'static str {
        "Readings are multiples of a step: the residual is spread evenly within half a step, and small motions vanish."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Sensor]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            ParameterSpec::size("step", "{y}", "distance of neighbouring readings"),
            ParameterSpec::size(
                "dither",
                "{y}",
                "noise before the rounding, rms; above 0 the reading is the mean over it",
            ),
        ];
        PARAMETERS
    }

    fn is_read_off(&self) -> bool {
        true
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        // What the noise before the rounding leaves of the step.
        let of = |step: f64| {
            [0.05, 0.15, 0.25, 0.4].map(|share| Trial::default().at("step", step).at("dither", share * step))
        };
        sizes.reading_step.into_iter().flat_map(of).collect()
    }

    fn action(&self, given: &Given<'_>) -> Action {
        let (step, dither) = (given.get("step"), given.get("dither"));
        Action::Sensor(SensorAction::Electronics(Box::new(move |reading| {
            if step > 0.0 { rounded(reading / step, dither / step) * step } else { reading }
        })))
    }
}

/// Below this share of a step noise does not change what is read.
const NO_DITHER: f64 = 0.02;

/// A reading in steps, rounded; with noise of `dither` steps before the rounding its mean, the Fourier series
/// of the rounding's error weakened term by term: `x + Σ (−1)^k sin(2πkx) e^{−2(πkσ)²}/(πk)`.
fn rounded(x: f64, dither: f64) -> f64 {
    if dither < NO_DITHER {
        return x.round();
    }
    let mut sum = 0.0;
    for k in 1..=60_u32 {
        let order = PI * f64::from(k);
        let share = (-2.0 * (order * dither).powi(2)).exp() / order;
        if share < 1e-12 {
            break;
        }
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        sum += sign * share * (2.0 * order * x).sin();
    }
    x + sum
}

#[cfg(test)]
mod tests {
    use super::rounded;

    /// Against the mean over a fine grid of normally distributed noise.
    #[test]
    fn dither_makes_the_mean_over_the_noise() {
        for dither in [0.03, 0.1, 0.25, 0.6] {
            for x in [0.0, 0.13, 0.49, 0.77, -1.31] {
                let (mut sum, mut weight) = (0.0, 0.0);
                for k in -40_000..=40_000 {
                    let z = f64::from(k) / 5000.0;
                    let density = (-0.5 * z * z).exp();
                    sum += density * (x + dither * z).round();
                    weight += density;
                }
                let error = rounded(x, dither) - sum / weight;
                assert!(error.abs() < 2e-4, "{x} with {dither}: {error}");
            }
        }
    }
}
