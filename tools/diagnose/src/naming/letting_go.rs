//! Laws that were fitted beside a guide, followed to where nothing holds the machine any more.
//!
//! The guide is made softer from fit to fit, at once by as much as what a law leaves allows: a fit that is on
//! its way leaves little more beside a much softer guide, before it is carried on there. Where a fit beside a
//! softer guide ends far above the one before it has lost the way, and the step is halved (in powers of ten).

use stillbeam_identify::tall::dot;
use stillbeam_recording::Role;

use super::guides::loosened;
use super::selection::Search;
use crate::effort::Effort;
use crate::fit::{Fitted, fit};
use crate::record::Record;
use crate::stacking::Stack;

/// From one guide to the next it is so many times as soft at least, ...
const SOFTER: f64 = 0.1;
/// ... or the root of that where fits leave so many times what they left before, ...
const ASTRAY: f64 = 3.0;
/// ... and no more roots are drawn than this.
const MOST_ROOTS: u32 = 3;
/// Once it is this many times as soft it is let go.
const LET_GO: f64 = 1e-4;
/// A mean square that is no sign of a lost way: of outputs that count as shares of what they reach, a
/// thousandth.
const NOTHING: f64 = 1e-6;
/// Laws are followed as long as they leave no more than this many times what the best leaves.
const FAR_BEHIND: f64 = 10.0;

/// A law on its way from a guide to none.
pub(super) struct Followed {
    pub(super) law: usize,
    pub(super) fitted: Fitted,
}

/// Laws beside a guide so many times as hard as the first, the best first.
struct Way {
    share: f64,
    followed: Vec<Followed>,
    /// Roots drawn of the least step.
    roots: u32,
    /// How many times what the best left those left that were given up.
    behind: Vec<f64>,
}

impl Search<'_> {
    /// The best of several laws, fitted beside softer and softer guides and then without one; and what the
    /// others would leave.
    pub(super) fn let_go(&self, records: &[Record], followed: Vec<Followed>) -> Option<(Followed, Vec<f64>)> {
        let mut way = Way { share: 1.0, followed, roots: 0, behind: Vec::new() };
        while way.share > 0.0 {
            way.sort_out();
            let next = self.next_share(records, &way)?;
            let (followed, best) = self.beside(records, &way, next)?;
            let least = followed.iter().map(left).fold(f64::INFINITY, f64::min);
            if least > ASTRAY * best && way.roots < MOST_ROOTS && !self.is_over() {
                way.roots += 1;
                continue;
            }
            way = Way { share: next, followed, ..way };
        }
        way.sort_out();
        let mut followed = way.followed.into_iter();
        let found = followed.next()?;
        let behind = way.behind.iter().map(|times| times * left(&found));
        let others = followed.map(|other| left(&other)).chain(behind).collect();
        Some((found, others))
    }

    /// The hardness of the guide that comes next: none, or that of the softest beside which the best law
    /// stays in step and leaves little more than now.
    fn next_share(&self, records: &[Record], way: &Way) -> Option<f64> {
        let best = way.followed.first()?;
        let least_step = SOFTER.powf(0.5_f64.powi(way.roots as i32));
        let furthest = way.share * least_step;
        let least = if furthest < LET_GO { 0.0 } else { furthest };
        let further = [0.0, LET_GO].into_iter().chain((1..4).map(|decade| LET_GO * 10_f64.powi(decade)));
        let leaves_little = |share: &f64| {
            let softer = self.let_loose(records, *share);
            let Fitted { hypothesis, .. } = &best.fitted;
            let Some(fits) = self.stack_of(&softer).evaluate(hypothesis, &best.fitted.initial_states())
            else {
                return false;
            };
            let left: f64 = fits.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum();
            left < ASTRAY * self.allowed(&best.fitted) && self.is_in_step(fits)
        };
        let is_tried = way.roots == 0 && !self.is_over();
        let jump = further.take_while(|share| is_tried && *share < least).find(leaves_little);
        Some(jump.unwrap_or(least))
    }

    /// What the best law leaves, and next to nothing at least.
    fn allowed(&self, best: &Fitted) -> f64 {
        best.sum_of_squares.max(NOTHING * self.study.stack(Role::Train).present() as f64)
    }

    /// The laws fitted beside a guide so many times as hard as the first, and what was allowed before.
    fn beside(&self, records: &[Record], way: &Way, share: f64) -> Option<(Vec<Followed>, f64)> {
        let softer = self.let_loose(records, share);
        let stack = self.stack_of(&softer);
        // Where the way was lost the valley bends.
        let effort = if way.roots > 0 || share == 0.0 { Effort::BENT } else { Effort::TRIAL };
        let fitted = |one: &Followed| {
            let Fitted { hypothesis, free, values, .. } = &one.fitted;
            let fitted = fit(&stack, hypothesis, free, values, &one.fitted.initial_states(), effort)?;
            Some(Followed { law: one.law, fitted })
        };
        Some((way.followed.iter().filter_map(fitted).collect(), self.allowed(&way.followed.first()?.fitted)))
    }

    /// The training recordings with guides so many times as hard.
    fn let_loose(&self, records: &[Record], share: f64) -> Vec<Record> {
        if share > 0.0 { loosened(records, share) } else { self.study.train.clone() }
    }

    fn stack_of<'r>(&self, records: &'r [Record]) -> Stack<'r> {
        Stack {
            records: records.iter().collect(),
            weights: self.study.stack(Role::Train).weights,
            patience: self.study.patience,
        }
    }
}

impl Way {
    /// The best first, those far behind left behind.
    fn sort_out(&mut self) {
        self.followed.sort_by(|a, b| left(a).total_cmp(&left(b)));
        let Some(best) = self.followed.first().map(left) else { return };
        let behind = self.followed.iter().map(|one| left(one) / best).filter(|times| *times > FAR_BEHIND);
        self.behind.extend(behind);
        self.followed.retain(|one| left(one) <= FAR_BEHIND * best);
    }
}

/// The sum of squares that is left.
fn left(one: &Followed) -> f64 {
    one.fitted.sum_of_squares
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;

    use super::*;
    use crate::naming::on_a_spring::{hardening, machine, noisy_runs, searched};
    use crate::naming::sets::{Member, law_parameters};

    const STIFFNESS: f64 = 2e5;

    /// A law of this strength beside the drawing, on these recordings, not fitted yet.
    fn beside(search: &Search<'_>, records: &[Record], drawn: &Fitted, physics: &Physics) -> Followed {
        let law = search.candidates.iter().position(|one| one.law.id() == physics.id).unwrap();
        let candidate = &search.candidates[law];
        let hypothesis = drawn.hypothesis.with_law(physics.clone());
        let names = candidate.amplitude_names();
        let added = law_parameters(&hypothesis.model, physics, 1, candidate, &names);
        let values = drawn.values.iter().copied().chain(added.iter().map(|free| free.given)).collect();
        let free = drawn.free.iter().cloned().chain(added).collect();
        let records = search.stack_of(records).evaluate(&hypothesis, &[]).unwrap();
        let sum_of_squares = records.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum();
        Followed { law, fitted: Fitted { hypothesis, free, values, records, sum_of_squares } }
    }

    /// What is said of laws beside the softest guide that holds a machine in step whose spring hardens.
    fn held<T>(look: impl FnOnce(&Search<'_>, &[Record], &dyn Fn(&Physics) -> Followed) -> T) -> T {
        let noisy = |amplitudes: &[f64]| noisy_runs(&hardening(machine(), STIFFNESS), amplitudes, 1e-4);
        searched(&noisy(&[20.0, 40.0]), &noisy(&[30.0]), |search, refitted: Member| {
            let (study, drawn) = search.held_in_step(&refitted).unwrap();
            look(search, &study.train, &|physics| beside(search, &study.train, &drawn, physics))
        })
    }

    fn spring(stiffness: f64) -> Physics {
        Physics::new("cubic_stiffness", "mass").with("stiffness", stiffness)
    }

    #[test]
    fn the_right_law_is_let_go_at_once_and_one_that_is_not_there_yet_step_by_step() {
        held(|search, records, beside| {
            let next = |one: Followed| {
                let way = Way { share: 1.0, followed: vec![one], roots: 0, behind: Vec::new() };
                search.next_share(records, &way)
            };
            assert_eq!(next(beside(&spring(STIFFNESS))), Some(0.0));
            assert_eq!(next(beside(&spring(0.5 * STIFFNESS))), Some(SOFTER));
        });
    }

    #[test]
    fn a_lost_way_is_gone_again_by_half_the_step() {
        held(|search, records, beside| {
            let after = |roots: u32| {
                let followed = vec![beside(&spring(STIFFNESS))];
                let way = Way { share: 0.1, followed, roots, behind: Vec::new() };
                search.next_share(records, &way).unwrap()
            };
            assert_eq!(after(0), 0.0);
            assert!((after(1) / (0.1 * SOFTER.sqrt()) - 1.0).abs() < 1e-9, "{}", after(1));
            assert!((after(2) / (0.1 * SOFTER.powf(0.25)) - 1.0).abs() < 1e-9, "{}", after(2));
        });
    }

    #[test]
    fn a_law_begun_half_as_strong_is_followed_to_where_nothing_holds_and_another_is_left_behind() {
        held(|search, records, beside| {
            let lag = Physics::new("servo_lag", "drive").with("time_constant", 0.01);
            let begun = vec![beside(&lag), beside(&spring(0.5 * STIFFNESS))];
            let (found, others_left) = search.let_go(records, begun).unwrap();
            assert_eq!(search.candidates[found.law].law.id(), "cubic_stiffness");
            let law = &found.fitted.hypothesis.model.setup().physics[0];
            assert!((law.parameters["stiffness"] / STIFFNESS - 1.0).abs() < 0.01, "{law:?}");
            assert_eq!(others_left.len(), 1);
            assert!(others_left[0] > FAR_BEHIND * left(&found), "{others_left:?}");
            let free = search.study.stack(Role::Train);
            let alone = free.evaluate(&found.fitted.hypothesis, &found.fitted.initial_states()).unwrap();
            let alone: f64 = alone.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum();
            assert!((alone / left(&found) - 1.0).abs() < 0.01, "what it leaves without a guide");
        });
    }
}
