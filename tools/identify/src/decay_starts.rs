//! Where the fit of a free decay starts: at the peaks of its averaged spectrum, and at what stays in place
//! over the orders of an eigensystem realisation.
//!
//! A short decay has no averaged spectrum to speak of: segments long enough to tell its modes apart hold all
//! of it once. The realisation uses every sample's phase, so it sees a belt that rings for a tenth of a
//! second under noise.

use crate::decay_modes::{Part, Uniform, find_parts, pair_at, part_at, remainder};
use crate::forced_fit::MAX_MODES;
use crate::modal_response::{Pole, free_response};
use crate::narrow_band::WholeSpectrum;
use crate::poles::{PoleMethod, Survey};
use crate::result::Rejected;
use crate::tall::{Orthonormal, dot};

/// Share of its frequency within which a find is what a known mode leaves behind because it does not decay as
/// a linear mode does, and half-power bandwidths within which two finds are one mode.
const SAME: (f64, f64) = (0.05, 1.5);

/// The modes that stand out, at most `wanted` of them from the lowest on; where fewer do, the search for that
/// many. Candidates that are no modes go into `rejected`, with the reason; beside the modes comes the root
/// mean square of what they and those above the wanted ones leave, where there are any above.
pub(crate) fn starting_parts(
    uniform: &Uniform,
    survey: &Survey,
    wanted: Option<usize>,
    rejected: &mut Vec<Rejected>,
) -> (Vec<Part>, Option<f64>) {
    let mut parts = with_realised(find_parts(uniform, None, rejected), uniform, survey, rejected);
    let Some(wanted) = wanted else { return (parts, None) };
    if parts.len() < wanted {
        rejected.clear();
        parts = with_realised(find_parts(uniform, Some(wanted), rejected), uniform, survey, rejected);
    }
    while parts.len() < wanted && split_one(&mut parts, uniform) {}
    rejected.extend(parts.iter().skip(wanted).map(|part| Rejected::Pole {
        frequency_hz: part.pole.frequency_hz,
        damping_ratio: Some(part.pole.damping_ratio),
        reason: format!("above the lowest {wanted} modes, which were asked for"),
    }));
    let left_rms = (parts.len() > wanted).then(|| {
        let left = remainder(&uniform.without_mean(), &parts, uniform.interval_s);
        (dot(&left, &left) / left.len().max(1) as f64).sqrt()
    });
    parts.truncate(wanted);
    (parts, left_rms)
}

/// Makes two modes of the strongest one that may be two; whether there was one.
fn split_one(parts: &mut Vec<Part>, uniform: &Uniform) -> bool {
    let mut order: Vec<usize> = (0..parts.len()).collect();
    order.sort_by(|a, b| parts[*b].energy.total_cmp(&parts[*a].energy));
    for index in order {
        let others: Vec<Part> =
            parts.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, part)| *part).collect();
        let left = remainder(&uniform.without_mean(), &others, uniform.interval_s);
        let whole = WholeSpectrum::new(&left, uniform.interval_s);
        let near: Vec<f64> = others.iter().map(|part| part.pole.frequency_hz).collect();
        let pair =
            pair_at(&whole, parts[index].pole.frequency_hz, &near, uniform, |values| values.possible_pair());
        if let Some(pair) = pair {
            parts.remove(index);
            parts.extend(pair);
            parts.sort_by(|a, b| a.pole.frequency_hz.total_cmp(&b.pole.frequency_hz));
            return true;
        }
    }
    false
}

/// The parts and those of the realisation's picks that are none of them and alone in their own band, by
/// frequency.
fn with_realised(
    mut parts: Vec<Part>,
    uniform: &Uniform,
    survey: &Survey,
    rejected: &mut Vec<Rejected>,
) -> Vec<Part> {
    let picks = survey.modes.iter().filter(|mode| mode.method == PoleMethod::EigensystemRealisation);
    let duration_s = uniform.duration_s();
    let mut fresh: Vec<Pole> = Vec::new();
    for pick in picks {
        let reach = |frequency_hz: f64, damping_ratio: f64| {
            (2.0 * SAME.1 * damping_ratio * frequency_hz).max(SAME.0 * frequency_hz).max(2.0 / duration_s)
        };
        let is_new = |hz: f64, damping: f64| (hz - pick.frequency_hz).abs() > reach(hz, damping);
        let known = parts.iter().all(|part| is_new(part.pole.frequency_hz, part.pole.damping_ratio));
        if known && fresh.iter().all(|pole| is_new(pole.frequency_hz, pole.damping_ratio)) {
            fresh.push(Pole { frequency_hz: pick.frequency_hz, damping_ratio: pick.damping_ratio });
        }
    }
    if fresh.is_empty() {
        return parts;
    }
    let left = remainder(&uniform.without_mean(), &parts, uniform.interval_s);
    let whole = WholeSpectrum::new(&left, uniform.interval_s);
    fresh.retain(|pole| {
        let noise = whole.noise_variance_near(pole.frequency_hz).max(f64::MIN_POSITIVE);
        let explains = explained_by(*pole, &left, uniform.interval_s) / noise;
        if explains <= SIGNIFICANT {
            rejected.push(Rejected::Pole {
                frequency_hz: pole.frequency_hz,
                damping_ratio: Some(pole.damping_ratio),
                reason: format!(
                    "stable in the eigensystem realisation, but explains no more than {explains:.0} variances of the noise around it; {SIGNIFICANT} are asked for"
                ),
            });
        }
        explains > SIGNIFICANT
    });
    let all: Vec<f64> = parts
        .iter()
        .map(|part| part.pole.frequency_hz)
        .chain(fresh.iter().map(|pole| pole.frequency_hz))
        .collect();
    parts.extend(fresh.iter().filter_map(|pole| {
        // Where noise fills the band, the realisation's own pole is the better start: the fit of the record
        // decides.
        part_at(&whole, pole.frequency_hz, &all, uniform).or_else(|| realised_part(*pole, &left, uniform))
    }));
    parts.sort_by(|a, b| b.energy.total_cmp(&a.energy));
    parts.truncate(MAX_MODES);
    parts.sort_by(|a, b| a.pole.frequency_hz.total_cmp(&b.pole.frequency_hz));
    parts
}

/// Half of the band that a realisation's pole may be searched in, in its half-power bandwidths and as a share
/// of its frequency.
const REACH: (f64, f64) = (3.0, 0.1);

/// A part that starts at a realisation's pole.
fn realised_part(pole: Pole, left: &[f64], uniform: &Uniform) -> Option<Part> {
    // The energy of a sampled decay: its sum of squares times the interval, twice for the integral of its
    // envelope.
    let energy = 2.0 * uniform.interval_s * explained_by(pole, left, uniform.interval_s);
    let width_hz = 2.0 * pole.damping_ratio * pole.frequency_hz;
    let half_width_hz = (REACH.0 * width_hz).min(REACH.1 * pole.frequency_hz).max(2.0 / uniform.duration_s());
    (energy > 0.0).then_some(Part { pole, half_width_hz, energy })
}

/// What a decay at a pole must explain, in variances of the noise around its frequency. Of noise alone the
/// best of all poles explains about twice the logarithm of the number of samples, less than 25 for any
/// record.
const SIGNIFICANT: f64 = 60.0;

/// The sum of squares that a free decay with this pole takes out of a signal.
fn explained_by(pole: Pole, signal: &[f64], interval_s: f64) -> f64 {
    let time_s: Vec<f64> = (0..signal.len()).map(|k| k as f64 * interval_s).collect();
    let mut own = Orthonormal::default();
    for column in free_response(pole, 0.0, &time_s) {
        own.push(column);
    }
    let mut left = signal.to_vec();
    own.remove_from(&mut left);
    dot(signal, signal) - dot(&left, &left)
}
