//! The response of one mode to a sampled input, exact for a piecewise-cubic input.
//!
//! With the pole lambda = -zeta omega + i omega_d, 1/(s² + 2 zeta omega s + omega²) is the sum of
//! 1/(2 i omega_d) / (s - lambda) and its conjugate, so one complex first-order recursion
//! z' = lambda z + u serves every input and output: s^n times it has residue lambda^n / (2 i omega_d) and,
//! from n = 2 on, direct terms in u and its derivatives. Base motion is minus s² on the base's *position*:
//! the mode follows without the recorded position ever being differentiated.

use rustfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};

use crate::interpolation::{PiecewiseCubic, polynomial};
use crate::step::StepCache;

/// What the recorded input is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InputKind {
    /// A force on the structure: s(t) = force.
    Force,
    /// The position of the moving base, in metres: s(t) = minus its acceleration.
    BasePosition,
    /// The acceleration of the moving base, in m/s²: s(t) = minus it.
    BaseAcceleration,
}

/// What the output is of the modal coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OutputQuantity {
    /// Displacement.
    Position,
    /// Its first derivative.
    Velocity,
    /// Its second derivative.
    Acceleration,
}

/// Frequency and damping of an underdamped mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pole {
    /// Undamped natural frequency, Hz.
    pub(crate) frequency_hz: f64,
    /// Fraction of critical damping, below 1.
    pub(crate) damping_ratio: f64,
}

impl Pole {
    pub(crate) fn omega(self) -> f64 {
        std::f64::consts::TAU * self.frequency_hz
    }

    /// -zeta omega + i omega sqrt(1 - zeta²), rad/s.
    pub(crate) fn lambda(self) -> Complex64 {
        let zeta = self.damping_ratio;
        Complex64::new(-zeta, (1.0 - zeta * zeta).sqrt()) * self.omega()
    }

    /// Derivatives of lambda with respect to the logarithms of frequency and damping ratio.
    pub(crate) fn lambda_slopes(self) -> [Complex64; 2] {
        let zeta = self.damping_ratio;
        let damping = Complex64::new(-1.0, -zeta / (1.0 - zeta * zeta).sqrt()) * (zeta * self.omega());
        [self.lambda(), damping]
    }

    /// Time for the amplitude to fall by e, seconds.
    pub(crate) fn decay_time_s(self) -> f64 {
        1.0 / (self.damping_ratio * self.omega())
    }
}

/// The transfer from a recorded input to a recorded quantity of one mode, as residue and direct terms.
struct Transfer {
    lambda: Complex64,
    residue: Complex64,
    /// Factors of the input, its first and its second derivative.
    direct: [f64; 3],
}

/// What lies between a recorded input and what is wanted of a mode: s to a power, with a sign.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Path {
    /// Minus for motions of the base.
    sign: f64,
    /// The power of s.
    order: i32,
}

impl Path {
    pub(crate) fn new(input: InputKind, output: OutputQuantity) -> Self {
        let (sign, input_order) = match input {
            InputKind::Force => (1.0, 0),
            InputKind::BasePosition => (-1.0, 2),
            InputKind::BaseAcceleration => (-1.0, 0),
        };
        let output_order = match output {
            OutputQuantity::Position => 0,
            OutputQuantity::Velocity => 1,
            OutputQuantity::Acceleration => 2,
        };
        Self { sign, order: input_order + output_order }
    }

    /// The rate of what is wanted; up to the fourth power of s.
    pub(crate) fn differentiated(self) -> Self {
        Self { order: (self.order + 1).min(4), ..self }
    }
}

impl Transfer {
    fn new(pole: Pole, path: Path) -> Self {
        let lambda = pole.lambda();
        let Path { sign, order } = path;
        let residue = lambda.powi(order) / Complex64::new(0.0, 2.0 * lambda.im);
        // Quotient of s^order by s² + a s + b.
        let (a, b) = (2.0 * pole.damping_ratio * pole.omega(), pole.omega().powi(2));
        let direct = match order {
            2 => [1.0, 0.0, 0.0],
            3 => [-a, 1.0, 0.0],
            4 => [a * a - b, -a, 1.0],
            _ => [0.0; 3],
        };
        Self { lambda, residue: residue * sign, direct: direct.map(|factor| factor * sign) }
    }

    /// Derivatives of residue and direct terms with respect to ln f (index 0) or ln zeta (1).
    fn slope(&self, pole: Pole, index: usize, path: Path) -> Self {
        let lambda = self.lambda;
        let turn = pole.lambda_slopes()[index.min(1)];
        let Path { sign, order } = path;
        let residue = self.residue * (turn / lambda * f64::from(order) - turn.im / lambda.im);
        let (a, b) = (2.0 * pole.damping_ratio * pole.omega(), pole.omega().powi(2));
        // a is proportional to both f and zeta, b to f².
        let slope_of_b = if index == 0 { 2.0 * b } else { 0.0 };
        let direct = match order {
            3 => [-a, 0.0, 0.0],
            4 => [2.0 * a * a - slope_of_b, -a, 0.0],
            _ => [0.0; 3],
        };
        Self { lambda: turn, residue, direct: direct.map(|factor| factor * sign) }
    }
}

/// The response of a mode of unit participation, starting from nothing, at increasing times within the input.
pub(crate) fn forced_response(pole: Pole, input: &PiecewiseCubic, path: Path, times_s: &[f64]) -> Vec<f64> {
    let transfer = Transfer::new(pole, path);
    let mut steps = StepCache::new(transfer.lambda);
    let mut response = Vec::with_capacity(times_s.len());
    let mut times = times_s.iter().copied().peekable();
    let mut state = Complex64::new(0.0, 0.0);
    let last = input.coefficients.len().saturating_sub(1);
    for (index, (ends, c)) in input.knots_s.windows(2).zip(&input.coefficients).enumerate() {
        let (start_s, end_s) = (ends[0], ends[1]);
        while let Some(time_s) = times.next_if(|&t| t < end_s || index == last) {
            let s = time_s - start_s;
            let here = if s == 0.0 { state } else { steps.get(s).advance(state, c) };
            let u = polynomial(c, s);
            response.push(2.0 * (transfer.residue * here).re + direct_part(transfer.direct, &u));
        }
        state = steps.get(end_s - start_s).advance(state, c);
    }
    response
}

/// What rings in the response of a mode to an input at even instants, `step_s` apart, from nothing: the
/// response without what follows the input at once. Between its samples the input is a cubic through four.
pub(crate) fn ringing_on_grid(pole: Pole, path: Path, input: &[f64], step_s: f64) -> Vec<f64> {
    let transfer = Transfer::new(pole, path);
    let mut steps = StepCache::new(transfer.lambda);
    let step = *steps.get(step_s);
    let (h, still) = (step_s, Complex64::new(0.0, 0.0));
    // Lagrange's polynomials on -h, 0, h and 2 h.
    let [cube, square] = [h.powi(3), h * h];
    let shares = [
        [0.0, -1.0 / (3.0 * h), 0.5 / square, -1.0 / (6.0 * cube)],
        [1.0, -0.5 / h, -1.0 / square, 0.5 / cube],
        [0.0, 1.0 / h, 0.5 / square, -0.5 / cube],
        [0.0, -1.0 / (6.0 * h), 0.0, 1.0 / (6.0 * cube)],
    ]
    .map(|c| step.advance(still, &c));
    let last = input.len().saturating_sub(1);
    let mut state = still;
    (0..input.len())
        .map(|k| {
            let here = 2.0 * (transfer.residue * state).re;
            let around =
                [input[k.saturating_sub(1)], input[k], input[(k + 1).min(last)], input[(k + 2).min(last)]];
            state *= step.decay;
            shares.iter().zip(around).for_each(|(share, u)| state += share * u);
            here
        })
        .collect()
}

/// The two free responses exp(-zeta omega t) times cosine and sine of omega_d t, t counted from `origin_s`.
pub(crate) fn free_response(pole: Pole, origin_s: f64, times_s: &[f64]) -> [Vec<f64>; 2] {
    let mut steps = StepCache::new(pole.lambda());
    let mut previous_s = origin_s;
    let mut state = Complex64::new(1.0, 0.0);
    times_s
        .iter()
        .map(|&time_s| {
            if time_s != previous_s {
                state *= steps.get(time_s - previous_s).decay;
                previous_s = time_s;
            }
            (state.re, state.im)
        })
        .unzip::<f64, f64, Vec<f64>, Vec<f64>>()
        .into()
}

/// Derivatives of [`forced_response`] times one factor, at the same times.
pub(crate) struct ForcedSlopes {
    /// With respect to the logarithm of the frequency and of the damping ratio.
    pub(crate) by_pole: [Vec<f64>; 2],
    /// With respect to time.
    pub(crate) by_time: Vec<f64>,
}

/// The derivatives of a mode's forced response, all in one pass.
pub(crate) fn forced_slopes(pole: Pole, input: &PiecewiseCubic, path: Path, times_s: &[f64]) -> ForcedSlopes {
    let transfer = Transfer::new(pole, path);
    let turns = pole.lambda_slopes();
    let slopes = [0, 1].map(|index| transfer.slope(pole, index, path));
    let mut found = ForcedSlopes {
        by_pole: [0, 1].map(|_| Vec::with_capacity(times_s.len())),
        by_time: Vec::with_capacity(times_s.len()),
    };
    let mut visit = |state: Complex64, state_slope: Complex64, u: [f64; 4]| {
        for ((values, slope), turn) in found.by_pole.iter_mut().zip(&slopes).zip(turns) {
            let ringing = slope.residue * state + transfer.residue * state_slope * turn;
            values.push(2.0 * ringing.re + direct_part(slope.direct, &u));
        }
        let rate = transfer.residue * (transfer.lambda * state + u[0]);
        found.by_time.push(2.0 * rate.re + direct_part(transfer.direct, &u[1..]));
    };

    let mut steps = StepCache::new(transfer.lambda);
    let mut times = times_s.iter().copied().peekable();
    let (mut state, mut state_slope) = (Complex64::default(), Complex64::default());
    let last = input.coefficients.len().saturating_sub(1);
    for (index, (ends, c)) in input.knots_s.windows(2).zip(&input.coefficients).enumerate() {
        let (start_s, end_s) = (ends[0], ends[1]);
        while let Some(time_s) = times.next_if(|&t| t < end_s || index == last) {
            let s = time_s - start_s;
            let (here, slope) = match s {
                0.0 => (state, state_slope),
                _ => {
                    let step = steps.get(s);
                    (step.advance(state, c), step.advance_slope(state, state_slope, c))
                }
            };
            let [u, du, ddu] = polynomial(c, s);
            visit(here, slope, [u, du, ddu, 6.0 * c[3]]);
        }
        let step = steps.get(end_s - start_s);
        (state, state_slope) = (step.advance(state, c), step.advance_slope(state, state_slope, c));
    }
    found
}

fn direct_part(direct: [f64; 3], u: &[f64]) -> f64 {
    direct.iter().zip(u).map(|(d, u)| d * u).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interpolation::InputInterpolation;

    /// q'' + 2 zeta omega q' + omega² q = s by fine Runge-Kutta steps; returns q, q', q'' at the times.
    fn runge_kutta(pole: Pole, s: impl Fn(f64) -> f64, times_s: &[f64]) -> Vec<[f64; 3]> {
        let (w, z) = (pole.omega(), pole.damping_ratio);
        let rate = |t: f64, q: [f64; 2]| [q[1], s(t) - 2.0 * z * w * q[1] - w * w * q[0]];
        let add = |q: [f64; 2], d: [f64; 2], h: f64| [q[0] + h * d[0], q[1] + h * d[1]];
        let mut q = [0.0; 2];
        let mut t = times_s[0];
        let mut out = Vec::new();
        for &end in times_s {
            let n = ((end - t) / 2e-4).ceil().max(1.0);
            let h = (end - t) / n;
            for _ in 0..n as usize {
                let k1 = rate(t, q);
                let k2 = rate(t + h / 2.0, add(q, k1, h / 2.0));
                let k3 = rate(t + h / 2.0, add(q, k2, h / 2.0));
                let k4 = rate(t + h, add(q, k3, h));
                for i in 0..2 {
                    q[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
                }
                t += h;
            }
            t = end;
            out.push([q[0], q[1], rate(t, q)[1]]);
        }
        out
    }

    #[test]
    fn a_cubic_input_gives_the_exact_response_on_uneven_stamps() {
        let pole = Pole { frequency_hz: 1.3, damping_ratio: 0.04 };
        let u = |t: f64| 0.4 * t - 0.9 * t * t + 0.3 * t * t * t;
        let acceleration = |t: f64| -1.8 + 1.8 * t;
        let knots: Vec<f64> = (0..40).map(|k| 0.05 * f64::from(k) + 0.01 * f64::from(k % 4)).collect();
        let samples: Vec<f64> = knots.iter().map(|&t| u(t)).collect();
        let spline = PiecewiseCubic::new(&knots, &samples, InputInterpolation::Cubic);
        let times: Vec<f64> = (0..150).map(|k| 0.013 * f64::from(k)).collect();
        let outputs = [OutputQuantity::Position, OutputQuantity::Velocity, OutputQuantity::Acceleration];
        for (order, output) in outputs.into_iter().enumerate() {
            let force = forced_response(pole, &spline, Path::new(InputKind::Force, output), &times);
            let wanted = runge_kutta(pole, u, &times);
            for (found, wanted) in force.iter().zip(&wanted) {
                assert!((found - wanted[order]).abs() < 1e-9, "force: {found} {}", wanted[order]);
            }
            // Base motion that begins with a speed: the position form differs from the acceleration form by a
            // free response, which is q(0) = -u(0), q'(0) = -u'(0) seen by the state that starts from
            // nothing.
            let base = forced_response(pole, &spline, Path::new(InputKind::BasePosition, output), &times);
            let wanted = runge_kutta(pole, |t| -acceleration(t), &times);
            let [cosine, sine] = free_response(pole, 0.0, &times);
            let difference: Vec<f64> = base.iter().zip(&wanted).map(|(b, w)| b - w[order]).collect();
            let mut basis = crate::tall::Orthonormal::default();
            basis.push(cosine);
            basis.push(sine);
            let mut rest = difference;
            basis.remove_from(&mut rest);
            assert!(rest.iter().all(|value| value.abs() < 1e-8), "base motion, order {order}");
        }
    }

    #[test]
    fn slopes_are_the_differences_of_responses() {
        let knots: Vec<f64> = (0..200).map(|k| 0.02 * f64::from(k) + 0.004 * f64::from(k % 3)).collect();
        let samples: Vec<f64> = knots.iter().map(|t| (3.0 * t + 0.8 * t * t).sin()).collect();
        let spline = PiecewiseCubic::new(&knots, &samples, InputInterpolation::Cubic);
        let times: Vec<f64> = (0..300).map(|k| 0.05 + 0.012 * f64::from(k)).collect();
        let base = Pole { frequency_hz: 1.7, damping_ratio: 0.03 };
        for kind in [InputKind::Force, InputKind::BasePosition, InputKind::BaseAcceleration] {
            for quantity in [OutputQuantity::Position, OutputQuantity::Velocity, OutputQuantity::Acceleration]
            {
                let slopes = forced_slopes(base, &spline, Path::new(kind, quantity), &times);
                let response = |f: f64, zeta: f64, shift: f64| {
                    let pole = Pole { frequency_hz: 1.7 * f.exp(), damping_ratio: 0.03 * zeta.exp() };
                    let times: Vec<f64> = times.iter().map(|t| t + shift).collect();
                    forced_response(pole, &spline, Path::new(kind, quantity), &times)
                };
                let h = 1e-6;
                let check = |found: &[f64], up: Vec<f64>, down: Vec<f64>| {
                    let size = found.iter().fold(0.0_f64, |top, v| top.max(v.abs()));
                    for ((found, up), down) in found.iter().zip(&up).zip(&down) {
                        let wanted = (up - down) / (2.0 * h);
                        assert!(
                            (found - wanted).abs() < 1e-5 * size,
                            "{kind:?} {quantity:?}: {found} {wanted}"
                        );
                    }
                };
                check(&slopes.by_pole[0], response(h, 0.0, 0.0), response(-h, 0.0, 0.0));
                check(&slopes.by_pole[1], response(0.0, h, 0.0), response(0.0, -h, 0.0));
                check(&slopes.by_time, response(0.0, 0.0, h), response(0.0, 0.0, -h));
            }
        }
    }
}
