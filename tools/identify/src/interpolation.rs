//! What happens between the samples of the input: piecewise polynomials, C2 cubic by default.
//!
//! Joining samples by straight lines weakens a sine of frequency f sampled at fs by sinc²(f/fs): 2 % at
//! 8 Hz and 100 Hz, which would end up in the participation. The cubic spline's error is of fourth order
//! (below 0.01 % there).

use serde::{Deserialize, Serialize};

/// What a sampled input does between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InputInterpolation {
    /// Smooth: a cubic spline with continuous curvature. Right for positions and sampled smooth forces.
    #[default]
    Cubic,
    /// Straight lines between the samples.
    Linear,
    /// Each value held until the next sample. Right for a force command renewed at the stamps.
    Hold,
}

/// A piecewise polynomial: on piece k, value = sum over j of `coefficients[k][j] * (t - knots_s[k])^j`.
#[derive(Debug, Clone)]
pub struct PiecewiseCubic {
    /// Ends of the pieces, one more than pieces, strictly increasing, seconds.
    pub knots_s: Vec<f64>,
    /// Polynomial of each piece.
    pub coefficients: Vec<[f64; 4]>,
}

impl PiecewiseCubic {
    /// Through all samples; at least four, times strictly increasing, all finite.
    pub fn new(time_s: &[f64], samples: &[f64], kind: InputInterpolation) -> Self {
        let coefficients = match kind {
            InputInterpolation::Cubic => cubic_pieces(time_s, samples),
            InputInterpolation::Linear => {
                pairs(time_s, samples).map(|(h, a, b)| [a, (b - a) / h, 0.0, 0.0]).collect()
            }
            InputInterpolation::Hold => pairs(time_s, samples).map(|(_, a, _)| [a, 0.0, 0.0, 0.0]).collect(),
        };
        Self { knots_s: time_s.to_vec(), coefficients }
    }

    /// The pieces that cover the times from one to another.
    pub(crate) fn between(&self, from_s: f64, to_s: f64) -> Self {
        let pieces = self.coefficients.len();
        let first =
            self.knots_s.partition_point(|t| *t <= from_s).saturating_sub(1).min(pieces.saturating_sub(1));
        let last = self.knots_s.partition_point(|t| *t < to_s).clamp(first + 1, pieces.max(first + 1));
        Self {
            knots_s: self.knots_s[first..=last].to_vec(),
            coefficients: self.coefficients[first..last].to_vec(),
        }
    }

    /// Values and first two derivatives at increasing times; times outside use the end pieces.
    pub fn sample(&self, times_s: impl IntoIterator<Item = f64>) -> Vec<[f64; 3]> {
        let last = self.coefficients.len().saturating_sub(1);
        let mut piece = 0;
        times_s
            .into_iter()
            .map(|t| {
                while piece < last && t >= self.knots_s[piece + 1] {
                    piece += 1;
                }
                polynomial(&self.coefficients[piece], t - self.knots_s[piece])
            })
            .collect()
    }
}

/// Value, first and second derivative.
pub fn polynomial(c: &[f64; 4], s: f64) -> [f64; 3] {
    [
        c[0] + s * (c[1] + s * (c[2] + s * c[3])),
        c[1] + s * (2.0 * c[2] + s * 3.0 * c[3]),
        2.0 * c[2] + 6.0 * s * c[3],
    ]
}

fn pairs<'a>(time_s: &'a [f64], samples: &'a [f64]) -> impl Iterator<Item = (f64, f64, f64)> + 'a {
    time_s.windows(2).zip(samples.windows(2)).map(|(t, y)| (t[1] - t[0], y[0], y[1]))
}

/// Cubic spline; the curvature at either end is that of the cubic through the four samples there.
fn cubic_pieces(time_s: &[f64], samples: &[f64]) -> Vec<[f64; 4]> {
    let n = samples.len();
    let step: Vec<f64> = time_s.windows(2).map(|t| t[1] - t[0]).collect();
    let slope: Vec<f64> = pairs(time_s, samples).map(|(h, a, b)| (b - a) / h).collect();
    let mut curvature = vec![0.0; n];
    curvature[0] = end_curvature([0, 1, 2, 3].map(|k| (time_s[k], samples[k])));
    curvature[n - 1] = end_curvature([1, 2, 3, 4].map(|k| (time_s[n - k], samples[n - k])));
    // Thomas algorithm on h[k-1] m[k-1] + 2 (h[k-1] + h[k]) m[k] + h[k] m[k+1] = 6 (slope[k] - slope[k-1]).
    let mut factor = vec![0.0; n];
    for k in 1..n - 1 {
        let pivot = 2.0 * (step[k - 1] + step[k]) - step[k - 1] * factor[k - 1];
        factor[k] = step[k] / pivot;
        let right = 6.0 * (slope[k] - slope[k - 1]);
        curvature[k] = (right - step[k - 1] * curvature[k - 1]) / pivot;
    }
    for k in (1..n - 1).rev() {
        curvature[k] -= factor[k] * curvature[k + 1];
    }
    (0..n - 1)
        .map(|k| {
            let (m, next) = (curvature[k], curvature[k + 1]);
            [samples[k], slope[k] - step[k] * (2.0 * m + next) / 6.0, m / 2.0, (next - m) / (6.0 * step[k])]
        })
        .collect()
}

/// Second derivative at the first of four points of the cubic through them (Newton's divided differences).
fn end_curvature(points: [(f64, f64); 4]) -> f64 {
    let [(t0, y0), (t1, y1), (t2, y2), (t3, y3)] = points;
    let (d01, d12, d23) = ((y1 - y0) / (t1 - t0), (y2 - y1) / (t2 - t1), (y3 - y2) / (t3 - t2));
    let (d012, d123) = ((d12 - d01) / (t2 - t0), (d23 - d12) / (t3 - t1));
    let d0123 = (d123 - d012) / (t3 - t0);
    2.0 * d012 + 2.0 * d0123 * ((t0 - t1) + (t0 - t2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_reproduced_exactly_on_uneven_stamps() {
        let time_s: Vec<f64> = (0..20).map(|k| 0.1 * f64::from(k) + 0.03 * f64::from(k % 3)).collect();
        let cubic = |t: f64| 1.0 - 2.0 * t + 0.5 * t * t - 0.3 * t * t * t;
        let samples: Vec<f64> = time_s.iter().map(|&t| cubic(t)).collect();
        let spline = PiecewiseCubic::new(&time_s, &samples, InputInterpolation::Cubic);
        for k in 0..190 {
            let t = f64::from(k) * 0.01;
            let [value, _, second] = spline.sample([t])[0];
            assert!((value - cubic(t)).abs() < 1e-12, "at {t}");
            assert!((second - (1.0 - 1.8 * t)).abs() < 1e-9, "curvature at {t}");
        }
    }

    #[test]
    fn a_sine_at_eight_percent_of_the_rate_keeps_its_size_where_straight_lines_lose_two_percent() {
        let time_s: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let omega = std::f64::consts::TAU * 8.0;
        let samples: Vec<f64> = time_s.iter().map(|t| (omega * t).sin()).collect();
        // The component at 8 Hz of the interpolated signal between 1 s and 3 s.
        let size = |kind| {
            let fine: Vec<f64> = (0..20_000).map(|k| 1.0 + 1e-4 * f64::from(k)).collect();
            let values = PiecewiseCubic::new(&time_s, &samples, kind).sample(fine.iter().copied());
            let sum: f64 = fine.iter().zip(&values).map(|(t, v)| v[0] * (omega * t).sin()).sum();
            2.0 * sum / fine.len() as f64
        };
        assert!((size(InputInterpolation::Cubic) - 1.0).abs() < 2e-4);
        let droop = 1.0 - size(InputInterpolation::Linear);
        assert!((0.018..0.024).contains(&droop), "{droop}");
    }
}
