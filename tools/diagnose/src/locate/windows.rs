//! When: the stretches of time that hold most of what noise does not explain.

use stillbeam_recording::Role;

use crate::noise::NoiseFloor;
use crate::study::{OnAll, Study};

/// Stretches of time in which the mismatch sits.
pub(crate) struct Windows {
    /// Which output shows it most.
    pub(crate) output: usize,
    /// `[from, to]` in seconds, of the recording that shows it most.
    pub(crate) stretches: Vec<[f64; 2]>,
    /// Share (0 to 1) of that recording's unexplained energy in them.
    pub(crate) share: f64,
    pub(crate) sentence: Option<String>,
}

/// Seconds of one window.
const WINDOW_S: f64 = 2.0;
/// Windows are taken, strongest first, until they hold this share.
const MOST: f64 = 0.6;

/// The windows of the training recording and output whose residual exceeds its noise most.
pub(crate) fn windows(study: &Study, on_all: &OnAll, floors: &[Option<NoiseFloor>]) -> Windows {
    let mut best: Option<(f64, Windows)> = None;
    for (output, floor) in floors.iter().enumerate() {
        let Some(floor) = floor else { continue };
        for part in study.parts(on_all, output).iter().filter(|part| part.record.role == Role::Train) {
            let times_s = part.record.times_s(part.output);
            let length = ((WINDOW_S * part.record.rate_hz(part.output)) as usize).max(8);
            let excess: Vec<f64> = part
                .residual
                .chunks(length)
                .map(|chunk| {
                    let power: f64 = chunk.iter().map(|value| value * value).sum();
                    (power - chunk.len() as f64 * floor.rms * floor.rms).max(0.0)
                })
                .collect();
            let total: f64 = excess.iter().sum();
            let weight = total / (floor.rms * floor.rms).max(f64::MIN_POSITIVE);
            if total <= 0.0 || best.as_ref().is_some_and(|(before, _)| *before >= weight) {
                continue;
            }
            let (chosen, share) = strongest(&excess, total);
            let end = |window: usize| times_s[((window + 1) * length).min(times_s.len()) - 1];
            let stretches: Vec<[f64; 2]> =
                runs(&chosen).into_iter().map(|(a, b)| [times_s[a * length], end(b)]).collect();
            let text: Vec<String> = stretches.iter().map(|[a, b]| format!("{a:.0} to {b:.0} s")).collect();
            let sentence = format!(
                "{:.0} % of what noise does not explain in {} of {} lies at {}.",
                100.0 * share,
                part.record.outputs[part.output].column,
                part.record.name,
                text.join(", ")
            );
            best = Some((weight, Windows { output, stretches, share, sentence: Some(sentence) }));
        }
    }
    best.map_or_else(
        || Windows { output: 0, stretches: Vec::new(), share: 0.0, sentence: None },
        |(_, windows)| windows,
    )
}

/// Which of the values, strongest first, hold most of the total, and what share they hold.
pub(crate) fn strongest(values: &[f64], total: f64) -> (Vec<bool>, f64) {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*b].total_cmp(&values[*a]));
    let mut chosen = vec![false; values.len()];
    let mut sum = 0.0;
    for index in order {
        if sum >= MOST * total {
            break;
        }
        chosen[index] = true;
        sum += values[index];
    }
    (chosen, sum / total)
}

/// First and last index of every run of neighbours; single gaps are closed.
pub(crate) fn runs(chosen: &[bool]) -> Vec<(usize, usize)> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for (index, _) in chosen.iter().enumerate().filter(|(_, chosen)| **chosen) {
        match runs.last_mut() {
            Some((_, end)) if index <= *end + 2 => *end = index,
            _ => runs.push((index, index)),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_become_one_stretch() {
        assert_eq!(runs(&[true, false, true, false, false, true]), vec![(0, 2), (5, 5)]);
        let (chosen, share) = strongest(&[1.0, 5.0, 0.0, 2.0], 8.0);
        assert_eq!(chosen, vec![false, true, false, false]);
        assert!((share - 0.625).abs() < 1e-12);
    }
}
