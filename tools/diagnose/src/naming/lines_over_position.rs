//! Waves along the travel as lines of a spectrum over position.
//!
//! A wave that is stiffer than what moves the machine lets it snap from place to place, and a short one has
//! as many valleys to fit in as periods. Along the motion that was there ([`super::by_latent_force`]) its
//! force is a sine of the position all the same. Where a run begins a wave holds the machine somewhere on its
//! slope, and nobody knows against what: a steady force is put aside, run by run.

use std::f64::consts::FRAC_PI_2;

use stillbeam_identify::tall::dot;

use super::by_latent_force::{Alike, AtPlace};
use super::selection::Search;
use super::trials::Candidate;
use crate::locate::latent_force::Moment;

/// A line has at least this share of the power of the force that is asked for, a steady one put aside: a
/// smoother passes little of where the machine is fast, and a fit decides.
const WAVE_ALIKE: f64 = 0.3;
/// Quarters of a wave over the travel that are looked for at most.
const MOST_QUARTERS: f64 = 320.0;
/// A line is looked for this much more finely once it is seen.
const FINER: i32 = 8;

impl Search<'_> {
    /// Waves at the lines of the spectrum, over the position, of the force that is asked for: each is a
    /// valley of its own for a fit.
    pub(super) fn waves_alike(&self, compared: &AtPlace<'_>) -> Vec<Alike> {
        let candidate = &self.candidates[compared.index];
        let asked = |moments: &Vec<Moment>| moments.iter().map(|moment| moment[2]).collect::<Vec<f64>>();
        let wanted = about_their_means(&compared.moments.iter().map(asked).collect::<Vec<Vec<f64>>>());
        let power = dot(&wanted, &wanted);
        let line = |waves_per_unit: f64| {
            let period = waves_per_unit.recip();
            let wave = candidate.trials.iter().find_map(|trial| trial.with_period(period))?;
            let ahead = wave.turned(FRAC_PI_2)?;
            let [sine, cosine] = [&wave, &ahead].map(|trial| self.force_of(compared, trial));
            let [sine, cosine] = [sine?, cosine?].map(|runs| about_their_means(&runs));
            let parts = of_both([&sine, &cosine], &wanted)?;
            let share = (parts[0] * dot(&sine, &wanted) + parts[1] * dot(&cosine, &wanted)) / power;
            let (trial, factor) = wave.combined(parts, &ahead)?;
            Some(Alike { candidate: compared.index, physics: candidate.physics(&trial, factor), share })
        };
        let places = || compared.moments.iter().flatten().map(|moment| moment[0]);
        tops(&frequencies_along(candidate, places), WAVE_ALIKE, line, |line| line.share)
    }
}

/// The lines that stand above those beside them, each looked for finely, where their share is more than
/// `least`.
pub(super) fn tops<L>(
    frequencies: &[f64],
    least: f64,
    line: impl Fn(f64) -> Option<L>,
    share: impl Fn(&L) -> f64,
) -> Vec<L> {
    let spectrum: Vec<f64> =
        frequencies.iter().map(|at| line(*at).map_or(0.0, |line| share(&line))).collect();
    let top = |place: usize| {
        let step = frequencies.get(1).map_or(0.0, |second| second - frequencies[0]);
        let between = (-FINER..=FINER).map(|k| frequencies[place] + step * f64::from(k) / f64::from(FINER));
        between.filter_map(&line).max_by(|a, b| share(a).total_cmp(&share(b)))
    };
    crests(&spectrum, least).filter_map(top).collect()
}

/// Runs one after the other, the mean of each taken out.
fn about_their_means(runs: &[Vec<f64>]) -> Vec<f64> {
    let about = |run: &Vec<f64>| {
        let mean = run.iter().sum::<f64>() / run.len().max(1) as f64;
        run.iter().map(|force| force - mean).collect::<Vec<f64>>()
    };
    runs.iter().flat_map(about).collect()
}

/// Where the shares of a spectrum that count stand above those beside them.
fn crests(shares: &[f64], least: f64) -> impl Iterator<Item = usize> {
    let share = |place: Option<usize>| place.and_then(|place| shares.get(place)).map_or(0.0, |share| *share);
    (0..shares.len()).filter(move |&place| {
        let [before, here, after] = [place.checked_sub(1), Some(place), Some(place + 1)].map(share);
        here > least && here > before && here >= after
    })
}

/// What of two columns adds up nearest to a third; `None` where they are one.
pub(super) fn of_both([one, other]: [&[f64]; 2], wanted: &[f64]) -> Option<[f64; 2]> {
    let [aa, ab, bb] = [dot(one, one), dot(one, other), dot(other, other)];
    let [a, b] = [dot(one, wanted), dot(other, wanted)];
    let determinant = aa * bb - ab * ab;
    (determinant > 1e-9 * aa * bb).then(|| [(bb * a - ab * b) / determinant, (aa * b - ab * a) / determinant])
}

/// Reciprocals of the periods that are tried along a motion that is known, evenly spaced: between two of them
/// the wave's pattern moves by a quarter of a wave over all of the motion.
pub(super) fn frequencies_along<P: Iterator<Item = f64>>(
    candidate: &Candidate,
    places: impl Fn() -> P,
) -> Vec<f64> {
    let most = places().fold(f64::NEG_INFINITY, f64::max);
    let travel = most - places().fold(f64::INFINITY, f64::min);
    let range = candidate.ranges.iter().find(|(name, ..)| *name == "period");
    let shortest = range.map_or(f64::INFINITY, |(_, shortest, _)| *shortest);
    let quarters = (4.0 * travel / shortest).min(MOST_QUARTERS) as u32;
    (4..=quarters).map(|quarters| f64::from(quarters) / (4.0 * travel)).collect()
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;

    use crate::naming::on_a_spring::{machine, noisy_runs, searched_around};

    /// At its steepest five times as stiff as the spring, and shorter than what the screen tries: the machine
    /// snaps from place to place.
    #[test]
    fn a_short_stiff_wave_is_seen_as_a_line_over_the_position_and_fitted_from_there() {
        let mut given = machine();
        given.set_parameter("damper.mass-ground.damping", 60.0).unwrap();
        let wave = [("force", 0.4), ("period", 1.5e-3), ("phase", 0.8)];
        let mut truth = given.clone();
        let law =
            wave.iter().fold(Physics::new("cogging", "mass"), |law, (name, value)| law.with(*name, *value));
        truth.setup_mut().physics = vec![law];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-6);
        searched_around(&given, &noisy(&[0.6, 6.0]), &noisy(&[4.0]), |search, refitted| {
            let waves = search.candidates.iter().find(|candidate| candidate.law.id() == "cogging").unwrap();
            assert!(waves.trials.iter().all(|trial| trial.period().unwrap() > 1.5e-3));
            let mut tried = Vec::new();
            search.take_laws_alike(&refitted, &mut tried);
            let found = tried.iter().find(|tried| search.candidates[tried.candidate].law.id() == "cogging");
            let found = found.expect("its line stands out");
            assert!(found.passes(), "{:?}", found.gates);
            for ((name, value, stderr, ..), (_, truth)) in found.parameters.iter().zip(&wave) {
                assert!(
                    (value - truth).abs() < 4.0 * stderr && *stderr < 0.02 * truth,
                    "{name}: {value} ± {stderr}"
                );
            }
        });
    }
}
