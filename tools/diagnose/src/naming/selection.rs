//! From screened candidates to the set of laws that the recordings demand.
//!
//! One law is added at a time: the screen proposes, every promising candidate is fitted by simulation error
//! together with the model's own parameters, and of those that pass all gates the one that fits best is
//! taken. After every addition each law in the set is tried without (deletion) and exchanged for others
//! (swap), because a first choice may only have stood in for what came later. When a law takes away so much
//! that the noise below is seen for the first time, the outputs are weighted by it before the search goes on.

use std::collections::{HashMap, HashSet};
use std::sync::Mutex;

use stillbeam_plant::Model;
use stillbeam_recording::Role;

use super::gates::{DETERMINED, fails_only};
use super::rivals::First;
use super::rounds::{Place, Round, RoundKey, Tried, by_fit};
use super::screening::Screened;
use super::sets::Member;
use super::trials::Candidate;
use crate::adequacy::Rest;
use crate::fit::Fitted;
use crate::noise::NoiseFloor;
use crate::options::Options;
use crate::stacking::RecordFit;
use crate::study::Study;

/// What the search found.
#[derive(Clone)]
pub(crate) struct Selection {
    /// The set that was chosen; the refitted model itself when it has no laws.
    pub(crate) chosen: Member,
    /// Every candidate as the screen saw it beside the refitted model.
    pub(crate) screened: Vec<Screened>,
    /// The law that was found first, as it was then.
    pub(crate) first: Option<First>,
    /// Every candidate that was fitted.
    pub(crate) tried: Vec<Tried>,
    /// Sets that fit as well as the chosen one.
    pub(crate) rivals: Vec<Member>,
    /// The judgement of every law in the chosen set, against the set without it.
    pub(crate) judged: Vec<Tried>,
    /// Laws in whose place, beside others, all laws were looked for, none of which did better.
    pub(crate) kept: Vec<usize>,
    /// What was not looked for because time was over.
    pub(crate) left_out: Vec<&'static str>,
    /// Share that the chosen set takes off what noise does not explain, where that was reckoned with another
    /// weighting than the study's.
    pub(crate) explained_share: Option<f64>,
}

impl Selection {
    /// No law beside the refitted model, and none looked for.
    pub(crate) fn nothing(refitted: &Fitted, held_out: Vec<RecordFit>) -> Self {
        Self::of(Member { laws: Vec::new(), fitted: refitted.clone(), held_out })
    }

    /// A set, and nothing said of what else was looked at.
    pub(crate) fn of(chosen: Member) -> Self {
        Self {
            chosen,
            screened: Vec::new(),
            first: None,
            tried: Vec::new(),
            rivals: Vec::new(),
            judged: Vec::new(),
            kept: Vec::new(),
            left_out: Vec::new(),
            explained_share: None,
        }
    }

    /// Whether a set of these laws, in whatever order they were added, is a rival already.
    pub(crate) fn has_rival(&self, laws: &[usize]) -> bool {
        self.rivals.iter().any(|rival| as_set(&rival.laws) == as_set(laws))
    }
}

/// The search.
pub(crate) struct Search<'s> {
    pub(crate) study: &'s mut Study,
    /// The model as given.
    pub(crate) given: &'s Model,
    pub(crate) candidates: &'s [Candidate],
    pub(crate) options: &'s Options,
    /// Laws that the given model already has.
    pub(crate) given_laws: usize,
    /// The noise that the outputs are weighted by.
    pub(crate) floors: Vec<Option<NoiseFloor>>,
    /// Whether that has changed since the search began.
    pub(crate) weighed_again: bool,
    /// Initial states of held-out free decays under the refitted model, which have no rest to begin from;
    /// empty where a record is driven.
    pub(crate) held_out_starts: Vec<Vec<f64>>,
    /// Whether it looks at pieces of recordings: what it finds there is followed through the whole of them,
    /// and fitted to the end and judged there.
    pub(crate) in_pieces: bool,
    /// Rounds made since.
    pub(crate) rounds: Mutex<HashMap<RoundKey, Round>>,
}

/// Where a search begins whose refit is out of phase with the recordings.
struct Begun {
    member: Member,
    /// What was found, as it was before it was weighed again.
    first: First,
    screened: Vec<Screened>,
}

impl Search<'_> {
    /// Whether no further search is to be begun.
    pub(crate) fn is_over(&self) -> bool {
        self.study.is_over()
    }

    /// Adds, swaps and deletes until no law passes any more. The gates are run again in [`Search::judge`].
    pub(crate) fn run(
        &mut self,
        refitted: &Fitted,
        held_out: Vec<RecordFit>,
        say: &mut dyn FnMut(&str, f64),
    ) -> Selection {
        let mut found = Selection::nothing(refitted, held_out);
        if let Some(begun) = self.begun_in_step(&found.chosen) {
            (found.first, found.screened) = (Some(begun.first), begun.screened);
            found.chosen = self.between_samples_again(begun.member);
        }
        let mut reached = HashSet::new();
        let all_time = self.study.patience;
        while found.chosen.laws.len() < self.options.most_terms {
            // The first law is looked for in any case.
            if self.is_over() && !found.screened.is_empty() {
                found.left_out.push("further laws");
                break;
            }
            let count = found.chosen.laws.len();
            if count > 0 && self.study.patience == all_time {
                self.study.patience = all_time.map(|all| all.for_share(FOR_MORE));
            }
            let done = count as f64 / self.options.most_terms as f64;
            say(&format!("trying what explains the rest beside {count} law(s)"), done);
            let (screened, tried) = self.round(&found.chosen);
            if count == 0 {
                (found.screened, found.tried) = (screened, tried.clone());
            }
            let Some(best) = self.best_of(&found.chosen, &tried) else {
                let missed = if count == 0 { "all laws that may be missing" } else { "further laws" };
                found.left_out.extend(self.is_over().then_some(missed));
                break;
            };
            if let [_] = best.member.laws[..] {
                found.first = Some(First::of(&best, &found.tried, &self.floors));
            }
            found.chosen = self.settled(best.member);
            // Two laws may each make the other look superfluous, and the third that is missing makes both
            // come back: in circles.
            if !reached.insert(as_set(&found.chosen.laws)) {
                break;
            }
            if found.chosen.laws.len() > 1 {
                if !self.is_over() {
                    say("trying other laws in place of those chosen", done + 0.1);
                    found.chosen = self.swapped(found.chosen, &mut found.kept);
                }
                found.left_out.extend(self.is_over().then_some("other laws in place of those chosen"));
            }
        }
        self.study.patience = all_time;
        found
    }

    /// Where the search begins if the refit is out of phase with recordings: the first that finds laws.
    fn begun_in_step(&mut self, refitted: &Member) -> Option<Begun> {
        let begun = self.begun_at_sensors(refitted).or_else(|| self.begun_guided(refitted));
        begun.or_else(|| self.begun_in_pieces(refitted))
    }

    /// What is taken of those tried beside a set.
    fn best_of(&self, chosen: &Member, tried: &[Tried]) -> Option<Tried> {
        let richer = || self.richer_in_place(chosen, tried);
        let found = self.simplest_of_the_best(tried).or_else(richer);
        found.or_else(|| self.two_at_once(chosen, tried))
    }

    /// A set after an addition: weighed by the noise that is seen beside it, read as the input goes between
    /// its samples, no law in it that can go, and each in the valley that fits best.
    fn settled(&mut self, member: Member) -> Member {
        let weighed = self.weighed_again(member);
        // In the right valley the reading of the input may leave nothing to look for in others.
        let read = self.between_samples_again(weighed);
        let before = read.fitted.sum_of_squares;
        let deepest = self.in_the_deepest_valleys(self.pruned(read));
        if deepest.fitted.sum_of_squares < before { self.between_samples_again(deepest) } else { deepest }
    }

    /// Where the search begins if laws of sensors are what has the refit out of phase, and what was seen
    /// beside the refit.
    fn begun_at_sensors(&mut self, refitted: &Member) -> Option<Begun> {
        let member = self.spoilt_readings(refitted)?;
        let first = First::ahead_of(&member, &[], &self.floors);
        let screened = self.seen_beside(refitted);
        Some(Begun { member: self.weighed_again(member), first, screened })
    }

    /// Where the search begins if the refit is out of phase with recordings that something drives, and what
    /// was seen there.
    fn begun_guided(&mut self, refitted: &Member) -> Option<Begun> {
        if !self.is_out_of_phase(refitted) {
            return None;
        }
        let found = self.found_guided(refitted)?;
        let member = self.member(vec![found.law], found.fitted)?;
        let first = First::ahead_of(&member, &found.others_left, &self.floors);
        let tried = self.judged_on(refitted, member.clone(), found.law);
        if !tried.passes() {
            return None;
        }
        Some(Begun { member: self.weighed_again(member), first, screened: found.screened })
    }

    /// Where the search begins if the refit is out of phase with the recordings, and what was seen there.
    fn begun_in_pieces(&mut self, refitted: &Member) -> Option<Begun> {
        let found = self.found_in_pieces(refitted)?;
        self.held_out_starts = found.held_out_starts;
        if self.study.much_lower(&found.floors, &self.floors) {
            self.study.weigh_by_floors(&found.floors);
            self.floors = found.floors;
            self.weighed_again = true;
            self.forget_rounds();
        }
        let member = self.member(found.laws, found.fitted)?;
        let first = First::ahead_of(&member, &found.others_left, &self.floors);
        Some(Begun { member: self.weighed_again(member), first, screened: found.screened })
    }

    /// Of those that pass all gates the one that fits best; or one with fewer parameters where the best is
    /// not significantly better: a law that contains another (Stribeck contains Coulomb) always fits a little
    /// better.
    fn simplest_of_the_best(&self, tried: &[Tried]) -> Option<Tried> {
        let passing: Vec<&Tried> = tried.iter().filter(|tried| tried.passes()).collect();
        let best = passing.iter().copied().min_by(|a, b| by_fit(a, b))?;
        let size = |tried: &Tried| tried.member.fitted.free.len();
        let as_good = |other: &&Tried| {
            size(other) < size(best) && self.better_by(&other.member, &best.member) < self.options.separation
        };
        let simpler =
            passing.iter().copied().filter(as_good).min_by(|a, b| size(a).cmp(&size(b)).then(by_fit(a, b)));
        Some(simpler.unwrap_or(best).clone())
    }

    /// A law that would pass but for sharing its strength with one that is there does that one's work too,
    /// and something else may do the rest of it: friction with a dip at low speed beside friction that
    /// differs by direction is friction with a dip beside a constant force. The set with such a law in the
    /// other's place, if it is beyond doubt better than the one that is there.
    fn richer_in_place(&self, chosen: &Member, tried: &[Tried]) -> Option<Tried> {
        let shares = |tried: &&Tried| fails_only(&tried.gates, DETERMINED);
        let richer = tried.iter().filter(shares).min_by(|a, b| by_fit(a, b))?;
        let instead = (0..chosen.laws.len()).filter_map(|place| {
            let without = self.without(&richer.member, place)?;
            let old = Place { law: chosen.laws[place], left: chosen.fitted.sum_of_squares };
            self.simplest_of_the_best(&self.round_in_place(&without, old).1)
        });
        let better = |tried: &Tried| self.better_by(chosen, &tried.member) > self.options.separation;
        instead.filter(better).min_by(by_fit)
    }

    /// Two laws where none passes alone. Fitted to what two of them do, one law may miss what is held out, or
    /// leave more than it explains; the second is looked for beside it all the same, and both stay only if
    /// neither can go. Beside laws that are there already only where much is left: what no further law
    /// explains is mostly small.
    fn two_at_once(&self, chosen: &Member, tried: &[Tried]) -> Option<Tried> {
        let is_room = chosen.laws.len() + 2 <= self.options.most_terms;
        if !is_room || (!chosen.laws.is_empty() && !self.leaves_much(chosen)) {
            return None;
        }
        let mut firsts: Vec<&Tried> = tried.iter().filter(|tried| tried.may_lack_another()).collect();
        firsts.sort_by(|a, b| by_fit(a, b));
        firsts.truncate(LACKING);
        let needed = |pair: &Tried| {
            let place = pair.member.laws.len() - 2;
            let without = self.without(&pair.member, place);
            without.is_some_and(|without| self.better_by(&without, &pair.member) > self.options.separation)
        };
        let pairs =
            firsts.into_iter().filter_map(|first| self.simplest_of_the_best(&self.round(&first.member).1));
        pairs.filter(needed).min_by(by_fit)
    }

    /// Whether what a set leaves goes with the motion, and is so much more than noise that two laws may be
    /// missing from it. By innovations nothing is: what they are made of is as loud as noise by definition.
    fn leaves_much(&self, member: &Member) -> bool {
        let noise = self.study.stack(Role::Train).present() as f64;
        member.fitted.sum_of_squares > MUCH * noise && self.rest(member) == Rest::Structured
    }

    /// Exchanges laws for others that fit better, one after another; adds to `kept` those that none was found
    /// for.
    fn swapped(&self, mut member: Member, kept: &mut Vec<usize>) -> Member {
        for place in 0..member.laws.len() {
            if self.is_over() {
                break;
            }
            let Some(without) = self.without(&member, place) else { continue };
            let old = Place { law: member.laws[place], left: member.fitted.sum_of_squares };
            let best = self.simplest_of_the_best(&self.round_in_place(&without, old).1);
            // A law that contains the old one always fits a little better.
            let is_richer = |best: &Tried| best.member.fitted.free.len() > member.fitted.free.len();
            let least = |best: &Tried| if is_richer(best) { self.options.separation } else { 0.0 };
            if let Some(best) = best
                && best.member.fitted.sum_of_squares < member.fitted.sum_of_squares
                && self.better_by(&member, &best.member) > least(&best)
            {
                member = best.member;
            } else if !self.is_over() {
                kept.push(old.law);
            }
        }
        member
    }
}

/// The laws in whatever order they were added.
fn as_set(laws: &[usize]) -> Vec<usize> {
    let mut set = laws.to_vec();
    set.sort_unstable();
    set
}

/// Share of the time left in which laws beside the first are looked for: what was found is judged in the
/// rest of it, whatever comes of them.
const FOR_MORE: f64 = 2.0 / 3.0;
/// Laws beside which a second one is looked for where none passes alone.
const LACKING: usize = 2;
/// What is left is much where a systematic rest has as much power as the noise.
const MUCH: f64 = 2.0;

#[cfg(test)]
mod tests {
    use super::*;
    use stillbeam_plant::Physics;

    use crate::patience::Patience;

    use crate::naming::on_a_spring::{
        fitted_with, machine, noisy_runs, searched, searched_beside_a_hardening_spring,
    };

    #[test]
    fn a_rival_is_known_in_whatever_order_its_laws_were_added() {
        let noisy = |amplitudes: &[f64]| noisy_runs(&machine(), amplitudes, 1e-5);
        searched(&noisy(&[3.0]), &noisy(&[5.0]), |_, refitted| {
            let rivals = vec![Member { laws: vec![2, 5], ..refitted.clone() }];
            let selection = Selection { rivals, ..Selection::of(refitted) };
            assert!(selection.has_rival(&[2, 5]) && selection.has_rival(&[5, 2]));
            assert!(!selection.has_rival(&[2]) && !selection.has_rival(&[2, 7]));
        });
    }

    #[test]
    fn the_same_laws_in_another_order_are_the_same_set() {
        assert_eq!(as_set(&[7, 2, 5]), as_set(&[5, 7, 2]));
        assert_ne!(as_set(&[7, 2]), as_set(&[7, 2, 5]));
    }

    #[test]
    fn two_laws_at_once_are_looked_for_where_much_is_left_that_goes_with_the_motion() {
        searched_beside_a_hardening_spring(|search, refitted, spring| {
            let found = fitted_with(search, &refitted, spring);
            let found = search.weighed_again(found);
            let refitted = search.reweighted(refitted).unwrap();
            assert!(search.leaves_much(&refitted));
            assert!(!search.leaves_much(&found));
        });
    }

    #[test]
    fn after_a_search_the_whole_time_counts_again() {
        searched_beside_a_hardening_spring(|search, refitted, _| {
            let hour = Options { time_limit_s: Some(3600.0), ..Options::default() };
            let all_time = Some(Patience::new(&hour));
            search.study.patience = all_time;
            let mut said = Vec::new();
            let Member { fitted, held_out, .. } = refitted;
            let found = search.run(&fitted, held_out, &mut |step, _| said.push(step.to_owned()));
            assert!(!found.chosen.laws.is_empty() && said.iter().any(|step| step.contains("beside 1 law")));
            assert_eq!(
                search.study.patience, all_time,
                "what is looked for beside a law has a part of it only"
            );
        });
    }

    #[test]
    fn a_law_is_kept_in_whose_place_nothing_does_better_and_an_exchanged_one_is_not() {
        searched_beside_a_hardening_spring(|search, refitted, spring| {
            let swapped = |law: &Physics| {
                let (mut kept, set) = (Vec::new(), fitted_with(search, &refitted, law));
                (set.laws.clone(), search.swapped(set, &mut kept).laws, kept)
            };
            let (right, after, kept) = swapped(spring);
            assert_eq!((&after, &kept), (&right, &right));
            let (wrong, after, kept) = swapped(&Physics::new("quadratic_drag", "mass").with("drag", 5.0));
            assert_ne!(after, wrong);
            assert!(kept.is_empty());
        });
    }
}
