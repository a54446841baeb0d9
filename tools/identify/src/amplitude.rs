//! Frequency and damping as functions of amplitude: the backbone and the damping curve of a mode.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::column::Column;
use crate::forced_model::{ForcedModel, pole, pole_parameters};
use crate::forced_record::ForcedRecord;
use crate::modal_response::Pole;
use crate::narrow_band::NarrowBand;
use crate::result::Estimate;
use crate::separable::{Separable, fit, fit_covariance};
use crate::warnings::Quantity;

/// A mode in one stretch of a record.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AmplitudePoint {
    /// Amplitude of the mode there, in the output's unit: of a decay the geometric mean, of a forced record
    /// the rms times the square root of two.
    pub amplitude: f64,
    /// Beginning and end of the stretch, s.
    pub window_s: [f64; 2],
    /// Natural frequency there, Hz.
    pub frequency_hz: Estimate,
    /// Damping ratio there.
    pub damping_ratio: Estimate,
}

/// How a quantity of a mode changes with amplitude.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AmplitudeChange {
    /// What changes.
    pub quantity: Quantity,
    /// Its value at small amplitude.
    pub small: Estimate,
    /// Its value at large amplitude.
    pub large: Estimate,
    /// The small amplitude, in the output's unit.
    pub small_amplitude: f64,
    /// The large amplitude.
    pub large_amplitude: f64,
}

impl AmplitudeChange {
    /// The change of the mode at `mode_hz`, in words.
    pub(crate) fn words(&self, mode_hz: f64) -> String {
        format!(
            "the {} of the mode at {mode_hz:.4} Hz {} by {:.2} %, from {:.6} at amplitude {:.2e} to {:.6} at {:.2e} ({:.1} standard errors)",
            self.quantity.plain_words(),
            if self.large.value < self.small.value { "falls" } else { "rises" },
            100.0 * (self.large.value / self.small.value - 1.0).abs(),
            self.small.value,
            self.small_amplitude,
            self.large.value,
            self.large_amplitude,
            self.small.distance(&self.large)
        )
    }
}

/// Standard errors from which a change counts, and where the course of a decay is known to bend: only what
/// bends is then asked.
pub(crate) const CLEAR: f64 = 4.0;
pub(crate) const CLEAR_WHERE_BENT: f64 = 2.0;
/// Shares of frequency and of damping from which it matters to a shaper.
pub(crate) const MATTERS: [f64; 2] = [0.001, 0.1];
/// Amplitudes must differ by this factor.
const APART: f64 = 1.3;
/// Errors, as shares, above which a point of the curve says nothing.
const WORTHLESS: [f64; 2] = [0.02, 0.5];

/// One of a point's quantities.
type Pick = fn(&AmplitudePoint) -> Estimate;

/// What changes with amplitude, clearly and enough to matter: the third of the points with the smallest
/// amplitude against the third with the largest.
pub(crate) fn changes(points: &[AmplitudePoint], clear: f64) -> Vec<AmplitudeChange> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.amplitude.total_cmp(&b.amplitude));
    let third = sorted.len().div_ceil(3);
    if sorted.len() < 2 {
        return Vec::new();
    }
    let (small, large) = (&sorted[..third], &sorted[sorted.len() - third..]);
    let middle = |some: &[AmplitudePoint]| {
        (some.iter().map(|point| point.amplitude.ln()).sum::<f64>() / some.len() as f64).exp()
    };
    let (small_amplitude, large_amplitude) = (middle(small), middle(large));
    let quantities: [(Quantity, Pick); 2] = [
        (Quantity::FrequencyHz, |point| point.frequency_hz),
        (Quantity::DampingRatio, |point| point.damping_ratio),
    ];
    let pairs = quantities.into_iter().zip(MATTERS).filter_map(|((quantity, pick), share)| {
        let (small, large) = (mean(small.iter().map(pick)), mean(large.iter().map(pick)));
        let counts = small.distance(&large) > clear
            && (small.value - large.value).abs() > share * large.value.abs()
            && large_amplitude > APART * small_amplitude;
        counts.then_some(AmplitudeChange { quantity, small, large, small_amplitude, large_amplitude })
    });
    pairs.collect()
}

/// The changes with the amplitude of a forced record's stretches, less those that go with time as well as
/// with the amplitude.
pub(crate) fn changes_not_in_time(points: &[AmplitudePoint], clear: f64) -> Vec<AmplitudeChange> {
    let third = points.len().div_ceil(3);
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.window_s[0].total_cmp(&b.window_s[0]));
    let in_time = |pick: Pick| {
        let (early, late) = (&sorted[..third], &sorted[sorted.len() - third..]);
        mean(early.iter().map(pick)).distance(&mean(late.iter().map(pick)))
    };
    let mut found = changes(points, clear);
    found.retain(|change| {
        let pick: Pick = match change.quantity {
            Quantity::FrequencyHz => |point| point.frequency_hz,
            Quantity::DampingRatio => |point| point.damping_ratio,
        };
        change.small.distance(&change.large) > in_time(pick)
    });
    found
}

/// The plain mean: weighing by error would weigh the middle of the curve, where points are sharpest.
fn mean(estimates: impl Iterator<Item = Estimate> + Clone) -> Estimate {
    let count = estimates.clone().count() as f64;
    let variance: f64 = estimates.clone().map(|estimate| estimate.stderr.powi(2)).sum();
    Estimate {
        value: estimates.map(|estimate| estimate.value).sum::<f64>() / count,
        stderr: variance.sqrt() / count,
    }
}

fn says_something(point: &AmplitudePoint) -> bool {
    let [frequency, damping] = WORTHLESS;
    point.frequency_hz.stderr < frequency * point.frequency_hz.value
        && point.damping_ratio.stderr < damping * point.damping_ratio.value
        && point.frequency_hz.stderr > 0.0
        && point.damping_ratio.stderr > 0.0
}

/// Stretches per factor e of amplitude, and how many at most.
const PER_NEPER: f64 = 1.5;
const MOST_POINTS: usize = 14;

/// The course of one mode of a free decay: stretches of equal fall of its own band's amplitude.
pub(crate) fn of_decay(band: &NarrowBand, usable: Range<usize>, origin_s: f64) -> Vec<AmplitudePoint> {
    let size: Vec<f64> = band.amplitude.iter().map(|z| z.norm()).collect();
    let (Some(first), Some(last)) = (size.get(usable.start), size.get(usable.end.wrapping_sub(1))) else {
        return Vec::new();
    };
    let depth = (first / last).ln();
    if depth.is_nan() || depth < 1.0 {
        return Vec::new();
    }
    let pieces = ((PER_NEPER * depth) as usize).clamp(2, MOST_POINTS);
    let mut points = Vec::new();
    let mut start = usable.start;
    for piece in 1..=pieces {
        let level = first * (-depth * piece as f64 / pieces as f64).exp();
        let end = match piece == pieces {
            true => usable.end,
            false => (start..usable.end).find(|&k| size[k] < level).unwrap_or(usable.end),
        };
        // Stretches with too little to fit join the next one.
        if end - start < 10 {
            continue;
        }
        if let Some(found) = band.fit(start..end) {
            let mean = size[start..end].iter().map(|a| a.ln()).sum::<f64>() / (end - start) as f64;
            points.push(AmplitudePoint {
                amplitude: mean.exp(),
                window_s: [band.time_s[start] + origin_s, band.time_s[end - 1] + origin_s],
                frequency_hz: found.frequency_hz,
                damping_ratio: found.damping_ratio,
            });
        }
        start = end;
    }
    points.retain(says_something);
    points
}

/// Stretches of a forced record, decay times and periods per stretch at least.
const STRETCHES: usize = 12;
const DECAY_TIMES: f64 = 2.0;
const PERIODS: f64 = 12.0;

/// The course of one mode of forced records: each stretch is fitted on its own, from its own initial state,
/// the other modes held where the whole records put them.
pub(crate) fn of_forced(model: &ForcedModel<'_>, parameters: &[f64], mode: usize) -> Vec<AmplitudePoint> {
    let own = pole(parameters, mode);
    let others: Vec<Pole> =
        (0..model.modes).filter(|other| *other != mode).map(|other| pole(parameters, other)).collect();
    let delay_s = model.delay_s(parameters);
    let shortest_s = (DECAY_TIMES * own.decay_time_s()).max(PERIODS / own.frequency_hz);
    let mut points = Vec::new();
    for record in model.records {
        let pieces = ((record.duration_s() / shortest_s) as usize).min(STRETCHES);
        let rows = record.time_s.len();
        if pieces < 2 {
            continue;
        }
        for piece in 0..pieces {
            let range = piece * rows / pieces..(piece + 1) * rows / pieces;
            let held = Held { others: &others, rate_per_s: model.rate_per_s(parameters), delay_s };
            points.extend(stretch(record.between(range, delay_s), own, held, model.direct));
        }
    }
    points.retain(says_something);
    points
}

/// What stays where the whole records put it while one mode is fitted to a stretch.
struct Held<'p> {
    others: &'p [Pole],
    /// Rate of a real pole, 1/s.
    rate_per_s: Option<f64>,
    delay_s: f64,
}

fn stretch(record: ForcedRecord, own: Pole, held: Held<'_>, direct: bool) -> Option<AmplitudePoint> {
    let Held { others, rate_per_s, delay_s } = held;
    let records = [record];
    let real_pole = rate_per_s.is_some();
    let fixed =
        ForcedModel { records: &records, modes: 0, delay: false, max_delay_s: 0.0, direct, real_pole };
    let held = others
        .iter()
        .flat_map(|pole| fixed.mode_columns(*pole, delay_s))
        .chain(rate_per_s.into_iter().flat_map(|rate| fixed.real_pole_columns(rate, delay_s)))
        .chain(std::iter::once(vec![1.0; records[0].time_s.len()].into()))
        .collect();
    let window = Stretch { model: fixed, held, delay_s };
    let found = fit(&window, &pole_parameters(own, 0.1))?;
    let covariance = fit_covariance(&window, &found)?;
    let stderr = |index: usize| covariance[(index, index)].max(0.0).sqrt();
    let here = pole(&found.parameters, 0);
    let mut contribution = vec![0.0; records[0].time_s.len()];
    for (column, coefficient) in window.block(0, &found.parameters).iter().zip(&found.point.coefficients) {
        column.add_to(&mut contribution, *coefficient);
    }
    let power = contribution.iter().map(|y| y * y).sum::<f64>() / contribution.len() as f64;
    let ends = [records[0].time_s.first()?, records[0].time_s.last()?];
    // Far from its resonance a mode follows the input, and what it does there hardly depends on its pole.
    let heard_hz = crossing_rate_hz(&contribution, ends[1] - ends[0]);
    if (heard_hz / here.frequency_hz - 1.0).abs() > AT_RESONANCE.max(2.0 * here.damping_ratio) {
        return None;
    }
    Some(AmplitudePoint {
        amplitude: (2.0 * power).sqrt(),
        window_s: ends.map(|t| t + records[0].origin_s),
        frequency_hz: Estimate { value: here.frequency_hz, stderr: here.frequency_hz * stderr(0) },
        damping_ratio: Estimate { value: here.damping_ratio, stderr: here.damping_ratio * stderr(1) },
    })
}

/// Share of its frequency within which a mode must be heard.
const AT_RESONANCE: f64 = 0.1;

/// Half the rate at which a signal changes its sign, Hz: the frequency of what dominates it.
fn crossing_rate_hz(signal: &[f64], duration_s: f64) -> f64 {
    let crossings = signal.windows(2).filter(|pair| (pair[0] < 0.0) != (pair[1] < 0.0)).count();
    0.5 * crossings as f64 / duration_s
}

/// One mode free, everything else held.
struct Stretch<'r> {
    model: ForcedModel<'r>,
    held: Vec<Column>,
    delay_s: f64,
}

impl Separable for Stretch<'_> {
    fn target(&self, _: &[f64]) -> Vec<f64> {
        self.model.target(&[])
    }

    fn blocks(&self) -> usize {
        2
    }

    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Column> {
        match block {
            0 => self.model.mode_columns(pole(parameters, 0), self.delay_s),
            _ => self.held.clone(),
        }
    }

    fn depends(&self, block: usize, _: usize) -> bool {
        block == 0
    }

    fn tangents(
        &self,
        block: usize,
        parameters: &[f64],
        columns: &[Column],
        coefficients: &[f64],
    ) -> Vec<(usize, Column)> {
        if block > 0 {
            return Vec::new();
        }
        // A delay is held, not searched: it goes in as one more parameter whose tangent is dropped.
        let free = ForcedModel { modes: 1, delay: true, ..self.model };
        let parameters: Vec<f64> = parameters.iter().copied().chain([self.delay_s]).collect();
        let mut tangents = free.tangents(0, &parameters, columns, coefficients);
        tangents.truncate(2);
        tangents
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(amplitude: f64, frequency_hz: f64) -> AmplitudePoint {
        AmplitudePoint {
            amplitude,
            window_s: [0.0, 1.0],
            frequency_hz: Estimate { value: frequency_hz, stderr: 0.01 },
            damping_ratio: Estimate { value: 0.01, stderr: 1e-4 },
        }
    }

    #[test]
    fn a_change_counts_when_it_is_clear_matters_and_goes_with_amplitude() {
        let hardening: Vec<AmplitudePoint> =
            (1..=6).map(|k| point(f64::from(k), 10.0 + 0.02 * f64::from(k * k))).collect();
        let found = changes(&hardening, CLEAR);
        assert_eq!(found.len(), 1);
        assert!(found[0].quantity == Quantity::FrequencyHz && found[0].large.value > found[0].small.value);
        let steady: Vec<AmplitudePoint> = (1..=6).map(|k| point(f64::from(k), 10.0)).collect();
        assert!(changes(&steady, CLEAR).is_empty());
        // The same change at one amplitude is not one with amplitude.
        let drifting: Vec<AmplitudePoint> =
            (1..=6).map(|k| point(1.0 + 0.01 * f64::from(k), 10.0 + 0.02 * f64::from(k * k))).collect();
        assert!(changes(&drifting, CLEAR).is_empty());
        assert!(changes(&hardening[..1], CLEAR).is_empty() && changes(&[], CLEAR).is_empty());
    }
}
