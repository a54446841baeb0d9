//! Where the modes of a function of frequency may be.

use crate::MAX_MODES;
use crate::frf::FrfEstimate;
use crate::modal_response::Pole;
use crate::poles::{Survey, survey_responses};

/// Factor by which a peak of a power spectrum tops the lowest line on either side.
const ABOVE: f64 = 1.6;
/// Frequencies this close, as a share of them, are one start.
const SAME: f64 = 3e-3;

/// What the classical methods see in responses.
pub(super) fn survey(responses: &[FrfEstimate]) -> Survey {
    survey_responses(responses)
}

/// The picks of the survey, local ones first, each place once; where nothing was picked, the largest
/// response.
pub(super) fn poles(survey: &Survey, responses: &[FrfEstimate]) -> Vec<Pole> {
    let mut poles: Vec<Pole> = Vec::new();
    for seen in survey.modes.iter().rev().filter(|seen| seen.damping_ratio > 0.0) {
        let pole = Pole { frequency_hz: seen.frequency_hz, damping_ratio: seen.damping_ratio.min(0.4) };
        let known = |other: &Pole| {
            let away = (other.frequency_hz / pole.frequency_hz).ln().abs();
            away < SAME.max(0.5 * pole.damping_ratio.min(other.damping_ratio))
        };
        if !poles.iter().any(known) {
            poles.push(pole);
        }
    }
    if poles.is_empty() {
        poles.extend(responses.iter().filter_map(|frf| {
            let sizes = frf.frequency_hz.iter().zip(&frf.response);
            let (hz, _) = sizes.max_by(|a, b| a.1.norm().total_cmp(&b.1.norm()))?;
            Some(Pole { frequency_hz: *hz, damping_ratio: 0.02 })
        }));
    }
    poles.truncate(2 * MAX_MODES);
    poles
}

/// Peaks of a power spectrum with their half-power widths, the most prominent first.
pub(super) fn peaks(frequency_hz: &[f64], density: &[f64]) -> Vec<Pole> {
    let smooth = |k: usize| {
        let around = &density[k.saturating_sub(1)..(k + 2).min(density.len())];
        around.iter().sum::<f64>() / around.len() as f64
    };
    let smoothed: Vec<f64> = (0..density.len()).map(smooth).collect();
    let mut found: Vec<(f64, Pole)> = (1..smoothed.len().saturating_sub(1))
        .filter(|&k| smoothed[k] >= smoothed[k - 1] && smoothed[k] > smoothed[k + 1])
        .filter_map(|k| {
            // Down to the lowest line before the spectrum climbs above the peak.
            let lowest = |side: &mut dyn Iterator<Item = usize>| {
                side.take_while(|&other| smoothed[other] <= smoothed[k])
                    .fold(smoothed[k], |low, other| low.min(smoothed[other]))
            };
            let prominence =
                smoothed[k] / lowest(&mut (0..k).rev()).max(lowest(&mut (k + 1..smoothed.len())));
            let half = 0.5 * smoothed[k];
            let ends = [
                first_below(&smoothed, (0..k).rev(), half),
                first_below(&smoothed, k + 1..smoothed.len(), half),
            ];
            let widths = ends.map(|end| end.map(|end| (frequency_hz[end] - frequency_hz[k]).abs()));
            let half_hz = widths.into_iter().flatten().fold(f64::INFINITY, f64::min);
            let damping_ratio = (half_hz / frequency_hz[k]).clamp(1e-4, 0.3);
            (prominence > ABOVE)
                .then_some((prominence, Pole { frequency_hz: frequency_hz[k], damping_ratio }))
        })
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().map(|(_, pole)| pole).take(2 * MAX_MODES).collect()
}

/// The first of some lines with less than a level.
fn first_below(values: &[f64], mut lines: impl Iterator<Item = usize>, level: f64) -> Option<usize> {
    lines.find(|line| values[*line] < level)
}
