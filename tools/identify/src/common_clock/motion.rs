//! The clocks from a motion that both recordings saw: correlation over all offsets, then least squares.

use nalgebra::{Matrix4, Vector4};
use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;

use super::{ClockError, ClockFit};
use crate::interpolation::{InputInterpolation, PiecewiseCubic};
use crate::result::Estimate;

/// Samples that have to be compared at least.
const FEWEST: usize = 40;
/// Share of the shorter recording that has to overlap.
const OVERLAP: f64 = 0.2;
/// Share of the power that has to agree.
const AGREES: f64 = 0.4;
/// Peaks of the correlation that are followed up.
const PEAKS: usize = 6;
/// The largest drift that is looked for, s per s.
const LARGEST_DRIFT: f64 = 1e-3;
/// Samples that the search for a start looks at.
const COARSE: usize = 3000;
/// Points of the common grid at most.
const MOST_POINTS: usize = 1 << 20;
/// How much more the second best offset must leave than the best one, as a ratio and as a share of the
/// power.
const CLEARLY_WORSE: (f64, f64) = (1.3, 0.02);
/// Width of the Gaussian that the faster recording is smoothed by, in samples, and its reach. Between
/// samples a spline has less noise than at them, and the fit would rather lie between them.
const SMOOTHED: f64 = 0.8;
const REACH: usize = 3;

/// A column over its stamps, without missing values.
#[derive(Debug, Clone, Copy)]
pub struct Signal<'s> {
    /// Stamps, s, strictly increasing.
    pub time_s: &'s [f64],
    /// The values.
    pub values: &'s [f64],
}

/// What the slower sampled recording saw of the faster one's motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Derivative {
    /// The same quantity.
    Same,
    /// Its rate: a speed of a position.
    Rate,
    /// The rate of its rate: an acceleration of a position.
    SecondRate,
}

impl Signal<'_> {
    fn span_s(&self) -> [f64; 2] {
        [self.time_s.first(), self.time_s.last()].map(|end| end.copied().unwrap_or(0.0))
    }

    fn interval_s(&self) -> f64 {
        let [first, last] = self.span_s();
        (last - first) / (self.time_s.len().max(2) - 1) as f64
    }
}

/// The clocks from a motion that both saw, to an unknown scale and zero.
///
/// # Errors
/// [`ClockError`] where there is too little, nothing in common, or a motion that repeats itself.
pub fn clock_by_motion(
    slow: Signal<'_>,
    fast: Signal<'_>,
    derivative: Derivative,
) -> Result<ClockFit, ClockError> {
    let found = slow.time_s.len().min(fast.time_s.len());
    if found < FEWEST {
        return Err(ClockError::TooFew { found, needed: FEWEST });
    }
    let pair = Pair::new(slow, fast, derivative);
    let mut fits: Vec<Fit> = pair.offsets_s().into_iter().filter_map(|start| pair.fitted(start)).collect();
    fits.sort_by(|a, b| a.left_share.total_cmp(&b.left_share));
    let Some(best) = fits.first() else { return Err(ClockError::NothingInCommon { explained: 0.0 }) };
    let explained = 1.0 - best.left_share;
    if explained < AGREES {
        return Err(ClockError::NothingInCommon { explained });
    }
    let elsewhere = |fit: &&Fit| (fit.at[0] - best.at[0]).abs() > 2.0 * slow.interval_s();
    if let Some(second) = fits.iter().find(elsewhere)
        && second.left_share < CLEARLY_WORSE.0 * best.left_share + CLEARLY_WORSE.1
    {
        let [first_s, second_s] = [best, second].map(|fit| fit.at[0]);
        return Err(ClockError::Ambiguous { first_s, second_s });
    }
    // The search counts from the middle of the slower recording, the result from its first stamp.
    let [value, drift] = [best.at[0], best.at[1]];
    let before_s = slow.time_s[0] - pair.middle_s;
    let covariance = best.covariance;
    let variance =
        covariance[(0, 0)] + 2.0 * before_s * covariance[(0, 1)] + before_s * before_s * covariance[(1, 1)];
    Ok(ClockFit {
        offset_s: Estimate { value: value + drift * before_s, stderr: variance.max(0.0).sqrt() },
        drift: Some(Estimate { value: drift, stderr: covariance[(1, 1)].max(0.0).sqrt() }),
        first_s: slow.time_s[0],
        pairs: best.pairs,
        explained,
    })
}

/// A signal without the highest part of its noise; its stamps are averaged as its values are.
fn smoothed(signal: Signal<'_>) -> (Vec<f64>, Vec<f64>) {
    let weights: Vec<f64> = (0..=REACH).map(|k| (-0.5 * (k as f64 / SMOOTHED).powi(2)).exp()).collect();
    let last = signal.time_s.len() - 1;
    let average = |samples: &[f64], row: usize| {
        let reach = REACH.min(row).min(last - row);
        let pairs = (1..=reach).map(|k| weights[k] * (samples[row - k] + samples[row + k]));
        let total = 1.0 + 2.0 * weights[1..=reach].iter().sum::<f64>();
        (samples[row] + pairs.sum::<f64>()) / total
    };
    let rows = 0..=last;
    rows.map(|row| (average(signal.time_s, row), average(signal.values, row))).unzip()
}

/// Both signals, ready for comparison.
struct Pair<'s> {
    slow: Signal<'s>,
    curve: PiecewiseCubic,
    fast_span_s: [f64; 2],
    derivative: Derivative,
    middle_s: f64,
}

/// A fit: offset at the middle (s), drift, scale and zero.
struct Fit {
    at: [f64; 4],
    covariance: Matrix4<f64>,
    left_share: f64,
    pairs: usize,
}

/// Sums of squares at some offset and drift.
struct Sums {
    normal: Matrix4<f64>,
    right: Vector4<f64>,
    left: f64,
    total: f64,
    pairs: usize,
}

impl<'s> Pair<'s> {
    fn new(slow: Signal<'s>, fast: Signal<'_>, derivative: Derivative) -> Self {
        let [first, last] = slow.span_s();
        let (time_s, values) = smoothed(fast);
        Self {
            slow,
            curve: PiecewiseCubic::new(&time_s, &values, InputInterpolation::Cubic),
            fast_span_s: fast.span_s(),
            derivative,
            middle_s: 0.5 * (first + last),
        }
    }

    /// The faster recording's motion at increasing times, as the slower one sees it, and its slope.
    fn motion(&self, times_s: &[f64]) -> Vec<[f64; 2]> {
        let pick = |[value, rate, second]: [f64; 3]| match self.derivative {
            Derivative::Same => [value, rate],
            Derivative::Rate => [rate, second],
            Derivative::SecondRate => [second, 0.0],
        };
        let mut found: Vec<[f64; 2]> =
            self.curve.sample(times_s.iter().copied()).into_iter().map(pick).collect();
        if self.derivative == Derivative::SecondRate {
            let step_s = 0.1 * self.slow.interval_s();
            let later: Vec<f64> = times_s.iter().map(|t| t + step_s).collect();
            let ahead = self.curve.sample(later);
            found.iter_mut().zip(ahead).for_each(|(own, [_, _, second])| own[1] = (second - own[0]) / step_s);
        }
        found
    }

    /// Rows of the slower recording that the faster one covers, every so manieth, with their times on its
    /// clock.
    fn rows(&self, offset_s: f64, drift: f64, stride: usize) -> (Vec<usize>, Vec<f64>) {
        let time = |t: &f64| t + offset_s + drift * (t - self.middle_s);
        let covered = self.slow.time_s.iter().enumerate().step_by(stride).filter_map(|(row, t)| {
            let t = time(t);
            (self.fast_span_s[0]..=self.fast_span_s[1]).contains(&t).then_some((row, t))
        });
        covered.unzip()
    }

    /// Scale and zero at an offset and a drift, and the share of the power that is left.
    fn scaled(&self, offset_s: f64, drift: f64, stride: usize) -> Option<(f64, [f64; 2])> {
        let (rows, times) = self.rows(offset_s, drift, stride);
        if rows.len() < FEWEST || (rows.len() * stride) as f64 <= OVERLAP * self.least_rows() {
            return None;
        }
        let motion = self.motion(&times);
        let count = rows.len() as f64;
        let (mut x, mut y, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (row, [value, _]) in rows.iter().zip(&motion) {
            let seen = self.slow.values[*row];
            (x, y) = (x + value, y + seen);
            (xx, xy, yy) = (xx + value * value, xy + value * seen, yy + seen * seen);
        }
        let (xx, xy, yy) = (xx - x * x / count, xy - x * y / count, yy - y * y / count);
        if !(xx > 0.0 && yy > 0.0) {
            return None;
        }
        let scale = xy / xx;
        Some((1.0 - scale * xy / yy, [scale, (y - scale * x) / count]))
    }

    /// Rows of the shorter recording, as the slower one would have them.
    fn least_rows(&self) -> f64 {
        let [first, last] = self.fast_span_s;
        ((last - first) / self.slow.interval_s()).min(self.slow.time_s.len() as f64)
    }

    /// Offsets at which the correlation over the overlap peaks, the best first, s.
    fn offsets_s(&self) -> Vec<f64> {
        let [slow_first, slow_last] = self.slow.span_s();
        let [fast_first, fast_last] = self.fast_span_s;
        let total_s = (slow_last - slow_first) + (fast_last - fast_first);
        let step_s = self.slow.interval_s().max(total_s / MOST_POINTS as f64);
        let grid = |first: f64, last: f64| -> Vec<f64> {
            let count = ((last - first) / step_s) as usize + 1;
            (0..count).map(|k| first + k as f64 * step_s).collect()
        };
        let (slow_grid, fast_grid) = (grid(slow_first, slow_last), grid(fast_first, fast_last));
        let seen = PiecewiseCubic::new(self.slow.time_s, self.slow.values, InputInterpolation::Linear);
        let seen: Vec<f64> = seen.sample(slow_grid).into_iter().map(|[value, ..]| value).collect();
        let motion: Vec<f64> = self.motion(&fast_grid).into_iter().map(|[value, _]| value).collect();
        let shares = Correlated::new(&seen, &motion).shares(OVERLAP, FEWEST);
        let mut peaks: Vec<(f64, f64)> = shares
            .windows(3)
            .filter(|three| three[1].1 >= three[0].1 && three[1].1 > three[2].1)
            .map(|three| (three[1].1, fast_first - slow_first + three[1].0 as f64 * step_s))
            .collect();
        peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
        peaks.into_iter().take(PEAKS).map(|(_, offset_s)| offset_s).collect()
    }

    /// Half a period of the motion, s: half its length over its changes of sign.
    fn half_period_s(&self) -> f64 {
        let mean = self.slow.values.iter().sum::<f64>() / self.slow.values.len() as f64;
        let crossings =
            self.slow.values.windows(2).filter(|pair| (pair[0] < mean) != (pair[1] < mean)).count();
        let [first, last] = self.slow.span_s();
        ((last - first) / crossings.max(1) as f64).max(2.0 * self.slow.interval_s())
    }

    /// The least squares fit from an offset.
    fn fitted(&self, start_s: f64) -> Option<Fit> {
        let stride = (self.slow.time_s.len() / COARSE).max(1);
        let [first, last] = self.slow.span_s();
        let step_s = (0.25 * self.half_period_s()).min(self.slow.interval_s());
        let drift_step = step_s / (0.5 * (last - first));
        let drifts = (LARGEST_DRIFT / drift_step).ceil().min(60.0) as i32;
        let starts = (-drifts..=drifts).flat_map(|drift| (-2..=2).map(move |offset| (drift, offset)));
        let (_, mut at) = starts
            .filter_map(|(drift, offset)| {
                let offset_s = start_s + f64::from(offset) * step_s;
                let drift = f64::from(drift) * LARGEST_DRIFT / f64::from(drifts.max(1));
                let (left, [scale, zero]) = self.scaled(offset_s, drift, stride)?;
                Some((left, [offset_s, drift, scale, zero]))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let mut sums = self.sums(at)?;
        for _ in 0..30 {
            let step = sums.normal.cholesky()?.solve(&sums.right);
            let mut share = 1.0;
            let (next, better) = loop {
                let next: [f64; 4] = std::array::from_fn(|k| at[k] + share * step[k]);
                match self.sums(next).filter(|next| {
                    next.left * sums.pairs as f64 <= sums.left * next.pairs as f64 * (1.0 + 1e-12)
                }) {
                    Some(better) => break (next, better),
                    None if share > 1e-3 => share *= 0.5,
                    None => return self.told(at, &sums),
                }
            };
            let done = sums.left - better.left < 1e-10 * sums.left && sums.pairs == better.pairs;
            (at, sums) = (next, better);
            if done {
                break;
            }
        }
        self.told(at, &sums)
    }

    /// Residuals and their slopes by offset, drift, scale and zero.
    fn residuals(&self, [offset_s, drift, scale, zero]: [f64; 4]) -> Vec<(f64, Vector4<f64>)> {
        let (rows, times) = self.rows(offset_s, drift, 1);
        let motion = self.motion(&times);
        let of = |(row, [value, slope]): (&usize, &[f64; 2])| {
            let since = self.slow.time_s[*row] - self.middle_s;
            let left = self.slow.values[*row] - scale * value - zero;
            (left, Vector4::new(scale * slope, scale * slope * since, *value, 1.0))
        };
        rows.iter().zip(&motion).map(of).collect()
    }

    fn sums(&self, at: [f64; 4]) -> Option<Sums> {
        let rows = self.residuals(at);
        if rows.len() < FEWEST {
            return None;
        }
        let mut sums = Sums {
            normal: Matrix4::zeros(),
            right: Vector4::zeros(),
            left: 0.0,
            total: 0.0,
            pairs: rows.len(),
        };
        let seen = |(left, slopes): &(f64, Vector4<f64>)| left + at[2] * slopes[2] + at[3];
        let mean = rows.iter().map(seen).sum::<f64>() / rows.len() as f64;
        for row in &rows {
            let (left, slopes) = row;
            sums.normal += slopes * slopes.transpose();
            sums.right += slopes * *left;
            sums.left += left * left;
            sums.total += (seen(row) - mean).powi(2);
        }
        Some(sums)
    }

    /// With the covariance that holds also where the error is larger in the steep parts, as that of stamps
    /// is.
    fn told(&self, at: [f64; 4], sums: &Sums) -> Option<Fit> {
        let inverse = sums.normal.try_inverse()?;
        let mut scatter = Matrix4::zeros();
        for (left, slopes) in self.residuals(at) {
            scatter += slopes * slopes.transpose() * (left * left);
        }
        let freedom = sums.pairs as f64 / (sums.pairs as f64 - 4.0).max(1.0);
        Some(Fit {
            at,
            covariance: inverse * scatter * inverse * freedom,
            left_share: sums.left / sums.total.max(f64::MIN_POSITIVE),
            pairs: sums.pairs,
        })
    }
}

/// Two signals on one grid, for every lag.
struct Correlated {
    products: Vec<f64>,
    slow: Moments,
    fast: Moments,
}

/// Running sums of a signal and its squares.
struct Moments {
    sums: Vec<f64>,
    squares: Vec<f64>,
}

impl Moments {
    fn new(values: &[f64]) -> Self {
        let running = |square: bool| {
            let mut sum = 0.0;
            std::iter::once(0.0)
                .chain(values.iter().map(|v| {
                    sum += if square { v * v } else { *v };
                    sum
                }))
                .collect()
        };
        Self { sums: running(false), squares: running(true) }
    }

    /// Sum and sum of squares from one place to another.
    fn between(&self, from: usize, to: usize) -> [f64; 2] {
        [self.sums[to] - self.sums[from], self.squares[to] - self.squares[from]]
    }

    fn len(&self) -> usize {
        self.sums.len() - 1
    }
}

impl Correlated {
    fn new(slow: &[f64], fast: &[f64]) -> Self {
        let size = (slow.len() + fast.len()).next_power_of_two();
        let mut planner = FftPlanner::new();
        let (forward, back) = (planner.plan_fft_forward(size), planner.plan_fft_inverse(size));
        let centred = |values: &[f64]| -> Vec<f64> {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            values.iter().map(|v| v - mean).collect()
        };
        let (slow, fast) = (centred(slow), centred(fast));
        let spectrum = |values: &[f64]| {
            let mut padded: Vec<Complex64> = values.iter().map(|v| Complex64::new(*v, 0.0)).collect();
            padded.resize(size, Complex64::default());
            forward.process(&mut padded);
            padded
        };
        let mut product: Vec<Complex64> =
            spectrum(&slow).iter().zip(spectrum(&fast)).map(|(a, b)| a.conj() * b).collect();
        back.process(&mut product);
        let products = product.into_iter().map(|value| value.re / size as f64).collect();
        Self { products, slow: Moments::new(&slow), fast: Moments::new(&fast) }
    }

    /// For every lag with enough overlap (slow[k] beside fast[k + lag]) the share of the power that agrees.
    fn shares(&self, overlap: f64, fewest: usize) -> Vec<(i64, f64)> {
        let (slow, fast) = (self.slow.len() as i64, self.fast.len() as i64);
        let least = ((overlap * slow.min(fast) as f64) as i64).max(fewest as i64);
        (1 - slow..fast)
            .filter_map(|lag| {
                let (from, to) = ((-lag).max(0), slow.min(fast - lag));
                let count = to - from;
                (count >= least).then(|| {
                    let [x, xx] = self.slow.between(from as usize, to as usize);
                    let [y, yy] = self.fast.between((from + lag) as usize, (to + lag) as usize);
                    let product = self.products[lag.rem_euclid(self.products.len() as i64) as usize];
                    let n = count as f64;
                    let (xx, yy, xy) = (xx - x * x / n, yy - y * y / n, product - x * y / n);
                    // More overlap is better evidence: the power that is left beside what could be
                    // compared.
                    let weight = n / slow.min(fast) as f64;
                    let share = if xx > 0.0 && yy > 0.0 { xy * xy / (xx * yy) } else { 0.0 };
                    (lag, share * weight.min(1.0).sqrt())
                })
            })
            .collect()
    }
}
