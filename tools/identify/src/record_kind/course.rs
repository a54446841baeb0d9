//! Whether the loudness of a record falls once and for all.
//!
//! Two things show a decay. A few decaying oscillations explain most of it from its peak on, however they
//! beat; or its loudness falls steadily, however its frequency and damping change with amplitude. In either
//! case what comes before the peak is small beside what follows.

use super::rms;
use crate::modal_response::{Pole, free_response};
use crate::narrow_band::WholeSpectrum;
use crate::poles::{decimated, eigensystem_realisation};
use crate::tall::{Orthonormal, dot};

/// Blocks of which the loudness is taken.
const BLOCKS: usize = 48;
/// Order of the realisation: so many half modes, noise among them.
const ORDER: usize = 16;
/// Samples per period of the loudest frequency, and most samples, that the oscillations are fitted to.
const PER_PERIOD: f64 = 10.0;
const MOST: usize = 3000;
/// Share of the energy from the peak on that decaying oscillations explain.
const EXPLAINED: f64 = 0.6;
/// Nepers by which the loudness falls at least, from the first third to the last: less shows no decay.
const FALLS: f64 = 0.2;
/// The same of each oscillation over the record.
const ONE_FALLS: f64 = 0.2;
/// Share of the energy that oscillations explain where nothing drives them any more.
const RINGS: f64 = 0.9;
/// The same where nothing but the course speaks for a decay, and how much of the course is falling.
const FALLS_STEADILY: (f64, f64) = (0.7, 0.85);
/// Share of the energy that oscillations explain of what is a decay beyond doubt.
const BEYOND_DOUBT: f64 = 0.97;
/// Share of the energy that may come before the peak of what is a decay beyond doubt: a sweep builds its
/// resonance up.
const NOTHING_BEFORE: f64 = 0.02;
/// Share of its loudest block from which a signal has begun, and nepers by which each oscillation of ringing
/// that hardly falls does fall over the record.
const LOUD: f64 = 0.3;
const BARELY_FALLS: f64 = 0.05;
/// Share of the energy that may come before the peak.
const BEFORE: f64 = 0.35;

/// Whether a signal without its trend is a free decay.
pub(super) fn is_decay(signal: &[f64], interval_s: f64) -> bool {
    let block = (signal.len() / BLOCKS).max(4);
    let loudness: Vec<f64> = signal.chunks(block).map(rms).collect();
    let top = |a: &usize, b: &usize| loudness[*a].total_cmp(&loudness[*b]);
    let Some(peak) = (0..loudness.len()).rev().max_by(top) else { return false };
    let energy = |some: &[f64]| some.iter().map(|r| r * r).sum::<f64>();
    if energy(&loudness[..peak]) > BEFORE * energy(&loudness) {
        return false;
    }
    let after = &loudness[peak..];
    if after.len() < 6 {
        // The record ends where it begins to ring: what little follows is all there is to read.
        return true;
    }
    let third = after.len() / 3;
    let level = |some: &[f64]| (energy(some) / some.len() as f64).sqrt().max(f64::MIN_POSITIVE);
    let fall = (level(&after[..third]) / level(&after[after.len() - third..])).ln();
    let [least, steady] = [FALLS_STEADILY.0, FALLS_STEADILY.1];
    if fall > least && share_falling(after) > steady {
        return true;
    }
    fall > FALLS && explained(&signal[peak * block..], interval_s) > EXPLAINED
}

/// Whether a signal is a decay beyond doubt: nothing is loud before its peak, and a few oscillations that
/// decay explain nearly all that follows.
pub(super) fn is_plain(signal: &[f64], interval_s: f64) -> bool {
    let block = (signal.len() / BLOCKS).max(4);
    let loudness: Vec<f64> = signal.chunks(block).map(rms).collect();
    let top = |a: &usize, b: &usize| loudness[*a].total_cmp(&loudness[*b]);
    let Some(peak) = (0..loudness.len()).rev().max_by(top) else { return false };
    let energy = |some: &[f64]| some.iter().map(|r| r * r).sum::<f64>();
    let quiet_before = energy(&loudness[..peak]) < NOTHING_BEFORE * energy(&loudness);
    quiet_before && explained(&signal[peak * block..], interval_s) > BEYOND_DOUBT
}

/// Whether a signal rings and hardly falls: nothing is loud before it begins, and a few oscillations explain
/// nearly all that follows, each of which falls. Lines that are driven do not fall at all.
pub(super) fn hardly_falls(signal: &[f64], interval_s: f64) -> bool {
    let block = (signal.len() / BLOCKS).max(4);
    let loudness: Vec<f64> = signal.chunks(block).map(rms).collect();
    let top = loudness.iter().fold(0.0_f64, |top, r| top.max(*r));
    let Some(begins) = loudness.iter().position(|r| *r > LOUD * top) else { return false };
    let energy = |some: &[f64]| some.iter().map(|r| r * r).sum::<f64>();
    // Within the block in which it begins there is still silence.
    let from = if begins > 0 { (begins + 1) * block } else { 0 };
    let after = signal.get(from..).unwrap_or_default();
    energy(&loudness[..begins]) < NOTHING_BEFORE * energy(&loudness)
        && after.len() > signal.len() / 2
        && explained_by(after, interval_s, BARELY_FALLS) > BEYOND_DOUBT
}

/// Whether a few oscillations that decay at all explain nearly all of a signal.
pub(super) fn rings(signal: &[f64], interval_s: f64) -> bool {
    explained_by(signal, interval_s, 0.0) > RINGS
}

/// Share of the scatter of the logarithm of a loudness that the best falling curve explains.
fn share_falling(loudness: &[f64]) -> f64 {
    let logs: Vec<f64> = loudness.iter().map(|r| r.max(f64::MIN_POSITIVE).ln()).collect();
    // Pools of neighbours that do not fall (isotonic regression): sum and count of each.
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for value in &logs {
        pools.push((*value, 1));
        while let [.., a, b] = pools.as_slice()
            && a.0 / (a.1 as f64) <= b.0 / b.1 as f64
        {
            let joined = (a.0 + b.0, a.1 + b.1);
            pools.truncate(pools.len() - 2);
            pools.push(joined);
        }
    }
    let curve = pools.iter().flat_map(|(sum, count)| std::iter::repeat_n(sum / *count as f64, *count));
    let mean = logs.iter().sum::<f64>() / logs.len() as f64;
    let left: f64 = logs.iter().zip(curve).map(|(log, fitted)| (log - fitted).powi(2)).sum();
    let all: f64 = logs.iter().map(|log| (log - mean).powi(2)).sum();
    if all > 0.0 { 1.0 - left / all } else { 0.0 }
}

/// Share of a signal's energy that the oscillations of its realisation explain that decay.
fn explained(signal: &[f64], interval_s: f64) -> f64 {
    explained_by(signal, interval_s, ONE_FALLS)
}

/// The same of the oscillations that fall by more than so many nepers over the signal.
fn explained_by(signal: &[f64], interval_s: f64, least_fall: f64) -> f64 {
    let Some(loudest_hz) = WholeSpectrum::new(signal, interval_s).strongest_hz() else { return 0.0 };
    let (mut slow, step_s) = decimated(signal, interval_s, PER_PERIOD * loudest_hz);
    slow.truncate(MOST);
    let time_s: Vec<f64> = (0..slow.len()).map(|k| k as f64 * step_s).collect();
    let mut basis = Orthonormal::default();
    let length_s = slow.len() as f64 * step_s;
    for pole in eigensystem_realisation(&slow, step_s, ORDER.min(slow.len() / 6)) {
        // Lines that stay are no decay, and heavy damping fits anything.
        let falls = std::f64::consts::TAU * pole.frequency_hz * pole.damping_ratio * length_s;
        if falls > least_fall && pole.damping_ratio < 0.9 {
            let pole = Pole { frequency_hz: pole.frequency_hz, damping_ratio: pole.damping_ratio };
            free_response(pole, 0.0, &time_s).into_iter().for_each(|column| basis.push(column));
        }
    }
    let mut left = slow.clone();
    basis.remove_from(&mut left);
    let all = dot(&slow, &slow);
    if all > 0.0 { 1.0 - dot(&left, &left) / all } else { 0.0 }
}
