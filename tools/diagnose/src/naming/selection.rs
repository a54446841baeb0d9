//! From screened candidates to the set of laws that the recordings demand.
//!
//! One law is added at a time: the screen proposes, every promising candidate is fitted by simulation error together
//! with the model's own parameters, and of those that pass all gates the one that fits best is taken. After every
//! addition each law in the set is tried without (deletion) and exchanged for others (swap), because a first choice
//! may only have stood in for what came later.

use rayon::prelude::*;
use stillbeam_identify::tall::Orthonormal;
use stillbeam_plant::Physics;
use stillbeam_recording::Role;

use super::gates::{Improvement, Trialled, gates, improvement};
use super::screening::{Screened, screen};
use super::trials::Candidate;
use crate::fit::{Fitted, fit, fit_beside};
use crate::intervals::standard_errors;
use crate::options::Options;
use crate::parameters::FreeParameter;
use crate::result::Gate;
use crate::stacking::RecordFit;
use crate::study::{OnAll, Study};

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

/// What the search found.
pub(crate) struct Selection {
    /// The set that was chosen; the refitted model itself when it has no laws.
    pub(crate) chosen: Member,
    /// Every candidate as it looked in the round in which it was judged last.
    pub(crate) screened: Vec<Screened>,
    /// Every fitted candidate of the first round, and of the round in which it was added.
    pub(crate) tried: Vec<Tried>,
    /// Sets that fit as well as the chosen one.
    pub(crate) rivals: Vec<Member>,
    /// The judgement of every law in the chosen set, against the set without it.
    pub(crate) judged: Vec<Tried>,
}

/// The search.
pub(crate) struct Search<'s> {
    pub(crate) study: &'s Study,
    pub(crate) candidates: &'s [Candidate],
    pub(crate) options: &'s Options,
    /// Laws that the given model already has.
    pub(crate) given_laws: usize,
}

/// Candidates fitted per round, the most promising first.
const FITTED_PER_ROUND: usize = 4;
/// Candidates fitted with the model's own parameters held to straight lines, to see which are worth more.
const SKETCHED_PER_ROUND: usize = 10;

impl Search<'_> {
    /// Adds, swaps and deletes until no law passes any more.
    pub(crate) fn run(
        &self,
        refitted: &Fitted,
        held_out: Vec<RecordFit>,
        say: &mut dyn FnMut(&str),
    ) -> Selection {
        let mut chosen = Member { laws: Vec::new(), fitted: refitted.clone(), held_out };
        let mut first_screen = Vec::new();
        let mut tried_first: Vec<Tried> = Vec::new();
        while chosen.laws.len() < self.options.most_terms {
            say(&format!("trying what explains the rest beside {} law(s)", chosen.laws.len()));
            let (screened, tried) = self.round(&chosen);
            if chosen.laws.is_empty() {
                first_screen = screened;
                tried_first.clone_from(&tried);
            }
            let best = self.simplest_of_the_best(tried);
            let Some(best) = best else { break };
            chosen = self.pruned(best.member);
            if chosen.laws.len() > 1 {
                say("trying other laws in place of those chosen");
                chosen = self.swapped(chosen);
            }
        }
        let (judged, rivals) = self.judge(&chosen, refitted, &mut tried_first);
        Selection { chosen, screened: first_screen, tried: tried_first, rivals, judged }
    }

    /// Of those that pass all gates the one that fits best; or one with fewer parameters where the best is not
    /// significantly better: a law that contains another (Stribeck contains Coulomb) always fits a little better.
    fn simplest_of_the_best(&self, tried: Vec<Tried>) -> Option<Tried> {
        let passing: Vec<Tried> = tried.into_iter().filter(Tried::passes).collect();
        let best = passing.iter().min_by(|a, b| by_fit(a, b))?;
        let size = |tried: &Tried| tried.member.fitted.free.len();
        let as_good = |other: &&Tried| {
            size(other) < size(best)
                && self.better_by(&other.member, &best.member) < self.options.held_out_gate
        };
        let simpler = passing.iter().filter(as_good).min_by(|a, b| size(a).cmp(&size(b)).then(by_fit(a, b)));
        Some(simpler.unwrap_or(best).clone())
    }

    /// Screens all candidates on top of a set and fits the promising ones.
    fn round(&self, base: &Member) -> (Vec<Screened>, Vec<Tried>) {
        let stack = self.study.stack(Role::Train);
        let screened = screen(&stack, &base.fitted, self.candidates, self.study.slowest_hz);
        crate::simulation::lap("screened");
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
        crate::simulation::lap("sketched");
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
        let free = law_parameters(&hypothesis.model, &physics, number, &screened.trial.amplitude_names());
        let start: Vec<f64> = free.iter().map(|parameter| parameter.given).collect();
        let states = base.fitted.initial_states();
        let stack = self.study.stack(Role::Train);
        let fitted = fit_beside(&stack, &hypothesis, &free, &start, &states, Some(absorbing))?;
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
        Some(self.judged(base, member, screened, &own, &errors))
    }

    /// The gates of the law whose parameters start with `own`, between a set without and a set with it.
    fn judged(&self, base: &Member, member: Member, screened: &Screened, own: &str, errors: &[f64]) -> Tried {
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
        let amplitudes = screened.trial.amplitude_names();
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
        Tried { member, candidate: screened.candidate, training, held_out, gates, parameters }
    }

    /// A set with one more law, fitted.
    fn extended(
        &self,
        base: &Member,
        candidate: usize,
        physics: &Physics,
        number: usize,
        amplitudes: &[String],
    ) -> Option<Member> {
        let hypothesis = base.fitted.hypothesis.with_law(physics.clone());
        let added = law_parameters(&hypothesis.model, physics, number, amplitudes);
        let free: Vec<FreeParameter> =
            base.fitted.free.iter().cloned().chain(added.iter().cloned()).collect();
        let start: Vec<f64> =
            base.fitted.values.iter().copied().chain(added.iter().map(|parameter| parameter.given)).collect();
        let stack = self.study.stack(Role::Train);
        let fitted = fit(&stack, &hypothesis, &free, &start, &base.fitted.initial_states())?;
        self.member([&base.laws[..], &[candidate]].concat(), fitted)
    }

    fn member(&self, laws: Vec<usize>, fitted: Fitted) -> Option<Member> {
        let held_out = self.study.stack(Role::HeldOut).evaluate(&fitted.hypothesis, &[])?;
        Some(Member { laws, fitted, held_out })
    }

    /// The set without its law at `place`, fitted again.
    fn without(&self, member: &Member, place: usize) -> Option<Member> {
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
        let stack = self.study.stack(Role::Train);
        let fitted = fit(&stack, &hypothesis, &free, &start, &member.fitted.initial_states())?;
        let mut laws = member.laws.clone();
        laws.remove(place);
        self.member(laws, fitted)
    }

    /// How many standard errors a set is better than another: held out where there is something, else in training.
    fn better_by(&self, without: &Member, with: &Member) -> f64 {
        let slowest_hz = self.study.slowest_hz;
        if self.study.held_out.is_empty() {
            let stack = self.study.stack(Role::Train);
            return improvement(&stack, &without.fitted.records, &with.fitted.records, slowest_hz).z;
        }
        improvement(&self.study.stack(Role::HeldOut), &without.held_out, &with.held_out, slowest_hz).z
    }

    /// Deletes laws that are not missed.
    fn pruned(&self, mut member: Member) -> Member {
        while member.laws.len() > 1 {
            let places: Vec<usize> = (0..member.laws.len() - 1).collect();
            let weakest = places
                .par_iter()
                .filter_map(|&place| {
                    let without = self.without(&member, place)?;
                    Some((self.better_by(&without, &member), without))
                })
                .collect::<Vec<_>>()
                .into_iter()
                .min_by(|a, b| a.0.total_cmp(&b.0));
            match weakest {
                Some((z, without)) if z < self.options.held_out_gate => member = without,
                _ => break,
            }
        }
        member
    }

    /// Exchanges laws for others that fit better, one after another.
    fn swapped(&self, mut member: Member) -> Member {
        for place in 0..member.laws.len() {
            let Some(without) = self.without(&member, place) else { continue };
            let old = member.laws[place];
            let (_, tried) = self.round(&without);
            let best = self.simplest_of_the_best(tried.into_iter().filter(|t| t.candidate != old).collect());
            if let Some(best) = best
                && best.member.fitted.sum_of_squares < member.fitted.sum_of_squares
                && self.better_by(&member, &best.member) > 0.0
            {
                member = best.member;
            }
        }
        member
    }

    /// Judges every law of the chosen set against the set without it, and collects rivals: sets in which another law
    /// in its place does as well.
    fn judge(&self, chosen: &Member, refitted: &Fitted, first: &mut Vec<Tried>) -> (Vec<Tried>, Vec<Member>) {
        let mut judged = Vec::new();
        let mut rivals = Vec::new();
        for place in 0..chosen.laws.len() {
            let without = if chosen.laws.len() == 1 {
                let held_out = self.study.stack(Role::HeldOut).evaluate(&refitted.hypothesis, &[]);
                held_out.map(|held_out| Member { laws: Vec::new(), fitted: refitted.clone(), held_out })
            } else {
                self.without(chosen, place)
            };
            let Some(without) = without else { continue };
            let old = chosen.laws[place];
            let tried = if chosen.laws.len() == 1 { first.clone() } else { self.round(&without).1 };
            for other in tried {
                if other.candidate == old {
                    judged.push(other);
                    continue;
                }
                let close = self.better_by(&other.member, chosen) < self.options.held_out_gate;
                // What needs more parameters to do as well is no rival.
                let as_simple = other.member.fitted.free.len() <= chosen.fitted.free.len();
                if other.passes() && close && as_simple && !chosen.laws.contains(&other.candidate) {
                    rivals.push(other.member.clone());
                }
                if !first.iter().any(|known| known.candidate == other.candidate) {
                    first.push(other);
                }
            }
        }
        (judged, rivals)
    }
}

impl super::trials::Trial {
    /// Names of the parameters that set the strength.
    pub(crate) fn amplitude_names(&self) -> Vec<String> {
        self.amplitudes.iter().map(|(name, _)| (*name).to_owned()).collect()
    }
}

fn by_fit(a: &Tried, b: &Tried) -> std::cmp::Ordering {
    a.member.fitted.sum_of_squares.total_cmp(&b.member.fitted.sum_of_squares)
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

/// Parameters that stay as tried: what the others already determine.
const KEPT: [&str; 3] = ["gamma", "rest_position", "step"];

/// The free parameters of a law just added as number `number`.
fn law_parameters(
    model: &stillbeam_plant::Model,
    physics: &Physics,
    number: usize,
    amplitudes: &[String],
) -> Vec<FreeParameter> {
    let own = format!("physics.{number}.");
    model
        .parameters()
        .into_iter()
        .filter_map(|parameter| {
            let name = parameter.path.strip_prefix(&own)?.to_owned();
            let given = *physics.parameters.get(&name)?;
            // A limit that does not limit is no parameter.
            (given.is_finite() && !KEPT.contains(&name.as_str())).then(|| FreeParameter {
                logarithmic: !amplitudes.contains(&name) && parameter.lower >= 0.0 && given > 0.0,
                path: parameter.path,
                given,
                lower: parameter.lower,
                upper: parameter.upper,
            })
        })
        .collect()
}
