//! Where the search for a forced mode starts: peaks of the averaged frequency response and of the spectrum of
//! what is left, refined by a coarse scan of the time-domain sum of squares.

use rustfft::num_complex::Complex64;

use crate::column::Column;
use crate::forced_model::{ForcedModel, MAX_DAMPING, MIN_DAMPING, pole};
use crate::forced_record::ForcedRecord;
use crate::frf::UniformRecord;
use crate::interpolation::{InputInterpolation, PiecewiseCubic};
use crate::modal_response::{InputKind, Pole};
use crate::poles::{MethodMode, Survey, survey_forced};
use crate::responses::Frf;
use crate::result::{CrossCheck, Estimate};
use crate::separable::sum_of_squares_at;
use crate::signal_checks::sweep_rate_at;
use crate::spectra::{CrossSpectra, Window, density, peaks};
use crate::tall::{Orthonormal, dot};

/// The record on a uniform grid at the output's rate, and its spectra.
pub(crate) struct Spectral {
    grid_s: Vec<f64>,
    pub(crate) record: UniformRecord,
    segment: usize,
    spectra: CrossSpectra,
    /// What drives the modes where that is not the input itself: the acceleration of a base whose position is
    /// recorded. A sweep of constant acceleration moves the base least where it is fastest.
    drive: Option<Vec<f64>>,
    drive_density: Vec<f64>,
    pub(crate) frf: Frf,
}

/// Segments a record is cut into: a quarter of it each, overlapping by half, so that seven are averaged.
const SEGMENTS: usize = 4;
/// Candidates taken from each of the three rankings of peaks.
const CANDIDATES: usize = 6;
/// An input that changes by less than this share of its largest change per sample rests: a hundredth is above
/// the steps of an encoder and below what a sweep does anywhere but at its turning points.
const STILL: f64 = 0.01;
/// Share of a record in which the input has to rest for ringing to be looked for: a response to the input is
/// found without.
const RESTING: f64 = 0.25;
/// Ratio of powers by which what rings tops the median of its spectrum: the largest of a hundred thousand
/// bins of noise does so once in a few hundred records. Scanning around peaks of noise takes time.
const ABOVE_FLOOR: f64 = 25.0;
/// Bins on either side of a peak that are scanned.
const AROUND: f64 = 1.5;
/// Input density, relative to its largest, below which a frequency counts as not excited.
const EXCITED: f64 = 1e-4;
/// The same of the base's acceleration, which a sensor's noise in its position reaches sooner.
const DRIVEN: f64 = 1e-2;
/// The damping that the scan assumes: wide enough a basin that a coarse grid of frequencies finds it.
const SCAN_DAMPING: f64 = 0.02;
/// Dampings of which the best one becomes the second start.
const START_DAMPINGS: [f64; 5] = [0.001, 0.003, 0.008, 0.05, 0.15];

impl Spectral {
    pub(crate) fn new(record: &ForcedRecord) -> Self {
        let n = record.time_s.len();
        let first_s = record.time_s[0];
        let mut intervals: Vec<f64> = record.time_s.windows(2).map(|t| t[1] - t[0]).collect();
        let interval_s = *intervals.select_nth_unstable_by((n - 1) / 2, f64::total_cmp).1;
        let count = (record.duration_s() / interval_s + 1e-6) as usize + 1;
        // Stamps with a pathological median must not ask for more memory than the record itself is worth.
        let count = count.min(20 * n);
        let interval_s = record.duration_s() / (count.max(2) - 1) as f64;
        let grid_s: Vec<f64> = (0..count).map(|k| first_s + k as f64 * interval_s).collect();
        let input = values(&record.input, &grid_s);
        let output = resample(&record.time_s, &record.output, &grid_s);
        let segment = (count / SEGMENTS).max(8);
        let spectra = CrossSpectra::welch(&input, &output, interval_s, segment, Window::Hamming);
        let frf = spectra.clone().frf();
        let drive = (record.input_kind == InputKind::BasePosition).then(|| {
            let input = record.input.sample(grid_s.iter().copied());
            input.into_iter().map(|[_, _, second]| -second).collect::<Vec<f64>>()
        });
        let drive_density = drive.as_ref().map_or(Vec::new(), |drive| {
            CrossSpectra::welch(drive, &output, interval_s, segment, Window::Hamming).input
        });
        let record = UniformRecord { input, output, interval_s };
        Self { grid_s, record, segment, spectra, drive, drive_density, frf }
    }

    pub(crate) fn nyquist_hz(&self) -> f64 {
        0.5 / self.record.interval_s
    }

    /// Lowest and highest frequency at which the density of the input, or of the base's acceleration where
    /// its position is the input, is noticeable.
    pub(crate) fn excited_band_hz(&self) -> [f64; 2] {
        let frequency = &self.spectra.frequency_hz;
        let mut band = [f64::INFINITY, 0.0];
        for (density, share) in [(&self.spectra.input, EXCITED), (&self.drive_density, DRIVEN)] {
            let top = density.iter().skip(1).fold(0.0_f64, |top, value| top.max(*value));
            for (f, value) in frequency.iter().zip(density).skip(1) {
                if *value >= share * top {
                    band = [band[0].min(*f), band[1].max(*f)];
                }
            }
        }
        let bin = self.bin_hz();
        [(band[0] - bin).max(0.0), band[1] + bin]
    }

    /// The record with another output on its grid, given at the record's own stamps.
    pub(crate) fn with_output(&self, time_s: &[f64], output: &[f64]) -> UniformRecord {
        UniformRecord { output: resample(time_s, output, &self.grid_s), ..self.record.clone() }
    }

    pub(crate) fn sweep_rate_at(&self, frequency_hz: f64) -> Option<f64> {
        sweep_rate_at(&self.grid_s, &self.record.input, frequency_hz)
    }

    fn bin_hz(&self) -> f64 {
        1.0 / (self.segment as f64 * self.record.interval_s)
    }

    /// Frequency and damping by the half-power points of the averaged response, with the resolution of the
    /// spectrum as standard error: a coarse but independent check.
    ///
    /// `None` where the half-power band is not resolved, which is the rule for light damping.
    pub(crate) fn half_power(&self, near: Pole) -> Option<CrossCheck> {
        let bin = self.bin_hz();
        if 2.0 * near.damping_ratio * near.frequency_hz < 4.0 * bin {
            return None;
        }
        let size: Vec<f64> = self.frf.real.iter().zip(&self.frf.imag).map(|(re, im)| re.hypot(*im)).collect();
        let reach = (2.0 * near.damping_ratio * near.frequency_hz / bin) as usize + 2;
        let centre = (near.frequency_hz / bin).round() as usize;
        let range = centre.saturating_sub(reach)..(centre + reach + 1).min(size.len());
        let peak = range.max_by(|a, b| size[*a].total_cmp(&size[*b]))?;
        let half = size[peak] / std::f64::consts::SQRT_2;
        let crossing = |inner: usize, outer: usize| {
            let share = (size[inner] - half) / (size[inner] - size[outer]);
            inner as f64 + share * (outer as f64 - inner as f64)
        };
        let below = (1..=peak).rev().find(|&k| size[k - 1] < half)?;
        let above = (peak..size.len().checked_sub(1)?).find(|&k| size[k + 1] < half)?;
        let (low, high) = (crossing(below, below - 1) * bin, crossing(above, above + 1) * bin);
        let frequency_hz = peak as f64 * bin;
        // The window widens the band, and the two ends scatter, by about a bin each.
        Some(CrossCheck {
            method: "frf_half_power".to_owned(),
            frequency_hz: Some(Estimate {
                value: frequency_hz,
                stderr: bin.hypot(near.damping_ratio * near.frequency_hz * 0.5),
            }),
            damping_ratio: Some(Estimate {
                value: (high - low) / (2.0 * frequency_hz),
                stderr: 2.0 * bin / frequency_hz,
            }),
        })
    }
}

/// Whether a frequency lies in a band that was refused.
pub(crate) fn is_refused(hz: f64, refused_hz: &[[f64; 2]]) -> bool {
    refused_hz.iter().any(|[low, high]| (low..=high).contains(&&hz))
}

/// The band around a frequency that was refused, Hz.
pub(crate) fn refused_band_hz(hz: f64) -> [f64; 2] {
    [-AWAY_FROM_REFUSED, AWAY_FROM_REFUSED].map(|away| hz * away.exp())
}

/// How far, as a share of the frequency, a start keeps from what was refused.
const AWAY_FROM_REFUSED: f64 = 0.03;
/// Rates that the scan for a real pole tries, less one.
const RATES: i32 = 12;
/// Rows that the scan for starts looks at; more make it slower, not better.
const SCAN_ROWS: usize = 8192;

/// What the search for further modes needs of the records, beside the model.
pub(crate) struct Starts {
    pub(crate) spectral: Vec<Spectral>,
    /// What the classical methods see in each record.
    pub(crate) surveys: Vec<Survey>,
    /// The records with every `stride`-th row only.
    thinned: Vec<ForcedRecord>,
    stride: usize,
}

impl Starts {
    pub(crate) fn new(records: &[ForcedRecord]) -> Self {
        let rows: usize = records.iter().map(|record| record.time_s.len()).sum();
        let stride = rows.div_ceil(SCAN_ROWS).max(1);
        let spectral: Vec<Spectral> = records.iter().map(Spectral::new).collect();
        Self {
            surveys: spectral.iter().map(|spectral| survey_forced(&spectral.record, None)).collect(),
            spectral,
            thinned: records.iter().map(|record| record.thinned(stride)).collect(),
            stride,
        }
    }

    /// Two starts for one more mode: the best frequency of the scan, and the best of the classical methods'
    /// modes and the scan's frequency with other dampings; none in a band that was refused.
    pub(crate) fn start_mode(
        &self,
        model: &ForcedModel,
        parameters: &[f64],
        residuals: &[f64],
        refused_hz: &[[f64; 2]],
    ) -> Vec<Start> {
        let delay_s = model.delay_s(parameters);
        let thin = ForcedModel { records: &self.thinned, ..*model };
        // The span of what is fitted already.
        let mut basis = Orthonormal::default();
        let mut left = Vec::new();
        for ((rows, _), (thin_rows, _)) in model.rows().zip(thin.rows()) {
            left.extend(residuals[rows].iter().step_by(self.stride));
            basis.push(Column { start: thin_rows.start, values: vec![1.0; thin_rows.len()] });
        }
        for mode in 0..model.modes {
            for column in thin.mode_columns(pole(parameters, mode), delay_s).into_iter().rev() {
                basis.push(column);
            }
        }
        if let Some(rate_per_s) = model.rate_per_s(parameters) {
            thin.real_pole_columns(rate_per_s, delay_s)
                .into_iter()
                .rev()
                .for_each(|column| basis.push(column));
        }
        let sum_with = |pole: Pole| {
            // The residuals are free of what is fitted already; the new columns must be too.
            let mut own = Orthonormal::default();
            for mut column in thin.mode_columns(pole, delay_s).into_iter().rev() {
                basis.remove_from_column(&mut column);
                own.push(column);
            }
            let mut left = left.clone();
            own.remove_from(&mut left);
            dot(&left, &left)
        };
        let best_of = |starts: Vec<Start>| {
            let sums = starts.into_iter().map(|start| (sum_with(start.pole), start));
            sums.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, start)| start)
        };
        let is_refused = |hz: f64| is_refused(hz, refused_hz);
        let mut frequencies = Vec::new();
        for ((rows, record), spectral) in model.rows().zip(&self.spectral) {
            for candidate in candidates(&residuals[rows], record, spectral) {
                frequencies.extend(around(candidate, record, spectral).filter(|hz| !is_refused(*hz)));
            }
        }
        let scanned = |frequency_hz: f64, damping_ratio: f64| Start {
            pole: Pole { frequency_hz, damping_ratio },
            from: "a scan of the record",
        };
        let Some(first) = best_of(frequencies.into_iter().map(|hz| scanned(hz, SCAN_DAMPING)).collect())
        else {
            return Vec::new();
        };
        let mut others: Vec<Start> =
            START_DAMPINGS.map(|damping_ratio| scanned(first.pole.frequency_hz, damping_ratio)).to_vec();
        others.extend(self.seen_by_methods().filter(|start| !is_refused(start.pole.frequency_hz)));
        std::iter::once(first).chain(best_of(others)).collect()
    }

    /// Where a real pole may start, 1/s: the best of a scan of its range and of the real poles that the
    /// frequency-domain methods see.
    pub(crate) fn start_rate(&self, model: &ForcedModel, poles: &[Pole], delay_s: f64) -> Option<f64> {
        let thin = ForcedModel { records: &self.thinned, real_pole: true, ..*model };
        let [lower, upper] = model.rate_range_per_s();
        let seen = self.surveys.iter().flat_map(|survey| survey.real_poles_per_s.iter().copied());
        let scanned = (0..=RATES).map(|k| lower * (upper / lower).powf(f64::from(k) / f64::from(RATES)));
        let sums = seen.filter(|rate| (lower..=upper).contains(rate)).chain(scanned).filter_map(|rate| {
            let parameters = thin.parameters(poles, delay_s, Some(rate));
            let start: Vec<f64> = parameters.iter().map(|parameter| parameter.start).collect();
            Some((sum_of_squares_at(&thin, &start)?, rate))
        });
        sums.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, rate)| rate)
    }

    /// The classical methods' modes, as starts.
    fn seen_by_methods(&self) -> impl Iterator<Item = Start> {
        let is_start = |mode: &&MethodMode| {
            (MIN_DAMPING..MAX_DAMPING).contains(&mode.damping_ratio) && mode.frequency_hz > 0.0
        };
        self.surveys.iter().flat_map(|survey| &survey.modes).filter(is_start).map(|mode| Start {
            pole: Pole { frequency_hz: mode.frequency_hz, damping_ratio: mode.damping_ratio },
            from: mode.method.words(),
        })
    }
}

/// Where a further mode may be, and who says so.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Start {
    pub(crate) pole: Pole,
    pub(crate) from: &'static str,
}

/// A peak of a spectrum.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    frequency_hz: f64,
    /// Width of a bin, Hz.
    bin_hz: f64,
}

/// Frequencies to try around a peak of the spectrum, as dense as the scan's damping asks for.
fn around(
    Candidate { frequency_hz, bin_hz }: Candidate,
    record: &ForcedRecord,
    spectral: &Spectral,
) -> impl Iterator<Item = f64> {
    let step = (0.5 * SCAN_DAMPING * frequency_hz).max(0.5 / record.duration_s());
    let half = (AROUND * bin_hz / step).ceil() as i32;
    let nyquist_hz = spectral.nyquist_hz();
    (-half..=half)
        .map(move |offset| frequency_hz + f64::from(offset) * step)
        .filter(move |f| *f > 0.0 && *f < nyquist_hz)
}

/// Where the residual responds most to the input, by response and by coherent output, and where it rings
/// most.
fn candidates(residuals: &[f64], record: &ForcedRecord, spectral: &Spectral) -> Vec<Candidate> {
    let output = resample(&record.time_s, residuals, &spectral.grid_s);
    let by_input = responding_bins(&spectral.record.input, &output, spectral, EXCITED);
    let by_drive = spectral.drive.iter().flat_map(|drive| responding_bins(drive, &output, spectral, DRIVEN));
    let mut bins: Vec<usize> = by_input.into_iter().chain(by_drive).collect();
    bins.sort_unstable();
    bins.dedup();
    let bin_hz = spectral.bin_hz();
    let mut found: Vec<Candidate> =
        bins.into_iter().map(|bin| Candidate { frequency_hz: bin as f64 * bin_hz, bin_hz }).collect();
    let ringing = if rests(&spectral.record.input) { ringing(&output, spectral) } else { Vec::new() };
    for other in ringing {
        let is_tried = |known: &Candidate| (known.frequency_hz - other.frequency_hz).abs() <= AROUND * bin_hz;
        if !found.iter().any(is_tried) {
            found.push(other);
        }
    }
    found
}

/// Bins of the spectrum at which an output responds most to what drives it, by response and by coherent
/// output.
fn responding_bins(driving: &[f64], output: &[f64], spectral: &Spectral, excited: f64) -> Vec<usize> {
    let interval_s = spectral.record.interval_s;
    let spectra = CrossSpectra::welch(driving, output, interval_s, spectral.segment, Window::Hamming);
    let top = spectra.input.iter().fold(0.0_f64, |top, value| top.max(*value));
    let rank = |exponent: f64| {
        let value = |(cross, input): (&Complex64, &f64)| {
            if *input > excited * top { cross.norm() / input.powf(exponent) } else { 0.0 }
        };
        let values: Vec<f64> = spectra.cross.iter().zip(&spectra.input).map(value).collect();
        peaks(&values, 2).into_iter().take(CANDIDATES)
    };
    rank(1.0).chain(rank(0.5)).collect()
}

/// Whether the input stays where it is for a good part of the record.
fn rests(input: &[f64]) -> bool {
    let moved: Vec<f64> = input.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let most = moved.iter().fold(0.0_f64, |most, moved| most.max(*moved));
    let still = moved.iter().filter(|moved| **moved < STILL * most).count();
    still as f64 > RESTING * moved.len() as f64
}

/// Peaks of the whole residual's spectrum within the excited band.
///
/// After a pulse the input rests while the structure rings: nothing in those segments is a response to it,
/// and segments of a short record are too short to show a low mode at all.
fn ringing(residuals: &[f64], spectral: &Spectral) -> Vec<Candidate> {
    let interval_s = spectral.record.interval_s;
    let whole = density(residuals, interval_s, residuals.len(), Window::Rectangular);
    let [lower_hz, upper_hz] = spectral.excited_band_hz();
    let bin_hz = 1.0 / (residuals.len() as f64 * interval_s);
    let excited: Vec<f64> = whole
        .frequency_hz
        .iter()
        .zip(&whole.density)
        .map(|(hz, value)| if (lower_hz..=upper_hz).contains(hz) { *value } else { 0.0 })
        .collect();
    let mut sorted = whole.density.clone();
    sorted.sort_by(f64::total_cmp);
    let floor = ABOVE_FLOOR * sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let strongest = peaks(&excited, 2).into_iter().take(CANDIDATES).filter(|&bin| excited[bin] > floor);
    strongest.map(|bin| Candidate { frequency_hz: whole.frequency_hz[bin], bin_hz }).collect()
}

fn values(curve: &PiecewiseCubic, times_s: &[f64]) -> Vec<f64> {
    curve.sample(times_s.iter().copied()).into_iter().map(|v| v[0]).collect()
}

fn resample(time_s: &[f64], samples: &[f64], grid_s: &[f64]) -> Vec<f64> {
    values(&PiecewiseCubic::new(time_s, samples, InputInterpolation::Cubic), grid_s)
}
