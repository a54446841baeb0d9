//! How much better one set of laws predicts than another.

use stillbeam_identify::tall::{add_scaled, dot};

use crate::intervals::Scatter;
use crate::stacking::{RecordFit, Stack};

/// How much better one model predicts than another, in standard errors.
///
/// `z = (RSS_without − RSS_with) / (2 sd(Σ d e))`, with `d` the difference of the predictions and `e` what
/// the better model leaves over. Tests on differences of squared errors block by block have no power here,
/// because the energy sits in a few blocks.
pub(crate) fn improvement(
    stack: &Stack<'_>,
    without: &[RecordFit],
    with: &[RecordFit],
    slowest_hz: Option<f64>,
) -> Improvement {
    let [before, after, difference] = left(without, with);
    let scatter = Scatter::new(stack, after.clone(), slowest_hz);
    let z = z_of(&before, &after, &difference, &scatter, 0..before.len());
    let mut worst = f64::INFINITY;
    let mut start = 0;
    for fit in with {
        let range = start..start + fit.residuals.len();
        worst = worst.min(z_of(&before, &after, &difference, &scatter, range.clone()));
        start = range.end;
    }
    let ratio = stack.even_square(without) / stack.even_square(with).max(f64::MIN_POSITIVE);
    Improvement { z, worst_z: worst, gain_db: 10.0 * ratio.log10() }
}

/// Squares that one model leaves less than another, and the variance of the sum that this hangs on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Compared {
    pub(crate) gain: f64,
    pub(crate) variance: f64,
}

/// The parts of [`improvement`], to be pooled over roles.
pub(crate) fn compare(
    stack: &Stack<'_>,
    without: &[RecordFit],
    with: &[RecordFit],
    slowest_hz: Option<f64>,
) -> Compared {
    let [before, after, difference] = left(without, with);
    let gain = dot(&before, &before) - dot(&after, &after);
    // Noise is what the better of the two leaves.
    let noise = if gain > 0.0 { after } else { before };
    Compared { gain, variance: Scatter::new(stack, noise, slowest_hz).variance_of_sum(&difference) }
}

/// See [`improvement`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Improvement {
    /// All recordings together.
    pub(crate) z: f64,
    /// The recording that gains least.
    pub(crate) worst_z: f64,
    /// Power without over power with, samples weighted evenly, decibels.
    pub(crate) gain_db: f64,
}

impl Improvement {
    /// Standard errors of the effect itself from zero: where the law was fitted to the same recordings, the
    /// improvement is half of that many of its own standard errors.
    pub(crate) fn t(&self) -> f64 {
        2.0 * self.z
    }
}

/// What two models leave of all recordings, and the difference.
fn left(without: &[RecordFit], with: &[RecordFit]) -> [Vec<f64>; 3] {
    let flat = |fits: &[RecordFit]| fits.iter().flat_map(|fit| fit.residuals.iter().copied()).collect();
    let (before, after): (Vec<f64>, Vec<f64>) = (flat(without), flat(with));
    let mut difference = before.clone();
    add_scaled(&mut difference, -1.0, &after);
    [before, after, difference]
}

fn z_of(
    before: &[f64],
    after: &[f64],
    difference: &[f64],
    scatter: &Scatter,
    range: std::ops::Range<usize>,
) -> f64 {
    let gain = dot(&before[range.clone()], &before[range.clone()])
        - dot(&after[range.clone()], &after[range.clone()]);
    let mut weights = vec![0.0; difference.len()];
    weights[range.clone()].copy_from_slice(&difference[range]);
    let sd = scatter.variance_of_sum(&weights).sqrt();
    if sd > 0.0 { gain / (2.0 * sd) } else { 0.0 }
}
