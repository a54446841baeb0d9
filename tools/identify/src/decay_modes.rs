//! Finding the modes of a free decay, and looking at each one alone.

use std::f64::consts::TAU;
use std::ops::Range;

use crate::amplitude::{AmplitudePoint, of_decay};
use crate::band_models::{Pair, Values};
use crate::forced_fit::MAX_MODES;
use crate::interpolation::{InputInterpolation, PiecewiseCubic};
use crate::log_decrement::damping_from_peaks;
use crate::modal_response::{Pole, free_response};
use crate::narrow_band::{BandFit, NarrowBand, WholeSpectrum};
use crate::responses::Spectrum;
use crate::result::{CrossCheck, Rejected};
use crate::spectra::{Window, density, local_median, peaks, prominence};
use crate::tall::Orthonormal;

/// Peaks this far above the floor around them (a power ratio, 20 dB) count as modes.
const ABOVE_FLOOR: f64 = 100.0;
/// Peaks must also hold this share of the largest peak's density (60 dB in amplitude): below it leakage
/// and distortion of the large ones are as likely.
const SHARE_OF_LARGEST: f64 = 1e-6;
/// And rise this far above the valleys around them: the skirts of a large peak ripple.
const PROMINENCE: f64 = 4.0;
/// A later find this close to a known mode (share of the frequency) and this small beside it (share of the
/// energy) is what the known one leaves behind because it does not decay as a linear mode does.
const LEFTOVER: (f64, f64) = (0.05, 0.02);
/// Stamps within this share of an interval of an even grid are on it; rounding when written, not jitter.
const EVEN: f64 = 0.05;

/// Samples per sample that the band's width calls for, where the course of the decay is read off.
const FINE: usize = 4;
/// Half of a mode's own band, in half half-power bandwidths (zeta f): a dozen samples per decay time.
const WIDTHS: f64 = 40.0;
/// Ratio of one tenth's amplitude to the next one's that counts as still falling.
const STEADY_FALL: f64 = 1.2;
/// Share of its band's energy that a single decaying oscillation must explain to be taken for a mode.
const EXPLAINED: f64 = 0.7;

/// The decay on a uniform grid.
pub(crate) struct Uniform {
    samples: Vec<f64>,
    pub(crate) interval_s: f64,
    segment: usize,
    pub(crate) spectrum: Spectrum,
}

impl Uniform {
    pub(crate) fn new(time_s: &[f64], output: &[f64]) -> Self {
        let n = time_s.len();
        let duration_s = time_s[n - 1] - time_s[0];
        let interval_s = duration_s / (n - 1) as f64;
        let even = |(k, t): (usize, &f64)| (t - time_s[0] - k as f64 * interval_s).abs() < EVEN * interval_s;
        let samples = if time_s.iter().enumerate().all(even) {
            output.to_vec()
        } else {
            let curve = PiecewiseCubic::new(time_s, output, InputInterpolation::Cubic);
            let grid = (0..n).map(|k| time_s[0] + k as f64 * interval_s);
            curve.sample(grid).into_iter().map(|v| v[0]).collect()
        };
        Self::on_grid(samples, interval_s)
    }

    /// Of samples at even times.
    pub(crate) fn on_grid(samples: Vec<f64>, interval_s: f64) -> Self {
        let n = samples.len();
        // Enough averaging for a floor, enough length for the slowest modes of short records.
        let segment = (n / 8).max(n.min(512));
        let spectrum = density(&samples, interval_s, segment, Window::Hann);
        Self { samples, interval_s, segment, spectrum }
    }

    /// The decay at the grid's stamps.
    pub(crate) fn samples(&self) -> &[f64] {
        &self.samples
    }

    pub(crate) fn without_mean(&self) -> Vec<f64> {
        let mean = self.samples.iter().sum::<f64>() / self.samples.len() as f64;
        self.samples.iter().map(|value| value - mean).collect()
    }

    pub(crate) fn duration_s(&self) -> f64 {
        self.samples.len() as f64 * self.interval_s
    }

    pub(crate) fn bin_hz(&self) -> f64 {
        1.0 / (self.segment as f64 * self.interval_s)
    }
}

/// A mode as found: where to start the fit, and the band that belongs to it alone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Part {
    pub(crate) pole: Pole,
    pub(crate) half_width_hz: f64,
    /// Integral of its square over the decay, which ranks the modes.
    pub(crate) energy: f64,
}

impl Part {
    /// A mode that is the only one.
    pub(crate) fn alone(pole: Pole, half_width_hz: f64) -> Self {
        Self { pole, half_width_hz, energy: 1.0 }
    }

    fn is_left_by(&self, known: &Self) -> bool {
        let apart = (self.pole.frequency_hz - known.pole.frequency_hz).abs();
        apart < LEFTOVER.0 * known.pole.frequency_hz && self.energy < LEFTOVER.1 * known.energy
    }
}

/// The modes that stand well above the floor, by frequency; at most `requested`, the most energetic ones.
///
/// Found in rounds: what the modes found so far leave over is searched again, so that a small mode beside a
/// large one is seen once the large one is out of the way.
/// Peaks that are none go into `rejected`, with the reason.
pub(crate) fn find_parts(
    uniform: &Uniform,
    requested: Option<usize>,
    rejected: &mut Vec<Rejected>,
) -> Vec<Part> {
    let limit = requested.unwrap_or(MAX_MODES).min(MAX_MODES);
    let signal = uniform.without_mean();
    let largest = uniform.spectrum.density.iter().skip(2).fold(0.0_f64, |top, v| top.max(*v));
    let mut parts: Vec<Part> = Vec::new();
    let mut left = signal.clone();
    for _ in 0..3 {
        let spectrum = density(&left, uniform.interval_s, uniform.segment, Window::Hann);
        let fresh = standing_peaks(&spectrum.density, largest, uniform, &parts);
        let known: Vec<f64> = parts.iter().map(|part| part.pole.frequency_hz).collect();
        let all: Vec<f64> = known.iter().chain(&fresh).copied().collect();
        let whole = WholeSpectrum::new(&left, uniform.interval_s);
        let before = parts.len();
        for &frequency_hz in &fresh {
            let is_new = |part: &Part| !parts[..before].iter().any(|known| part.is_left_by(known));
            if let Some(pair) = pair_at(&whole, frequency_hz, &all, uniform, |values| values.clear_pair()) {
                let fresh: Vec<Part> = pair.into_iter().filter(is_new).collect();
                parts.extend(fresh);
                continue;
            }
            match part_at(&whole, frequency_hz, &all, uniform) {
                Some(part) if is_new(&part) => parts.push(part),
                Some(part) => rejected.push(Rejected::Pole {
                    frequency_hz: part.pole.frequency_hz,
                    damping_ratio: Some(part.pole.damping_ratio),
                    reason: "a leftover of the mode beside it, which does not decay as a linear one".to_owned(),
                }),
                None => rejected.push(Rejected::Pole {
                    frequency_hz,
                    damping_ratio: None,
                    reason: format!(
                        "a peak of the spectrum whose band holds no single decaying oscillation (less than {:.0} % of its energy)",
                        100.0 * EXPLAINED
                    ),
                }),
            }
        }
        if parts.len() == before {
            break;
        }
        left = remainder(&signal, &parts, uniform.interval_s);
    }
    parts.sort_by(|a, b| b.energy.total_cmp(&a.energy));
    rejected.extend(parts.iter().skip(limit).map(|part| Rejected::Pole {
        frequency_hz: part.pole.frequency_hz,
        damping_ratio: Some(part.pole.damping_ratio),
        reason: format!("weaker than the {limit} modes that were looked for"),
    }));
    parts.truncate(limit);
    parts.sort_by(|a, b| a.pole.frequency_hz.total_cmp(&b.pole.frequency_hz));
    parts
}

/// Frequencies of the peaks that stand above the floor and belong to no known mode.
fn standing_peaks(density: &[f64], largest: f64, uniform: &Uniform, known: &[Part]) -> Vec<f64> {
    let bin = uniform.bin_hz();
    peaks(density, 3)
        .into_iter()
        .filter(|&k| {
            let frequency_hz = k as f64 * bin;
            let reach = (k / 3).max(24);
            let clear = known.iter().all(|part| {
                let pole = part.pole;
                let own = (4.0 * bin)
                    .max(8.0 * pole.damping_ratio * pole.frequency_hz)
                    .max(0.01 * pole.frequency_hz);
                (pole.frequency_hz - frequency_hz).abs() > own
            });
            clear
                && prominence(density, k) > PROMINENCE
                && density[k] > ABOVE_FLOOR * local_median(density, k, reach)
                && density[k] > SHARE_OF_LARGEST * largest
        })
        .take(MAX_MODES)
        .map(|k| k as f64 * bin)
        .collect()
}

/// Looks at one peak through the band up to half way to its neighbours.
pub(crate) fn part_at(
    whole: &WholeSpectrum,
    frequency_hz: f64,
    all: &[f64],
    uniform: &Uniform,
) -> Option<Part> {
    let nearest = all
        .iter()
        .map(|other| (other - frequency_hz).abs())
        .filter(|distance| *distance > 0.0)
        .fold(f64::INFINITY, f64::min);
    let nyquist_hz = 0.5 / uniform.interval_s;
    let half_width_hz =
        (0.45 * nearest).min(0.4 * frequency_hz).min(nyquist_hz - frequency_hz).max(2.0 * uniform.bin_hz());
    let duration_s = uniform.duration_s();
    let first = band_fit(whole, frequency_hz, half_width_hz)?;
    // A light mode in a wide band is a small signal among much else: look again, as closely as it decays.
    let close = (WIDTHS * first.pole.damping_ratio * frequency_hz).max(8.0 / duration_s);
    let half_width_hz = half_width_hz.min(close);
    let fit = band_fit(whole, frequency_hz, half_width_hz)?;
    let apart = (fit.pole.frequency_hz - frequency_hz).abs();
    let found = apart < half_width_hz && fit.damping_ratio.value > -1e-3 && fit.explained > EXPLAINED;
    found.then(|| Part {
        pole: fit.pole,
        half_width_hz,
        energy: fit.amplitude.powi(2) * fit.pole.decay_time_s().min(duration_s),
    })
}

/// Half of the band that a pair of close modes is looked for in, as a share of its frequency, and its lines
/// at least.
const PAIR: (f64, f64) = (0.25, 30.0);
/// Samples of that band at either end that the abrupt beginning and the end disturb.
const DISTURBED: usize = 3;

/// Looks at one peak for two close modes.
pub(crate) fn pair_at(
    whole: &WholeSpectrum,
    frequency_hz: f64,
    all: &[f64],
    uniform: &Uniform,
    find: fn(&Values<'_>) -> Option<Pair>,
) -> Option<[Part; 2]> {
    let nearest = all
        .iter()
        .map(|other| (other - frequency_hz).abs())
        .filter(|distance| *distance > 0.0)
        .fold(f64::INFINITY, f64::min);
    let duration_s = uniform.duration_s();
    let half_width_hz = (PAIR.0 * frequency_hz)
        .max(PAIR.1 / duration_s)
        .min(0.45 * nearest)
        .min(0.4 * frequency_hz)
        .min(0.5 / uniform.interval_s - frequency_hz);
    let band = whole.narrow_band(frequency_hz, half_width_hz, 1);
    let values = band.values(DISTURBED..band.amplitude.len().saturating_sub(DISTURBED))?;
    let pair = find(&values).filter(|pair| pair.sum_of_squares < (1.0 - EXPLAINED) * values.energy())?;
    let parts: Vec<Part> = pair
        .rates
        .iter()
        .zip(pair.sizes)
        .filter_map(|(rate, size)| {
            let pole = band.pole_of(*rate)?;
            Some(Part { pole, half_width_hz, energy: size.powi(2) * pole.decay_time_s().min(duration_s) })
        })
        .collect();
    let inside = |part: &Part| (part.pole.frequency_hz - frequency_hz).abs() < half_width_hz;
    <[Part; 2]>::try_from(parts).ok().filter(|pair| pair.iter().all(inside))
}

fn band_fit(whole: &WholeSpectrum, centre_hz: f64, half_width_hz: f64) -> Option<BandFit> {
    let band = whole.narrow_band(centre_hz, half_width_hz, 1);
    band.fit(inner(&band, band.amplitude.len(), 1))
}

/// The band's samples without those that the abrupt beginning and the end disturb.
fn inner(band: &NarrowBand, end: usize, oversample: usize) -> Range<usize> {
    let count = band.amplitude.len();
    let skip = if count > 24 * oversample { 2 } else { 1 } * oversample;
    skip..end.min(count.saturating_sub(skip)).max(skip)
}

/// What the modes found so far leave of the signal.
pub(crate) fn remainder(signal: &[f64], parts: &[Part], interval_s: f64) -> Vec<f64> {
    let time_s: Vec<f64> = (0..signal.len()).map(|k| k as f64 * interval_s).collect();
    let mut basis = Orthonormal::default();
    for part in parts {
        for column in free_response(part.pole, 0.0, &time_s) {
            basis.push(column);
        }
    }
    let mut left = signal.to_vec();
    basis.remove_from(&mut left);
    left
}

/// What one mode's own band says.
pub(crate) struct Seen {
    pub(crate) early_late: Option<[CrossCheck; 2]>,
    pub(crate) decrement: Option<CrossCheck>,
    pub(crate) course: Vec<AmplitudePoint>,
    /// Whether one oscillation that bends explains the band far better than a straight one.
    pub(crate) bends: bool,
    /// What it explains more, per sample of the record, where it bends.
    pub(crate) more_by_bending: f64,
}

/// Evidence from which a mode bends: changes with amplitude count only then. Of a linear mode under noise it
/// is more than 19 once in a thousand records.
const BENDS: f64 = 30.0;

/// A fitted mode as its record shows it.
pub(crate) struct Fitted {
    pub(crate) pole: Pole,
    /// Factors of cosine and sine at the beginning.
    pub(crate) factors: [f64; 2],
    pub(crate) half_width_hz: f64,
}

/// Looks at a fitted mode alone: its early and its late decay, its logarithmic decrement and its course over
/// amplitude. The spectrum is that of what all modes leave; the mode itself is added exactly, so that neither
/// the others nor the abrupt beginning disturb its band.
pub(crate) fn decay_part(left: &WholeSpectrum, mode: &Fitted, origin_s: f64) -> Seen {
    let pole = mode.pole;
    let at = |oversample: usize| {
        let band = left.narrow_band(pole.frequency_hz, mode.half_width_hz, oversample);
        band.with_oscillation(pole, mode.factors)
    };
    let band = at(FINE);
    let size: Vec<f64> = band.amplitude.iter().map(|z| z.norm()).collect();
    let end = clear_of_noise(&size);
    let usable = inner(&band, end, FINE);
    let coarse = at(1);
    let last = (usable.end / FINE).min(coarse.amplitude.len());
    let stretch = coarse.values(inner(&coarse, last, 1));
    let bending = stretch.and_then(|values| values.bending(coarse.rate_of(pole)));
    let bending = bending.filter(|bending| bending.evidence > BENDS);
    let course = of_decay(&band, usable.clone(), origin_s);
    // The mean square of an oscillation is half that of its amplitude.
    let per_sample = 0.5 / coarse.amplitude.len() as f64;
    let stays = frequency_spread(&course) < ONE_MODE * pole.frequency_hz;
    Seen {
        early_late: early_and_late(&band, &size, usable.clone()),
        decrement: decrement(pole, &band, usable),
        bends: bending.is_some(),
        more_by_bending: bending.filter(|_| stays).map_or(0.0, |bending| per_sample * bending.gain),
        course,
    }
}

/// Share of the frequency by which one mode may move; a course that moves more joins several.
const ONE_MODE: f64 = 0.06;

/// From the lowest to the highest frequency of a course, Hz.
fn frequency_spread(course: &[AmplitudePoint]) -> f64 {
    let all = course.iter().map(|point| point.frequency_hz.value);
    all.clone().fold(0.0, f64::max) - all.fold(f64::INFINITY, f64::min).min(f64::MAX)
}

/// Where the amplitude comes within a factor five of the floor that the last tenth holds; the end where it is
/// still falling steadily there.
fn clear_of_noise(size: &[f64]) -> usize {
    let tenth = size.len().div_ceil(10);
    let middle = |from: usize| {
        let mut some = size[from.min(size.len() - 1)..(from + tenth).min(size.len())].to_vec();
        some.sort_by(f64::total_cmp);
        some[some.len() / 2]
    };
    let [before, last, floor] = [3, 2, 1].map(|tenths| middle(size.len().saturating_sub(tenths * tenth)));
    if before > STEADY_FALL * last && last > STEADY_FALL * floor {
        return size.len();
    }
    let clear = size.iter().skip(2 * FINE).position(|value| *value < 5.0 * floor);
    clear.map_or(size.len(), |k| k + 2 * FINE)
}

/// Fits the first and the last third of the decay, counted in decibels.
fn early_and_late(band: &NarrowBand, size: &[f64], usable: Range<usize>) -> Option<[CrossCheck; 2]> {
    let first = *size.get(usable.start)?;
    let last = *size.get(usable.end.checked_sub(1)?)?;
    let depth = (first / last).ln();
    // Less than a factor of two per third shows nothing.
    if depth.is_nan() || depth < 3.0 * std::f64::consts::LN_2 {
        return None;
    }
    let falls_below = |level: f64| usable.clone().find(|&k| size[k] < level);
    let one = falls_below(first * (-depth / 3.0).exp())?;
    let two = falls_below(first * (-2.0 * depth / 3.0).exp())?;
    let check = |method: &str, range| {
        let fit = band.fit(range)?;
        Some(CrossCheck {
            method: method.to_owned(),
            frequency_hz: Some(fit.frequency_hz),
            damping_ratio: Some(fit.damping_ratio),
        })
    };
    Some([check("early_decay", usable.start..one)?, check("late_decay", two..usable.end)?])
}

/// The logarithmic decrement from the first clean peak to the one a factor e below it, or as far as the
/// decay can be used.
///
/// Peaks of a decaying oscillation touch its envelope up to a constant factor, one per damped period, so
/// their heights are read off the band's envelope: sampled peaks of fast modes are too coarse.
fn decrement(pole: Pole, band: &NarrowBand, usable: Range<usize>) -> Option<CrossCheck> {
    let step_s = band.time_s.get(1)? - band.time_s[0];
    let envelope = |t: f64| {
        let place = t / step_s;
        let below = place as usize;
        let (a, b) = (band.amplitude.get(below)?.norm(), band.amplitude.get(below + 1)?.norm());
        Some(a * (b / a).powf(place - below as f64))
    };
    let first_s = *band.time_s.get(usable.start)?;
    let last_s = *band.time_s.get(usable.end.checked_sub(1)?)?;
    let period_s = TAU / pole.lambda().im;
    let highest = envelope(first_s)?;
    let mut heights = vec![highest];
    for k in 1.. {
        let time_s = first_s + f64::from(k) * period_s;
        if time_s > last_s {
            break;
        }
        let height = envelope(time_s)?;
        if height < highest / std::f64::consts::E {
            break;
        }
        heights.push(height);
    }
    // What a single exponential leaves in the band over these peaks is the scatter of their heights.
    let end_s = first_s + heights.len() as f64 * period_s;
    let end = band.time_s.iter().position(|t| *t > end_s).unwrap_or(usable.end);
    let scatter = band.fit(usable.start..end.clamp(usable.start + 5, usable.end.max(usable.start + 5)))?;
    Some(CrossCheck {
        method: "logarithmic_decrement".to_owned(),
        frequency_hz: None,
        damping_ratio: Some(damping_from_peaks(&heights, scatter.residual_rms)?),
    })
}
