//! The screen: one law at a time, by simulation at the fitted model, what the model could absorb taken out.

use std::ops::Range;

use rayon::prelude::*;
use stillbeam_identify::tall::{Orthonormal, add_scaled, dot};
use stillbeam_plant::Motion;
use stillbeam_plant::catalogue::Trial;

use super::sizing::{CLOSE, ROUNDS, brought_to_size};
use super::trials::Candidate;
use crate::fit::Fitted;
use crate::intervals::Scatter;
use crate::simulation::{first_effect, motion};
use crate::stacking::Stack;

/// What the screen says of one candidate.
#[derive(Clone)]
pub(crate) struct Screened {
    /// Index into the candidates.
    pub(crate) candidate: usize,
    /// The best trial.
    pub(crate) trial: Trial,
    /// By how much its amplitudes are to be multiplied, as far as a straight line says.
    pub(crate) factor: f64,
    /// Standard errors from zero.
    pub(crate) t: f64,
    /// Share of the effect's power that a refit of the free parameters would hide.
    pub(crate) hidden: f64,
    /// Sum of squares that it would take off the residual.
    pub(crate) explained: f64,
    /// The effect of the factor found, what could be absorbed taken out.
    pub(crate) direction: Vec<f64>,
    /// The next best trials with their factors: a shape may have more than one valley.
    pub(crate) others: Vec<(Trial, f64)>,
}

/// Trials kept besides the best.
const OTHERS: usize = 2;
/// As long as they explain this share of what the best explains.
const WORTH: f64 = 0.5;

/// Trials of one law whose effects are simulated: the most promising along the motion that there is without
/// them.
const MANY: usize = 6;
/// So much weaker a trial is looked at again, ...
const WEAKER: f64 = 0.1;
/// ... where less than this share of its effect's power is the same but for its size.
const IN_PROPORTION: f64 = 0.9;
/// What a screen leaves out.
pub(crate) struct Leaving<'l> {
    /// Candidates whose forces, along the motion that there is without them, would take off less than this
    /// sum of squares.
    pub(crate) least_explained: f64,
    /// All that have not been reached when this holds.
    pub(crate) is_given_up: &'l (dyn Fn() -> bool + Sync),
}

/// Screens all candidates against a fitted model, in order; those whose effect cannot be simulated or seen
/// are left out, too.
pub(crate) fn screen(
    stack: &Stack<'_>,
    fitted: &Fitted,
    candidates: &[Candidate],
    slowest_hz: Option<f64>,
    leaving: &Leaving<'_>,
) -> Vec<Screened> {
    let residuals = fitted.residuals();
    let columns = fitted.sensitivities(stack);
    let mut absorbing = Orthonormal::default();
    columns.iter().for_each(|column| absorbing.push(column.clone()));
    let telling = Telling::new(stack, fitted, &residuals, &columns, &absorbing);
    candidates
        .par_iter()
        .enumerate()
        .filter(|_| !(leaving.is_given_up)())
        .filter(|(_, candidate)| telling.may_take_off(stack, fitted, candidate, leaving.least_explained))
        .filter_map(|(index, candidate)| {
            let sized = telling.best_trials(stack, fitted, candidate);
            let weaker: Vec<Sized> =
                sized.iter().filter_map(|sized| telling.weaker(stack, fitted, candidate, sized)).collect();
            let seen: Vec<Seen> = sized
                .into_iter()
                .chain(weaker)
                .filter_map(|sized| {
                    see(stack, fitted, &residuals, &absorbing, candidate, sized, telling.record)
                })
                .collect();
            let mut seen = joined(seen, &residuals);
            seen.sort_by(|a, b| b.explained.total_cmp(&a.explained));
            let least = WORTH * seen.first().map_or(0.0, |best| best.explained);
            let others = seen.iter().skip(1).take(OTHERS).filter(|other| other.explained > least);
            let others = others.map(|seen| (seen.trial.clone(), seen.factor)).collect();
            let best = seen.into_iter().next()?;
            screened(stack, &residuals, index, best, others, slowest_hz)
        })
        .collect()
}

/// The recording of which most is left: there trials are brought to size.
struct Telling<'t> {
    record: usize,
    residuals: &'t [f64],
    absorbing: Orthonormal,
    /// All recordings, on which trials are compared where there are many of them: the one of which most is
    /// left may only be the longest or the noisiest, and show little of a law.
    whole: Whole<'t>,
}

/// What is left of all recordings, and what the model's own parameters could absorb of it.
struct Whole<'t> {
    residuals: &'t [f64],
    absorbing: &'t Orthonormal,
    /// The motion on each under the fitted model, where that is known.
    motions: Option<Vec<Motion>>,
}

/// A trial, what its amplitudes are to be multiplied by, and its effect on the telling recording if that was
/// simulated.
struct Sized<'c> {
    trial: &'c Trial,
    size: f64,
    effect: Option<Vec<f64>>,
    explained: f64,
}

impl<'t> Telling<'t> {
    fn new(
        stack: &Stack<'_>,
        fitted: &Fitted,
        residuals: &'t [f64],
        columns: &[Vec<f64>],
        all_absorbing: &'t Orthonormal,
    ) -> Self {
        let mut start = 0;
        let mut best = (0, f64::NEG_INFINITY, 0..0);
        for (index, record) in fitted.records.iter().enumerate() {
            let rows = start..start + record.residuals.len();
            start = rows.end;
            let left = dot(&residuals[rows.clone()], &residuals[rows.clone()]);
            if left > best.1 {
                best = (index, left, rows);
            }
        }
        let (record, _, rows) = best;
        let mut absorbing = Orthonormal::default();
        columns.iter().for_each(|column| absorbing.push(column[rows.clone()].to_vec()));
        let fits = fitted.records.iter().zip(&stack.records);
        let motions = fits.map(|(fit, record)| motion(&fitted.hypothesis, record, &fit.initial)).collect();
        let whole = Whole { residuals, absorbing: all_absorbing, motions };
        Self { record, residuals: &residuals[rows], absorbing, whole }
    }

    /// The trials that are looked at on all recordings. Where there are many, they are compared by what their
    /// forces would do along the motion that there is without them.
    fn best_trials<'c>(
        &self,
        stack: &Stack<'_>,
        fitted: &Fitted,
        candidate: &'c Candidate,
    ) -> Vec<Sized<'c>> {
        let trials = candidate.trials.iter();
        if candidate.trials.len() <= MANY {
            return trials.filter_map(|trial| self.sized(stack, fitted, candidate, trial, 1.0)).collect();
        }
        let mut compared: Vec<Sized<'c>> =
            trials.clone().filter_map(|trial| self.compared_along(stack, fitted, candidate, trial)).collect();
        if compared.is_empty() {
            compared = trials.filter_map(|trial| self.sized(stack, fitted, candidate, trial, 1.0)).collect();
        }
        share_with_quadrature(&mut compared);
        let mut compared = crests_first(compared);
        compared.truncate(MANY);
        let simulated = |sized: Sized<'c>| match sized.effect {
            Some(_) => Some(sized),
            None => self.sized(stack, fitted, candidate, sized.trial, sized.size),
        };
        compared.into_iter().filter_map(simulated).collect()
    }

    /// Whether a candidate could take so much off; where that is not known without a simulation it could.
    fn may_take_off(
        &self,
        stack: &Stack<'_>,
        fitted: &Fitted,
        candidate: &Candidate,
        least_explained: f64,
    ) -> bool {
        if least_explained <= 0.0 {
            return true;
        }
        let along = candidate.trials.iter().map(|trial| self.compared_along(stack, fitted, candidate, trial));
        let Some(mut compared) = along.collect::<Option<Vec<Sized<'_>>>>() else { return true };
        share_with_quadrature(&mut compared);
        compared.iter().any(|sized| sized.explained > least_explained)
    }

    fn compared_along<'c>(
        &self,
        stack: &Stack<'_>,
        fitted: &Fitted,
        candidate: &Candidate,
        trial: &'c Trial,
    ) -> Option<Sized<'c>> {
        let law = candidate.physics(trial, 1.0);
        let mut effect = Vec::with_capacity(self.whole.residuals.len());
        for (record, motion) in self.whole.motions.as_ref()?.iter().enumerate() {
            let signals = first_effect(&fitted.hypothesis, stack.records[record], &law, motion)?;
            let mut own = stack.weighted(record, &signals);
            fitted.records[record].nuisances.remove_from(&mut own);
            effect.extend(own);
        }
        let length = dot(&effect, &effect).sqrt();
        let size = dot(self.whole.residuals, self.whole.residuals).sqrt() / length;
        let explained = || explained(effect, self.whole.residuals, self.whole.absorbing);
        size.is_finite().then(|| Sized { trial, size, explained: explained(), effect: None })
    }

    /// What an effect would take off the residual of the telling recording.
    fn explained(&self, effect: Vec<f64>) -> f64 {
        explained(effect, self.residuals, &self.absorbing)
    }

    /// The same trial much weaker, where that is another effect and not only a smaller one: a base that
    /// drifts without a law and is held by it moves otherwise the more the stronger the law is, and where to
    /// begin is not known. `None` where the effect is in proportion.
    fn weaker<'c>(
        &self,
        stack: &Stack<'_>,
        fitted: &Fitted,
        candidate: &Candidate,
        sized: &Sized<'c>,
    ) -> Option<Sized<'c>> {
        if sized.trial.amplitudes.is_empty() {
            return None;
        }
        let mut strong = sized.effect.clone()?;
        let size = WEAKER * sized.size;
        let effect = effect(stack, fitted, candidate, sized.trial, size, self.record)?;
        let mut weak = effect.clone();
        self.absorbing.remove_from(&mut strong);
        self.absorbing.remove_from(&mut weak);
        let both = dot(&strong, &weak);
        let alike = both * both / (dot(&strong, &strong) * dot(&weak, &weak));
        (alike < IN_PROPORTION).then(|| Sized {
            trial: sized.trial,
            size,
            explained: self.explained(effect.clone()),
            effect: Some(effect),
        })
    }

    fn sized<'c>(
        &self,
        stack: &Stack<'_>,
        fitted: &Fitted,
        candidate: &Candidate,
        trial: &'c Trial,
        start: f64,
    ) -> Option<Sized<'c>> {
        let target = dot(self.residuals, self.residuals).sqrt();
        let effect = |size: f64| effect(stack, fitted, candidate, trial, size, self.record);
        let (effect, size) = brought_to_size(target, !trial.amplitudes.is_empty(), start, effect)?;
        Some(Sized { trial, size, explained: self.explained(effect.clone()), effect: Some(effect) })
    }
}

/// What an effect would take off a residual, the model's own parameters following.
fn explained(mut effect: Vec<f64>, residuals: &[f64], absorbing: &Orthonormal) -> f64 {
    absorbing.remove_from(&mut effect);
    let left = dot(&effect, &effect);
    let along = dot(&effect, residuals);
    if left > 0.0 { along * along / left } else { 0.0 }
}

/// Waves that differ by a quarter in phase and in nothing else count together: each alone may explain nothing
/// of a wave between them.
fn share_with_quadrature(compared: &mut [Sized<'_>]) {
    for later in 1..compared.len() {
        let (before, after) = compared.split_at_mut(later);
        if let (Some(one), Some(other)) = (before.last_mut(), after.first_mut())
            && other.trial.is_quadrature_of(one.trial)
        {
            let both = one.explained + other.explained;
            (one.explained, other.explained) = (both, both);
        }
    }
}

/// Trials from the most promising down, of waves those before all others whose period promises more than its
/// neighbours do: each such crest is a valley of its own for a fit to begin in, and the neighbours of the
/// highest lead to the same one.
fn crests_first(compared: Vec<Sized<'_>>) -> Vec<Sized<'_>> {
    let mut by_period: Vec<(f64, f64)> =
        compared.iter().filter_map(|sized| Some((sized.trial.period()?, sized.explained))).collect();
    by_period.sort_by(|a, b| a.0.total_cmp(&b.0));
    by_period.dedup_by_key(|(period, _)| *period);
    let is_crest = |sized: &Sized<'_>| {
        let Some(period) = sized.trial.period() else { return true };
        let place = by_period.partition_point(|(other, _)| *other < period);
        let neighbours = [place.checked_sub(1), Some(place + 1)].into_iter().flatten();
        neighbours
            .filter_map(|place| by_period.get(place))
            .all(|(_, explained)| *explained <= sized.explained)
    };
    let (mut crests, mut slopes): (Vec<_>, Vec<_>) = compared.into_iter().partition(is_crest);
    for part in [&mut crests, &mut slopes] {
        part.sort_by(|a, b| b.explained.total_cmp(&a.explained));
    }
    crests.into_iter().chain(slopes).collect()
}

/// Pairs of trials that add up replaced by the sum that explains most: waves a quarter apart by the wave of
/// any phase, to first order the force being linear in both.
fn joined(seen: Vec<Seen>, residuals: &[f64]) -> Vec<Seen> {
    let mut left: Vec<Option<Seen>> = seen.into_iter().map(Some).collect();
    let mut all = Vec::with_capacity(left.len());
    for index in 0..left.len() {
        let Some(one) = left[index].take() else { continue };
        let partner = (index + 1..left.len())
            .find(|&later| left[later].as_ref().is_some_and(|other| other.trial.adds_to(&one.trial)));
        match partner.and_then(|later| left[later].take()).map(|other| one.joined(&other, residuals)) {
            Some(Some(joined)) if joined.explained > CLEARLY_MORE * one.explained => all.push(joined),
            _ => all.push(one),
        }
    }
    all
}

/// One trial's effect beside the residual.
struct Seen {
    trial: Trial,
    /// What the trial's amplitudes are to be multiplied by for one effect.
    size: f64,
    /// What the trial's amplitudes are to be multiplied by.
    factor: f64,
    /// What the effect is to be multiplied by.
    share: f64,
    effect: Vec<f64>,
    hidden: f64,
    explained: f64,
}

impl Seen {
    /// This trial and one that adds to it as one; `None` where they do the same.
    fn joined(&self, ahead: &Self, residuals: &[f64]) -> Option<Self> {
        let (a, b, both) = (
            dot(&self.effect, &self.effect),
            dot(&ahead.effect, &ahead.effect),
            dot(&self.effect, &ahead.effect),
        );
        let (along_a, along_b) = (dot(&self.effect, residuals), dot(&ahead.effect, residuals));
        let determinant = a * b - both * both;
        if determinant.is_nan() || determinant <= ALIKE * a * b {
            return None;
        }
        let shares =
            [(b * along_a - both * along_b) / determinant, (a * along_b - both * along_a) / determinant];
        let parts = [shares[0] * self.size, shares[1] * ahead.size];
        let mut effect: Vec<f64> = self.effect.iter().map(|value| shares[0] * value).collect();
        add_scaled(&mut effect, shares[1], &ahead.effect);
        let explained = dot(&effect, residuals);
        let whole = |seen: &Self, share: f64, left: f64| share * share * left / (1.0 - seen.hidden);
        let wholes = whole(self, shares[0], a) + whole(ahead, shares[1], b);
        let (trial, factor) = self.trial.combined(parts, &ahead.trial)?;
        (factor.is_finite() && factor != 0.0).then(|| Self {
            trial,
            size: factor,
            factor,
            share: 1.0,
            hidden: (1.0 - explained / wholes).clamp(0.0, 1.0),
            explained,
            effect,
        })
    }
}

/// Two trials together are looked at further where they explain so many times what one does.
const CLEARLY_MORE: f64 = 1.01;
/// Two trials are the same when less than this share of one's power is its own.
const ALIKE: f64 = 1e-4;

fn see(
    stack: &Stack<'_>,
    fitted: &Fitted,
    residuals: &[f64],
    absorbing: &Orthonormal,
    candidate: &Candidate,
    sized: Sized<'_>,
    telling: usize,
) -> Option<Seen> {
    let Sized { trial, size, effect: known, .. } = sized;
    let mut effect: Vec<f64> = Vec::with_capacity(residuals.len());
    for record in 0..fitted.records.len() {
        match known.as_ref().filter(|_| record == telling) {
            Some(known) => effect.extend(known),
            None => effect.extend(self::effect(stack, fitted, candidate, trial, size, record)?),
        }
    }
    let whole = dot(&effect, &effect);
    // Twice: one pass leaves rounding of what was large.
    absorbing.remove_from(&mut effect);
    absorbing.remove_from(&mut effect);
    let left = dot(&effect, &effect);
    if !(left > 1e-12 * whole && left > 0.0) {
        return None;
    }
    let mut share = dot(&effect, residuals) / left;
    if share < 0.0 && !candidate.is_signed(trial) {
        // A law of one sign that would have to be negative explains nothing.
        share = 0.0;
    }
    let (hidden, explained) = (1.0 - left / whole, share * share * left);
    Some(Seen { trial: trial.clone(), size, factor: share * size, share, effect, hidden, explained })
}

/// How certain the best trial is.
fn screened(
    stack: &Stack<'_>,
    residuals: &[f64],
    candidate: usize,
    seen: Seen,
    others: Vec<(Trial, f64)>,
    slowest_hz: Option<f64>,
) -> Option<Screened> {
    let Seen { trial, factor, share, mut effect, hidden, explained, .. } = seen;
    let mut rest = residuals.to_vec();
    add_scaled(&mut rest, -share, &effect);
    let scatter = Scatter::new(stack, rest, slowest_hz);
    let t = share * dot(&effect, &effect) / scatter.variance_of_sum(&effect).sqrt();
    effect.iter_mut().for_each(|value| *value *= if share == 0.0 { 1.0 } else { share });
    t.is_finite().then_some(Screened {
        candidate,
        trial,
        factor,
        t,
        hidden,
        explained,
        direction: effect,
        others,
    })
}

/// The change of the weighted outputs of one recording that a law makes, nuisances taken out.
fn effect(
    stack: &Stack<'_>,
    fitted: &Fitted,
    candidate: &Candidate,
    trial: &Trial,
    size: f64,
    record: usize,
) -> Option<Vec<f64>> {
    let extended = fitted.hypothesis.with_law(candidate.physics(trial, size));
    extended.model.check().ok()?;
    let fit = fitted.records.get(record)?;
    let mut change = stack.prediction(record, &extended, &fit.initial)?;
    add_scaled(&mut change, -1.0, &stack.weighted(record, &fit.simulated));
    if !change.iter().all(|value| value.is_finite()) {
        return None;
    }
    fit.nuisances.remove_from(&mut change);
    Some(change)
}

/// The effect of a trial made so weak that it is about as large as the noise, and what its amplitudes were
/// multiplied by.
pub(crate) fn small_effect(
    stack: &Stack<'_>,
    fitted: &Fitted,
    candidate: &Candidate,
    trial: &Trial,
) -> Option<(f64, Vec<f64>)> {
    small_effect_on(stack, fitted, candidate, trial, 0..fitted.records.len())
}

/// The same on some of the recordings.
pub(crate) fn small_effect_on(
    stack: &Stack<'_>,
    fitted: &Fitted,
    candidate: &Candidate,
    trial: &Trial,
    records: Range<usize>,
) -> Option<(f64, Vec<f64>)> {
    let whole = |size: f64| -> Option<Vec<f64>> {
        let parts = records.clone().map(|record| effect(stack, fitted, candidate, trial, size, record));
        Some(parts.collect::<Option<Vec<Vec<f64>>>>()?.concat())
    };
    let samples: usize = fitted.records[records.clone()].iter().map(|record| record.residuals.len()).sum();
    let target = (samples as f64).sqrt();
    let mut size = 1.0;
    for _ in 0..ROUNDS {
        let found = whole(size)?;
        let length = dot(&found, &found).sqrt();
        if length.is_nan() || length <= 0.0 {
            return None;
        }
        if (target / CLOSE..target * CLOSE).contains(&length) {
            return Some((size, found));
        }
        size *= target / length;
    }
    None
}

/// Absolute cosines between the effects of screened candidates.
pub(crate) fn cosines(screened: &[&Screened]) -> Vec<Vec<f64>> {
    let length = |s: &Screened| dot(&s.direction, &s.direction).sqrt();
    screened
        .iter()
        .map(|a| {
            screened
                .iter()
                .map(|b| (dot(&a.direction, &b.direction) / (length(a) * length(b))).abs().min(1.0))
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_crest_of_a_wave_comes_before_the_slopes_of_the_highest() {
        let wave = |period: f64, phase: f64| Trial {
            amplitudes: vec![("force", 1.0)],
            shapes: vec![("period", period), ("phase", phase)],
        };
        let other = Trial { amplitudes: vec![("force", 1.0)], shapes: vec![("velocity", 0.1)] };
        let promises =
            [(0.08, 3.0), (0.06, 9.0), (0.05, 10.0), (0.04, 8.0), (0.03, 2.0), (0.02, 5.0), (0.015, 1.0)];
        let mut trials: Vec<(Trial, f64)> = promises
            .iter()
            .flat_map(|&(period, explained)| [0.0, 1.5].map(|phase| (wave(period, phase), explained)))
            .collect();
        trials.push((other, 7.0));
        let sized = trials.iter().map(|(trial, explained)| Sized {
            trial,
            size: 1.0,
            effect: None,
            explained: *explained,
        });
        let order: Vec<f64> = crests_first(sized.collect()).iter().map(|sized| sized.explained).collect();
        assert_eq!(order[..5], [10.0, 10.0, 7.0, 5.0, 5.0]);
        assert_eq!(order[5..], [9.0, 9.0, 8.0, 8.0, 3.0, 3.0, 2.0, 2.0, 1.0, 1.0]);
    }
}
