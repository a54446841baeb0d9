//! What a sensor drifts or creeps by while a structure rings: temperature, a charge that leaks away.
//!
//! Drift and ringing are told apart by fitting both at once. The courses that a drift may take are few and
//! smooth; the ringing is what a realisation finds beside them, from where it begins on. What is smooth,
//! goes one way, and explains nearly all that moves on average over the record is the drift. A move to
//! another place is not smooth, a slow mode comes back, and what a mode explains leaves a drift nothing to
//! explain. Where something drives the structure its ringing averages out.

use crate::column::Column;
use crate::decay_modes::Uniform;
use crate::modal_response::{Pole, free_response};
use crate::narrow_band::WholeSpectrum;
use crate::poles::{decimated, eigensystem_realisation};
use crate::tall::{Orthonormal, add_scaled, dot};
use crate::wild_samples::without_wild;

/// Highest power of time in a drift.
const HIGHEST_POWER: usize = 5;
/// Times, as shares of the record, in which a charge leaks away; shorter ones are hardly slower than what
/// rings.
const LEAKS: [f64; 5] = [0.08, 0.12, 0.18, 0.27, 0.4];
/// Times, as shares of the record, after which a creep (of an adhesive, of plastics) goes with the
/// logarithm of time.
const CREEPS: [f64; 3] = [0.01, 0.04, 0.15];
/// Periods within the record below which an oscillation is no ringing beside a drift.
const RINGS: f64 = 3.0;
/// Order of the realisation: so many half modes, noise among them.
const ORDER: usize = 20;
/// Samples per period of the loudest frequency, and most samples, that the ringing is realised from.
const PER_PERIOD: f64 = 10.0;
const MOST: usize = 3000;
/// Share of the loudest moment from which it rings.
const BEGINS: f64 = 0.7;
/// Damping ratio by which noise lets a steady hum seem to grow.
const GROWS: f64 = 2e-3;
/// Damping ratio from which nothing can be said to ring.
const MOST_DAMPED: f64 = 0.9;
/// Averages over the record by which a drift is judged.
const AVERAGES: usize = 24;
/// Share of what these averages scatter by that a drift explains.
const SMOOTH: f64 = 0.97;
/// The way that a drift goes, over the distance that it covers.
const ONE_WAY: f64 = 1.15;
/// The same of one that turns back once, and what the ringing beside it leaves of the swing: where nothing
/// rings, what turns back may be a slow mode.
const TURNS_BACK: (f64, f64) = (2.2, 0.2);
/// Share of a record's range that a drift is at least: a smaller one hides nothing.
const MATTERS: f64 = 0.03;
/// Rows of a record at least.
const LEAST_ROWS: usize = 4 * AVERAGES;

/// The course of a drift over the share of the record that has passed: powers of time, and what bends faster.
struct Course {
    powers: usize,
    bend: Option<Bend>,
}

/// A course that is fast at first, with its time as a share of the record.
#[derive(Clone, Copy)]
enum Bend {
    Leak(f64),
    Creep(f64),
}

impl Bend {
    fn at(self, share: f64) -> f64 {
        match self {
            Self::Leak(time) => (-share / time).exp(),
            Self::Creep(time) => (share / time).ln_1p(),
        }
    }
}

impl Course {
    /// All that are tried, the simple ones first.
    fn all() -> impl Iterator<Item = Self> {
        let powers = (1..=HIGHEST_POWER).map(|powers| Self { powers, bend: None });
        let bends = LEAKS.map(Bend::Leak).into_iter().chain(CREEPS.map(Bend::Creep));
        powers.chain(bends.map(|bend| Self { powers: 1, bend: Some(bend) }))
    }

    /// Its columns but for the constant, over shares of the record.
    fn columns(&self, shares: &[f64]) -> Vec<Vec<f64>> {
        let mut columns: Vec<Vec<f64>> =
            (1..=self.powers).map(|power| shares.iter().map(|x| chebyshev(power, *x)).collect()).collect();
        columns.extend(self.bend.map(|bend| shares.iter().map(|x| bend.at(*x)).collect()));
        columns
    }
}

/// Chebyshev's polynomial on 0 to 1.
pub(crate) fn chebyshev(power: usize, share: f64) -> f64 {
    (power as f64 * (2.0 * share - 1.0).clamp(-1.0, 1.0).acos()).cos()
}

/// A course with its factors, that of the constant first.
struct Fitted {
    course: Course,
    factors: Vec<f64>,
    left: Vec<f64>,
}

impl Fitted {
    /// A course fitted to a signal beside what rings.
    fn of(course: Course, signal: &[f64], ringing: &Orthonormal, pushed: usize) -> Self {
        let mut basis = ringing.clone();
        let columns = course.columns(&evenly(signal.len()));
        columns.into_iter().for_each(|column| basis.push(column));
        let mut left = signal.to_vec();
        let components = basis.remove_from(&mut left);
        let factors = basis.coefficients(&components).split_off(pushed);
        Self { course, factors, left }
    }

    /// The drift at shares of the record.
    fn at(&self, shares: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; shares.len()];
        for (column, factor) in self.course.columns(shares).iter().zip(&self.factors) {
            add_scaled(&mut sum, *factor, column);
        }
        sum
    }

    /// Whether it explains nearly all that moves on average in what is left without it, goes no longer a way
    /// than so many times its extent, and matters beside a range.
    fn is_drift(&self, without: &[f64], range: f64, most_way: f64) -> bool {
        let [left, without] = [&self.left[..], without].map(averages);
        let over = averages(&self.at(&evenly(self.left.len())));
        let way: f64 = over.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
        dot(&left, &left) < (1.0 - SMOOTH) * dot(&without, &without)
            && way < most_way * extent(&over)
            && extent(&over) > MATTERS * range
    }

    /// Whether the ringing beside it explains nearly all of what swings about it.
    fn is_beside_ringing(&self, slow: &[f64]) -> bool {
        let drift = self.at(&evenly(slow.len()));
        let swing: Vec<f64> = slow.iter().zip(&drift).map(|(y, drift)| y - drift).collect();
        let mean = swing.iter().sum::<f64>() / swing.len().max(1) as f64;
        let energy: f64 = swing.iter().map(|y| (y - mean).powi(2)).sum();
        dot(&self.left, &self.left) < TURNS_BACK.1 * energy
    }

    /// Bayes' information criterion, up to a constant.
    fn worth(&self) -> f64 {
        let rows = self.left.len() as f64;
        rows * dot(&self.left, &self.left).max(f64::MIN_POSITIVE).ln() + self.factors.len() as f64 * rows.ln()
    }
}

/// The course that says most with least.
fn best(signal: &[f64], ringing: &Orthonormal, pushed: usize) -> Option<Fitted> {
    Course::all()
        .map(|course| Fitted::of(course, signal, ringing, pushed))
        .min_by(|a, b| a.worth().total_cmp(&b.worth()))
}

/// The drift of a decay, by row; `None` where there is none to speak of.
pub(crate) fn drift(time_s: &[f64], values: &[f64]) -> Option<Vec<f64>> {
    if values.len() < LEAST_ROWS {
        return None;
    }
    let uniform = Uniform::new(time_s, &without_wild(values));
    let signal = uniform.without_mean();
    let beside = Beside::of(&signal, uniform.interval_s)?;
    let found = best(&beside.slow, &beside.ringing, beside.columns)?;
    let mut still = beside.slow.clone();
    beside.ringing.remove_from(&mut still);
    let most_way = if found.is_beside_ringing(&beside.slow) { TURNS_BACK.0 } else { ONE_WAY };
    found.is_drift(&still, extent(&signal), most_way).then(|| found.at(&shares_at(time_s)))
}

/// The drift of the output of a driven structure, by row; `None` where there is none to speak of, or what
/// drives it goes as smoothly.
pub(crate) fn drift_of_driven(time_s: &[f64], values: &[f64], drive: &[f64]) -> Option<Vec<f64>> {
    if values.len() < LEAST_ROWS {
        return None;
    }
    let of = |values: &[f64]| {
        let signal = Uniform::new(time_s, &without_wild(values)).without_mean();
        let found = best(&signal, &constant(signal.len()), 1)?;
        found.is_drift(&signal, extent(&signal), ONE_WAY).then_some(found)
    };
    let found = of(values)?;
    of(drive).is_none().then(|| found.at(&shares_at(time_s)))
}

/// Shares of a record that have passed at its stamps.
fn shares_at(time_s: &[f64]) -> Vec<f64> {
    let (first_s, last_s) = (time_s[0], time_s[time_s.len() - 1]);
    time_s.iter().map(|t| (t - first_s) / (last_s - first_s)).collect()
}

/// The span of a constant.
fn constant(rows: usize) -> Orthonormal {
    let mut constant = Orthonormal::default();
    constant.push(vec![1.0; rows]);
    constant
}

/// What rings beside a drift.
struct Beside {
    /// The record at a few samples per period.
    slow: Vec<f64>,
    /// A constant and the ringing there, and how many columns that took.
    ringing: Orthonormal,
    columns: usize,
}

impl Beside {
    fn of(signal: &[f64], interval_s: f64) -> Option<Self> {
        let lowest_hz = RINGS / (signal.len() as f64 * interval_s);
        // As if nothing rang; a constant alone rings beside it.
        let rough = best(signal, &constant(signal.len()), 1)?;
        let loudest_hz = WholeSpectrum::new(&rough.left, interval_s).loudest_above_hz(lowest_hz)?;
        let (swing, step_s) = decimated(&rough.left, interval_s, PER_PERIOD * loudest_hz);
        // Thinning the drift itself would leave its jump at the ends.
        let mut slow = rough.at(&evenly(swing.len()));
        add_scaled(&mut slow, 1.0, &swing);
        let top = swing.iter().fold(0.0_f64, |top, y| top.max(y.abs()));
        // Ringing that hardly falls is as loud as ever long after it begins.
        let start = swing.iter().position(|y| y.abs() >= BEGINS * top)?;
        let decay = &swing[start..swing.len().min(start + MOST)];
        let since: Vec<f64> = (0..swing.len() - start).map(|k| k as f64 * step_s).collect();
        let (mut ringing, mut columns) = (Orthonormal::default(), 1);
        for pole in eigensystem_realisation(decay, step_s, ORDER.min(decay.len() / 6)) {
            if pole.frequency_hz > lowest_hz && (-GROWS..MOST_DAMPED).contains(&pole.damping_ratio) {
                let damping_ratio = pole.damping_ratio.max(0.0);
                let pole = Pole { frequency_hz: pole.frequency_hz, damping_ratio };
                for values in free_response(pole, 0.0, &since) {
                    ringing.push(Column { start, values });
                    columns += 1;
                }
            }
        }
        ringing.push(vec![1.0; slow.len()]);
        Some(Self { slow, ringing, columns })
    }
}

/// Shares of a record that have passed at evenly spaced samples.
fn evenly(count: usize) -> Vec<f64> {
    let last = count.max(2) as f64 - 1.0;
    (0..count).map(|k| k as f64 / last).collect()
}

/// Averages over stretches of equal length.
fn averages(values: &[f64]) -> Vec<f64> {
    let length = values.len().div_ceil(AVERAGES).max(1);
    values.chunks(length).map(|some| some.iter().sum::<f64>() / some.len() as f64).collect()
}

/// From the lowest to the highest.
pub(crate) fn extent(values: &[f64]) -> f64 {
    let [low, high] =
        values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], y| [low.min(*y), high.max(*y)]);
    high - low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_creep_is_taken_out_from_its_beginning_on() {
        for time in [0.01, 0.04, 0.15] {
            let time_s: Vec<f64> = (0..4000).map(|k| f64::from(k) / 400.0).collect();
            let creep: Vec<f64> = time_s.iter().map(|t| 5.0 * (t / (10.0 * time)).ln_1p()).collect();
            let rings = |t: f64| (-0.5 * t).exp() * (40.0 * t).cos();
            let values: Vec<f64> = time_s.iter().zip(&creep).map(|(t, creep)| creep + rings(*t)).collect();
            let found = drift(&time_s, &values).unwrap();
            let left: Vec<f64> = creep.iter().zip(&found).map(|(creep, found)| creep - found).collect();
            assert!(extent(&left) < 0.03 * extent(&creep), "{time}: {} {}", extent(&left), extent(&creep));
        }
    }
}
