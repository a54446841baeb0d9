//! The least residual that a shaper of a given duration can leave, from both sides.
//!
//! Only a few taps of the optimum have weight and only a few modes of the boxes touch the worst residual, so
//! the programme (`programme`) holds few of both and grows: by the modes at which its answer leaves more than
//! it thought, and by the taps that its multipliers price below its value. For any multipliers λ_j with
//! Σ|λ_j| = 1 every shaper w with negative weights of at most L in all obeys
//!
//! > max_j |V_j(w)| ≥ Σ_k w_k g(k) ≥ (1 + L) min_k g(k) − L max_k g(k),  g(k) = Re Σ_j λ̄_j φ_j(k),
//!
//! so the prices, taken over *all* ticks, prove a bound that does not depend on the solver. A duration is
//! given up only when that bound lies above the tolerance.

use super::boundary::{self, FINER, Peak};
use super::pole::{Complex, Pole};
use super::programme::Programme;
use super::uncertainty::ModeBox;
use crate::error::ShapeError;

/// What a search over durations has in common.
#[derive(Clone, Debug)]
pub(super) struct Problem {
    pub(super) modes: Vec<ModeBox>,
    /// Residuals that differ by less than this are the same.
    pub(super) accuracy: f64,
    /// A gap between what is found and what is proven, relative to it, that counts as none.
    pub(super) gap: f64,
    pub(super) tick_s: f64,
    pub(super) negative_limit: f64,
}

/// Taps with real weights: tick, weight; ticks increase.
pub(super) type RealTaps = Vec<(u32, f64)>;

/// What is known about a duration.
#[derive(Clone, Debug)]
pub(super) struct Verdict {
    /// The best shaper found.
    pub(super) taps: RealTaps,
    /// What it leaves at worst.
    pub(super) worst: f64,
    /// No shaper of this duration leaves less.
    pub(super) bound: f64,
}

/// Programmes of one duration until the gap is closed; far more than ever needed.
const ROUNDS: usize = 60;
/// A weight or multiplier that means nothing for the next duration.
const NO_WEIGHT: f64 = 1e-5;
/// When a programme has more taps than this, those that it does not use and that cost most are dropped.
const MANY_TAPS: usize = 80;
/// When a programme has more places than this to hold down, those that leave less than a part of the worst
/// are dropped.
const MANY_POLES: (usize, f64) = (40, 0.5);
/// Taps that are as near to each other as this are refined to neighbours.
const NEAR: u32 = 16;
/// Taps that the first programme of a search starts with, evenly spaced.
const FIRST_TAPS: u32 = 60;
/// Evenly spaced taps of the others, beside those that had weight before.
const EVEN_TAPS: u32 = 12;

/// Places worth trying, kept from one duration to the next.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    /// Taps as fractions of the duration.
    taps: Vec<f64>,
    /// Modes that held the last answer down.
    poles: Vec<Pole>,
}

impl Problem {
    /// Finds the least residual for shapers of `end_tick` ticks, until the answer to "is it at most
    /// `tolerance`?" is proven, or without a tolerance until nothing is left to gain.
    ///
    /// # Errors
    /// [`ShapeError::Solver`].
    pub(super) fn least_residual(
        &self,
        end_tick: u32,
        tolerance: Option<f64>,
        memory: &mut Memory,
    ) -> Result<Verdict, ShapeError> {
        let mut ticks = self.first_ticks(end_tick, memory);
        let mut poles = self.first_poles(end_tick, memory);
        let mut verdict = Verdict { taps: Vec::new(), worst: f64::INFINITY, bound: 0.0 };
        for _ in 0..ROUNDS {
            let answer = self.programme(&ticks, &poles, end_tick).solve()?;
            let prices = self.prices(end_tick, &poles, &answer.multipliers);
            verdict.bound = verdict.bound.max(self.bound(&prices));
            let taps = normalised(&ticks, &answer.weights);
            let held = poles.iter().map(|pole| self.ringing(&taps, pole, end_tick)).fold(0.0, f64::max);
            let peaks = self.peaks(&taps, end_tick, FINER);
            let worst = peaks.iter().map(|peak| peak.residual).fold(0.0, f64::max);
            memory.remember(&taps, &poles, &answer.multipliers, end_tick);
            if worst < verdict.worst {
                (verdict.taps, verdict.worst) = (taps.clone(), worst);
            }
            let closed = verdict.worst - verdict.bound <= self.gap * verdict.worst + self.accuracy;
            let answered = tolerance.is_some_and(|most| verdict.worst <= most || verdict.bound > most);
            if closed || answered {
                break;
            }
            let before = (ticks.len(), poles.len());
            keep_cheap(&mut ticks, &answer.weights, &prices);
            let kept = ticks.len();
            add_priced(&mut ticks, &prices, self.negative_limit > 0.0);
            if poles.len() > MANY_POLES.0 {
                poles.retain(|pole| self.ringing(&taps, pole, end_tick) > MANY_POLES.1 * held);
            }
            poles.extend(beyond(&peaks, held, self.accuracy));
            if before == (kept, poles.len()) && kept == ticks.len() {
                break;
            }
        }
        Ok(verdict)
    }

    /// The least residual with weights on the given ticks only, or one of at most `tolerance`. `poles` are
    /// the places that held it down, to start the next of a kind with.
    pub(super) fn reweighted(
        &self,
        ticks: &[u32],
        end_tick: u32,
        tolerance: f64,
        poles: &mut Vec<Pole>,
    ) -> Result<(RealTaps, f64), ShapeError> {
        let mut best = (Vec::new(), f64::INFINITY);
        for _ in 0..ROUNDS {
            let answer = self.programme(ticks, poles, end_tick).solve()?;
            let taps = normalised(ticks, &answer.weights);
            let held = poles.iter().map(|pole| self.ringing(&taps, pole, end_tick)).fold(0.0, f64::max);
            let peaks = self.peaks(&taps, end_tick, FINER);
            let worst = peaks.iter().map(|peak| peak.residual).fold(0.0, f64::max);
            if worst < best.1 {
                best = (taps, worst);
            }
            let more: Vec<Pole> = beyond(&peaks, held, self.accuracy).collect();
            if worst <= tolerance || held > tolerance + self.accuracy || more.is_empty() {
                break;
            }
            poles.extend(more);
        }
        Ok(best)
    }

    fn programme<'p>(&self, ticks: &'p [u32], poles: &'p [Pole], end_tick: u32) -> Programme<'p> {
        Programme {
            ticks,
            poles,
            end_tick,
            tick_s: self.tick_s,
            negative_limit: self.negative_limit,
            accuracy: self.accuracy,
        }
    }

    /// The constraint grid of all boxes, and what held the last answer down.
    pub(super) fn first_poles(&self, end_tick: u32, memory: &Memory) -> Vec<Pole> {
        let duration_s = f64::from(end_tick) * self.tick_s;
        let grids = self.modes.iter().flat_map(|mode| boundary::grid(mode, duration_s));
        grids.chain(memory.poles.iter().copied()).collect()
    }

    /// The residual's local maxima over all boxes.
    pub(super) fn peaks(&self, taps: &[(u32, f64)], end_tick: u32, finer: usize) -> Vec<Peak> {
        let duration_s = f64::from(end_tick) * self.tick_s;
        let residual = |pole: &Pole| self.ringing(taps, pole, end_tick);
        self.modes.iter().flat_map(|mode| boundary::peaks(mode, duration_s, finer, &residual)).collect()
    }

    fn ringing(&self, taps: &[(u32, f64)], pole: &Pole, end_tick: u32) -> f64 {
        let end_s = f64::from(end_tick) * self.tick_s;
        let sum = taps.iter().fold(Complex::default(), |sum, (tick, weight)| {
            sum + pole.ringing(f64::from(*tick) * self.tick_s, end_s).scaled(*weight)
        });
        sum.magnitude()
    }

    /// g of every tick.
    fn prices(&self, end_tick: u32, poles: &[Pole], multipliers: &[Complex]) -> Vec<f64> {
        let mut prices = vec![0.0; end_tick as usize + 1];
        let end_s = f64::from(end_tick) * self.tick_s;
        for (pole, multiplier) in poles.iter().zip(multipliers) {
            // What weighs less than this cannot move the bound by more than it.
            if multiplier.magnitude() < 1e-13 {
                continue;
            }
            let (mut phi, step) = (pole.ringing(0.0, end_s), pole.step(self.tick_s));
            for price in &mut prices {
                *price += phi.along(*multiplier);
                phi = phi * step;
            }
        }
        prices
    }

    fn bound(&self, prices: &[f64]) -> f64 {
        let least = prices.iter().copied().fold(f64::INFINITY, f64::min);
        let most = prices.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (1.0 + self.negative_limit) * least - self.negative_limit * most
    }

    fn first_ticks(&self, end_tick: u32, memory: &Memory) -> Vec<u32> {
        let even = if memory.taps.is_empty() { FIRST_TAPS } else { EVEN_TAPS };
        let mut ticks: Vec<u32> = (0..=even)
            .map(|place| (u64::from(end_tick) * u64::from(place) / u64::from(even)) as u32)
            .collect();
        for fraction in &memory.taps {
            let tick = (fraction * f64::from(end_tick)).round() as u32;
            ticks.extend(tick.saturating_sub(1)..=tick.saturating_add(1).min(end_tick));
        }
        ticks.sort_unstable();
        ticks.dedup();
        ticks
    }
}

impl Memory {
    fn remember(&mut self, taps: &[(u32, f64)], poles: &[Pole], multipliers: &[Complex], end_tick: u32) {
        let weighty = taps.iter().filter(|(_, weight)| weight.abs() > NO_WEIGHT);
        self.taps = weighty.map(|(tick, _)| f64::from(*tick) / f64::from(end_tick.max(1))).collect();
        let active =
            poles.iter().zip(multipliers).filter(|(_, multiplier)| multiplier.magnitude() > NO_WEIGHT);
        self.poles = active.map(|(pole, _)| *pole).collect();
    }
}

/// The peaks that rise above what the programme held down.
fn beyond(peaks: &[Peak], held: f64, accuracy: f64) -> impl Iterator<Item = Pole> + '_ {
    peaks.iter().filter(move |peak| peak.residual > held + accuracy).map(|peak| peak.pole)
}

fn verdict_taps(ticks: &[u32], weights: &[f64]) -> RealTaps {
    ticks.iter().copied().zip(weights.iter().copied()).collect()
}

/// Weights above rounding, summing to one.
fn normalised(ticks: &[u32], weights: &[f64]) -> RealTaps {
    let mut taps = verdict_taps(ticks, weights);
    taps.retain(|(_, weight)| weight.abs() > 1e-11);
    let sum: f64 = taps.iter().map(|(_, weight)| weight).sum();
    for (_, weight) in &mut taps {
        *weight /= sum;
    }
    taps
}

/// Drops the dearer half of the ticks without weight when there are many.
fn keep_cheap(ticks: &mut Vec<u32>, weights: &[f64], prices: &[f64]) {
    if ticks.len() <= MANY_TAPS {
        return;
    }
    let price = |tick: u32| prices.get(tick as usize).copied().unwrap_or(f64::INFINITY);
    let (used, mut idle): (Vec<_>, Vec<_>) =
        ticks.iter().copied().zip(weights).partition(|(_, weight)| weight.abs() > NO_WEIGHT);
    idle.sort_by(|(a, _), (b, _)| price(*a).total_cmp(&price(*b)));
    idle.truncate(MANY_TAPS / 2);
    *ticks = used.into_iter().chain(idle).map(|(tick, _)| tick).collect();
    ticks.sort_unstable();
}

/// Adds the ticks at the local minima of the prices below what the programme's own taps cost, with their
/// neighbours where a tap is near already; with negative weights the maxima above them too.
fn add_priced(ticks: &mut Vec<u32>, prices: &[f64], both_ways: bool) {
    let known = ticks.clone();
    let near = |tick: u32| {
        let place = known.partition_point(|other| *other < tick);
        let beside = [known.get(place), place.checked_sub(1).and_then(|before| known.get(before))];
        beside.into_iter().flatten().any(|other| other.abs_diff(tick) <= NEAR)
    };
    for sign in [1.0, -1.0].into_iter().take(if both_ways { 2 } else { 1 }) {
        let price = |index: usize| prices.get(index).map_or(f64::INFINITY, |price| sign * price);
        let least = known.iter().map(|tick| price(*tick as usize)).fold(f64::INFINITY, f64::min);
        for (index, tick) in (0..prices.len()).zip(0_u32..) {
            let here = price(index);
            let before = index.checked_sub(1).map_or(f64::INFINITY, price);
            if here < least && here <= before && here < price(index + 1) {
                ticks.push(tick);
                if near(tick) {
                    ticks.extend(tick.checked_sub(1));
                    ticks.extend(Some(tick + 1).filter(|next| (*next as usize) < prices.len()));
                }
            }
        }
    }
    ticks.sort_unstable();
    ticks.dedup();
}
