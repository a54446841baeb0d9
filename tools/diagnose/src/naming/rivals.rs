//! Whether laws that a search did not try could do the work of one that it found.
//!
//! A search that time has ended has not seen what further laws beside or instead of a found one would do. Two
//! things speak for it all the same: that others do not make its effect, as far as straight lines say, and
//! that none of those fitted in its place came near to what it leaves.

use stillbeam_identify::tall::{Orthonormal, dot};

use super::rounds::Tried;
use super::screening::Screened;
use super::selection::{Search, Selection};
use super::sets::Member;
use crate::noise::NoiseFloor;

/// A law leads where every other that was fitted in its place leaves at least so many times the squares.
const LEAD: f64 = 2.0;

/// So many times the separation of two sets behind, a set that has been fitted for a while is no rival.
const FAR_BEHIND: f64 = 10.0;

/// A round is decided by a law that takes this share of what was left ...
const DECISIVE: f64 = 0.95;
/// ... while every other leaves at least so many times as much as it does.
const FAR_AHEAD: f64 = 10.0;

/// What a search that may have been ended knows about other laws.
pub(super) struct Rivals<'s> {
    /// Whether time ended it.
    pub(super) is_cut_short: bool,
    screened: &'s [Screened],
    /// The law that was found first, if it leads.
    leader: Option<usize>,
    /// Laws in whose place others were looked for in vain.
    kept: &'s [usize],
}

/// What speaks against other laws in one law's place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rivalry {
    /// Share of the law's effect that all other laws together do not make, as far as straight lines say.
    pub(crate) own_share: f64,
    /// Whether the law stands alone and every other that was fitted in its place left far more.
    pub(crate) leads: bool,
    /// Whether others were looked for in its place, beside another law, in time, and none did better.
    pub(crate) is_kept: bool,
}

impl<'s> Rivals<'s> {
    /// Of a selection; `is_over`: whether time has ended since.
    pub(super) fn of(selection: &'s Selection, is_over: bool) -> Self {
        let first = selection.first.as_ref().filter(|first| first.leads);
        let leader = first.and_then(|first| first.found.laws.first().copied());
        let is_cut_short = is_over || !selection.left_out.is_empty();
        Self { is_cut_short, screened: &selection.screened, leader, kept: &selection.kept }
    }

    /// Of a law in a set of laws.
    pub(super) fn beside(&self, laws: &[usize], law: usize) -> Rivalry {
        let leads = laws.len() == 1 && self.leader == Some(law);
        Rivalry { own_share: own_share(self.screened, law), leads, is_kept: self.kept.contains(&law) }
    }
}

/// What a search found first: a law, or those of sensors that it began with.
#[derive(Clone)]
pub(crate) struct First {
    found: Member,
    /// Whether every other that was fitted in its place leaves far more.
    leads: bool,
    /// The noise that the outputs were weighted by then.
    floors: Vec<Option<NoiseFloor>>,
}

impl First {
    /// Of those fitted in one round.
    pub(super) fn of(found: &Tried, round: &[Tried], floors: &[Option<NoiseFloor>]) -> Self {
        let others = round.iter().filter(|tried| tried.candidate != found.candidate);
        let left: Vec<f64> = others.map(|other| other.member.fitted.sum_of_squares).collect();
        Self::ahead_of(&found.member, &left, floors)
    }

    /// Of a set of one law, and what others leave that were fitted in its place.
    pub(super) fn ahead_of(found: &Member, others_left: &[f64], floors: &[Option<NoiseFloor>]) -> Self {
        let least = others_left.iter().copied().min_by(f64::total_cmp);
        let leads = least.is_some_and(|least| least > LEAD * found.fitted.sum_of_squares);
        Self { found: found.clone(), leads, floors: floors.to_vec() }
    }
}

/// Whether one law that passes its gates takes nearly all away that `base` leaves, and no other comes near
/// that was worth a fit: then what it leaves is for further laws, and the first is looked for nowhere else.
pub(super) fn is_decided(base: &Member, tried: &[Tried]) -> bool {
    let left = |tried: &Tried| tried.member.fitted.sum_of_squares;
    let best = tried.iter().filter(|tried| tried.passes()).min_by(|a, b| left(a).total_cmp(&left(b)));
    best.is_some_and(|best| {
        let mut others = tried.iter().filter(|other| other.candidate != best.candidate);
        left(best) < (1.0 - DECISIVE) * base.fitted.sum_of_squares
            && others.all(|other| left(other) > FAR_AHEAD * left(best))
    })
}

impl Search<'_> {
    /// Time is over: whatever was tried and passes its gates counts as doing as well, for that it does not is
    /// not known; but for what is so far behind, or leaves so much more, that no further fit would bring it
    /// here.
    pub(super) fn suspect_rivals(&self, selection: &mut Selection) {
        selection.left_out.push("laws that would do as well");
        let chosen = &selection.chosen;
        let comes_near = |other: &Member| {
            other.fitted.sum_of_squares < LEAD * chosen.fitted.sum_of_squares
                && self.better_by(other, chosen) < FAR_BEHIND * self.options.separation
        };
        let others = selection.tried.iter().filter(|other| {
            other.passes()
                && !chosen.laws.contains(&other.candidate)
                && other.member.laws.len() == chosen.laws.len()
                && self.reweighted(other.member.clone()).is_none_or(|other| comes_near(&other))
        });
        let suspected = others.filter(|other| !selection.has_rival(&other.member.laws));
        let suspected: Vec<Member> = suspected.map(|other| other.member.clone()).collect();
        selection.rivals.extend(suspected);
    }

    /// Back to the law that was found first, as it was then, where time has ended what was looked for on top
    /// of it and nothing passed: laws that fail may have moved the rest of the model to where it fails too,
    /// and the weighting to noise that they made up.
    pub(crate) fn back_to_the_first(&mut self, ended: &Selection) -> Option<Selection> {
        let is_cut_short = Rivals::of(ended, self.is_over()).is_cut_short;
        let First { found, floors, .. } = ended.first.clone()?;
        if !is_cut_short || !ended.chosen.laws.is_empty() {
            return None;
        }
        self.study.weigh_by_floors(&floors);
        (self.floors, self.weighed_again) = (floors, false);
        self.forget_rounds();
        Some(Selection { chosen: self.reweighted(found)?, ..ended.clone() })
    }
}

/// Share of a candidate's effect that no combination of the other screened candidates makes, as far as
/// straight lines say; nothing of one that was not screened.
fn own_share(screened: &[Screened], candidate: usize) -> f64 {
    let mut others = Orthonormal::default();
    screened.iter().filter(|s| s.candidate != candidate).for_each(|s| others.push(s.direction.clone()));
    screened.iter().find(|s| s.candidate == candidate).map_or(0.0, |own| {
        let mut rest = own.direction.clone();
        others.remove_from(&mut rest);
        dot(&rest, &rest) / dot(&own.direction, &own.direction).max(f64::MIN_POSITIVE)
    })
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::catalogue::Trial;

    use super::*;
    use crate::naming::on_a_spring::{searched_beside_a_hardening_spring, stopped_at};

    fn screened(candidate: usize, direction: &[f64]) -> Screened {
        Screened {
            candidate,
            trial: Trial { amplitudes: Vec::new(), shapes: Vec::new() },
            factor: 1.0,
            t: 10.0,
            hidden: 0.0,
            explained: dot(direction, direction),
            direction: direction.to_vec(),
            others: Vec::new(),
        }
    }

    #[test]
    fn a_law_keeps_for_its_own_what_no_others_make_together() {
        let all =
            [screened(3, &[2.0, 0.0, 0.0]), screened(5, &[1.0, 1.0, 0.0]), screened(9, &[0.0, 3.0, 4.0])];
        assert!((own_share(&all, 9) - 16.0 / 25.0).abs() < 1e-12, "two others make the second component");
        assert!(own_share(&all[..2], 3) > 0.4, "half of it is the other's");
        assert_eq!(own_share(&all, 7), 0.0, "not screened");
    }

    /// Work on a search beside a mass whose spring hardens, and on what its first round found.
    fn around_a_hardening_spring(work: impl FnOnce(&mut Search<'_>, Member, Vec<Tried>)) {
        searched_beside_a_hardening_spring(|search, refitted, _| {
            let tried = search.round(&refitted).1;
            work(search, refitted, tried);
        });
    }

    #[test]
    fn a_law_leads_where_all_others_left_at_least_twice_as_much() {
        around_a_hardening_spring(|search, _, tried| {
            let [found, other, ..] = &tried[..] else { panic!("two laws are tried") };
            let leads = |times: f64| {
                let mut other = other.clone();
                other.member.fitted.sum_of_squares = times * found.member.fitted.sum_of_squares;
                First::of(found, &[found.clone(), other], &search.floors).leads
            };
            assert!(leads(2.5) && !leads(1.5));
            let alone = First::of(found, std::slice::from_ref(found), &search.floors);
            assert!(!alone.leads, "nothing was compared");
        });
    }

    #[test]
    fn a_round_is_decided_by_a_law_that_does_nearly_all_and_far_more_than_any_other() {
        around_a_hardening_spring(|_, refitted, tried| {
            let [found, other, ..] = &tried[..] else { panic!("two laws are tried") };
            let mut found = found.clone();
            found.gates.iter_mut().for_each(|gate| gate.passed = true);
            let decided = |share_left: f64, times: f64| {
                let mut base = refitted.clone();
                base.fitted.sum_of_squares = found.member.fitted.sum_of_squares / share_left;
                let mut other = other.clone();
                other.member.fitted.sum_of_squares = times * found.member.fitted.sum_of_squares;
                is_decided(&base, &[found.clone(), other])
            };
            assert!(decided(0.04, 11.0));
            assert!(!decided(0.06, 11.0), "much is left");
            assert!(!decided(0.04, 9.0), "another comes near");
            let mut much = refitted.clone();
            much.fitted.sum_of_squares = 100.0 * found.member.fitted.sum_of_squares;
            assert!(is_decided(&much, std::slice::from_ref(&found)), "no other was worth a fit");
            let mut refused = found.clone();
            refused.gates[0].passed = false;
            assert!(!is_decided(&much, &[refused]), "it does not pass");
        });
    }

    #[test]
    fn what_time_left_unfitted_and_leaves_at_least_twice_as_much_is_no_rival() {
        around_a_hardening_spring(|search, refitted, tried| {
            let chosen = search.weighed_again(tried[0].member.clone());
            let (candidate, laws) = (tried[1].candidate, tried[1].member.laws.clone());
            let rivals = |factor: f64| {
                let stiffness = |path: &str| if path.starts_with("physics.") { factor } else { 1.0 };
                let stopped = Member { laws: laws.clone(), ..stopped_at(search, &chosen, stiffness) };
                let left = stopped.fitted.sum_of_squares / chosen.fitted.sum_of_squares;
                assert!(search.better_by(&stopped, &chosen) < FAR_BEHIND * search.options.separation);
                let other = Tried { member: stopped, candidate, gates: Vec::new(), ..tried[1].clone() };
                let nothing = Selection::nothing(&refitted.fitted, refitted.held_out.clone());
                let mut selection = Selection { chosen: chosen.clone(), tried: vec![other], ..nothing };
                search.suspect_rivals(&mut selection);
                (left, selection.rivals.len())
            };
            for factor in [0.9, 0.5, 0.3, 0.1, 0.0] {
                let (left, found) = rivals(factor);
                assert_eq!(found, usize::from(left < LEAD), "{factor} leaves {left} times as much");
            }
            assert!(rivals(0.9).0 < LEAD && rivals(0.0).0 > LEAD, "on either side");
        });
    }

    #[test]
    fn a_search_that_time_ended_goes_back_to_what_it_found_first_with_the_weights_of_then() {
        around_a_hardening_spring(|search, refitted, tried| {
            let found = &tried[0];
            let floors = search.floors.clone();
            let first = First { found: found.member.clone(), leads: false, floors };
            let nothing = Selection::nothing(&refitted.fitted, refitted.held_out.clone());
            let ended = |left_out: Vec<&'static str>| Selection {
                first: Some(first.clone()),
                left_out,
                ..nothing.clone()
            };
            assert!(search.back_to_the_first(&ended(Vec::new())).is_none(), "nothing was left out");
            search.study.weights.iter_mut().for_each(|weight| *weight *= 7.0);
            let back = search.back_to_the_first(&ended(vec!["further laws"])).expect("time ended it");
            assert_eq!(back.chosen.laws, found.member.laws);
            let left = back.chosen.fitted.sum_of_squares / found.member.fitted.sum_of_squares;
            assert!((left - 1.0).abs() < 1e-3, "{left}");
        });
    }
}
