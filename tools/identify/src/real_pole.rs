//! A real pole: what a force does to a body that moves freely against viscous friction.
//!
//! A base of moved mass m that slides against friction c forgets its velocity with exp(-t c / m). A beam on
//! it feels that as one first-order response, 1 / (s + rate), beside its modes; the modes themselves then no
//! longer move in phase, which gives each a share in proportion to the rate of its coordinate
//! (docs/derivations/identification.md).

use rustfft::num_complex::Complex64;

use crate::interpolation::{PiecewiseCubic, polynomial};
use crate::modal_response::OutputQuantity;
use crate::step::StepCache;

/// The response of a real pole to a force, and its derivatives, at the same times.
pub(crate) struct RealResponse {
    /// From nothing at the input's first knot.
    pub(crate) forced: Vec<f64>,
    /// With respect to the logarithm of the rate.
    pub(crate) by_rate: Vec<f64>,
    /// With respect to time.
    pub(crate) by_time: Vec<f64>,
}

/// The response of s^n / (s + rate) to the input, n being 0 for a position, 1 for a velocity, 2 for an
/// acceleration.
pub(crate) fn real_response(
    rate_per_s: f64,
    input: &PiecewiseCubic,
    output: OutputQuantity,
    times_s: &[f64],
) -> RealResponse {
    let p = rate_per_s;
    let room = || Vec::with_capacity(times_s.len());
    let mut found = RealResponse { forced: room(), by_rate: room(), by_time: room() };
    // The state's derivative with respect to ln rate is minus the rate times that with respect to the pole.
    let mut visit = |z: f64, slope: f64, [u, du, ddu]: [f64; 3]| {
        let z_rate = -p * slope;
        let dz = u - p * z;
        let (value, by_rate, by_time) = match output {
            OutputQuantity::Position => (z, z_rate, dz),
            OutputQuantity::Velocity => (dz, -p * (z + z_rate), du - p * dz),
            OutputQuantity::Acceleration => {
                (du - p * dz, p * (p * (2.0 * z + z_rate) - u), ddu - p * (du - p * dz))
            }
        };
        found.forced.push(value);
        found.by_rate.push(by_rate);
        found.by_time.push(by_time);
    };
    let mut steps = StepCache::new(Complex64::new(-p, 0.0));
    let mut times = times_s.iter().copied().peekable();
    let (mut state, mut slope) = (Complex64::default(), Complex64::default());
    let last = input.coefficients.len().saturating_sub(1);
    for (index, (ends, c)) in input.knots_s.windows(2).zip(&input.coefficients).enumerate() {
        let (start_s, end_s) = (ends[0], ends[1]);
        while let Some(time_s) = times.next_if(|&t| t < end_s || index == last) {
            let step = steps.get(time_s - start_s);
            let (here, slope_here) = (step.advance(state, c), step.advance_slope(state, slope, c));
            visit(here.re, slope_here.re, polynomial(c, time_s - start_s));
        }
        let step = steps.get(end_s - start_s);
        (state, slope) = (step.advance(state, c), step.advance_slope(state, slope, c));
    }
    found
}

/// exp(-rate t), t counted from `origin_s`.
pub(crate) fn real_free(rate_per_s: f64, origin_s: f64, times_s: &[f64]) -> Vec<f64> {
    times_s.iter().map(|t| (-rate_per_s * (t - origin_s)).exp()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interpolation::InputInterpolation;

    fn spline(u: impl Fn(f64) -> f64) -> (PiecewiseCubic, Vec<f64>) {
        let knots: Vec<f64> = (0..60).map(|k| 0.05 * f64::from(k) + 0.01 * f64::from(k % 4)).collect();
        let samples: Vec<f64> = knots.iter().map(|&t| u(t)).collect();
        let times = (0..200).map(|k| 0.013 * f64::from(k)).collect();
        (PiecewiseCubic::new(&knots, &samples, InputInterpolation::Cubic), times)
    }

    #[test]
    fn a_parabola_gives_the_closed_form() {
        // z' = -p z + 2 t + t², from z(0) = 0: z = t²/p + k t - k/p (1 - exp(-p t)) with k = (2 - 2/p) / p.
        let (input, times) = spline(|t| 2.0 * t + t * t);
        for p in [0.05, 0.4, 1.5, 80.0] {
            let [z, dz, ddz] =
                [OutputQuantity::Position, OutputQuantity::Velocity, OutputQuantity::Acceleration]
                    .map(|output| real_response(p, &input, output, &times).forced);
            for (k, &t) in times.iter().enumerate() {
                let turn = (2.0 - 2.0 / p) / p;
                let fading = (-p * t).exp();
                let wanted = t * t / p + turn * t + turn / p * (-p * t).exp_m1();
                let size = 1.0 + (turn / p).abs() * 1e-7;
                assert!((z[k] - wanted).abs() < 1e-9 * size, "{p}: {} {wanted}", z[k]);
                assert!((dz[k] - (2.0 * t / p + turn * (1.0 - fading))).abs() < 1e-8 * size * p.max(1.0));
                assert!((ddz[k] - (2.0 / p + turn * p * fading)).abs() < 1e-7 * size * p.max(1.0).powi(2));
            }
        }
    }

    #[test]
    fn slopes_are_the_differences_of_responses() {
        let (input, times) = spline(|t| (3.0 * t + 0.8 * t * t).sin());
        let times: Vec<f64> = times.iter().map(|t| t + 0.05).collect();
        for output in [OutputQuantity::Position, OutputQuantity::Velocity, OutputQuantity::Acceleration] {
            let found = real_response(1.7, &input, output, &times);
            let h = 1e-6;
            let at = |ln_rate: f64, shift_s: f64| {
                let times: Vec<f64> = times.iter().map(|t| t + shift_s).collect();
                real_response(1.7 * ln_rate.exp(), &input, output, &times).forced
            };
            let check = |found: &[f64], up: Vec<f64>, down: Vec<f64>| {
                let size = found.iter().fold(0.0_f64, |top, v| top.max(v.abs()));
                for ((found, up), down) in found.iter().zip(&up).zip(&down) {
                    let wanted = (up - down) / (2.0 * h);
                    assert!((found - wanted).abs() < 1e-5 * size, "{output:?}: {found} {wanted}");
                }
            };
            check(&found.by_rate, at(h, 0.0), at(-h, 0.0));
            check(&found.by_time, at(0.0, h), at(0.0, -h));
        }
    }
}
