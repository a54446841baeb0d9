//! What a parameter that moved too far may stand for.
//!
//! A law that does what a parameter of the model does too is not missed once that parameter is refitted: a
//! cable that pulls on a body beside its own spring is a stiffer spring. No recording of the machine as it
//! stands tells them apart, but what is known of the machine does: masses, stiffnesses and dimensions are
//! known from a drawing, a balance and a calliper. A value that has to move by far more than that is wrong,
//! or stands for a law; both are said.

use rayon::prelude::*;
use stillbeam_identify::tall::{Orthonormal, add_scaled, dot};
use stillbeam_recording::Role;

use super::screening::small_effect;
use super::selection::Search;
use super::sets::{Member, law_parameters};
use crate::effort::Effort;
use crate::fit::{Fitted, fit};
use crate::intervals::standard_errors;
use crate::parameters::FreeParameter;

/// So many times as large or as small is no parameter of the same machine any more.
const ANOTHER_MACHINE: f64 = 10.0;
/// A law does the same as a parameter when at least this share of the power of what the parameter does, all
/// else following, is its.
const THE_SAME: f64 = 0.9;

/// A parameter that moved further than its given value can be wrong.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Moved {
    pub(crate) path: String,
    pub(crate) given: f64,
    pub(crate) to: f64,
}

impl Moved {
    /// Whether the refit describes another machine than the given model.
    pub(crate) fn is_another_machine(&self) -> bool {
        (self.to / self.given).ln().abs() > ANOTHER_MACHINE.ln()
    }

    /// In words, with numbers.
    pub(crate) fn words(&self) -> String {
        let ratio = self.to / self.given;
        if (1.0 / 3.0..3.0).contains(&ratio) {
            let which = if ratio > 1.0 { "larger" } else { "smaller" };
            format!("{} {:.0} % {which} than given", self.path, 100.0 * (ratio - 1.0).abs())
        } else {
            format!("{} {ratio:.3} times what was given", self.path)
        }
    }
}

/// Parameters that moved too far, and sets of laws with which they need not.
#[derive(Default)]
pub(crate) struct StandIns {
    pub(crate) moved: Vec<Moved>,
    pub(crate) members: Vec<Member>,
}

impl Search<'_> {
    /// Looks for laws that explain the recordings as well as the refitted model while the parameters that
    /// moved too far are as given.
    pub(crate) fn stand_ins(&self, refitted: &Member) -> StandIns {
        let fitted = &refitted.fitted;
        let far = self.far_places(fitted);
        if far.is_empty() {
            return StandIns::default();
        }
        let moved = self.far(fitted);
        let (wanted, absorbing) = self.done_by(fitted, &far);
        let mut members: Vec<Member> = (0..self.candidates.len())
            .into_par_iter()
            .filter_map(|candidate| self.stand_in(refitted, &far, candidate, &wanted, &absorbing))
            .filter(|member| self.better_by(member, refitted) < self.options.separation)
            .collect();
        members.sort_by(|a, b| a.fitted.sum_of_squares.total_cmp(&b.fitted.sum_of_squares));
        StandIns { moved, members }
    }

    /// Whether a parameter of a fit moved further than its given value can be wrong.
    pub(crate) fn moved_far(&self, fitted: &Fitted) -> bool {
        !self.far(fitted).is_empty()
    }

    /// Whether one moved so far that it is no parameter of the same machine any more.
    pub(crate) fn needs_another_machine(&self, fitted: &Fitted) -> bool {
        self.far(fitted).iter().any(Moved::is_another_machine)
    }

    /// The parameters of a fit that moved further than their given values can be wrong.
    fn far(&self, fitted: &Fitted) -> Vec<Moved> {
        let moved = self.far_places(fitted).into_iter().map(|index| Moved {
            path: fitted.free[index].path.clone(),
            given: fitted.free[index].given,
            to: fitted.values[index],
        });
        moved.collect()
    }

    fn far_places(&self, fitted: &Fitted) -> Vec<usize> {
        let errors = standard_errors(&self.study.stack(Role::Train), fitted, self.study.slowest_hz);
        let is_far =
            |index: &usize| moved_too_far(&fitted.free[*index], fitted.values[*index], errors[*index]);
        (0..fitted.free.len()).filter(is_far).collect()
    }

    /// What these parameters changed by moving from their given values, as far as straight lines say and all
    /// others follow; and the directions of the others.
    fn done_by(&self, fitted: &Fitted, far: &[usize]) -> (Vec<f64>, Orthonormal) {
        let columns = fitted.sensitivities(&self.study.stack(Role::Train));
        let mut absorbing = Orthonormal::default();
        let mut wanted = vec![0.0; columns.first().map_or(0, Vec::len)];
        for (index, column) in columns.into_iter().enumerate() {
            if far.contains(&index) {
                let (parameter, value) = (&fitted.free[index], fitted.values[index]);
                let slope = parameter.slope(parameter.to_search(value));
                add_scaled(&mut wanted, (value - parameter.given) / slope, &column);
            } else {
                absorbing.push(column);
            }
        }
        absorbing.remove_from(&mut wanted);
        (wanted, absorbing)
    }

    /// The model with one law instead of the parameters' moves, fitted; `None` where the law does something
    /// else, or is not determined.
    fn stand_in(
        &self,
        refitted: &Member,
        far: &[usize],
        index: usize,
        wanted: &[f64],
        absorbing: &Orthonormal,
    ) -> Option<Member> {
        let candidate = &self.candidates[index];
        let base = &refitted.fitted;
        let stack = self.study.stack(Role::Train);
        let (trial, strength, _) = candidate
            .trials
            .iter()
            .filter_map(|trial| {
                let (size, mut effect) = small_effect(&stack, base, candidate, trial)?;
                absorbing.remove_from(&mut effect);
                absorbing.remove_from(&mut effect);
                let (own, along) = (dot(&effect, &effect), dot(&effect, wanted));
                let alike = along * along / (own * dot(wanted, wanted));
                let strength = size * along / own;
                let possible = strength > 0.0 || candidate.is_signed(trial);
                (alike > THE_SAME && possible).then_some((trial, strength, alike))
            })
            .max_by(|a, b| a.2.total_cmp(&b.2))?;
        let physics = candidate.physics(trial, strength);
        let number = self.given_laws + 1;
        let hypothesis = base.hypothesis.with_given(far, &base.free)?.with_law(physics.clone());
        let amplitudes = candidate.amplitude_names();
        let added = law_parameters(&hypothesis.model, &physics, number, candidate, &amplitudes);
        let kept = (0..base.free.len()).filter(|index| !far.contains(index));
        let (mut free, mut start): (Vec<FreeParameter>, Vec<f64>) =
            kept.map(|index| (base.free[index].clone(), base.values[index])).unzip();
        start.extend(added.iter().map(|parameter| parameter.given));
        free.extend(added);
        let fitted = fit(&stack, &hypothesis, &free, &start, &base.initial_states(), Effort::FULL)?;
        let errors = standard_errors(&stack, &fitted, self.study.slowest_hz);
        let own = format!("physics.{number}.");
        let determined =
            fitted.free.iter().zip(&fitted.values).zip(&errors).all(|((parameter, value), error)| {
                let name = parameter.path.strip_prefix(&own);
                let sets_strength =
                    name.is_some_and(|name| amplitudes.iter().any(|amplitude| amplitude == name));
                !sets_strength || value.abs() > self.options.training_gate * error
            });
        let plausible =
            |place: usize| !moved_too_far(&fitted.free[place], fitted.values[place], errors[place]);
        let others_stay = (0..fitted.free.len()).filter(|&place| !fitted.free[place].is_added).all(plausible);
        (determined && others_stay).then(|| self.member(vec![index], fitted))?
    }
}

fn moved_too_far(parameter: &FreeParameter, value: f64, stderr: f64) -> bool {
    let sure = value.abs() > 0.0 && stderr.is_finite() && parameter.given > 0.0;
    let moved = (value / parameter.given).ln().abs();
    sure && moved - 3.0 * (stderr / value).abs() > parameter.known_within().ln()
}
