//! A second search where a disturbance drowns the first: see [`crate::weighting`].

use stillbeam_identify::tall::dot;
use stillbeam_recording::Role;

use super::rivals::Rivals;
use super::rounds::Tried;
use super::selection::{Search, Selection};
use super::sets::Member;
use crate::comparison::Compared;
use crate::fit::{Fitted, LOUD};
use crate::parameters::free_parameters;
use crate::refit::refit_from;
use crate::simulation::Hypothesis;

/// A set fitted to innovations that leaves this many times what the same set leaves fitted to the readings is
/// no better known for it.
const MUCH_MORE: f64 = 1.5;

impl Search<'_> {
    /// Searches again with outputs weighted by the innovations of what `nearest`, the set that the first
    /// search ended with, leaves over; `None` where time is over, where that is no other weighting, and where
    /// no law passes its gates this time either.
    ///
    /// What is wrong about the weighting costs efficiency and no honesty: the gates judge by how what is left
    /// really scatters.
    pub(crate) fn by_innovations(
        &mut self,
        nearest: &Member,
        given: &Hypothesis,
        compared: &Compared,
        say: &mut dyn FnMut(&str, f64),
    ) -> Option<Selection> {
        let found = self.weighted_by_innovations(nearest, given, compared, |search, refitted| {
            let held_out = search
                .study
                .stack(Role::HeldOut)
                .evaluate_held_out(&refitted.hypothesis, &search.held_out_starts)?;
            let found = search.run(refitted, held_out, &mut |step, done| say(step, 0.7 * done));
            Some(search.judge(found, refitted, &mut |step, done| say(step, 0.7 + 0.2 * done)))
        })?;
        Some(
            self.fitted_to_readings(found, &compared.refitted, &mut |step, done| say(step, 0.9 + 0.1 * done)),
        )
    }

    /// What was found with outputs weighted by innovations, fitted to the readings themselves where it then
    /// is better: what had been left when the weighting was made may have been the law's own doing, and with
    /// the law nothing of that colour is left.
    fn fitted_to_readings(
        &self,
        found: Selection,
        refitted: &Fitted,
        say: &mut dyn FnMut(&str, f64),
    ) -> Selection {
        let evenly = self.in_the_deepest_valleys(self.finished(found.chosen.clone()));
        if self.better_by(&found.chosen, &evenly) < self.options.separation {
            return found;
        }
        let again = Selection {
            chosen: evenly,
            rivals: Vec::new(),
            judged: Vec::new(),
            explained_share: None,
            ..found.clone()
        };
        let again = self.judge(again, refitted, say);
        if again.chosen.laws.is_empty() { found } else { again }
    }

    /// What was chosen, and what was tied with it, fitted and judged again with outputs weighted by the
    /// innovations of what it leaves over: beside a disturbance its values are known better so, and some ties
    /// can be told apart. `None` where it does not pass then.
    pub(crate) fn refined_by_innovations(
        &mut self,
        selection: &Selection,
        given: &Hypothesis,
        compared: &Compared,
    ) -> Option<Selection> {
        self.weighted_by_innovations(&selection.chosen, given, compared, |search, refitted| {
            let again =
                |member: &Member| search.reweighted(member.clone()).map(|member| search.finished(member));
            let separation = search.options.separation;
            let mut chosen = again(&selection.chosen)?;
            let mut rivals: Vec<Member> = selection.rivals.iter().filter_map(again).collect();
            for rival in &mut rivals {
                if search.better_by(&chosen, rival) > separation {
                    std::mem::swap(rival, &mut chosen);
                }
            }
            rivals.retain(|rival| search.better_by(rival, &chosen) < separation);
            if !search.leaves_as_little(&chosen, &selection.chosen) {
                return None;
            }
            let (judged, _) = search.judge_laws(&chosen, refitted, &Rivals::of(selection, false));
            judged.iter().all(Tried::passes).then(|| Selection {
                chosen,
                rivals,
                judged,
                explained_share: None,
                ..selection.clone()
            })
        })
    }

    /// Whether a set fitted to innovations leaves about as little of the readings as what was fitted to the
    /// readings themselves. Beside noise of any colour it does; where what is left is the model's own fault,
    /// innovations only make the most of another part of it.
    fn leaves_as_little(&self, weighted: &Member, even: &Member) -> bool {
        let stack = self.study.stack(Role::Train);
        stack.even_square(&weighted.fitted.records) < MUCH_MORE * even.fitted.sum_of_squares
    }

    /// Does something with outputs weighted by the innovations of what a set leaves over, beside the refit
    /// weighted so; what is found is weighted evenly again. `None` where nothing is.
    fn weighted_by_innovations(
        &mut self,
        nearest: &Member,
        given: &Hypothesis,
        compared: &Compared,
        work: impl FnOnce(&mut Self, &Fitted) -> Option<Selection>,
    ) -> Option<Selection> {
        if self.is_over() {
            return None;
        }
        if !self.study.weigh_by_innovations(&nearest.on_all()) {
            self.study.weigh_evenly();
            return None;
        }
        self.forget_rounds();
        let stack = self.study.stack(Role::Train);
        let refitted = refit_from(&stack, given, &free_parameters(given), &compared.refitted);
        let found = refitted.ok().and_then(|(refitted, _)| {
            let mut found = work(self, &refitted)?;
            // Laws are measured against the refit to the innovations: that to even squares has swallowed some
            // of the disturbance.
            let stack = self.study.stack(Role::Train);
            let squares = [&refitted, &found.chosen.fitted].map(|fitted| stack.even_square(&fitted.records));
            found.explained_share = Some(explained_share(squares, stack.present() as f64));
            Some(found)
        });
        self.study.weigh_evenly();
        self.forget_rounds();
        let mut found = found.filter(|found| !found.chosen.laws.is_empty())?;
        found.chosen = self.reweighted(found.chosen)?;
        found.rivals = found.rivals.into_iter().filter_map(|rival| self.reweighted(rival)).collect();
        Some(found)
    }

    pub(super) fn forget_rounds(&mut self) {
        self.rounds = std::sync::Mutex::default();
    }

    /// A set with the values that it has, its residuals weighted as the study's are now.
    pub(super) fn reweighted(&self, member: Member) -> Option<Member> {
        let Fitted { hypothesis, .. } = &member.fitted;
        let states = member.fitted.initial_states();
        let records = self.study.stack(Role::Train).evaluate(hypothesis, &states)?;
        let sum_of_squares = records.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum();
        self.member(member.laws, Fitted { records, sum_of_squares, ..member.fitted })
    }
}

/// Share that laws take off what noise does not explain, from the sums of squares without and with them,
/// every sample weighted evenly, and the number of samples. All of it where there is nothing louder than
/// noise to begin with: a disturbance all the time is taken for noise.
pub(crate) fn explained_share([without, with]: [f64; 2], samples: f64) -> f64 {
    if without < LOUD * samples { 1.0 } else { (without - with) / (without - samples) }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;

    use super::*;
    use crate::naming::on_a_spring::{fitted_with, machine, noisy_runs, searched, shaken_runs, stopped_at};
    use crate::{Diagnosis, Options, diagnose};

    #[test]
    fn a_share_is_of_what_is_louder_than_noise() {
        assert!((explained_share([5000.0, 2000.0], 1000.0) - 0.75).abs() < 1e-12);
        assert!((explained_share([5000.0, 900.0], 1000.0) - 1.025).abs() < 1e-12, "noise fitted, too");
        assert!((explained_share([1050.0, 1200.0], 1000.0) - 1.0).abs() < 1e-12, "nothing was louder");
    }

    #[test]
    fn a_fit_to_innovations_that_leaves_much_more_of_the_readings_is_not_taken() {
        let noisy = |amplitudes: &[f64]| noisy_runs(&machine(), amplitudes, 1e-5);
        searched(&noisy(&[3.0]), &noisy(&[5.0]), |search, refitted| {
            assert!(search.leaves_as_little(&refitted, &refitted));
            let other = stopped_at(search, &refitted, |_| 1.2);
            assert!(!search.leaves_as_little(&other, &refitted));
        });
    }

    #[test]
    fn what_was_found_by_innovations_is_fitted_to_the_readings_where_that_is_better() {
        let mut truth = machine();
        let friction = Physics::new("coulomb_friction", "mass").with("force", 1.0);
        truth.setup_mut().physics = vec![friction.clone()];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
            let best = fitted_with(search, &refitted, &friction);
            let biased =
                stopped_at(search, &best, |path| if path.starts_with("physics") { 1.06 } else { 1.0 });
            let found = |chosen: &Member| Selection {
                chosen: chosen.clone(),
                screened: Vec::new(),
                first: None,
                tried: Vec::new(),
                rivals: Vec::new(),
                judged: Vec::new(),
                kept: Vec::new(),
                left_out: Vec::new(),
                explained_share: Some(0.9),
            };
            let again = search.fitted_to_readings(found(&biased), &refitted.fitted, &mut |_, _| {});
            let law = &again.chosen.fitted.hypothesis.model.setup().physics[0];
            assert!((law.parameters["force"] - 1.0).abs() < 0.01, "{law:?}");
            assert_eq!(again.judged.len(), 1);
            let kept = search.fitted_to_readings(found(&best), &refitted.fitted, &mut |_, _| {});
            assert_eq!((kept.explained_share, kept.judged.len()), (Some(0.9), 0));
        });
    }

    const SHAKING_N: f64 = 0.3;

    const DRAG: f64 = 3.0;

    fn diagnosed(law: Option<Physics>, seed: u64) -> Diagnosis {
        let mut truth = machine();
        truth.setup_mut().physics.extend(law);
        let train = shaken_runs(&truth, &[3.0, 6.0], SHAKING_N, 1e-5, seed);
        let held_out = shaken_runs(&truth, &[4.5], SHAKING_N, 1e-5, seed + 100);
        diagnose(&machine(), &train, &held_out, &Options::default(), &mut |_| {}).unwrap()
    }

    #[test]
    fn drag_is_named_beside_a_force_that_shakes_the_machine_all_the_time() {
        for seed in 1..=3 {
            let found = diagnosed(Some(Physics::new("quadratic_drag", "mass").with("drag", DRAG)), seed);
            let named: Vec<&str> = found.effects.iter().map(|effect| effect.id.as_str()).collect();
            assert_eq!(named, ["quadratic_drag"], "{}", found.sentence);
            let drag = &found.effects[0].parameters["drag"];
            assert!((drag.value - DRAG).abs() < 3.0 * drag.stderr, "{drag:?}");
        }
    }

    #[test]
    fn a_force_that_shakes_the_machine_is_no_law() {
        for seed in 1..=3 {
            let found = diagnosed(None, seed);
            assert!(found.effects.is_empty(), "{}", found.sentence);
        }
    }
}
