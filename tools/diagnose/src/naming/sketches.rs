//! Sketches: a law's own parameters fitted on top of a set, those of the model following along straight
//! lines. They say which candidates are worth a fit.

use stillbeam_identify::tall::dot;
use stillbeam_plant::Physics;
use stillbeam_plant::catalogue::Trial;
use stillbeam_recording::Role;

use super::gates::NOTICEABLE;
use super::improvement::improvement;
use super::rounds::directions;
use super::screening::Screened;
use super::selection::Search;
use super::sets::{Member, law_parameters};
use crate::effort::Effort;
use crate::fit::{Fitted, Others, fit_near};
use crate::parameters::FreeParameter;
use crate::stacking::RecordFit;

/// A law with parameters of its own fitted, those of the model following.
pub(super) struct Sketched<'s> {
    pub(super) screened: &'s Screened,
    /// Sum of squares that is left.
    pub(super) left: f64,
    pub(super) physics: Physics,
    /// The recordings, what the model's parameters would absorb taken out of the residuals where those follow
    /// along straight lines.
    pub(super) records: Vec<RecordFit>,
    /// The fit, where the model's parameters were searched along.
    pub(super) begun: Option<Fitted>,
}

/// A sketch that reaches this share of what a gate asks is worth a fit.
const HOPEFUL: f64 = 0.5;

/// The size that a straight line asks for may be more than the machine can bear, a stiffness taken away that
/// holds it up: a sketch begins with half of it, so often at most, ...
const HALVINGS: i32 = 5;
/// ... until no more than this many times what is there without the law is left over.
const TOO_FAR: f64 = 4.0;

impl Search<'_> {
    /// Whether a sketched law could pass the gates of size and training beside laws that are there already,
    /// where the fit begins nearby: the sketch has let everything else follow along straight lines.
    pub(super) fn may_pass(&self, base: &Member, sketched: &Sketched<'_>) -> bool {
        if base.laws.is_empty() {
            return true;
        }
        let stack = self.study.stack(Role::Train);
        let before = base.fitted.sum_of_squares;
        let systematic = (before - stack.present() as f64).max(1.0);
        let size = (before - sketched.left) / systematic;
        let training = improvement(&stack, &base.fitted.records, &sketched.records, self.study.slowest_hz);
        size > HOPEFUL * NOTICEABLE && training.t() > HOPEFUL * self.options.training_gate
    }

    /// Fits the law's own parameters from its best trials; those of the model follow. What is left,
    /// and the law.
    pub(super) fn sketch<'s>(
        &self,
        base: &Member,
        screened: &'s Screened,
        others: Others<'_>,
    ) -> Option<Sketched<'s>> {
        let best = (&screened.trial, screened.factor);
        let trials =
            std::iter::once(best).chain(screened.others.iter().map(|(trial, factor)| (trial, *factor)));
        let (mut physics, fitted) = trials
            .filter_map(|trial| self.sketch_from(base, screened, trial, others))
            .min_by(|(_, a), (_, b)| a.sum_of_squares.total_cmp(&b.sum_of_squares))?;
        // What the trial does not have stays out: every law has more parameters than are tried at once.
        let own = format!("physics.{}.", base.laws.len() + 1 + self.given_laws);
        for (parameter, value) in fitted.free.iter().zip(&fitted.values) {
            if let Some(name) = parameter.path.strip_prefix(&own) {
                physics.parameters.insert(name.to_owned(), *value);
            }
        }
        let left = fitted.sum_of_squares;
        let Others::Absorb(absorbing) = others else {
            let records = fitted.records.clone();
            return Some(Sketched { left, physics, screened, records, begun: Some(fitted) });
        };
        let mut records = fitted.records;
        let mut residuals: Vec<f64> =
            records.iter().flat_map(|record| record.residuals.iter().copied()).collect();
        absorbing.remove_from(&mut residuals);
        let mut rest = &residuals[..];
        for record in &mut records {
            let (own, others) = rest.split_at(record.residuals.len());
            record.residuals.copy_from_slice(own);
            rest = others;
        }
        Some(Sketched { left, physics, screened, records, begun: None })
    }

    /// The same from one trial.
    fn sketch_from(
        &self,
        base: &Member,
        screened: &Screened,
        (trial, factor): (&Trial, f64),
        others: Others<'_>,
    ) -> Option<(Physics, Fitted)> {
        let number = base.laws.len() + 1 + self.given_laws;
        let candidate = &self.candidates[screened.candidate];
        let stack = self.study.stack(Role::Train);
        let started = (0..=HALVINGS).find_map(|halvings| {
            let physics = candidate.physics(trial, factor * 0.5_f64.powi(halvings));
            let hypothesis = base.fitted.hypothesis.with_law(physics.clone());
            let near = stack.begin_near(&hypothesis, &base.fitted.records)?;
            let left: f64 = near.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum();
            let is_bearable = trial.amplitudes.is_empty() || left < TOO_FAR * base.fitted.sum_of_squares;
            (is_bearable || halvings == HALVINGS).then_some((physics, hypothesis, near))
        });
        let (physics, hypothesis, near) = started?;
        let law =
            law_parameters(&hypothesis.model, &physics, number, candidate, &candidate.amplitude_names());
        let follow = match others {
            Others::Absorb(_) => 0,
            Others::Searched | Others::Known(_) => base.fitted.free.len(),
        };
        let free: Vec<FreeParameter> = base.fitted.free[..follow].iter().chain(&law).cloned().collect();
        let given = law.iter().map(|parameter| parameter.given);
        let start: Vec<f64> = base.fitted.values[..follow].iter().copied().chain(given).collect();
        let fitted = fit_near(&stack, &hypothesis, &free, &start, near, others, Effort::SKETCH)?;
        Some((physics, fitted))
    }

    /// One more law as it is sketched on top of a set.
    pub(super) fn sketched_on_top(&self, base: &Member, screened: &Screened) -> Option<Physics> {
        let (absorbing, _) = directions(&self.study.stack(Role::Train), base);
        Some(self.sketch(base, screened, Others::Absorb(&absorbing))?.physics)
    }
}
