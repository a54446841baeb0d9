//! One round: every candidate on top of a set is screened, the promising ones are sketched, the best of those
//! fitted.

use rayon::prelude::*;
use stillbeam_identify::tall::{Orthonormal, dot};
use stillbeam_plant::Physics;
use stillbeam_recording::Role;

use super::gates::{Closer, DOUBT, FOR_ANOTHER, Trialled, gates, pulls_back};
use super::improvement::{Improvement, improvement};
use super::rivals::{Rivalry, is_decided};
use super::screening::{Leaving, Screened, screen};
use super::second_tries::take_better;
use super::selection::Search;
use super::sets::Member;
use super::sketches::Sketched;
use super::trials::Candidate;
use crate::adequacy::Rest;
use crate::effort::Effort;
use crate::fit::{Fitted, Others};
use crate::intervals::rough_standard_errors;
use crate::parameters::FreeParameter;
use crate::result::Gate;
use crate::stacking::Stack;

/// Every candidate as the screen sees it beside a set, and those that were fitted on top of it.
pub(crate) type Round = (Vec<Screened>, Vec<Tried>);

/// What rounds are known by: the laws of the set they began from, and the law whose place was to be taken.
pub(crate) type RoundKey = (Vec<usize>, Option<usize>);

/// What a law is looked for that could take another's place: that law, and the sum of squares that the set
/// with it leaves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) law: usize,
    pub(crate) left: f64,
}

/// What laws on top of a set are compared with.
#[derive(Clone, Copy)]
pub(super) struct Beside<'b> {
    /// They are judged against it: the same set of laws, perhaps fitted otherwise.
    pub(super) rival: &'b Member,
    /// Where their fits are begun too.
    pub(super) drawing: Option<&'b Member>,
    /// The place that is to be taken, if only such laws are looked for.
    pub(super) place: Option<Place>,
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
    /// Whether no laws that were not tried could do its work: see the gate of that name.
    pub(crate) unrivalled: bool,
    /// Whether the machine runs away with it where it is driven harder.
    pub(crate) runs_away: bool,
}

impl Tried {
    pub(crate) fn passes(&self) -> bool {
        self.gates.iter().all(|gate| gate.passed)
    }

    /// Whether all that speaks against the law may be another one that is missing beside it.
    pub(super) fn may_lack_another(&self) -> bool {
        self.gates.iter().all(|gate| gate.passed || FOR_ANOTHER.contains(&gate.name.as_str()))
    }
}

/// Candidates fitted per round: these many at least and at most, the most promising first, ...
const FITTED_PER_ROUND: std::ops::RangeInclusive<usize> = 2..=6;
/// ... as long as they take away at least this share of what the best takes.
pub(super) const CONTENDS: f64 = 0.5;
/// Candidates that are sketched even if the screen is not certain of them, unless it is certain that they are
/// nothing.
const LOOKED_AT_ANYWAY: usize = 4;
const UNLIKELY: f64 = 2.0;
/// Where the model's own parameters are no more than these and all recordings are decays, they are searched
/// with the law's in a sketch: that costs little more than straight lines, which end where a decay rate or a
/// frequency has to move by as much as a decay shows of it. A law that the refit has hidden in its damping
/// for the most part looks like nothing along them.
const SEARCHED_ALONG: usize = 4;
/// Candidates sketched, to see which are worth more: with the model's own parameters held to straight lines,
/// or searched along.
const SKETCHED_PER_ROUND: usize = 16;
/// As long as the screen says that they take away this share of what the best takes. Of 341 sketches in
/// thirteen searches none with less than a fifth came to contend.
const WORTH_A_SKETCH: f64 = 0.1;

impl Search<'_> {
    /// Screens all candidates on top of a set and fits the promising ones; what has been done for the same
    /// laws is not done again.
    pub(crate) fn round(&self, base: &Member) -> Round {
        self.known((base.laws.clone(), None)).unwrap_or_else(|| self.tried_on(base, None))
    }

    /// The same for laws that could take the place of one: those alone are fitted whose sketches come near to
    /// what it does, and the law itself is not.
    pub(crate) fn round_in_place(&self, base: &Member, place: Place) -> Round {
        let (screened, tried) = self
            .known((base.laws.clone(), None))
            .or_else(|| self.known((base.laws.clone(), Some(place.law))))
            .unwrap_or_else(|| self.tried_on(base, Some(place)));
        (screened, tried.into_iter().filter(|tried| tried.candidate != place.law).collect())
    }

    fn known(&self, key: RoundKey) -> Option<Round> {
        self.rounds.lock().ok()?.get(&key).cloned()
    }

    fn tried_on(&self, base: &Member, place: Option<Place>) -> Round {
        let found = self.looked_for_on(base, place);
        if let Ok(mut rounds) = self.rounds.lock() {
            rounds.insert((base.laws.clone(), place.map(|place| place.law)), found.clone());
        }
        found
    }

    fn looked_for_on(&self, base: &Member, place: Option<Place>) -> Round {
        if self.is_given_up(base) {
            return (Vec::new(), Vec::new());
        }
        if !base.laws.is_empty() {
            return self.tried_around(base, Beside { rival: base, drawing: None, place });
        }
        let Some(drawing) = self.better_drawing(base) else {
            return self.looked_for_around_refit(base, place);
        };
        let (seen, mut tried) = self.tried_around(&drawing, Beside { rival: base, drawing: None, place });
        if place.is_none() && !is_decided(base, &tried) {
            take_better(&mut tried, self.gross_laws(base));
        }
        if place.is_some() || tried.iter().any(Tried::passes) || self.is_over() {
            return (seen, tried);
        }
        // A refit that tells less of the held-out recordings than the drawing does may still be the nearer
        // machine: the loud part of a decay counts for all of it.
        let (screened, around_refit) = self.looked_for_around_refit(base, place);
        take_better(&mut tried, around_refit);
        (screened, tried)
    }

    /// Looks for the first law around the refit, and where that finds none, around the drawing that it has
    /// left.
    fn looked_for_around_refit(&self, base: &Member, place: Option<Place>) -> Round {
        let drawing = self.drawing_of_far_refit(base);
        let (screened, mut tried) =
            self.tried_around(base, Beside { rival: base, drawing: drawing.as_ref(), place });
        if place.is_some() {
            return (screened, tried);
        }
        if self.in_pieces && tried.iter().any(Tried::passes) {
            tried.extend(self.laws_seen_as_well(base, &screened, &tried));
            return (screened, tried);
        }
        if !tried.iter().any(Tried::passes)
            && let Some(drawing) = self.drawing_of_another_machine(base)
        {
            let (_, around) = self.tried_around(&drawing, Beside { rival: base, drawing: None, place });
            tried.retain(|known| around.iter().all(|tried| tried.candidate != known.candidate));
            tried.extend(around);
        }
        tried.extend(self.hidden_laws(base, &screened, &tried));
        if !is_decided(base, &tried) {
            self.take_laws_alike(base, &mut tried);
        }
        tried.extend(self.laws_seen_as_well(base, &screened, &tried));
        if !is_decided(base, &tried) {
            take_better(&mut tried, self.gross_laws(base));
        }
        (screened, tried)
    }

    /// Whether no further law is looked for on top of a set. The first one is as long as what is under way
    /// may go on.
    fn is_given_up(&self, base: &Member) -> bool {
        if base.laws.is_empty() { self.study.is_spent() } else { self.is_over() }
    }

    /// Fits laws on top of `base`.
    pub(super) fn tried_around(&self, base: &Member, beside: Beside<'_>) -> Round {
        let place = beside.place;
        let is_given_up = || self.is_given_up(base);
        let stack = self.study.stack(Role::Train);
        let rest = self.rest_beside(base);
        let least_t = self.least_t(rest);
        // What is worth looking at is there before it is simulated, to a factor of two.
        let least_explained = if rest == Rest::Noise { (0.5 * least_t).powi(2) } else { 0.0 };
        let leaving = Leaving { least_explained, is_given_up: &is_given_up };
        let smooth = self.without_rounding(base);
        let seen_from = smooth.as_ref().unwrap_or(base);
        let screened = screen(&stack, &seen_from.fitted, self.candidates, self.study.slowest_hz, &leaving);
        if is_given_up() {
            return (screened, Vec::new());
        }
        let mut promising = self.promising(base, &screened, least_t);
        promising.retain(|screened| place.is_none_or(|place| place.law != screened.candidate));
        let (absorbing, own) = directions(&stack, seen_from);
        let only_decays = stack.records.iter().all(|record| record.input.is_none());
        let others = if only_decays && own.len() <= SEARCHED_ALONG {
            Others::Known(&own)
        } else {
            Others::Absorb(&absorbing)
        };
        let mut sketched: Vec<Sketched<'_>> = promising
            .par_iter()
            .filter(|_| !is_given_up())
            .filter_map(|screened| self.sketch(seen_from, screened, others))
            .collect();
        sketched.retain(|sketched| self.may_pass(seen_from, sketched));
        sketched.sort_by(|a, b| a.left.total_cmp(&b.left));
        if smooth.is_some() {
            // Where the fit is to begin is known; it has not begun.
            sketched.iter_mut().for_each(|sketched| sketched.begun = None);
        }
        // What a law does to readings that are rounded is not what it does to those that are not.
        let comparable = place.filter(|_| smooth.is_none());
        let contenders = contenders(&sketched, seen_from.fitted.sum_of_squares, comparable);
        let fitted = match place {
            Some(_) => contenders.min(*FITTED_PER_ROUND.end()),
            None => contenders.clamp(*FITTED_PER_ROUND.start(), *FITTED_PER_ROUND.end()).min(sketched.len()),
        };
        let rest = sketched.split_off(fitted);
        let mut tried = self.fitted_ones(base, beside, &sketched, &own);
        // The best may be no law at all, a wave longer than the travel say: then those behind it are heard.
        if place.is_none() && !tried.iter().any(Tried::passes) && !is_given_up() {
            let next = &rest[..rest.len().min(*FITTED_PER_ROUND.end())];
            tried.extend(self.fitted_ones(base, beside, next, &own));
        }
        self.begin_even_friction_at_uneven(beside.rival, place.map(|place| place.law), &mut tried);
        self.settle_the_best(beside.rival, &mut tried);
        if !self.in_pieces {
            self.settle_those_as_good(beside.rival, &mut tried);
        }
        self.begin_the_best_elsewhere(base, beside.rival, &screened, &mut tried);
        tried.retain(|tried| tried.training.t() > least_t);
        drop(sketched);
        (screened, tried)
    }

    /// Standard errors that a further law must have on the training recordings: where nothing is left that
    /// goes with the motion, it must be beyond doubt. A random force that shakes a resonance looks much like
    /// a steady tone.
    fn least_t(&self, rest: Rest) -> f64 {
        let nothing_to_find = rest != Rest::Structured;
        if nothing_to_find { DOUBT * self.options.training_gate } else { self.options.training_gate }
    }

    /// What is left beside laws; without any there is something to look for whatever the tests say.
    fn rest_beside(&self, base: &Member) -> Rest {
        if base.laws.is_empty() { Rest::Structured } else { self.rest(base) }
    }

    /// The candidates that are worth a sketch, the most promising first.
    fn promising<'s>(&self, base: &Member, screened: &'s [Screened], least_t: f64) -> Vec<&'s Screened> {
        let mut promising: Vec<&Screened> =
            screened.iter().filter(|s| !base.laws.contains(&s.candidate)).collect();
        promising.sort_by(|a, b| b.explained.total_cmp(&a.explained));
        let best = promising.first().map_or(0.0, |best| best.explained);
        // Where what is left is strongly coloured nothing looks certain: the first few are looked at in any
        // case.
        let mut place = 0;
        promising.retain(|s| {
            place += 1;
            s.t.abs() > least_t || (place <= LOOKED_AT_ANYWAY && s.t.abs() > UNLIKELY)
        });
        promising.retain(|s| s.explained > WORTH_A_SKETCH * best);
        promising.truncate(SKETCHED_PER_ROUND);
        promising
    }

    /// Fits laws together with the model's own parameters, those to the end that still contend after the
    /// beginning.
    fn fitted_ones(
        &self,
        base: &Member,
        beside: Beside<'_>,
        sketched: &[Sketched<'_>],
        own: &[Vec<f64>],
    ) -> Vec<Tried> {
        let before = base.fitted.sum_of_squares;
        let mut begun: Vec<(Fitted, &Screened)> = sketched
            .par_iter()
            .filter(|_| !self.is_given_up(base))
            .filter_map(|sketched| {
                let Sketched { physics, screened, begun, .. } = sketched;
                let around_base = match begun {
                    Some(begun) => Some(begun.clone()),
                    None => self.begun(base, screened, physics, Others::Known(own)),
                };
                let around_drawing = beside
                    .drawing
                    .and_then(|drawing| self.begun(drawing, screened, physics, Others::Searched));
                let read_off = self.wave_where_it_went(base, screened.candidate);
                let all = around_base.into_iter().chain(around_drawing).chain(read_off);
                Some((all.min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))?, *screened))
            })
            .collect();
        begun.sort_by(|a, b| a.0.sum_of_squares.total_cmp(&b.0.sum_of_squares));
        let best = begun.first().map_or(0.0, |(fitted, _)| before - fitted.sum_of_squares);
        begun.retain(|(fitted, _)| before - fitted.sum_of_squares > CONTENDS * best);
        begun
            .par_iter()
            .filter_map(|(fitted, screened)| self.try_on(beside.rival, screened, fitted))
            .collect()
    }

    /// Begins the fit of one candidate on top of a set.
    pub(super) fn begun(
        &self,
        base: &Member,
        screened: &Screened,
        physics: &Physics,
        others: Others<'_>,
    ) -> Option<Fitted> {
        let number = base.laws.len() + 1 + self.given_laws;
        let amplitudes = self.candidates[screened.candidate].amplitude_names();
        self.extended(base, screened.candidate, physics, number, &amplitudes, others)
    }

    /// Goes on with that fit and runs the candidate's gates.
    pub(super) fn try_on(&self, base: &Member, screened: &Screened, begun: &Fitted) -> Option<Tried> {
        let fitted = self.fitted_on(begun, Effort::COMPARE);
        let laws = [&base.laws[..], &[screened.candidate]].concat();
        let member = self.member(laws, fitted.unwrap_or_else(|| begun.clone()))?;
        Some(self.judged_on(base, member, screened.candidate))
    }

    /// The gates of the law that a set has on top of another.
    pub(super) fn judged_on(&self, base: &Member, member: Member, candidate: usize) -> Tried {
        let own = format!("physics.{}.", base.laws.len() + 1 + self.given_laws);
        let stack = self.study.stack(Role::Train);
        let errors = rough_standard_errors(&stack, &member.fitted, self.study.slowest_hz);
        self.judged(base, member, candidate, &own, &errors, (None, None))
    }

    /// The gates of the law whose parameters start with `own`, between a set without and a set with it.
    pub(crate) fn judged(
        &self,
        base: &Member,
        member: Member,
        candidate: usize,
        own: &str,
        errors: &[f64],
        (closer, rivalry): (Option<Closer>, Option<Rivalry>),
    ) -> Tried {
        let slowest_hz = self.study.slowest_hz;
        let stack = self.study.stack(Role::Train);
        let training = improvement(&stack, &base.fitted.records, &member.fitted.records, slowest_hz);
        let held_out = (!self.study.held_out.is_empty()).then(|| {
            improvement(&self.study.stack(Role::HeldOut), &base.held_out, &member.held_out, slowest_hz)
        });
        let number = own.split('.').nth(1).and_then(|number| number.parse::<usize>().ok());
        let laws = &member.fitted.hypothesis.model.setup().physics;
        let law = number.and_then(|number| laws.get(number - 1));
        let parameters = self.parameters_of(&member.fitted, (candidate, law), own, errors);
        let amplitudes = self.candidates[candidate].amplitude_names();
        let noise = stack.present() as f64;
        let trialled = Trialled {
            training,
            held_out,
            freedom: parameters.len(),
            parameters: &parameters,
            amplitudes: &amplitudes,
            explained: base.fitted.sum_of_squares - member.fitted.sum_of_squares,
            systematic: (base.fitted.sum_of_squares - noise).max(1.0),
            held_out_share: held_out.map(|_| self.held_out_share(base, &member)),
            closer,
        };
        let unrivalled = trialled.is_unrivalled(rivalry, self.options);
        let runs_away = closer.is_some_and(|closer| !closer.stable);
        let mut gates = gates(&trialled, self.options);
        gates.extend(law.and_then(|law| pulls_back(self.candidates[candidate].law, law)));
        let mut tried =
            Tried { member, candidate, training, held_out, gates, parameters, unrivalled, runs_away };
        if let Some(known) = self.known_from_below(&tried, own) {
            tried.gates.retain(|gate| gate.name != known.name);
            tried.gates.push(known);
        }
        tried
    }
}

/// Name, value, standard error, lower and upper bound of a parameter of a law.
type Row = (String, f64, f64, f64, f64);

impl Search<'_> {
    /// The parameters, whose paths start with `own`, of a law in a fit: those that are free, with these
    /// errors, and a step that was read off the recordings.
    fn parameters_of(
        &self,
        fitted: &Fitted,
        (candidate, law): (usize, Option<&Physics>),
        own: &str,
        errors: &[f64],
    ) -> Vec<Row> {
        let Candidate { law: known, step_stderr, .. } = &self.candidates[candidate];
        let row = |((free, value), stderr): ((&FreeParameter, &f64), &f64)| {
            let name = free.path.strip_prefix(own)?.to_owned();
            // A law that is complete at its bound is not pressed against it.
            let mut specs = known.parameters().iter();
            let is_natural =
                specs.any(|spec| spec.name == name && spec.is_complete_at_upper && spec.upper == free.upper);
            Some((name, *value, *stderr, free.lower, if is_natural { f64::INFINITY } else { free.upper }))
        };
        let free = fitted.free.iter().zip(&fitted.values).zip(errors).filter_map(row);
        let step = law.and_then(|law| law.parameters.get("step")).zip(*step_stderr);
        let step =
            step.map(|(step, stderr)| ("step".to_owned(), *step, stderr, f64::NEG_INFINITY, f64::INFINITY));
        free.chain(step).collect()
    }
}

/// How many of the sketches, the best first, take away a good part of what the best does, or what the law
/// does whose place is to be taken.
fn contenders(sketched: &[Sketched<'_>], before: f64, place: Option<Place>) -> usize {
    let best = match place {
        Some(place) => before - place.left,
        None => sketched.first().map_or(0.0, |best| before - best.left),
    };
    sketched.iter().take_while(|sketched| before - sketched.left > CONTENDS * best).count()
}

pub(super) fn by_fit(a: &Tried, b: &Tried) -> std::cmp::Ordering {
    a.member.fitted.sum_of_squares.total_cmp(&b.member.fitted.sum_of_squares)
}

/// What a set's free parameters would absorb, and how its residuals change with those of the model's own that
/// are free. They do nearly the same with one more law as without it; residuals are recorded minus simulated.
pub(super) fn directions(stack: &Stack<'_>, base: &Member) -> (Orthonormal, Vec<Vec<f64>>) {
    let columns = base.fitted.rough_sensitivities(stack);
    let mut absorbing = Orthonormal::default();
    columns.iter().for_each(|column| absorbing.push(column.clone()));
    let own = base.fitted.free.iter().zip(columns).filter(|(free, _)| !free.is_added);
    let own = own.map(|(_, column)| column.into_iter().map(|value| -value).collect()).collect();
    (absorbing, own)
}

impl Search<'_> {
    /// Share of what noise does not explain of the held-out recordings that one set takes off another's rest;
    /// what the better one leaves below the noise counts as noise.
    fn held_out_share(&self, without: &Member, with: &Member) -> f64 {
        let left = |member: &Member| -> f64 {
            member.held_out.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum()
        };
        let noise = self.study.stack(Role::HeldOut).present() as f64;
        let (before, after) = (left(without), left(with));
        (before - after) / (before - noise.min(after)).max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;

    use super::*;
    use crate::naming::hidden_laws::AS_WELL;
    use crate::naming::on_a_spring::{
        machine, noisy_runs, searched, searched_around, searched_beside_a_hardening_spring,
    };
    use crate::options::Options;
    use crate::patience::Patience;
    use crate::two_bodies::{driven, slide, swept};

    #[test]
    fn the_first_law_is_looked_for_until_what_is_under_way_has_to_end() {
        searched_beside_a_hardening_spring(|search, refitted, _| {
            let spent = Options { processor_limit_s: Some(-1e6), ..Options::default() };
            search.study.patience = Some(Patience::new(&spent));
            let (seen, tried) = search.looked_for_on(&refitted, None);
            assert!(seen.is_empty() && tried.is_empty(), "spent");
            search.study.patience = Some(Patience::that_is_over());
            assert!(search.is_over() && !search.study.is_spent());
            let (seen, tried) = search.looked_for_on(&refitted, None);
            assert!(!seen.is_empty() && !tried.is_empty());
        });
    }

    #[test]
    fn a_sensor_that_loses_the_sign_wholly_is_known_and_not_pressed_against_a_bound() {
        for amplitude in [3.0, 8.0] {
            let mut truth = machine();
            truth.setup_mut().physics = vec![Physics::new("rectification", "sensor").with("share", 1.0)];
            let noisy = |times: f64| noisy_runs(&truth, &[amplitude, times * amplitude], 1e-4);
            searched(&noisy(2.0), &noisy(1.5), |search, refitted| {
                let (_, tried) = search.round(&refitted);
                let is_it = |tried: &&Tried| search.candidates[tried.candidate].law.id() == "rectification";
                let tried = tried.iter().find(is_it).expect("tried");
                let (_, share, ..) = &tried.parameters[0];
                assert!(*share > 0.99, "{share}");
                for name in ["bounds", "determined", "training"] {
                    let gate = tried.gates.iter().find(|gate| gate.name == name).unwrap();
                    assert!(gate.passed, "{name}: {}", gate.detail);
                }
            });
        }
    }

    /// One-sided springs, stops and springs elsewhere do along straight lines what a hardening spring does.
    /// The weak one is fitted at the wrong body too.
    #[test]
    fn what_the_screen_is_sure_of_and_sees_as_well_as_the_best_is_fitted_whatever_its_sketch_says() {
        for stiffness in [3e5, 1e6] {
            let spring = Physics::new("cubic_stiffness", "motor").with("stiffness", stiffness);
            let truth = slide(20_000.0, &[spring]);
            let run = |amplitude: f64, seed: u64| driven(&truth, &swept(amplitude), None, seed);
            let (train, held_out) = ([run(40.0, 1), run(120.0, 2)], [run(80.0, 3)]);
            searched_around(&slide(20_000.0, &[]), &train, &held_out, |search, refitted| {
                let (screened, tried) = search.round(&refitted);
                let most = screened.iter().map(|seen| seen.explained).fold(0.0, f64::max);
                let is_sure = |seen: &&Screened| seen.t.abs() > search.options.training_gate;
                let as_well = |seen: &&Screened| seen.explained > AS_WELL * most;
                for seen in screened.iter().filter(as_well).filter(is_sure) {
                    let is_fitted = tried.iter().any(|tried| tried.candidate == seen.candidate);
                    let candidate = &search.candidates[seen.candidate];
                    assert!(is_fitted, "{} at {}", candidate.law.id(), candidate.location);
                }
                // In pieces of recordings what is seen best is fitted as well, though another passes.
                search.in_pieces = true;
                search.rounds.lock().unwrap().clear();
                let (screened, tried) = search.round(&refitted);
                let best = screened.iter().max_by(|a, b| a.explained.total_cmp(&b.explained)).unwrap();
                assert!(tried.iter().any(|tried| tried.candidate == best.candidate));
            });
        }
    }

    #[test]
    fn in_a_laws_place_only_what_does_its_work_is_fitted_and_the_law_itself_is_not() {
        let mut truth = machine();
        truth.setup_mut().physics = vec![Physics::new("coulomb_friction", "mass").with("force", 1.0)];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
            let id = |candidate: usize| search.candidates[candidate].law.id();
            let is_friction = |tried: &&Tried| id(tried.candidate) == "coulomb_friction";
            let (_, all) = search.round(&refitted);
            let friction = all.iter().find(is_friction).expect("the truth is fitted");
            let place = Place { law: friction.candidate, left: friction.member.fitted.sum_of_squares };
            // What is known is not done again: the rounds are forgotten.
            search.rounds.lock().unwrap().clear();
            let (_, instead) = search.round_in_place(&refitted, place);
            assert!(instead.iter().all(|tried| tried.candidate != place.law));
            let before = refitted.fitted.sum_of_squares;
            let worth = |tried: &Tried| before - tried.member.fitted.sum_of_squares;
            assert!(!instead.is_empty(), "a dip or hysteresis do the same");
            assert!(instead.iter().all(|tried| worth(tried) > CONTENDS * (before - place.left)));
        });
    }

    #[test]
    fn beside_a_set_that_leaves_noise_what_would_take_nothing_off_is_not_simulated() {
        let mut truth = machine();
        truth.setup_mut().physics = vec![Physics::new("coulomb_friction", "mass").with("force", 1.0)];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
            let is_given_up = || false;
            let stack = search.study.stack(Role::Train);
            let seen = |least_explained: f64| -> Vec<(&str, f64)> {
                let leaving = Leaving { least_explained, is_given_up: &is_given_up };
                let screened = screen(&stack, &refitted.fitted, search.candidates, None, &leaving);
                let id = |s: &Screened| search.candidates[s.candidate].law.id();
                screened.iter().map(|s| (id(s), s.explained)).collect()
            };
            let has = |seen: &[(&str, f64)], id: &str| seen.iter().any(|(seen, _)| *seen == id);
            let all = seen(0.0);
            let friction = all.iter().find(|(id, _)| *id == "coulomb_friction").expect("the truth is seen").1;
            let likely = seen(0.25 * friction);
            assert!(has(&likely, "coulomb_friction") && likely.len() < all.len(), "{likely:?}");
            let none = seen(f64::MAX);
            assert!(!has(&none, "coulomb_friction") && has(&none, "saturation"), "no force: {none:?}");
        });
    }
}
