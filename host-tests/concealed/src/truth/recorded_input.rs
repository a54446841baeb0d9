//! An input as far as its recording tells it: the cubic spline through its samples.
//!
//! With x_k'' = m_k at the samples, h apart, the spline is twice continuously differentiable where
//! m_{k-1} + 4 m_k + m_{k+1} = 6 (x_{k-1} - 2 x_k + x_{k+1}) / h², and it begins and ends without curvature
//! (C. de Boor, A Practical Guide to Splines, Springer 1978, chapter IV).

use super::jet::Jet;

/// A signal known at evenly spaced samples.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedInput {
    interval_s: f64,
    samples: Vec<f64>,
    /// Second derivative at the samples.
    bends: Vec<f64>,
}

impl RecordedInput {
    /// Through samples from time 0 on; `None` for fewer than two or a rate that is not positive.
    pub fn through(samples: &[f64], rate_hz: f64) -> Option<Self> {
        if samples.len() < 2 || rate_hz.is_nan() || rate_hz <= 0.0 {
            return None;
        }
        let interval_s = 1.0 / rate_hz;
        let bends = bends(samples, interval_s);
        Some(Self { interval_s, samples: samples.to_vec(), bends })
    }

    /// Value and derivatives; outside the recording the value at its nearer end.
    pub fn at(&self, time_s: f64) -> Jet {
        let last = self.samples.len() - 1;
        let place = time_s / self.interval_s;
        if place <= 0.0 {
            return Jet::constant(self.samples[0]);
        }
        if place >= last as f64 {
            return Jet::constant(self.samples[last]);
        }
        let k = (place.floor() as usize).min(last - 1);
        let (h, s) = (self.interval_s, place - k as f64);
        let r = 1.0 - s;
        let ([from, to], [a, b]) =
            ([self.samples[k], self.samples[k + 1]], [self.bends[k], self.bends[k + 1]]);
        Jet {
            value: r * from + s * to + h * h / 6.0 * ((r * r * r - r) * a + (s * s * s - s) * b),
            rate: (to - from) / h + h / 6.0 * ((1.0 - 3.0 * r * r) * a + (3.0 * s * s - 1.0) * b),
            bend: r * a + s * b,
        }
    }
}

/// Second derivatives at the samples: the tridiagonal system, eliminated from the front.
fn bends(samples: &[f64], interval_s: f64) -> Vec<f64> {
    let mut bends = vec![0.0; samples.len()];
    let mut shares = vec![0.0; samples.len()];
    for k in 1..samples.len() - 1 {
        let curvature = 6.0 * (samples[k - 1] - 2.0 * samples[k] + samples[k + 1]) / interval_s.powi(2);
        let pivot = 4.0 - shares[k - 1];
        shares[k] = 1.0 / pivot;
        bends[k] = (curvature - bends[k - 1]) / pivot;
    }
    for k in (1..samples.len() - 1).rev() {
        bends[k] -= shares[k] * bends[k + 1];
    }
    bends
}

#[cfg(test)]
mod tests {
    use super::super::excitation::{Excitation, Shape};
    use super::*;

    fn sampled(signal: impl Fn(f64) -> f64, rate_hz: f64, count: usize) -> RecordedInput {
        let samples: Vec<f64> = (0..=count).map(|k| signal(k as f64 / rate_hz)).collect();
        RecordedInput::through(&samples, rate_hz).unwrap()
    }

    #[test]
    fn a_curve_without_curvature_at_its_ends_is_met_with_its_derivatives() {
        // x'' = 12 t² - 12 t is nothing at 0 and at 1; a spline is right to the fourth order of the interval.
        let x = |t: f64| t * t * t * (t - 2.0) + t;
        let input = sampled(x, 200.0, 200);
        for k in 1..97 {
            let t = k as f64 / 97.0;
            let jet = input.at(t);
            assert!((jet.value - x(t)).abs() < 1e-9, "{t}");
            assert!((jet.rate - (4.0 * t.powi(3) - 6.0 * t * t + 1.0)).abs() < 1e-6, "{t}");
            assert!((jet.bend - 12.0 * (t * t - t)).abs() < 1e-3, "{t}");
        }
    }

    #[test]
    fn a_sweep_to_nine_hertz_sampled_at_a_hundred_is_known_to_a_thousandth() {
        let shape = Shape::Sweep { from_hz: 0.5, to_hz: 9.0, exponential: true };
        let sweep = Excitation { shape, amplitude: 1.0, duration_s: 20.0 };
        let input = sampled(|t| sweep.at(t).value, 100.0, 2000);
        let worst = (0..20_000)
            .map(|k| k as f64 * 1e-3)
            .map(|t| (input.at(t).value - sweep.at(t).value).abs())
            .fold(0.0, f64::max);
        assert!((1e-6..1e-3).contains(&worst), "{worst}");
    }

    #[test]
    fn outside_the_recording_its_ends_are_held() {
        let input = RecordedInput::through(&[1.0, 2.0, 4.0], 10.0).unwrap();
        assert_eq!(input.at(-1.0), Jet::constant(1.0));
        assert_eq!(input.at(9.0), Jet::constant(4.0));
    }

    #[test]
    fn fewer_than_two_samples_or_no_rate_is_no_recording() {
        assert_eq!(RecordedInput::through(&[1.0], 10.0), None);
        assert_eq!(RecordedInput::through(&[1.0, 2.0], 0.0), None);
        assert_eq!(RecordedInput::through(&[1.0, 2.0], f64::NAN), None);
    }
}
