//! Single samples that the record itself does not foresee: spikes that hide within the swing of what rings.
//!
//! An autoregression foresees what rings. A knock is one push that it does not foresee, and all that follows
//! it does; a spike that is in one sample alone and rings in nothing is unforeseen in that sample and, with
//! the weights of the autoregression and the other sign, in those after it. Only what has this pattern
//! counts.

use nalgebra::{DMatrix, DVector};

use crate::time_stamps::sensor_step;

/// Order of the autoregression.
const ORDER: usize = 16;
/// Rows that it is fitted to at least, for each of its weights.
const ROWS_EACH: usize = 12;
/// Searches, each without the spikes of those before.
const SEARCHES: usize = 6;
/// Fits of the weights, each without the rows that the one before foresaw worse than this many usual errors.
const FITS: usize = 3;
const OUTLYING: f64 = 4.0;
/// Standard errors of its height from which a spike is certain.
const CERTAIN: f64 = 12.0;
/// Share of the unforeseen within its reach that the pattern of a spike explains.
const EXPLAINED: f64 = 0.85;
/// Share of the range of the samples around it that a spike has at least.
const OF_RANGE: f64 = 0.2;
/// Samples on either side that make this range.
const AROUND: usize = 24;
/// Steps of the recorder's resolution that a spike has at least.
const STEPS: f64 = 4.0;

/// Rows of the spikes in a signal.
pub(crate) fn spikes(values: &[f64]) -> Vec<usize> {
    let mut tame = values.to_vec();
    let mut found: Vec<usize> = Vec::new();
    let least = STEPS * sensor_step(values);
    for _ in 0..SEARCHES {
        let Some(foreseen) = Foreseen::of(&tame) else { break };
        let fresh = foreseen.spikes(&tame, least);
        if fresh.is_empty() {
            break;
        }
        for (row, height) in fresh {
            tame[row] -= height;
            if !found.contains(&row) {
                found.push(row);
            }
        }
    }
    found.sort_unstable();
    found
}

/// What an autoregression leaves of a signal.
struct Foreseen {
    /// Weights of a sample and of those before it in the error.
    pattern: Vec<f64>,
    /// Error of each row; 0 in the first ones.
    errors: Vec<f64>,
    /// Usual size of an error.
    usual: f64,
}

impl Foreseen {
    fn of(signal: &[f64]) -> Option<Self> {
        if signal.len() < ORDER * (ROWS_EACH + 1) {
            return None;
        }
        let mean = signal.iter().sum::<f64>() / signal.len() as f64;
        let centred: Vec<f64> = signal.iter().map(|y| y - mean).collect();
        let mut within = f64::INFINITY;
        let mut last = None;
        for _ in 0..FITS {
            let pattern = pattern(&centred, last.as_ref().map(|one: &Self| one.errors.as_slice()), within)?;
            let error = |row: usize| (0..=ORDER).map(|lag| pattern[lag] * centred[row - lag]).sum::<f64>();
            let mut errors = vec![0.0; ORDER];
            errors.extend((ORDER..centred.len()).map(error));
            let mut sizes: Vec<f64> = errors[ORDER..].iter().map(|e| e.abs()).collect();
            let middle = sizes.len() / 2;
            let usual = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.6745;
            within = OUTLYING * usual;
            last = Some(Self { pattern, errors, usual });
        }
        last.filter(|one| one.usual > 0.0)
    }

    /// Rows and heights of the spikes of which none larger is near.
    fn spikes(&self, signal: &[f64], least: f64) -> Vec<(usize, f64)> {
        let size: f64 = self.pattern.iter().map(|a| a * a).sum();
        let heights: Vec<f64> = (0..signal.len()).map(|row| self.height(row) / size).collect();
        let smallest = least.max(CERTAIN * self.usual / size.sqrt());
        let is_spike = |row: &usize| {
            let (row, height) = (*row, heights[*row]);
            let near = row.saturating_sub(ORDER)..(row + ORDER + 1).min(heights.len());
            let unforeseen: f64 =
                self.errors[row..(row + ORDER + 1).min(signal.len())].iter().map(|e| e * e).sum();
            height.abs() > smallest
                && heights[near].iter().all(|other| other.abs() <= height.abs())
                && height * height * size > EXPLAINED * unforeseen
                && height.abs() > OF_RANGE * range_around(signal, row)
        };
        // What begins or ends within the reach of a spike shows no pattern.
        (ORDER..signal.len().saturating_sub(ORDER)).filter(is_spike).map(|row| (row, heights[row])).collect()
    }

    /// The errors after a row, weighted as a spike in it would show in them.
    fn height(&self, row: usize) -> f64 {
        self.pattern.iter().zip(&self.errors[row..]).map(|(a, e)| a * e).sum()
    }
}

/// The weights that leave least of the rows whose error was within a limit: 1, then those of earlier samples.
fn pattern(signal: &[f64], errors: Option<&[f64]>, within: f64) -> Option<Vec<f64>> {
    let mut square = DMatrix::<f64>::zeros(ORDER, ORDER);
    let mut right = DVector::<f64>::zeros(ORDER);
    for row in ORDER..signal.len() {
        if errors.is_some_and(|errors| errors[row].abs() > within) {
            continue;
        }
        for i in 0..ORDER {
            let earlier = signal[row - 1 - i];
            right[i] += earlier * signal[row];
            for j in 0..=i {
                square[(i, j)] += earlier * signal[row - 1 - j];
            }
        }
    }
    square.fill_upper_triangle_with_lower_triangle();
    let ridge = (1e-10 * square.trace() / ORDER as f64).max(f64::MIN_POSITIVE);
    (0..ORDER).for_each(|k| square[(k, k)] += ridge);
    let weights = square.cholesky()?.solve(&right);
    let all: Vec<f64> = std::iter::once(1.0).chain(weights.iter().map(|w| -w)).collect();
    all.iter().all(|a| a.is_finite()).then_some(all)
}

/// The range of the samples around a row, the farthest of them and the row itself left out.
fn range_around(signal: &[f64], row: usize) -> f64 {
    let (from, to) = (row.saturating_sub(AROUND), (row + AROUND + 1).min(signal.len()));
    let mut around: Vec<f64> = (from..to).filter(|other| *other != row).map(|other| signal[other]).collect();
    around.sort_by(f64::total_cmp);
    match around.len() {
        0..8 => f64::INFINITY,
        many => around[many - 3] - around[2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two decaying oscillations at these samples per period from row 100 on, with noise.
    fn ringing(per_period: f64, noise: f64) -> Vec<f64> {
        let mut state = 7_u64;
        (0..2400)
            .map(|k| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                let e = noise * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5);
                let t = f64::from((k - 100).max(0)) / per_period;
                let wave = |f: f64| (-0.02 * f * t).exp() * (std::f64::consts::TAU * f * t).cos();
                if k < 100 { e } else { wave(1.0) + 0.4 * wave(0.31) + e }
            })
            .collect()
    }

    #[test]
    fn spikes_within_the_swing_are_found_and_knocks_are_none() {
        for per_period in [7.0, 12.0, 31.0] {
            for noise in [0.004, 0.03] {
                let clean = ringing(per_period, noise);
                assert!(spikes(&clean).is_empty(), "{per_period} {noise}: {:?}", spikes(&clean));
                for height in [0.6, -1.3] {
                    let mut wild = clean.clone();
                    let rows = [131, 160, 222, 900, 1500];
                    rows.iter().for_each(|row| wild[*row] += height);
                    assert_eq!(spikes(&wild), rows, "{per_period} {noise} {height}");
                }
                // A second knock while it rings.
                let mut twice = clean.clone();
                (0..1800).for_each(|k| twice[k + 600] += 0.7 * clean[k + 100]);
                assert!(spikes(&twice).is_empty(), "{per_period} {noise}: {:?}", spikes(&twice));
            }
        }
    }
}
