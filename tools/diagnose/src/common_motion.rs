//! What two sensors see alike is no noise of either.
//!
//! The noise of one sensor knows nothing of another's. A disturbance that is there all the time, or physics
//! that a stationary excitation shows all the time, raises the quiet quarter of every sensor's residual, and
//! a disturbance what a machine at rest reads; but it moves all of them together, and what of one residual
//! the others predict is that motion. What they do not predict bounds the noise from above, the others' own
//! noise being in it. Sensors that share a disturbance of their own (one camera that shakes and reads both)
//! are taken for a machine that moves.

use stillbeam_identify::tall::{Orthonormal, dot};

use crate::noise::OutputResidual;
use crate::statistics::autoregression::Autoregression;
use crate::statistics::distributions::chi_squared_tail;

/// Samples to either side from which one residual is predicted.
const LAGS: i32 = 12;
/// Chance of as much in common between sensors that have nothing in common, above which nothing is concluded.
const CHANCE: f64 = 1e-6;

/// Root mean square of what of one output's residuals another output's do not predict, and the number of
/// samples that it is of, over all recordings that have both, in step and gap for gap; `None` where they have
/// nothing in common beyond chance.
pub(crate) fn own_rms(parts: &[OutputResidual<'_>], others: &[OutputResidual<'_>]) -> Option<(f64, f64)> {
    let pairs: Vec<(&[f64], &[f64])> = parts
        .iter()
        .filter_map(|part| {
            let other = others.iter().find(|other| std::ptr::eq(part.record, other.record))?;
            let (one, two) = (&part.record.outputs[part.output], &other.record.outputs[other.output]);
            (one.at == two.at && part.residual.len() > 8 * LAGS as usize)
                .then_some((&part.residual[..], &other.residual[..]))
        })
        .collect();
    if pairs.is_empty() || chance(&pairs) > CHANCE {
        return None;
    }
    let (mut sum, mut count) = (0.0, 0.0);
    for (one, other) in pairs {
        let mut basis = Orthonormal::default();
        (-LAGS..=LAGS).for_each(|lag| basis.push(shifted(other, lag)));
        let mut own = one.to_vec();
        basis.remove_from(&mut own);
        sum += dot(&own, &own);
        count += one.len() as f64 - f64::from(2 * LAGS + 1);
    }
    (count > 0.0).then(|| ((sum / count).sqrt(), count))
}

/// The series `lag` samples later, nothing where it has none.
fn shifted(series: &[f64], lag: i32) -> Vec<f64> {
    let length = series.len() as i32;
    (0..length)
        .map(|k| if (0..length).contains(&(k - lag)) { series[(k - lag) as usize] } else { 0.0 })
        .collect()
}

/// Chance that independent series of these colours are as alike at any lag, pooled over recordings.
///
/// The correlation of two independent series scatters by the sum over lags of the product of their
/// autocorrelations, over the count (M. Bartlett, 1935).
fn chance(pairs: &[(&[f64], &[f64])]) -> f64 {
    let scatters: Vec<f64> = pairs
        .iter()
        .map(|(one, other)| {
            let [a, b] =
                [one, other].map(|series| Autoregression::fit(&[series]).autocorrelations(series.len()));
            let both: f64 = a.iter().zip(&b).skip(1).map(|(a, b)| a * b).sum();
            // Opposite colours may nearly cancel; series are never more independent than their samples.
            (1.0 + 2.0 * both).max(1.0) / one.len() as f64
        })
        .collect();
    let least = (-LAGS..=LAGS)
        .map(|lag| {
            let squares = pairs.iter().zip(&scatters).map(|((one, other), scatter)| {
                let moved = shifted(other, lag);
                let product = dot(one, &moved);
                product * product / (dot(one, one) * dot(other, other)).max(f64::MIN_POSITIVE) / scatter
            });
            chi_squared_tail(squares.sum(), pairs.len() as f64)
        })
        .fold(1.0, f64::min);
    least * f64::from(2 * LAGS + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    fn coloured(random: &mut Xoshiro256PlusPlus, rho: f64) -> Vec<f64> {
        let mut last = 0.0;
        (0..2500)
            .map(|_| {
                let innovation: f64 = StandardNormal.sample(random);
                last = rho * last + (1.0_f64 - rho * rho).sqrt() * innovation;
                last
            })
            .collect()
    }

    #[test]
    fn independent_noises_of_any_colour_have_nothing_in_common() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
        for rho in [0.0, 0.8, 0.95] {
            for _ in 0..20 {
                let series: Vec<Vec<f64>> = (0..10).map(|_| coloured(&mut random, rho)).collect();
                let pairs: Vec<(&[f64], &[f64])> =
                    series.chunks(2).map(|two| (&two[0][..], &two[1][..])).collect();
                let chance = chance(&pairs);
                assert!(chance > CHANCE, "rho {rho}: {chance:e}");
            }
        }
    }

    #[test]
    fn a_slow_motion_under_the_noise_of_one_of_two_sensors_is_seen() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(12);
        let motions: Vec<Vec<f64>> = (0..5).map(|_| coloured(&mut random, 0.95)).collect();
        let mut noisy = |rms: f64| -> Vec<Vec<f64>> {
            let noises = motions.iter().map(|motion| (motion, coloured(&mut random, 0.0)));
            noises
                .map(|(motion, noise)| motion.iter().zip(noise).map(|(m, n)| m + rms * n).collect())
                .collect()
        };
        let (loud, quiet) = (noisy(1.5), noisy(0.1));
        let pairs: Vec<(&[f64], &[f64])> = loud.iter().zip(&quiet).map(|(a, b)| (&a[..], &b[..])).collect();
        assert!(chance(&pairs) < CHANCE);
    }
}
