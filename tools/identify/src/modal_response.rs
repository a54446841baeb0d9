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

impl Transfer {
    fn new(pole: Pole, input: InputKind, output: OutputQuantity) -> Self {
        let lambda = pole.lambda();
        let (sign, input_order) = match input {
            InputKind::Force => (1.0, 0),
            InputKind::BasePosition => (-1.0, 2),
            InputKind::BaseAcceleration => (-1.0, 0),
        };
        let order = input_order
            + match output {
                OutputQuantity::Position => 0,
                OutputQuantity::Velocity => 1,
                OutputQuantity::Acceleration => 2,
            };
        let residue = lambda.powi(order) / Complex64::new(0.0, 2.0 * lambda.im);
        // Quotient of s^order by s² + 2 zeta omega s + omega².
        let a = 2.0 * pole.damping_ratio * pole.omega();
        let b = pole.omega() * pole.omega();
        let direct = match order {
            2 => [1.0, 0.0, 0.0],
            3 => [-a, 1.0, 0.0],
            4 => [a * a - b, -a, 1.0],
            _ => [0.0; 3],
        };
        Self { lambda, residue: residue * sign, direct: direct.map(|factor| factor * sign) }
    }
}

/// The response of a mode of unit participation, starting from nothing, at increasing times within the input.
pub(crate) fn forced_response(
    pole: Pole,
    input: &PiecewiseCubic,
    input_kind: InputKind,
    output: OutputQuantity,
    times_s: &[f64],
) -> Vec<f64> {
    let transfer = Transfer::new(pole, input_kind, output);
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
            let direct: f64 = transfer.direct.iter().zip(u).map(|(d, u)| d * u).sum();
            response.push(2.0 * (transfer.residue * here).re + direct);
        }
        state = steps.get(end_s - start_s).advance(state, c);
    }
    response
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

/// What one step of length h does: z becomes exp(lambda h) z plus the integrals of the input's powers.
#[derive(Clone, Copy)]
struct Step {
    length_s: f64,
    decay: Complex64,
    /// Integral over 0..h of exp(lambda (h - t)) t^j, for j = 0..3.
    moments: [Complex64; 4],
}

impl Step {
    fn new(lambda: Complex64, h: f64) -> Self {
        let x = lambda * h;
        let decay = x.exp();
        let mut moments = [Complex64::new(0.0, 0.0); 4];
        let powers = [1.0, h, h * h, h * h * h];
        if x.norm() < 1.0 {
            // j = 3 by its series h^4 * sum of x^m 3!/(m+4)!, the others downwards: both are free of cancellation.
            let mut term = Complex64::new(0.25, 0.0);
            let mut sum = term;
            for m in 1..20 {
                term *= x / f64::from(m + 4);
                sum += term;
            }
            moments[3] = sum * powers[3] * h;
            for j in (1..4).rev() {
                moments[j - 1] = (lambda * moments[j] + powers[j]) / j as f64;
            }
        } else {
            moments[0] = (decay - 1.0) / lambda;
            for j in 1..4 {
                moments[j] = (moments[j - 1] * j as f64 - powers[j]) / lambda;
            }
        }
        Self { length_s: h, decay, moments }
    }

    fn advance(&self, state: Complex64, c: &[f64; 4]) -> Complex64 {
        let [m0, m1, m2, m3] = self.moments;
        self.decay * state + m0 * c[0] + m1 * c[1] + m2 * c[2] + m3 * c[3]
    }
}

/// The few step lengths that occur again and again in a record, even when its stamps were rounded.
struct StepCache {
    lambda: Complex64,
    steps: [Option<Step>; 4],
    next: usize,
}

/// Steps that differ by less than this share are the same: the stamps' own rounding is of that size.
const SAME_STEP: f64 = 1e-9;

impl StepCache {
    fn new(lambda: Complex64) -> Self {
        Self { lambda, steps: [None; 4], next: 0 }
    }

    fn get(&mut self, h: f64) -> Step {
        let same = |step: &&Step| (step.length_s - h).abs() <= SAME_STEP * h.abs();
        if let Some(step) = self.steps.iter().flatten().find(same) {
            return *step;
        }
        let step = Step::new(self.lambda, h);
        self.steps[self.next] = Some(step);
        self.next = (self.next + 1) % self.steps.len();
        step
    }
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
            let force = forced_response(pole, &spline, InputKind::Force, output, &times);
            let wanted = runge_kutta(pole, u, &times);
            for (found, wanted) in force.iter().zip(&wanted) {
                assert!((found - wanted[order]).abs() < 1e-9, "force: {found} {}", wanted[order]);
            }
            // Base motion that begins with a speed: the position form differs from the acceleration form by a
            // free response, which is q(0) = -u(0), q'(0) = -u'(0) seen by the state that starts from nothing.
            let base = forced_response(pole, &spline, InputKind::BasePosition, output, &times);
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
    fn step_moments_join_where_the_series_hands_over() {
        for angle in [1.6, 2.0, 2.5, 3.0] {
            let lambda = Complex64::from_polar(7.0, angle);
            let (inside, outside) =
                (Step::new(lambda, (1.0 - 1e-12) / 7.0), Step::new(lambda, (1.0 + 1e-12) / 7.0));
            for (a, b) in inside.moments.iter().zip(outside.moments) {
                assert!((a - b).norm() < 1e-11 * b.norm());
            }
        }
    }
}
