//! Start and rate of a sweep to a fraction of a period: one mode, its input's start and rate, fitted to the
//! record.

use super::align::{Alignment, Evened};
use super::plan::SweepPlan;
use super::signal::{SweepShape, SweepSignal};
use crate::column::Column;
use crate::forced_model::{pole, pole_parameters};
use crate::interpolation::{InputInterpolation, PiecewiseCubic};
use crate::levenberg_marquardt::Parameter;
use crate::modal_response::{InputKind, OutputQuantity, Path, Pole, forced_response, free_response};
use crate::separable::{Separable, fit_roughly};

/// Points of the sweep per period of its highest frequency.
const POINTS: f64 = 8.0;
/// Harmonics of pulses that are kept, in multiples of the highest frequency.
const HARMONICS: f64 = 2.0;
/// Rows of a fit, at most.
const MOST_ROWS: usize = 6000;
/// Half periods at which the start is tried on either side of the alignment.
const HALF_PERIODS: i32 = 5;
/// Share of the largest level above which samples belong to the resonance.
const RESONANCE: f64 = 0.3;
/// How far the logarithm of the rate may move.
const RATE_REACH: f64 = 0.01;
/// Damping ratio that the fit starts from.
const DAMPING: f64 = 0.03;

/// The parameters are ln f and ln zeta of the mode, the start (s), the logarithm of the rate and the phase at
/// the start (periods).
struct OneMode<'r> {
    time_s: Vec<f64>,
    output: Vec<f64>,
    plan: &'r SweepPlan,
    /// Sign of the rate.
    sign: f64,
    shape: SweepShape,
    path: Path,
}

/// A sweep that explains the record.
pub(super) struct Fitted {
    pub(super) start_s: f64,
    pub(super) rate: f64,
    /// Where in a period it starts, periods.
    pub(super) phase: f64,
    pub(super) shape: SweepShape,
    /// What the sweep and one mode leave of the output, sum of squares.
    pub(super) left: f64,
}

impl OneMode<'_> {
    fn input(&self, parameters: &[f64]) -> PiecewiseCubic {
        let signal = SweepSignal::new(self.plan, self.sign * parameters[3].exp(), self.shape, parameters[4]);
        let highest_hz = self.plan.from_hz.max(self.plan.to_hz);
        let step_s = 1.0 / (POINTS * highest_hz);
        let ends = [self.time_s.first(), self.time_s.last()].map(|end| end.copied().unwrap_or(0.0));
        let knots = ((ends[1] - ends[0]) / step_s) as usize + 4;
        let knots_s: Vec<f64> = (0..knots).map(|k| ends[0] + (k as f64 - 1.0) * step_s).collect();
        let below_hz = HARMONICS * highest_hz;
        let values: Vec<f64> = knots_s.iter().map(|t| signal.value(t - parameters[2], below_hz)).collect();
        PiecewiseCubic::new(&knots_s, &values, InputInterpolation::Cubic)
    }
}

impl Separable for OneMode<'_> {
    fn target(&self, _parameters: &[f64]) -> Vec<f64> {
        self.output.clone()
    }

    fn blocks(&self) -> usize {
        2
    }

    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Column> {
        let input = self.input(parameters);
        if block == 1 {
            let direct: Vec<f64> =
                input.sample(self.time_s.iter().copied()).into_iter().map(|value| value[0]).collect();
            return vec![direct.into(), vec![1.0; self.time_s.len()].into()];
        }
        let pole = pole(parameters, 0);
        let origin_s = self.time_s.first().copied().unwrap_or(0.0);
        let forced = forced_response(pole, &input, self.path, &self.time_s);
        let [cosine, sine] = free_response(pole, origin_s, &self.time_s);
        vec![forced.into(), cosine.into(), sine.into()]
    }

    fn depends(&self, block: usize, parameter: usize) -> bool {
        block == 0 || parameter >= 2
    }
}

/// The sweep of one shape that explains the record best, from where they are aligned.
pub(super) fn fitted(
    record: &Evened,
    plan: &SweepPlan,
    shape: SweepShape,
    quantity: OutputQuantity,
    alignment: Alignment,
) -> Option<Fitted> {
    let signal = SweepSignal::new(plan, alignment.rate, shape, 0.0);
    let time = |k: usize| record.first_s + k as f64 * record.interval_s;
    let level = record.level(4.0 / plan.from_hz.min(plan.to_hz));
    let swept = |k: usize| (0.0..=signal.duration_s).contains(&(time(k) - alignment.start_s));
    let loudest = (0..level.len()).filter(|k| swept(*k)).max_by(|a, b| level[*a].total_cmp(&level[*b]))?;
    let peak_hz = signal.frequency_hz(time(loudest) - alignment.start_s);
    let model = |rows: std::ops::Range<usize>| {
        let stride = rows.len().div_ceil(MOST_ROWS).max(1);
        let kept: Vec<usize> = rows.step_by(stride).collect();
        OneMode {
            time_s: kept.iter().map(|k| time(*k)).collect(),
            output: kept.iter().map(|k| record.samples[*k]).collect(),
            plan,
            sign: alignment.rate.signum(),
            shape,
            path: Path::new(InputKind::BaseAcceleration, quantity),
        }
    };
    // First the resonance, where a wrong rate does little; then the whole.
    let is_loud = |k: &usize| level[*k] > RESONANCE * level[loudest];
    let quiet_before = (0..loudest).rev().find(|k| !is_loud(k)).map_or(0, |k| k + 1);
    let quiet_after = (loudest..level.len()).find(|k| !is_loud(k)).unwrap_or(level.len());
    let around = (10.0 / (peak_hz * record.interval_s)) as usize;
    let near = model(
        quiet_before.min(loudest.saturating_sub(around))
            ..quiet_after.max((loudest + around).min(level.len())),
    );
    let pole = Pole { frequency_hz: peak_hz, damping_ratio: DAMPING };
    let starts = starts(shape, alignment.start_s, peak_hz).into_iter().filter_map(|[start_s, phase]| {
        fit_roughly(&near, &parameters(pole, [start_s, alignment.rate, phase], shape, peak_hz))
    });
    let near = starts.min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))?;
    let first = (0..level.len()).find(|k| swept(*k))?;
    let last = (first..level.len()).rev().find(|k| swept(*k))?;
    let whole = model(first..last + 1);
    let pole = crate::forced_model::pole(&near.parameters, 0);
    let rate = alignment.rate.signum() * near.parameters[3].exp();
    let best = fit_roughly(
        &whole,
        &parameters(pole, [near.parameters[2], rate, near.parameters[4]], shape, peak_hz),
    )?;
    Some(Fitted {
        start_s: best.parameters[2],
        rate: alignment.rate.signum() * best.parameters[3].exp(),
        phase: best.parameters[4],
        shape,
        left: best.sum_of_squares,
    })
}

/// Starts (s) and phases (periods) to fit from. Of a sweep that may start anywhere in a period two phases are
/// enough, as the mode's sign is free; one of a known phase is in step only half a period further.
fn starts(shape: SweepShape, aligned_s: f64, peak_hz: f64) -> Vec<[f64; 2]> {
    if shape.starts_anywhere() {
        return vec![[aligned_s, 0.0], [aligned_s, 0.25]];
    }
    let halves = -HALF_PERIODS..=HALF_PERIODS;
    halves.map(|half| [aligned_s + f64::from(half) * 0.5 / peak_hz, 0.0]).collect()
}

/// The parameters around a mode and a sweep of a start (s), a rate and a phase (periods).
fn parameters(at: Pole, sweep: [f64; 3], shape: SweepShape, peak_hz: f64) -> Vec<Parameter> {
    let [start_s, rate, phase] = sweep;
    let mut parameters = pole_parameters(at, 0.3).to_vec();
    let rate = rate.abs().ln();
    let phase_reach = if shape.starts_anywhere() { 1.0 } else { 0.0 };
    for (start, reach, max_step) in
        [(start_s, 4.0 / peak_hz, 0.25 / peak_hz), (rate, RATE_REACH, 1e-3), (phase, phase_reach, 0.1)]
    {
        parameters.push(Parameter { start, lower: start - reach, upper: start + reach, max_step });
    }
    parameters
}
