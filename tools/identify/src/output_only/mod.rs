//! Modes from what a structure does under noise, traffic or wind: output-only modal analysis.
//!
//! The covariances of the outputs are taken stretch by stretch. Their mean gives the poles by
//! covariance-driven subspace identification; those that stay in place over the model orders are modes.
//! Leaving one stretch out at a time (the jackknife) gives their standard errors, whatever the excitation
//! was, as long as it was no line: what the record says twice in different stretches is known, what moves is
//! not.

mod report;
mod subspace;
mod unexplained;

use std::collections::BTreeMap;
use std::ops::Range;

use rustfft::num_complex::Complex64;
use stillbeam_recording::Recording;

use crate::column::Column;
use crate::decay_modes::Uniform;
use crate::error::IdentifyError;
use crate::forced_fit::check_modes;
use crate::forced_record::readings;
use crate::gaps::{Grid, in_both, missing_rows};
use crate::magnitude::refuse_magnitude;
use crate::poles::{
    ContinuousPole, OrderPoles, PoleMethod, StabilisationChart, Survey, Tolerances, decimated,
};
use crate::result::{Estimate, IdentifiedModes, Rejected};
use crate::spectra::{local_median, peaks, prominence};
use crate::tall::Orthonormal;
use crate::warnings::{Warning, WarningKind};
use crate::wild_samples::without_wild;
use report::report;
use subspace::{Covariances, OrderPole, Outputs, Subspace};
use unexplained::{Peak, unexplained};

/// Stretches of which one at a time is left out.
const STRETCHES: usize = 20;
/// Samples per period of the highest frequency of a band, and how far down a band reaches, as a ratio.
const PER_PERIOD: f64 = 5.0;
const BAND: f64 = 6.0;
/// Bands at most.
const BANDS: usize = 4;
/// Model orders.
const ORDERS: std::ops::RangeInclusive<usize> = 2..=32;
/// Orders of a pick that are tried.
const ORDERS_TRIED: usize = 8;
/// Columns of a shortened record's range beyond the highest order: the last ones of an iteration are rough.
const SPARE: usize = 8;
/// Share of the power of the outputs that a mode makes at least.
const SMALLEST: f64 = 2e-3;
/// Standard error of a damping ratio, as a share of it, from which a pole is no mode.
const UNKNOWN: f64 = 0.6;
/// Factors that the lags are shortened by where a peak is looked at again, and how far its band reaches.
const SHORTENED: [usize; 3] = [1, 2, 4];
const HIGHER: f64 = 1.3;
/// Share of the outputs' power that its mode makes at least, the share of its frequency that is the standard
/// error at most, and how much of its damping may be unknown where it is as loud as that.
const LOUD: f64 = 0.05;
const KNOWN: f64 = 0.02;
const HARDLY_KNOWN: f64 = 2.0;
/// Share of the frequency within which a pole of a shortened record is the same one.
const SAME: f64 = 0.05;
/// A peak that a band is laid around stands above the median around it and above its valleys by these ratios.
const STANDS: (f64, f64) = (4.0, 3.0);

/// Choices of [`identify_output_only`].
#[derive(Debug, Clone, PartialEq)]
pub struct OutputOnlyOptions {
    /// Output columns, at least one; several give shapes. The first one's unit is that of the amplitudes.
    pub outputs: Vec<String>,
    /// How many modes, the most powerful ones; `None` takes all that stay in place.
    pub modes: Option<usize>,
}

/// A mode before it is reported.
struct Found {
    /// Share of each output, to a common factor.
    shape: Vec<Complex64>,
    frequency_hz: Estimate,
    damping_ratio: Estimate,
    /// Its share of the first output's variance, and of all outputs' power.
    variance: f64,
    share: f64,
}

/// Identifies modes from outputs alone, under excitation without a pattern.
///
/// # Errors
/// [`IdentifyError`] when a column cannot be used or no mode stays in place.
pub fn identify_output_only(
    recording: &Recording,
    options: &OutputOnlyOptions,
) -> Result<IdentifiedModes, IdentifyError> {
    check_modes(options.modes)?;
    let Signals { uniform, sound, mut said } = signals_of(recording, &options.outputs)?;
    let Some(first) = uniform.first() else {
        return Err(IdentifyError::BadOption {
            option: "outputs",
            value: "none".to_owned(),
            remedy: "name at least one output column",
        });
    };
    let signals: Vec<Vec<f64>> = uniform.iter().map(Uniform::without_mean).collect();
    let mut found: Vec<Found> = Vec::new();
    let mut survey = Survey::default();
    for highest_hz in band_tops_hz(&uniform) {
        let band = Band { signals: &signals, sound: &sound, interval_s: first.interval_s, highest_hz };
        let (modes, chart) = band.modes(1, UNKNOWN);
        survey.charts.extend(chart);
        let fresh = modes.into_iter().filter(|mode| {
            found.iter().all(|known| {
                (known.frequency_hz.value - mode.frequency_hz.value).abs()
                    > 4.0 * known.frequency_hz.stderr.hypot(mode.frequency_hz.stderr)
            })
        });
        let fresh: Vec<Found> = fresh.collect();
        found.extend(fresh);
    }
    for peak in unexplained(first, &found) {
        let highest_hz = HIGHER * peak.frequency_hz;
        let band = Band { signals: &signals, sound: &sound, interval_s: first.interval_s, highest_hz };
        found.extend(looked_at_again(&band, &peak, first.bin_hz()));
    }
    said.extend(unexplained(first, &found).iter().map(|peak| peak.told(&options.outputs[0]).into()));
    let mut rejected = Vec::new();
    if let Some(wanted) = options.modes {
        found.sort_by(|a, b| b.share.total_cmp(&a.share));
        rejected.extend(found.iter().skip(wanted).map(|mode| Rejected::Pole {
            frequency_hz: mode.frequency_hz.value,
            damping_ratio: Some(mode.damping_ratio.value),
            reason: format!("weaker than the {wanted} modes that were asked for"),
        }));
        found.truncate(wanted);
    }
    found.sort_by(|a, b| a.frequency_hz.value.total_cmp(&b.frequency_hz.value));
    let column = options.outputs[0].clone();
    if found.is_empty() {
        return Err(IdentifyError::NoPeaks { recording: recording.name.clone(), column });
    }
    let mut modes = report(recording, options, first, &found, (survey, rejected));
    modes.warnings.extend(said);
    Ok(modes)
}

/// The mode of a peak that the first look explained by none: with shorter lags, too, which hold less of a
/// short record's noise, and with a damping ratio of which little may be known. What other lags say instead
/// belongs to its errors, and no damping ratio is known better than so many periods can tell.
fn looked_at_again(band: &Band<'_>, peak: &Peak, bin_hz: f64) -> Option<Found> {
    let reach_hz = (2.0 * bin_hz).max(SAME * peak.frequency_hz);
    let share = |mode: &Found| mode.damping_ratio.stderr / mode.damping_ratio.value;
    let at_peak = |mode: &Found| {
        (mode.frequency_hz.value - peak.frequency_hz).abs() < reach_hz
            && mode.frequency_hz.stderr < KNOWN * mode.frequency_hz.value
            && mode.share > LOUD
    };
    let seen = SHORTENED.into_iter().filter_map(|shortened| {
        let modes = band.modes(shortened, f64::INFINITY).0.into_iter().filter(at_peak);
        modes.min_by(|a, b| share(a).total_cmp(&share(b)))
    });
    let mut seen: Vec<Found> = seen.collect();
    seen.sort_by(|a, b| share(a).total_cmp(&share(b)));
    let others: Vec<[f64; 2]> =
        seen.iter().skip(1).map(|mode| [mode.frequency_hz.value, mode.damping_ratio.value]).collect();
    let mut best = seen.into_iter().next()?;
    let rows: usize = band.sound.iter().map(ExactSizeIterator::len).sum();
    let radians = std::f64::consts::TAU * best.frequency_hz.value * rows as f64 * band.interval_s;
    let damping = &mut best.damping_ratio;
    damping.stderr = damping.stderr.max((damping.value / radians).sqrt());
    for [frequency_hz, damping_ratio] in others {
        damping.stderr = damping.stderr.max((damping_ratio - damping.value).abs());
        let apart_hz = (frequency_hz - best.frequency_hz.value).abs();
        best.frequency_hz.stderr = best.frequency_hz.stderr.max(apart_hz);
    }
    (share(&best) < HARDLY_KNOWN).then_some(best)
}

/// Outputs on one even grid.
struct Signals {
    uniform: Vec<Uniform>,
    /// The rows between gaps of the stamps.
    sound: Vec<Range<usize>>,
    said: Vec<Warning>,
}

fn signals_of(recording: &Recording, outputs: &[String]) -> Result<Signals, IdentifyError> {
    let mut signals = Signals { uniform: Vec::new(), sound: Vec::new(), said: Vec::new() };
    let mut grid = None;
    for (index, column) in outputs.iter().enumerate() {
        let all = readings(recording, column)?;
        refuse_magnitude(recording, column, &all.values)?;
        let values = without_wild(&all.values);
        if index == 0 {
            grid = Grid::of(&all.time_s);
            signals.said.extend(missing_rows(&recording.name, &all.time_s, &values));
        }
        let (uniform, sound) = match &grid {
            Some(grid) => {
                let taken = grid.take(&all.time_s, &values);
                (Uniform::on_grid(taken.values, grid.interval_s), taken.stretches)
            }
            None => (Uniform::new(&all.time_s, &values), std::iter::once(0..values.len()).collect()),
        };
        signals.sound = if index == 0 { sound } else { in_both(&signals.sound, &sound) };
        signals.uniform.push(uniform);
        signals.said.extend(all.remarks.into_iter().map(Warning::from));
    }
    if let Some(grid) = grid {
        let rows: usize = signals.sound.iter().map(ExactSizeIterator::len).sum();
        signals.said.push(
            WarningKind::StretchesRead {
                recording: recording.name.clone(),
                stretches: signals.sound.len(),
                together_s: rows as f64 * grid.interval_s,
            }
            .into(),
        );
    }
    Ok(signals)
}

/// Highest frequencies of the bands that hold the peaks of the spectra, from the highest band down, Hz.
fn band_tops_hz(uniform: &[Uniform]) -> Vec<f64> {
    let mut standing: Vec<f64> = Vec::new();
    for one in uniform {
        let (density, bin_hz) = (&one.spectrum.density, one.bin_hz());
        let is_peak = |k: &usize| {
            density[*k] > STANDS.0 * local_median(density, *k, (k / 3).max(24))
                && prominence(density, *k) > STANDS.1
        };
        let largest = density.iter().skip(2).fold(0.0_f64, |top, v| top.max(*v));
        let loud = peaks(density, 3).into_iter().filter(is_peak).filter(|k| density[*k] > 1e-5 * largest);
        standing.extend(loud.map(|k| k as f64 * bin_hz));
    }
    standing.sort_by(|a, b| b.total_cmp(a));
    let mut tops: Vec<f64> = Vec::new();
    for hz in standing {
        if tops.last().is_none_or(|top| hz < top / BAND) && tops.len() < BANDS {
            tops.push(1.2 * hz);
        }
    }
    tops
}

/// The outputs below a frequency.
struct Band<'s> {
    signals: &'s [Vec<f64>],
    sound: &'s [Range<usize>],
    interval_s: f64,
    highest_hz: f64,
}

impl Band<'_> {
    /// Its modes, with lags shortened by a factor, whose damping is known to a share, and its chart.
    fn modes(&self, shortened: usize, unknown: f64) -> (Vec<Found>, Option<StabilisationChart>) {
        of_band((self.signals, self.sound), self.interval_s, self.highest_hz, (shortened, unknown))
    }
}

/// The modes of one band, and its chart.
fn of_band(
    (signals, sound): (&[Vec<f64>], &[Range<usize>]),
    interval_s: f64,
    highest_hz: f64,
    (shortened, unknown): (usize, f64),
) -> (Vec<Found>, Option<StabilisationChart>) {
    let slow: Vec<(Vec<f64>, f64)> =
        signals.iter().map(|signal| decimated(signal, interval_s, PER_PERIOD * highest_hz)).collect();
    let outputs = Outputs::new(slow, sound, interval_s, shortened);
    if outputs.sound_rows() < 40 * STRETCHES / 2 {
        return (Vec::new(), None);
    }
    let stretches = outputs.covariances(STRETCHES);
    if stretches.len() < STRETCHES / 2 {
        return (Vec::new(), None);
    }
    let all = Covariances::mean(&stretches, None);
    let Some(whole) = Subspace::new(&all, outputs.interval_s) else { return (Vec::new(), None) };
    let highest = (*ORDERS.end()).min(whole.size() / 2);
    let orders: Vec<(usize, Vec<OrderPole>)> =
        (*ORDERS.start()..=highest).step_by(2).map(|order| (order, whole.poles(order))).collect();
    let charted: Vec<OrderPoles> = orders
        .iter()
        .map(|(order, poles)| OrderPoles { order: *order, poles: poles.iter().map(|one| one.pole).collect() })
        .collect();
    let band_hz = [highest_hz / (1.1 * BAND), 1.1 * highest_hz];
    // Over orders the poles of a finite record scatter by their errors, which are larger than those of a
    // decay.
    let tolerances = Tolerances { damping: 0.15, ..Tolerances::default() };
    let chart = StabilisationChart::new(PoleMethod::CovarianceSubspace, &charted, band_hz, tolerances);
    let without: Vec<Subspace> = (0..stretches.len())
        .filter_map(|index| whole.near(&Covariances::mean(&stretches, Some(index)), highest + SPARE))
        .collect();
    let mut shortened = Shortened { without: &without, by_order: BTreeMap::new() };
    let found = chart
        .picks
        .iter()
        .filter_map(|pick| {
            // The order whose pole is nearest the middle of the pick, of those that shortened records bear
            // out.
            let middle = pick.pole();
            let mut places: Vec<(usize, &Vec<OrderPole>, OrderPole)> = orders
                .iter()
                .filter_map(|(order, poles)| Some((*order, poles, nearest(poles, &middle)?)))
                .collect();
            let away = |pole: &OrderPole| distance(&pole.pole, &middle);
            places.sort_by(|a, b| away(&a.2).total_cmp(&away(&b.2)));
            places.into_iter().take(ORDERS_TRIED).find_map(|(order, poles, pole)| {
                let [frequency_hz, damping_ratio] = shortened.estimates(order, &pole.pole)?;
                let [variance, share] = power_of(&pole, poles, &all);
                let shape = whole.shape(order, &pole)?;
                let is_mode = share > SMALLEST && damping_ratio.stderr < unknown * damping_ratio.value;
                is_mode.then_some(Found { shape, frequency_hz, damping_ratio, variance, share })
            })
        })
        .collect();
    (found, Some(chart))
}

/// How far two poles are apart, as a share of their frequency.
fn distance(a: &ContinuousPole, b: &ContinuousPole) -> f64 {
    let apart = (a.frequency_hz / b.frequency_hz - 1.0).hypot(a.damping_ratio - b.damping_ratio);
    if apart.is_finite() { apart } else { f64::INFINITY }
}

fn nearest(poles: &[OrderPole], to: &ContinuousPole) -> Option<OrderPole> {
    let away = |one: &&OrderPole| distance(&one.pole, to);
    poles.iter().min_by(|a, b| away(a).total_cmp(&away(b))).filter(|one| away(one) < SAME).copied()
}

/// The record with one stretch left out at a time.
struct Shortened<'s> {
    without: &'s [Subspace],
    /// Poles of each, by order.
    by_order: BTreeMap<usize, Vec<Vec<OrderPole>>>,
}

impl Shortened<'_> {
    /// Frequency and damping with their standard errors by the jackknife; `None` for a pole that shortened
    /// records lack.
    fn estimates(&mut self, order: usize, pole: &ContinuousPole) -> Option<[Estimate; 2]> {
        let all = self
            .by_order
            .entry(order)
            .or_insert_with(|| self.without.iter().map(|one| one.poles(order)).collect());
        let again: Vec<OrderPole> = all.iter().filter_map(|poles| nearest(poles, pole)).collect();
        if again.len() + 2 < self.without.len() || again.len() < 4 {
            return None;
        }
        let estimate = |pick: fn(&ContinuousPole) -> f64| {
            let values: Vec<f64> = again.iter().map(|one| pick(&one.pole)).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let spread: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
            let stderr = ((values.len() - 1) as f64 / values.len() as f64 * spread).sqrt();
            Estimate { value: pick(pole), stderr }
        };
        Some([estimate(|one| one.frequency_hz), estimate(|one| one.damping_ratio)])
    }
}

/// What a mode makes of the first output's variance and of all outputs' power as a share: the covariances by
/// lag as a sum of decays at the poles.
fn power_of(own: &OrderPole, poles: &[OrderPole], all: &Covariances) -> [f64; 2] {
    let lags = all.0.len();
    let decay = |z: Complex64| -> [Column; 2] {
        let values: Vec<Complex64> = (0..lags).map(|lag| z.powu(lag as u32)).collect();
        [
            values.iter().map(|v| v.re).collect::<Vec<_>>().into(),
            values.iter().map(|v| v.im).collect::<Vec<_>>().into(),
        ]
    };
    let mut basis = Orthonormal::default();
    poles
        .iter()
        .filter(|one| one.z != own.z)
        .flat_map(|one| decay(one.z))
        .for_each(|column| basis.push(column));
    let others = poles.iter().filter(|one| one.z != own.z).count();
    decay(own.z).into_iter().for_each(|column| basis.push(column));
    let at_zero = |output: usize| {
        // White noise of a sensor is in lag 0 alone, which is why it does not count.
        let mut by_lag: Vec<f64> = all.0.iter().map(|one| one[(output, output)]).collect();
        let total = by_lag[0];
        by_lag[0] = by_lag.get(1..3).map_or(total, |next| 2.0 * next[0] - next[1]).clamp(-total, total);
        let components = basis.remove_from(&mut by_lag);
        let coefficients = basis.coefficients(&components);
        (coefficients.get(2 * others).copied().unwrap_or(0.0).clamp(0.0, total), total)
    };
    let outputs = all.0[0].nrows();
    let (own, total) = (0..outputs).map(at_zero).fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    [at_zero(0).0, if total > 0.0 { own / total } else { 0.0 }]
}
