//! One round: every candidate on top of a set is screened, the promising ones are sketched, the best of those fitted.

use rayon::prelude::*;
use stillbeam_identify::tall::Orthonormal;
use stillbeam_plant::Physics;
use stillbeam_recording::Role;

use super::gates::{Improvement, Trialled, gates, improvement};
use super::screening::{Screened, screen};
use super::selection::Search;
use super::sets::{Member, law_parameters};
use crate::fit::{Effort, fit_beside};
use crate::intervals::standard_errors;
use crate::result::Gate;

/// A candidate that was fitted on top of a set.
#[derive(Clone)]
pub(crate) struct Tried {
    pub(crate) member: Member,
    /// The candidate that was added last.
    pub(crate) candidate: usize,
    pub(crate) training: Improvement,
    pub(crate) held_out: Option<Improvement>,
    pub(crate) gates: Vec<Gate>,
    /// Name, value, standard error, lower and upper bound.
    pub(crate) parameters: Vec<(String, f64, f64, f64, f64)>,
}

impl Tried {
    pub(crate) fn passes(&self) -> bool {
        self.gates.iter().all(|gate| gate.passed)
    }
}

/// Candidates fitted per round, the most promising first.
const FITTED_PER_ROUND: usize = 4;
/// Candidates fitted with the model's own parameters held to straight lines, to see which are worth more.
const SKETCHED_PER_ROUND: usize = 10;

impl Search<'_> {
    /// Screens all candidates on top of a set and fits the promising ones.
    pub(crate) fn round(&self, base: &Member) -> (Vec<Screened>, Vec<Tried>) {
        let stack = self.study.stack(Role::Train);
        let screened = screen(&stack, &base.fitted, self.candidates, self.study.slowest_hz);
        let mut promising: Vec<&Screened> = screened
            .iter()
            .filter(|s| !base.laws.contains(&s.candidate) && s.t.abs() > self.options.training_gate)
            .collect();
        promising.sort_by(|a, b| b.explained.total_cmp(&a.explained));
        promising.truncate(SKETCHED_PER_ROUND);
        let mut absorbing = Orthonormal::default();
        base.fitted.sensitivities(&stack).into_iter().for_each(|column| absorbing.push(column));
        let mut sketched: Vec<(f64, Physics, &Screened)> =
            promising.par_iter().filter_map(|screened| self.sketch(base, screened, &absorbing)).collect();
        sketched.sort_by(|a, b| a.0.total_cmp(&b.0));
        sketched.truncate(FITTED_PER_ROUND);
        let tried = sketched
            .par_iter()
            .filter_map(|(_, physics, screened)| self.try_on(base, screened, physics))
            .collect();
        (screened, tried)
    }

    /// Fits the law's own parameters; those of the model follow along straight lines. What is left, and the law.
    fn sketch<'s>(
        &self,
        base: &Member,
        screened: &'s Screened,
        absorbing: &Orthonormal,
    ) -> Option<(f64, Physics, &'s Screened)> {
        let number = base.laws.len() + 1 + self.given_laws;
        let mut physics = self.candidates[screened.candidate].physics(&screened.trial, screened.factor);
        let hypothesis = base.fitted.hypothesis.with_law(physics.clone());
        let free = law_parameters(
            &hypothesis.model,
            &physics,
            number,
            &self.candidates[screened.candidate],
            &screened.trial.amplitude_names(),
        );
        let start: Vec<f64> = free.iter().map(|parameter| parameter.given).collect();
        let states = base.fitted.initial_states();
        let stack = self.study.stack(Role::Train);
        let fitted =
            fit_beside(&stack, &hypothesis, &free, &start, &states, Some(absorbing), Effort::SKETCH)?;
        for (parameter, value) in free.iter().zip(&fitted.values) {
            if let Some((_, name)) = parameter.path.rsplit_once('.') {
                physics.parameters.insert(name.to_owned(), *value);
            }
        }
        Some((fitted.sum_of_squares, physics, screened))
    }

    /// Fits one candidate on top of a set and runs its gates.
    fn try_on(&self, base: &Member, screened: &Screened, physics: &Physics) -> Option<Tried> {
        let number = base.laws.len() + 1 + self.given_laws;
        let amplitudes = screened.trial.amplitude_names();
        let member = self.extended(base, screened.candidate, physics, number, &amplitudes)?;
        let own = format!("physics.{number}.");
        let stack = self.study.stack(Role::Train);
        let errors = standard_errors(&stack, &member.fitted, self.study.slowest_hz);
        Some(self.judged(base, member, screened.candidate, &own, &errors))
    }

    /// The gates of the law whose parameters start with `own`, between a set without and a set with it.
    pub(crate) fn judged(
        &self,
        base: &Member,
        member: Member,
        candidate: usize,
        own: &str,
        errors: &[f64],
    ) -> Tried {
        let slowest_hz = self.study.slowest_hz;
        let stack = self.study.stack(Role::Train);
        let training = improvement(&stack, &base.fitted.records, &member.fitted.records, slowest_hz);
        let held_out = (!self.study.held_out.is_empty()).then(|| {
            improvement(&self.study.stack(Role::HeldOut), &base.held_out, &member.held_out, slowest_hz)
        });
        let parameters: Vec<(String, f64, f64, f64, f64)> = member
            .fitted
            .free
            .iter()
            .zip(&member.fitted.values)
            .zip(errors)
            .filter_map(|((parameter, value), stderr)| {
                let name = parameter.path.strip_prefix(own)?.to_owned();
                Some((name, *value, *stderr, parameter.lower, parameter.upper))
            })
            .collect();
        let amplitudes = self.candidates[candidate].amplitude_names();
        let noise = stack.present() as f64;
        let gates = gates(
            &Trialled {
                training,
                held_out,
                freedom: parameters.len(),
                parameters: &parameters,
                amplitudes: &amplitudes,
                explained: base.fitted.sum_of_squares - member.fitted.sum_of_squares,
                systematic: (base.fitted.sum_of_squares - noise).max(1.0),
            },
            self.options,
        );
        Tried { member, candidate, training, held_out, gates, parameters }
    }
}

impl super::trials::Trial {
    /// Names of the parameters that set the strength.
    pub(crate) fn amplitude_names(&self) -> Vec<String> {
        self.amplitudes.iter().map(|(name, _)| (*name).to_owned()).collect()
    }
}
