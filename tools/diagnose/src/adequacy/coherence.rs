//! Whether what goes in step with the motion does so in the same way throughout a recording.
//!
//! A force that nobody recorded, as the error of a recorded input is, makes a lightly damped machine ring at
//! its own frequencies. So does what the recorded input drives, and for a few periods two such motions are as
//! good as in step. What a machine does of itself it does alike whenever it moves alike: one combination of
//! what laws make of a motion (in proportion to it, to its square and cube, in the same size whatever the
//! motion's, growing with time) goes through the whole recording. It does not with another motion: with this
//! very one, turned round in time.

use stillbeam_identify::tall::{Orthonormal, dot};

use crate::statistics::distributions::chi_squared_tail;

/// The motion is turned round by so many shares of the recording, ...
const TURNS: usize = 24;
/// ... none of them so short that the machine would still ring of the same push.
const SHORTEST_TURN: f64 = 0.2;
/// Turned, it is another motion where it makes up less than this share of the original.
const ANOTHER: f64 = 0.8;
/// With fewer other motions, how chance scatters is not known.
const FEWEST: usize = 8;
/// A motion is taken for no smaller than this share of what it is on the whole.
const LEAST_SIZE: f64 = 0.05;

/// The chance that what a residual, its colour taken out, has in common with the motion is no more than it
/// has with others; `None` where the motion does not change: turned round, a steady sine is itself. `columns`
/// are what goes with the motion, its first two the motion and its speed, and `whiten` takes the residual's
/// colour out of them.
pub(super) fn chance(
    white: &[f64],
    columns: &[Vec<f64>],
    window: usize,
    whiten: &dyn Fn(&[f64]) -> Vec<f64>,
) -> Option<f64> {
    let columns = with_sizes_and_time(columns, window);
    let whitened: Vec<Vec<f64>> = columns.iter().map(|column| whiten(column)).collect();
    let own = taken(white, &whitened);
    let length = white.len();
    let reach = (1.0 - 2.0 * SHORTEST_TURN) * length as f64;
    let turned = |turn: usize| -> Option<f64> {
        // Fractions of the golden section are near no simple ones, as those of a repeated input would be.
        let share = (turn as f64 * GOLDEN_SECTION).fract();
        let by = (SHORTEST_TURN * length as f64 + share * reach) as usize;
        let other: Vec<Vec<f64>> = whitened
            .iter()
            .map(|column| {
                let (before, after) = column.split_at(by.min(column.len()));
                [after, before].concat()
            })
            .collect();
        let motion = &whitened[0];
        // On either side of the seam another combination may make the same.
        let seam = length - by.min(length);
        let same = [0..seam, seam..length].map(|side| {
            let other: Vec<Vec<f64>> =
                other[..2].iter().map(|column| column[side.clone()].to_vec()).collect();
            taken(&motion[side], &other)
        });
        (same[0] + same[1] < ANOTHER * dot(motion, motion)).then(|| taken(white, &other))
    };
    let others: Vec<f64> = (1..=TURNS).filter_map(turned).collect();
    if others.len() < FEWEST {
        return None;
    }
    let count = others.len() as f64;
    let mean = others.iter().sum::<f64>() / count;
    let variance = others.iter().map(|other| (other - mean).powi(2)).sum::<f64>() / (count - 1.0);
    if mean <= 0.0 || variance <= 0.0 {
        return None;
    }
    // Sums of few independent squares: a gamma distribution of the others' mean and variance.
    let scale = variance / mean;
    Some(chi_squared_tail(2.0 * own / scale, 2.0 * mean / scale))
}

const GOLDEN_SECTION: f64 = 0.618_033_988_749_895;

/// The columns, and the motion and its speed in the same size whatever the motion's and growing with time.
fn with_sizes_and_time(columns: &[Vec<f64>], window: usize) -> Vec<Vec<f64>> {
    let [motion, speed, ..] = columns else { return columns.to_vec() };
    let sizes = sizes(motion, window);
    let of_one_size = |column: &[f64]| column.iter().zip(&sizes).map(|(value, size)| value / size).collect();
    let with_time =
        |column: &[f64]| column.iter().zip(0_u32..).map(|(value, k)| value * f64::from(k)).collect();
    let more = [of_one_size(motion), of_one_size(speed), with_time(motion), with_time(speed)];
    columns.iter().cloned().chain(more).collect()
}

/// How large a motion is around every sample: its root mean square over a window.
fn sizes(motion: &[f64], window: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    for value in motion {
        sums.push(sums[sums.len() - 1] + value * value);
    }
    let rms = |from: usize, to: usize| ((sums[to] - sums[from]) / (to - from).max(1) as f64).max(0.0).sqrt();
    let least = (LEAST_SIZE * rms(0, motion.len())).max(f64::MIN_POSITIVE);
    let around = |k: usize| rms(k.saturating_sub(window / 2), (k + window / 2 + 1).min(motion.len()));
    (0..motion.len()).map(|k| around(k).max(least)).collect()
}

/// Squares that one combination of columns takes off a series, levels aside.
fn taken(series: &[f64], columns: &[Vec<f64>]) -> f64 {
    let mut basis = Orthonormal::default();
    let mut rest = series.to_vec();
    basis.push(vec![1.0; series.len()]);
    basis.remove_from(&mut rest);
    let before = dot(&rest, &rest);
    columns.iter().for_each(|column| basis.push(column.clone()));
    basis.remove_from(&mut rest);
    before - dot(&rest, &rest)
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    use super::*;

    /// A resonance with 0.8 % of critical damping and 25 samples in a period, shaken at random.
    fn shaken(seed: u64, samples: usize) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let (mut last, mut before) = (0.0, 0.0);
        let turn = std::f64::consts::TAU / 25.0;
        let decay = (-0.008 * turn).exp();
        (0..samples + 2000)
            .map(|_| {
                let push: f64 = StandardNormal.sample(&mut random);
                let now = 2.0 * decay * turn.cos() * last - decay * decay * before + push;
                (before, last) = (last, now);
                now
            })
            .skip(2000)
            .collect()
    }

    fn columns(motion: &[f64]) -> Vec<Vec<f64>> {
        let speed: Vec<f64> = std::iter::once(0.0).chain(motion.windows(2).map(|w| w[1] - w[0])).collect();
        let cube = motion.iter().map(|y| y.powi(3)).collect();
        vec![motion.to_vec(), speed, cube]
    }

    fn of_residual((seed, samples): (u64, usize), residual: impl Fn(f64, f64, f64) -> f64) -> Option<f64> {
        let motion = shaken(seed, samples);
        let columns = columns(&motion);
        let foreign = shaken(1000 + seed, samples);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(2000 + seed);
        let rms = (dot(&motion, &motion) / samples as f64).sqrt();
        let values = motion.iter().zip(&columns[1]).zip(&foreign);
        let white: Vec<f64> = values
            .map(|((y, v), foreign)| {
                let noise: f64 = StandardNormal.sample(&mut random);
                noise + residual(y / rms, v / rms, foreign / rms)
            })
            .collect();
        chance(&white, &columns, 100, &<[f64]>::to_vec)
    }

    #[test]
    fn a_resonance_shaken_from_outside_goes_with_its_own_motion_by_chance_only() {
        let likely =
            |seed| of_residual((seed, 2000), |_, _, foreign| 0.5 * foreign).is_some_and(|p| p > 1e-3);
        let count = (0..100).filter(|seed| likely(*seed)).count();
        assert!(count >= 97, "{count} of 100");
    }

    #[test]
    fn what_a_law_leaves_goes_with_the_motion_throughout() {
        let is_seen = |residual: fn(f64, f64, f64) -> f64| {
            (0..20).filter(|seed| of_residual((*seed, 5000), residual).is_none_or(|p| p < 1e-4)).count()
        };
        assert!(is_seen(|_, v, _| 0.5 * v.signum()) >= 19, "friction");
        assert!(is_seen(|y, _, _| 0.2 * y.powi(3)) >= 19, "a hardening spring");
    }

    #[test]
    fn a_steady_sine_is_no_other_motion_at_another_time() {
        let sine: Vec<f64> = (0..2000).map(|k| (0.31 * f64::from(k)).sin()).collect();
        assert_eq!(chance(&shaken(1, 2000), &columns(&sine), 100, &<[f64]>::to_vec), None);
    }
}
