//! Where in a record a sweep begins: pulse compression.
//!
//! The record, its level evened out, is correlated with the sweep's own phase at every lag. A structure only
//! turns the phase slowly while the sweep passes, so that the correlation is compressed into a peak as narrow
//! as one over the swept band, whatever the resonances. Clocks differ: neighbouring rates are tried, too.

use std::f64::consts::TAU;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;

use super::plan::SweepPlan;
use super::signal::{SweepShape, SweepSignal};

/// An output on an even grid, without its mean, just fast enough for the sweep.
pub(super) struct Evened {
    pub(super) first_s: f64,
    pub(super) interval_s: f64,
    pub(super) samples: Vec<f64>,
}

/// Where a sweep may begin.
#[derive(Debug, Clone, Copy)]
pub(super) struct Alignment {
    pub(super) start_s: f64,
    pub(super) rate: f64,
    /// Correlation of the record with the sweep, 0 to 1.
    pub(super) coherent: f64,
}

/// How far the rate of a clock may be off, as a share.
const CLOCKS: f64 = 0.02;
/// Rates that are tried on either side, at most.
const MOST_RATES: f64 = 150.0;
/// Samples per period of the highest frequency.
const SAMPLES: f64 = 4.0;
/// Periods of the lowest frequency over which the level is evened out, and its floor as a share of the
/// whole's.
const LEVEL_PERIODS: f64 = 4.0;
const LEVEL_FLOOR: f64 = 0.02;
/// Samples of record and sweep together, at most.
const MOST_SAMPLES: usize = 1 << 22;
/// Share of the record, or of the sweep, that both must have in common.
const OVERLAP: f64 = 0.2;

impl Evened {
    /// From an even record of that interval, s.
    pub(super) fn new(first_s: f64, interval_s: f64, values: &[f64], highest_hz: f64) -> Self {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        let stride = ((1.0 / (SAMPLES * highest_hz * interval_s)) as usize).max(1);
        let samples =
            values.chunks_exact(stride).map(|some| some.iter().sum::<f64>() / stride as f64 - mean).collect();
        let first_s = first_s + 0.5 * (stride - 1) as f64 * interval_s;
        Self { first_s, interval_s: stride as f64 * interval_s, samples }
    }

    pub(super) fn time_s(&self, row: usize) -> f64 {
        self.first_s + row as f64 * self.interval_s
    }

    pub(super) fn duration_s(&self) -> f64 {
        self.samples.len() as f64 * self.interval_s
    }

    /// Root mean square around every sample, over a time, s.
    pub(super) fn level(&self, over_s: f64) -> Vec<f64> {
        let half = ((0.5 * over_s / self.interval_s) as usize).clamp(2, (self.samples.len() / 2).max(2));
        let mut sums = vec![0.0];
        for value in &self.samples {
            sums.push(sums[sums.len() - 1] + value * value);
        }
        let mean = |k: usize| {
            let (from, to) = (k.saturating_sub(half), (k + half + 1).min(self.samples.len()));
            ((sums[to] - sums[from]) / (to - from) as f64).max(0.0).sqrt()
        };
        (0..self.samples.len()).map(mean).collect()
    }

    /// The same sweep at every level.
    fn evened_out(&self, lowest_hz: f64) -> Vec<f64> {
        let level = self.level(LEVEL_PERIODS / lowest_hz);
        let floor = LEVEL_FLOOR * level.iter().fold(0.0_f64, |top, level| top.max(*level));
        let value = |(value, level): (&f64, &f64)| value / level.max(floor).max(f64::MIN_POSITIVE);
        self.samples.iter().zip(&level).map(value).collect()
    }
}

/// Where the record and a sweep of this shape agree best, for each rate that the plan may mean.
pub(super) fn align(record: &Evened, plan: &SweepPlan, shape: SweepShape) -> Vec<Alignment> {
    plan.rates().into_iter().filter_map(|rate| align_at(record, plan, shape, rate)).collect()
}

fn align_at(record: &Evened, plan: &SweepPlan, shape: SweepShape, rate: f64) -> Option<Alignment> {
    let h = record.interval_s;
    let whole = SweepSignal::new(plan, rate, shape, 0.0);
    let template = (whole.duration_s / h) as usize;
    if template < 16 || record.samples.len() + template > MOST_SAMPLES {
        return None;
    }
    let y = record.evened_out(plan.from_hz.min(plan.to_hz));
    let length = (y.len() + template + template / 32).next_power_of_two();
    let mut planner = FftPlanner::new();
    let (forward, inverse) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
    let padded = |some: &mut dyn Iterator<Item = Complex64>| {
        let mut bins: Vec<Complex64> = some.collect();
        bins.resize(length, Complex64::new(0.0, 0.0));
        forward.process(&mut bins);
        bins
    };
    let spectrum = padded(&mut y.iter().map(|value| Complex64::from(*value)));
    let mut power = vec![0.0];
    for value in &y {
        power.push(power[power.len() - 1] + value * value);
    }
    let correlate = |rate: f64| {
        let signal = SweepSignal::new(plan, rate, shape, 0.0);
        let count = ((signal.duration_s / h) as usize).min(length - y.len());
        let turn = |k: usize| Complex64::from_polar(1.0, TAU * signal.periods(k as f64 * h).fract());
        let mut bins = padded(&mut (0..count).map(turn));
        bins.iter_mut().zip(&spectrum).for_each(|(bin, y)| *bin = y * bin.conj());
        inverse.process(&mut bins);
        let best = (0..length).filter_map(|bin| {
            // Lags below zero: the sweep began before the record.
            let lag = if bin < y.len() { bin as i64 } else { bin as i64 - length as i64 };
            let from = lag.max(0) as usize;
            let to = usize::try_from((lag + count as i64).clamp(0, y.len() as i64)).ok()?;
            let common = to.saturating_sub(from);
            let energy = 0.5 * (power[to.max(from)] - power[from]) * common as f64;
            (common as f64 > OVERLAP * y.len().min(count) as f64 && energy > 0.0).then(|| {
                let size = bins[bin].norm() / length as f64;
                (
                    size,
                    Alignment {
                        start_s: record.first_s + lag as f64 * h,
                        rate,
                        coherent: size / energy.sqrt(),
                    },
                )
            })
        });
        best.max_by(|a, b| a.0.total_cmp(&b.0))
    };
    // A rate off by this much turns the phase by half a period at the ends of what is in the record.
    let seen_s = whole.duration_s.min(record.duration_s());
    let steepest = if plan.exponential { rate.abs() * plan.from_hz.max(plan.to_hz) } else { rate.abs() };
    let step = (1.0 / (steepest * seen_s * seen_s)).min(CLOCKS);
    let steps = (CLOCKS / step).min(MOST_RATES) as i32;
    let found = (-steps..=steps).filter_map(|k| correlate(rate * (1.0 + f64::from(k) * step)));
    found.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, alignment)| alignment)
}
