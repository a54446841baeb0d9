//! Steady lines in what goes on: one is a tone, many that repeat are a multisine.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;

use crate::narrow_band::WholeSpectrum;

/// Share of the energy that the lines of a tone hold, the share from which there is nothing else, and bins of
/// the whole record around each.
const OF_TONE: f64 = 0.5;
pub(super) const ALONE: f64 = 0.9;
const BINS: usize = 2;
/// Periods below which a line is as wide as anything else.
const FEW_PERIODS: f64 = (2 * BINS + 1) as f64;
/// A tone's harmonics that count.
const HARMONICS: usize = 8;
/// Share of its wider band that a tone's own bins hold; a resonance under noise is wider than a line.
const NARROW: f64 = 0.97;
const WIDER: usize = 20;
/// How well a signal repeats itself once every frequency is made as loud as the next: what noise leaves of 1,
/// and so many standard deviations of a signal that does not.
const REPEATS: (f64, f64) = (0.1, 6.0);
/// Share of its likeness a period later that a signal keeps after any number of periods.
const GOES_ON: f64 = 0.4;
/// The loudness of a frequency is taken over this share of all lines on either side, and over so many at
/// least.
const SMOOTH: (f64, usize) = (0.01, 6);
/// Share of the record at either end that fades.
const FADE: f64 = 0.15;

/// One steady line.
#[derive(Clone, Copy)]
pub(super) struct Tone {
    pub(super) hz: f64,
    /// Share of the energy that it holds, with its harmonics.
    pub(super) share: f64,
}

/// The one line that holds the energy, with its harmonics.
pub(super) fn tone(signal: &[f64], interval_s: f64) -> Option<Tone> {
    let strongest_hz = WholeSpectrum::new(signal, interval_s).strongest_hz()?;
    let power = windowed_power(signal);
    let bin_hz = 1.0 / (signal.len() as f64 * interval_s);
    let near = (strongest_hz / bin_hz).round() as usize;
    let around = near.saturating_sub(2)..(near + 3).min(power.len());
    let top = around.max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
    let within = |centre: usize, reach: usize| -> f64 {
        power[centre.saturating_sub(reach).max(1).min(power.len())..(centre + reach + 1).min(power.len())]
            .iter()
            .sum()
    };
    let all: f64 = power.iter().skip(1).sum();
    let harmonics = (1..=HARMONICS).map(|order| order * top).take_while(|bin| *bin < power.len());
    let lines: f64 = harmonics.map(|bin| within(bin, BINS)).sum();
    let is_narrow = within(top, BINS) > NARROW * within(top, WIDER.min(top / 2 + BINS));
    let is_line = top > 2 * BINS && is_narrow && lines > OF_TONE * all;
    is_line.then(|| Tone { hz: top as f64 * bin_hz, share: lines / all })
}

/// Whether a signal has too few periods of its loudest frequency for a line to show.
pub(super) fn is_short(signal: &[f64], interval_s: f64) -> bool {
    let strongest_hz = WholeSpectrum::new(signal, interval_s).strongest_hz();
    strongest_hz.is_some_and(|hz| hz * signal.len() as f64 * interval_s < FEW_PERIODS)
}

/// The period of a signal that repeats itself at least twice, s.
///
/// Frequencies are made equally loud first: a resonance is like itself at every one of its periods, and one
/// of many lines that it favours would be all there is.
pub(super) fn repeats_every_s(signal: &[f64], interval_s: f64) -> Option<f64> {
    let rows = signal.len();
    let alike = self_likeness(&equally_loud(signal));
    let shortest = (rows / 200).max(16);
    let likely = |lag: usize| alike[lag] > REPEATS.0.max(REPEATS.1 / ((rows - lag) as f64).sqrt());
    let peaks = (shortest..alike.len()).filter(|lag| {
        let next = alike.get(lag + 1).copied().unwrap_or(f64::NEG_INFINITY);
        alike[*lag] >= alike[lag - 1] && alike[*lag] > next && likely(*lag) && goes_on(&alike, *lag)
    });
    let peaks: Vec<usize> = peaks.collect();
    let best = peaks.iter().map(|lag| alike[*lag]).fold(0.0, f64::max);
    // Of a period and its multiples, the shortest that is about as good.
    let period = peaks.into_iter().find(|lag| alike[*lag] > 0.8 * best)?;
    Some(period as f64 * interval_s)
}

/// Whether a likeness comes back after every multiple of a lag, one at least: what rings is like itself once
/// or twice later, and ever less.
fn goes_on(alike: &[f64], lag: usize) -> bool {
    let most = (alike.len() - 1) / lag;
    most > 1
        && (2..=most).all(|times| {
            let around = &alike[times * (lag - 1)..(times * (lag + 1) + 1).min(alike.len())];
            around.iter().fold(0.0_f64, |top, one| top.max(*one)) > GOES_ON * alike[lag]
        })
}

/// The signal with every line divided by the loudness of those around it.
fn equally_loud(signal: &[f64]) -> Vec<f64> {
    let rows = signal.len();
    let mut planner = FftPlanner::new();
    // Ends that do not meet would spread every strong line over all others.
    let fade = |k: usize| {
        let from_end = (k.min(rows - 1 - k) as f64 + 0.5) / (FADE * rows as f64);
        0.5 - 0.5 * (std::f64::consts::PI * from_end.min(1.0)).cos()
    };
    let mut bins: Vec<Complex64> =
        signal.iter().enumerate().map(|(k, y)| Complex64::new(y * fade(k), 0.0)).collect();
    planner.plan_fft_forward(rows).process(&mut bins);
    let half = rows / 2;
    let mut sums = vec![0.0; half + 2];
    for k in 0..=half {
        sums[k + 1] = sums[k] + bins[k.min(rows - 1)].norm_sqr();
    }
    let reach = ((SMOOTH.0 * half as f64) as usize).max(SMOOTH.1);
    for k in 1..rows.div_ceil(2) {
        let (from, to) = (k.saturating_sub(reach).max(1), (k + reach).min(half));
        let loudness = ((sums[to + 1] - sums[from]) / (to + 1 - from) as f64).sqrt();
        let factor = if loudness > 0.0 { 1.0 / loudness } else { 0.0 };
        bins[k] *= factor;
        bins[rows - k] *= factor;
    }
    bins[0] = Complex64::new(0.0, 0.0);
    if rows.is_multiple_of(2) {
        bins[half] = Complex64::new(0.0, 0.0);
    }
    planner.plan_fft_inverse(rows).process(&mut bins);
    bins.iter().map(|bin| bin.re / rows as f64).collect()
}

/// Correlation of a signal with itself by lag, each over the part that both have, up to three quarters of its
/// length.
fn self_likeness(signal: &[f64]) -> Vec<f64> {
    let rows = signal.len();
    let length = (2 * rows).next_power_of_two();
    let mut bins: Vec<Complex64> = signal.iter().map(|y| Complex64::new(*y, 0.0)).collect();
    bins.resize(length, Complex64::new(0.0, 0.0));
    let mut planner = FftPlanner::new();
    planner.plan_fft_forward(length).process(&mut bins);
    bins.iter_mut().for_each(|bin| *bin = Complex64::new(bin.norm_sqr(), 0.0));
    planner.plan_fft_inverse(length).process(&mut bins);
    let mut energy = vec![0.0; rows + 1];
    for (k, y) in signal.iter().enumerate() {
        energy[k + 1] = energy[k] + y * y;
    }
    (0..3 * rows / 4 + 1)
        .map(|lag| {
            // What is over at once has nothing to be compared with.
            let steady = 0.5 * energy[rows] * (rows - lag) as f64 / rows as f64;
            let both = (energy[rows - lag] * (energy[rows] - energy[lag])).sqrt().max(steady);
            if both > 0.0 { bins[lag].re / length as f64 / both } else { 0.0 }
        })
        .collect()
}

/// Power of the whole record under a Hann window.
fn windowed_power(signal: &[f64]) -> Vec<f64> {
    let rows = signal.len();
    let weight = |k: usize| 0.5 - 0.5 * (std::f64::consts::TAU * (k as f64 + 0.5) / rows as f64).cos();
    let mut bins: Vec<Complex64> =
        signal.iter().enumerate().map(|(k, y)| Complex64::new(y * weight(k), 0.0)).collect();
    FftPlanner::new().plan_fft_forward(rows).process(&mut bins);
    bins.iter().take(rows / 2).map(Complex64::norm_sqr).collect()
}
