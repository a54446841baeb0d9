//! Start and rate of a sweep to a fraction of a period: modes and their input's start, rate and phase, fitted
//! to the record.
//!
//! One mode finds the start roughly. What it does not explain pulls the start and the choice among the shapes
//! to where the one mode stands in for the others, so that modes are added as long as they explain more.

use std::cell::RefCell;
use std::rc::Rc;

use super::align::{Alignment, Evened};
use super::plan::SweepPlan;
use super::signal::{SweepShape, SweepSignal};
use crate::column::Column;
use crate::forced_model::{pole, pole_parameters};
use crate::levenberg_marquardt::{Minimum, Parameter};
use crate::modal_response::{InputKind, OutputQuantity, Path, Pole, free_response, ringing_on_grid};
use crate::separable::{Projected, Separable, fit_roughly, span, sum_of_squares_at};
use crate::tall::dot;

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

/// The most modes that are fitted with the sweep.
const MOST_MODES: usize = 4;
/// What a further mode must leave of the sum of squares at most.
const WORTH_A_MODE: f64 = 0.9;
/// By how much one shape must leave less than another one for every mode that it needs more.
const PER_MODE: f64 = 1.4;
/// Frequencies at which a further mode is looked for, and how far beyond the ends of the sweep.
const TRIED: usize = 60;
const BEYOND: f64 = 1.3;
/// By how much of a turn between the two strongest modes the start is tried on either side when there are
/// two.
const TURNS: [f64; 5] = [0.0, 0.2, -0.2, 0.4, -0.4];
/// How many of those starts are fitted.
const FITTED_TURNS: usize = 2;

/// The parameters are ln f and ln zeta of every mode, the start (s), the logarithm of the rate and the phase
/// at the start (periods).
struct SweptModes<'r> {
    modes: usize,
    time_s: Vec<f64>,
    output: Vec<f64>,
    /// The instants of the input: the first one is that of the first output, each so manieth that of one.
    step_s: f64,
    instants_per_row: usize,
    plan: &'r SweepPlan,
    /// Sign of the rate.
    sign: f64,
    shape: SweepShape,
    path: Path,
    /// Inputs that were asked for last, with start, rate and phase: every block asks for the same ones.
    inputs: RefCell<Vec<KnownInput>>,
}

/// An input with its start (s), rate and phase (periods).
type KnownInput = ([f64; 3], Rc<Vec<f64>>);

/// How many inputs are kept: that of a trial and those on either side of it by three parameters.
const KEPT_INPUTS: usize = 8;

/// A sweep that explains the record.
pub(super) struct Fitted {
    pub(super) start_s: f64,
    pub(super) rate: f64,
    /// Where in a period it starts, periods.
    pub(super) phase: f64,
    pub(super) shape: SweepShape,
    /// What the sweep and the modes leave of the output, sum of squares.
    pub(super) left: f64,
    /// The modes, the most that are worth it.
    poles: Vec<Pole>,
}

impl Fitted {
    /// The less the better: what is left, and more for every mode. Heavily damped modes make up for a sweep
    /// that kept something else the same.
    pub(super) fn worth(&self) -> f64 {
        self.left * PER_MODE.powi(self.poles.len() as i32)
    }

    /// Whether a further mode explains enough more.
    pub(super) fn is_worth(&self, more: &Self) -> bool {
        more.left < WORTH_A_MODE * self.left
    }
}

impl SweptModes<'_> {
    /// The input at all instants.
    fn input(&self, sweep: [f64; 3]) -> Rc<Vec<f64>> {
        let mut inputs = self.inputs.borrow_mut();
        if let Some((_, known)) = inputs.iter().find(|(known, _)| *known == sweep) {
            return Rc::clone(known);
        }
        let [start_s, rate, phase] = sweep;
        let signal = SweepSignal::new(self.plan, rate, self.shape, phase);
        let below_hz = HARMONICS * self.plan.from_hz.max(self.plan.to_hz);
        let first_s = self.time_s.first().copied().unwrap_or(0.0) - start_s;
        let instants = (self.time_s.len().max(1) - 1) * self.instants_per_row + 1;
        let value = |k: usize| signal.value(first_s + k as f64 * self.step_s, below_hz);
        let fresh = Rc::new((0..instants).map(value).collect::<Vec<f64>>());
        if inputs.len() == KEPT_INPUTS {
            inputs.remove(0);
        }
        inputs.push((sweep, Rc::clone(&fresh)));
        fresh
    }

    /// What rings in the response of a mode to an input, by row.
    fn ringing(&self, pole: Pole, input: &[f64]) -> Vec<f64> {
        let all = ringing_on_grid(pole, self.path, input, self.step_s);
        all.into_iter().step_by(self.instants_per_row).collect()
    }

    /// Start, rate and phase.
    fn sweep_of(&self, parameters: &[f64]) -> [f64; 3] {
        let sweep = &parameters[2 * self.modes..];
        [sweep[0], self.sign * sweep[1].exp(), sweep[2]]
    }

    fn found(&self, minimum: &Minimum<Projected>) -> Fitted {
        let [start_s, rate, phase] = self.sweep_of(&minimum.parameters);
        let poles = (0..self.modes).map(|mode| pole(&minimum.parameters, mode)).collect();
        Fitted { start_s, rate, phase, shape: self.shape, left: minimum.sum_of_squares, poles }
    }
}

impl Separable for SweptModes<'_> {
    fn target(&self, _parameters: &[f64]) -> Vec<f64> {
        self.output.clone()
    }

    fn blocks(&self) -> usize {
        self.modes + 1
    }

    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Column> {
        let input = self.input(self.sweep_of(parameters));
        if block == self.modes {
            let direct: Vec<f64> = input.iter().copied().step_by(self.instants_per_row).collect();
            return vec![direct.into(), vec![1.0; self.time_s.len()].into()];
        }
        let pole = pole(parameters, block);
        let origin_s = self.time_s.first().copied().unwrap_or(0.0);
        let [cosine, sine] = free_response(pole, origin_s, &self.time_s);
        vec![self.ringing(pole, &input).into(), cosine.into(), sine.into()]
    }

    fn depends(&self, block: usize, parameter: usize) -> bool {
        parameter >= 2 * self.modes || parameter / 2 == block
    }
}

/// The record over some rows as a fit takes it.
fn model<'r>(
    record: &Evened,
    plan: &'r SweepPlan,
    (shape, sign, quantity, modes): (SweepShape, f64, OutputQuantity, usize),
    rows: std::ops::Range<usize>,
) -> SweptModes<'r> {
    let stride = rows.len().div_ceil(MOST_ROWS).max(1);
    let kept: Vec<usize> = rows.step_by(stride).collect();
    let finer = (POINTS * plan.from_hz.max(plan.to_hz) * record.interval_s).ceil().max(1.0);
    SweptModes {
        modes,
        time_s: kept.iter().map(|k| record.time_s(*k)).collect(),
        output: kept.iter().map(|k| record.samples[*k]).collect(),
        step_s: record.interval_s / finer,
        instants_per_row: stride * finer as usize,
        plan,
        sign,
        shape,
        path: Path::new(InputKind::BaseAcceleration, quantity),
        inputs: RefCell::default(),
    }
}

/// The rows during which a sweep of that start (s) and rate goes on.
fn swept_rows(
    record: &Evened,
    plan: &SweepPlan,
    shape: SweepShape,
    [start_s, rate]: [f64; 2],
) -> Option<std::ops::Range<usize>> {
    let duration_s = SweepSignal::new(plan, rate, shape, 0.0).duration_s;
    let swept = |k: &usize| (0.0..=duration_s).contains(&(record.time_s(*k) - start_s));
    let first = (0..record.samples.len()).find(swept)?;
    let last = (first..record.samples.len()).rev().find(swept)?;
    Some(first..last + 1)
}

/// The sweep of one shape that explains the record best with one mode, from where they are aligned.
pub(super) fn fitted(
    record: &Evened,
    plan: &SweepPlan,
    shape: SweepShape,
    quantity: OutputQuantity,
    alignment: Alignment,
) -> Option<Fitted> {
    let signal = SweepSignal::new(plan, alignment.rate, shape, 0.0);
    let level = record.level(4.0 / plan.from_hz.min(plan.to_hz));
    let whole = swept_rows(record, plan, shape, [alignment.start_s, alignment.rate])?;
    let loudest = whole.clone().max_by(|a, b| level[*a].total_cmp(&level[*b]))?;
    let peak_hz = signal.frequency_hz(record.time_s(loudest) - alignment.start_s);
    let kind = (shape, alignment.rate.signum(), quantity, 1);
    // First the resonance, where a wrong rate does little; then the whole.
    let is_loud = |k: &usize| level[*k] > RESONANCE * level[loudest];
    let quiet_before = (0..loudest).rev().find(|k| !is_loud(k)).map_or(0, |k| k + 1);
    let quiet_after = (loudest..level.len()).find(|k| !is_loud(k)).unwrap_or(level.len());
    let around = (10.0 / (peak_hz * record.interval_s)) as usize;
    let near = model(
        record,
        plan,
        kind,
        quiet_before.min(loudest.saturating_sub(around))
            ..quiet_after.max((loudest + around).min(level.len())),
    );
    let start = Pole { frequency_hz: peak_hz, damping_ratio: DAMPING };
    let starts = starts(shape, alignment.start_s, peak_hz).into_iter().filter_map(|[start_s, phase]| {
        fit_roughly(&near, &parameters(&[start], [start_s, alignment.rate, phase], shape, peak_hz))
    });
    let closest = starts.min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))?;
    let from = near.found(&closest);
    let whole = model(record, plan, kind, whole);
    let range = parameters(&from.poles, [from.start_s, from.rate, from.phase], shape, peak_hz);
    Some(whole.found(&fit_roughly(&whole, &range)?))
}

/// The same sweep with one more mode; `None` where it has all that are looked for.
pub(super) fn with_one_more(
    record: &Evened,
    plan: &SweepPlan,
    quantity: OutputQuantity,
    best: &Fitted,
) -> Option<Fitted> {
    if best.poles.len() == MOST_MODES {
        return None;
    }
    let shape = best.shape;
    let rows = swept_rows(record, plan, shape, [best.start_s, best.rate])?;
    let kind = |modes| (shape, best.rate.signum(), quantity, modes);
    let known = model(record, plan, kind(best.poles.len()), rows.clone());
    let sweep = [best.start_s, best.rate, best.phase];
    let peak_hz = best.poles[0].frequency_hz;
    let before = fit_roughly(&known, &parameters(&best.poles, sweep, shape, peak_hz))?;
    let fresh = further_pole(&known, &before)?;
    let mut poles = best.poles.clone();
    poles.push(fresh);
    let more = model(record, plan, kind(poles.len()), rows);
    // One mode cannot tell a later start from a phase. Two can, and the start that the one chose may be off
    // by a part of a turn between them.
    let apart_hz = fresh.frequency_hz - peak_hz;
    let sweep = known.sweep_of(&before.parameters);
    let turned = |turn: f64| {
        let later_s = turn / apart_hz;
        [sweep[0] + later_s, sweep[1], sweep[2] + peak_hz * later_s]
    };
    let tried = if shape.starts_anywhere() && best.poles.len() == 1 { &TURNS[..] } else { &TURNS[..1] };
    let mut ranges: Vec<(f64, Vec<Parameter>)> = tried
        .iter()
        .filter_map(|turn| {
            let range = parameters(&poles, turned(*turn), shape, peak_hz);
            let start: Vec<f64> = range.iter().map(|parameter| parameter.start).collect();
            Some((sum_of_squares_at(&more, &start)?, range))
        })
        .collect();
    ranges.sort_by(|a, b| a.0.total_cmp(&b.0));
    let fits = ranges.iter().take(FITTED_TURNS).filter_map(|(_, range)| fit_roughly(&more, range));
    let least = fits.min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))?;
    Some(more.found(&least))
}

/// The mode that explains most of what a fit leaves, in either phase.
fn further_pole(model: &SweptModes<'_>, known: &Minimum<Projected>) -> Option<Pole> {
    let taken = span(model, known);
    let left = &known.point.residuals;
    let [start_s, rate, phase] = model.sweep_of(&known.parameters);
    let inputs = [0.0, 0.25].map(|turn| model.input([start_s, rate, phase + turn]));
    let [low, high] = [model.plan.from_hz.min(model.plan.to_hz), model.plan.from_hz.max(model.plan.to_hz)];
    let step = (high * BEYOND / low).powf(1.0 / (TRIED - 1) as f64);
    let candidates = (0..TRIED as i32)
        .map(|k| Pole { frequency_hz: low * step.powi(k), damping_ratio: DAMPING })
        .map(|pole| {
            let gain: f64 = inputs
                .iter()
                .map(|input| {
                    let mut column = model.ringing(pole, input);
                    let size = dot(&column, &column);
                    taken.remove_from(&mut column);
                    let own = dot(&column, &column);
                    // What the known modes hold all but wholly is rounding.
                    if own > 1e-6 * size { dot(&column, left).powi(2) / own } else { 0.0 }
                })
                .sum();
            (gain, pole)
        });
    candidates.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, pole)| pole)
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

/// The parameters around modes and a sweep of a start (s), a rate and a phase (periods).
fn parameters(poles: &[Pole], sweep: [f64; 3], shape: SweepShape, peak_hz: f64) -> Vec<Parameter> {
    let [start_s, rate, phase] = sweep;
    let mut parameters: Vec<Parameter> = poles.iter().flat_map(|at| pole_parameters(*at, 0.3)).collect();
    let rate = rate.abs().ln();
    let phase_reach = if shape.starts_anywhere() { 1.0 } else { 0.0 };
    for (start, reach, max_step) in
        [(start_s, 4.0 / peak_hz, 0.25 / peak_hz), (rate, RATE_REACH, 1e-3), (phase, phase_reach, 0.1)]
    {
        parameters.push(Parameter { start, lower: start - reach, upper: start + reach, max_step });
    }
    parameters
}
