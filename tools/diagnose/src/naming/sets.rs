//! Sets of laws, each fitted together with the model's own parameters.

use stillbeam_plant::Physics;
use stillbeam_recording::Role;

use super::improvement::compare;
use super::selection::Search;
use super::trials::Candidate;
use crate::effort::Effort;
use crate::fit::{Fitted, Others, fit, fit_near};
use crate::parameters::{AS_GIVEN, FreeParameter};
use crate::refit::refit_beside_laws;
use crate::simulation::Hypothesis;
use crate::stacking::RecordFit;
use crate::study::OnAll;

/// A model with some laws, fitted and judged.
#[derive(Clone)]
pub(crate) struct Member {
    /// Indices into the candidates, in the order in which they were added.
    pub(crate) laws: Vec<usize>,
    pub(crate) fitted: Fitted,
    pub(crate) held_out: Vec<RecordFit>,
}

impl Member {
    /// The set on all recordings.
    pub(crate) fn on_all(&self) -> OnAll {
        OnAll { train: self.fitted.records.clone(), held_out: self.held_out.clone() }
    }
}

/// A rival that is no more than this many times the separation behind is fitted to the end.
const NEAR: f64 = 2.0;
/// One further behind is fitted on as long as every attempt leaves no more than this share of the distance.
const COMES_CLOSER: f64 = 0.6;

impl Search<'_> {
    /// The beginning of the fit of a set with one more law; `others` are the model's own parameters.
    pub(crate) fn extended(
        &self,
        base: &Member,
        candidate: usize,
        physics: &Physics,
        number: usize,
        amplitudes: &[String],
        others: Others<'_>,
    ) -> Option<Fitted> {
        let hypothesis = base.fitted.hypothesis.with_law(physics.clone());
        let added =
            law_parameters(&hypothesis.model, physics, number, &self.candidates[candidate], amplitudes);
        let free: Vec<FreeParameter> =
            base.fitted.free.iter().cloned().chain(added.iter().cloned()).collect();
        let start: Vec<f64> =
            base.fitted.values.iter().copied().chain(added.iter().map(|parameter| parameter.given)).collect();
        let stack = self.study.stack(Role::Train);
        let near = stack.begin_near(&hypothesis, &base.fitted.records)?;
        fit_near(&stack, &hypothesis, &free, &start, near, others, Effort::BEGIN)
    }

    pub(crate) fn member(&self, laws: Vec<usize>, fitted: Fitted) -> Option<Member> {
        let held_out =
            self.study.stack(Role::HeldOut).evaluate_held_out(&fitted.hypothesis, &self.held_out_starts)?;
        Some(Member { laws, fitted, held_out })
    }

    /// The set without its law at `place`, fitted again.
    pub(crate) fn without(&self, member: &Member, place: usize) -> Option<Member> {
        let (hypothesis, free, start) = self.lacking(member, place);
        // To the end even when time is: a set that is not fitted would make its missing law look necessary.
        let stack = self.study.stack(Role::Train);
        let states = member.fitted.initial_states();
        let fitted = fit(&stack, &hypothesis, &free, &start, &states, Effort::TRIAL)?;
        let mut laws = member.laws.clone();
        laws.remove(place);
        self.member(laws, fitted)
    }

    /// The set without its law at `place` and the other parameters with their values, as they are beside it.
    pub(crate) fn lacking(
        &self,
        member: &Member,
        place: usize,
    ) -> (Hypothesis, Vec<FreeParameter>, Vec<f64>) {
        let mut hypothesis = member.fitted.hypothesis.clone();
        let index = self.given_laws + place;
        hypothesis.model.setup_mut().physics.remove(index);
        let removed = format!("physics.{}.", index + 1);
        let mut free = Vec::new();
        let mut start = Vec::new();
        for (parameter, value) in member.fitted.free.iter().zip(&member.fitted.values) {
            if parameter.path.starts_with(&removed) {
                continue;
            }
            free.push(FreeParameter { path: renumbered(&parameter.path, index + 1), ..parameter.clone() });
            start.push(*value);
        }
        (hypothesis, free, start)
    }

    /// The set with another law in the place of one, begun from that law's values and fitted again.
    pub(crate) fn exchanged(
        &self,
        member: &Member,
        place: usize,
        candidate: usize,
        physics: &Physics,
    ) -> Option<Member> {
        let number = self.given_laws + place + 1;
        let own = format!("physics.{number}.");
        let mut hypothesis = member.fitted.hypothesis.clone();
        *hypothesis.model.setup_mut().physics.get_mut(number - 1)? = physics.clone();
        let other = &self.candidates[candidate];
        let added = law_parameters(&hypothesis.model, physics, number, other, &other.amplitude_names());
        let rows = member.fitted.free.iter().zip(&member.fitted.values);
        let (mut free, mut start): (Vec<FreeParameter>, Vec<f64>) = rows
            .filter(|(parameter, _)| !parameter.path.starts_with(&own))
            .map(|(parameter, value)| (parameter.clone(), *value))
            .unzip();
        start.extend(added.iter().map(|parameter| parameter.given));
        free.extend(added);
        let stack = self.study.stack(Role::Train);
        let fitted = fit(&stack, &hypothesis, &free, &start, &member.fitted.initial_states(), Effort::TRIAL)?;
        let mut laws = member.laws.clone();
        *laws.get_mut(place)? = candidate;
        self.member(laws, fitted)
    }

    /// How many standard errors a set is better than another over all recordings, training and held out;
    /// every parameter that it has more is worth one square of noise in training.
    pub(crate) fn better_by(&self, without: &Member, with: &Member) -> f64 {
        let slowest_hz = self.study.slowest_hz;
        let compared = |role: Role, without: &[RecordFit], with: &[RecordFit]| {
            compare(&self.study.stack(role), without, with, slowest_hz)
        };
        let training = compared(Role::Train, &without.fitted.records, &with.fitted.records);
        let held_out = compared(Role::HeldOut, &without.held_out, &with.held_out);
        let freedom = with.fitted.free.len() as f64 - without.fitted.free.len() as f64;
        let scale = with.fitted.sum_of_squares / self.study.stack(Role::Train).present().max(1) as f64;
        let gain = training.gain + held_out.gain - freedom * scale;
        // The square that a parameter is worth is itself uncertain by as much: two sets that do the same are
        // no standard errors apart.
        let sd = (training.variance + held_out.variance + scale * scale).sqrt();
        if sd > 0.0 { gain / (2.0 * sd) } else { 0.0 }
    }

    /// A set fitted to the end.
    pub(crate) fn finished(&self, member: Member) -> Member {
        self.further(member, Effort::FULL)
    }

    /// A rival fitted to the end, given up while it does not come closer to the chosen set: `None` then.
    pub(crate) fn finished_if_close(&self, mut member: Member, chosen: &Member) -> Option<Member> {
        let mut behind = self.better_by(&member, chosen);
        while behind > NEAR * self.options.separation {
            member = self.further(member, Effort::TRIAL);
            let now = self.better_by(&member, chosen);
            if now > COMES_CLOSER * behind {
                return None;
            }
            behind = now;
        }
        let member = self.finished(member);
        (self.better_by(&member, chosen) < self.options.separation).then_some(member)
    }

    fn further(&self, member: Member, effort: Effort) -> Member {
        let fitted = self.fitted_on(&member.fitted, effort);
        fitted.and_then(|fitted| self.member(member.laws.clone(), fitted)).unwrap_or(member)
    }

    /// A fit carried on, if that makes it better.
    pub(crate) fn fitted_on(&self, from: &Fitted, effort: Effort) -> Option<Fitted> {
        let stack = self.study.stack(Role::Train);
        let fitted = fit(&stack, &from.hypothesis, &from.free, &from.values, &from.initial_states(), effort);
        fitted.filter(|fitted| fitted.sum_of_squares <= from.sum_of_squares)
    }

    /// Weights the outputs by the noise that a set leaves over, if that is much less than was thought, and
    /// halves the sub-steps where that noise shows what they get wrong; the set is then fitted again, and
    /// which of the model's own parameters are free is decided anew.
    pub(crate) fn weighed_again(&mut self, member: Member) -> Member {
        let weighed = self.weighed_by_what_is_left(member);
        if !self.study.halve_steps(&weighed.fitted) {
            return weighed;
        }
        self.forget_rounds();
        let finer = self.refitted_beside_laws(&weighed).unwrap_or(weighed);
        // What steps got wrong was taken for noise.
        self.weighed_by_what_is_left(finer)
    }

    fn weighed_by_what_is_left(&mut self, member: Member) -> Member {
        if self.study.is_coloured() {
            return member;
        }
        let floors = self.study.floors(&member.on_all());
        if !self.study.much_lower(&floors, &self.floors) {
            return member;
        }
        self.study.trim_zeros(&member.on_all(), &floors);
        self.study.weigh_by_floors(&floors);
        self.floors = floors;
        self.weighed_again = true;
        self.forget_rounds();
        self.refitted_beside_laws(&member).unwrap_or(member)
    }

    /// A set fitted again, which of the model's own parameters are free decided anew.
    fn refitted_beside_laws(&self, member: &Member) -> Option<Member> {
        let stack = self.study.stack(Role::Train);
        let mut hypothesis = Hypothesis::given(self.given);
        hypothesis.model.setup_mut().physics = member.fitted.hypothesis.model.setup().physics.clone();
        let fitted = refit_beside_laws(&stack, &hypothesis, &member.fitted)?;
        self.member(member.laws.clone(), fitted)
    }
}

/// The path with laws counted as if number `removed` were gone.
fn renumbered(path: &str, removed: usize) -> String {
    let Some((number, name)) = path.strip_prefix("physics.").and_then(|rest| rest.split_once('.')) else {
        return path.to_owned();
    };
    match number.parse::<usize>() {
        Ok(number) if number > removed => format!("physics.{}.{name}", number - 1),
        _ => path.to_owned(),
    }
}

/// The free parameters of a law just added as number `number`.
pub(crate) fn law_parameters(
    model: &stillbeam_plant::Model,
    physics: &Physics,
    number: usize,
    candidate: &Candidate,
    amplitudes: &[String],
) -> Vec<FreeParameter> {
    let own = format!("physics.{number}.");
    model
        .parameters()
        .into_iter()
        .filter_map(|parameter| {
            let name = parameter.path.strip_prefix(&own)?.to_owned();
            let given = *physics.parameters.get(&name)?;
            // A limit that does not limit is no parameter. Where a cable pulls to is the others' to say
            // unless it is asked for: most machines start where it does not pull.
            let is_asked = name == "rest_position" && given != 0.0;
            if !given.is_finite() || (AS_GIVEN.contains(&name.as_str()) && !is_asked) {
                return None;
            }
            let range = candidate.ranges.iter().find(|(ranged, ..)| *ranged == name);
            let (least, most) =
                range.map_or((f64::NEG_INFINITY, f64::INFINITY), |(_, least, most)| (*least, *most));
            Some(FreeParameter {
                logarithmic: !amplitudes.contains(&name) && parameter.lower >= 0.0 && given > 0.0,
                path: parameter.path,
                given,
                lower: parameter.lower.max(least),
                upper: parameter.upper.min(most),
                is_added: true,
            })
        })
        .collect()
}
