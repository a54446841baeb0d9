//! Single wild samples: values far outside everything around them, which no structure makes.
//!
//! A glitch of a cable or a lost bit is one sample, or two; a knock is followed by what it sets ringing. So a
//! sample is judged by the range of those on both sides of it, the farthest of them left out.

use crate::spikes::spikes;

/// Samples on either side that a sample is judged by.
const AROUND: usize = 12;
/// Of these, so many at either end of their range do not count: other wild ones.
const SPARED: usize = 2;
/// A wild sample lies outside the range by more than this many ranges.
const OUTSIDE: f64 = 2.0;
/// More than this share of a record is no few wild samples, but how the signal is.
const FEW: f64 = 0.01;

/// Rows of the wild samples; none where they are so many that they are the signal.
pub(crate) fn wild_samples(values: &[f64]) -> Vec<usize> {
    let far = far_samples(values);
    let hidden = spikes(&bridged(values, &far));
    let mut all: Vec<usize> = far.iter().chain(&hidden).copied().collect();
    all.sort_unstable();
    all.dedup();
    if all.len() as f64 > (FEW * values.len() as f64).max(1.0) { far } else { all }
}

/// Rows of those that lie far outside the range of the samples around them.
///
/// Noise with heavy tails has samples at every distance; those that stand out of it are beyond a limit that
/// hardly more exceed by half.
fn far_samples(values: &[f64]) -> Vec<usize> {
    let outlying: Vec<(usize, f64)> = (0..values.len())
        .filter_map(|k| Some((k, outside(values, k)?)))
        .filter(|(_, ranges)| *ranges > 0.5 * OUTSIDE)
        .collect();
    let mut limit = OUTSIDE;
    loop {
        let wild: Vec<usize> =
            outlying.iter().filter(|(_, ranges)| *ranges > limit).map(|(row, _)| *row).collect();
        let half = outlying.iter().filter(|(_, ranges)| *ranges > 0.5 * limit).count();
        if wild.is_empty() || wild.len() as f64 > (FEW * values.len() as f64).max(1.0) {
            return Vec::new();
        }
        if half <= 2 * wild.len() {
            return wild;
        }
        limit *= 2.0;
    }
}

/// By how many ranges of the samples around it a sample lies outside them; `None` inside, and where it starts
/// something.
fn outside(values: &[f64], k: usize) -> Option<f64> {
    let (from, to) = (k.saturating_sub(AROUND), (k + AROUND + 1).min(values.len()));
    let mut around: Vec<f64> = (from..to).filter(|other| *other != k).map(|other| values[other]).collect();
    if around.len() < 4 * SPARED {
        return None;
    }
    around.sort_by(f64::total_cmp);
    let (low, high) = (around[SPARED], around[around.len() - 1 - SPARED]);
    let range = high - low;
    let outside = (values[k] - high).max(low - values[k]);
    (range > 0.0 && outside > 0.0 && !starts_something(values, k, outside)).then(|| outside / range)
}

/// Whether what follows a sample is unlike what came before it: the first peak of a knock, say.
fn starts_something(values: &[f64], k: usize, outside: f64) -> bool {
    let spread = |some: &[f64]| {
        let mut sorted = some.to_vec();
        sorted.sort_by(f64::total_cmp);
        match sorted.len() {
            0..8 => f64::INFINITY,
            many => sorted[many - 1 - SPARED] - sorted[SPARED],
        }
    };
    let before = spread(&values[k.saturating_sub(AROUND)..k]);
    let after = spread(&values[(k + 1).min(values.len())..(k + 1 + AROUND).min(values.len())]);
    before.is_finite() && after.is_finite() && after > 3.0 * before && after > 0.02 * outside
}

/// The values with the wild ones on the line between their neighbours.
pub(crate) fn without_wild(values: &[f64]) -> Vec<f64> {
    bridged(values, &wild_samples(values))
}

/// The values with those of some rows on the line between their neighbours.
fn bridged(values: &[f64], wild: &[usize]) -> Vec<f64> {
    let mut tame = values.to_vec();
    for &k in wild {
        let sound = |other: &usize| !wild.contains(other);
        let before = (0..k).rev().find(sound);
        let after = (k + 1..values.len()).find(sound);
        tame[k] = match (before, after) {
            (Some(a), Some(b)) => {
                let share = (k - a) as f64 / (b - a) as f64;
                values[a] + share * (values[b] - values[a])
            }
            (Some(one), None) | (None, Some(one)) => values[one],
            (None, None) => values[k],
        };
    }
    tame
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ringing at `per_period` samples per period from row 100 on, with noise.
    fn ringing(per_period: f64, noise: f64) -> Vec<f64> {
        let mut state = 5_u64;
        (0..2000)
            .map(|k| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                let e = noise * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5);
                let t = f64::from((k - 100).max(0)) / per_period;
                let rings = if k < 100 { 0.0 } else { (-0.05 * t).exp() * (std::f64::consts::TAU * t).cos() };
                rings + e
            })
            .collect()
    }

    #[test]
    fn a_wild_sample_is_found_where_it_is_and_the_beginning_of_a_decay_is_none() {
        for per_period in [4.3, 11.0, 60.0] {
            for noise in [1e-3, 0.05] {
                let clean = ringing(per_period, noise);
                assert!(wild_samples(&clean).is_empty(), "{per_period} {noise}: {:?}", wild_samples(&clean));
                for at in [40, 300, 301, 1500] {
                    let mut wild = clean.clone();
                    wild[at] += 8.0;
                    assert_eq!(wild_samples(&wild), [at], "{per_period} {noise}");
                    assert!((without_wild(&wild)[at] - clean[at]).abs() < 2.0);
                }
            }
        }
    }
}
