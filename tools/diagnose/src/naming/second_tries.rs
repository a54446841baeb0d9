//! What fits best and does not pass is tried again before it is given up: fitted to the end, and begun at its
//! other shapes.

use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;
use stillbeam_plant::Physics;
use stillbeam_recording::Role;

use super::gates::DOUBT;
use super::rounds::{Tried, by_fit, directions};
use super::screening::Screened;
use super::selection::Search;
use super::sets::Member;
use crate::effort::Effort;
use crate::fit::{Fitted, LOUD, Others};
use crate::refit::is_far_anywhere;

impl Search<'_> {
    /// Where a law acts for moments only, an end stop say, a fit that has not settled may know enough for the
    /// recordings that it is fitted to and fail on others. The best of those that were tried is fitted to the
    /// end before it is given up for that.
    pub(super) fn settle_the_best(&self, base: &Member, tried: &mut [Tried]) {
        let Some(best) = tried.iter_mut().min_by(|a, b| by_fit(a, b)) else { return };
        if !self.deserves_more(best) {
            return;
        }
        let across = self.across_the_jags(&best.member);
        let settled = self.finished(across.unwrap_or_else(|| best.member.clone()));
        if settled.fitted.sum_of_squares < best.member.fitted.sum_of_squares {
            *best = self.judged_on(base, settled, best.candidate);
        }
    }

    /// Laws that take nearly as much away as the best of those that pass, where that leaves more than noise,
    /// are fitted to the end: a fit that has not settled leaves more than another law does, and the other one
    /// would be taken for it. So does one beside parameters that have gone far to make up for the law before
    /// it was there: the drawing is where they are looked for then.
    pub(super) fn settle_those_as_good(&self, base: &Member, tried: &mut [Tried]) {
        let left = |tried: &Tried| tried.member.fitted.sum_of_squares;
        let Some(best) = tried.iter().filter(|tried| tried.passes()).min_by(|a, b| by_fit(a, b)) else {
            return;
        };
        if !self.is_louder_than_noise(&best.member.fitted) || self.is_over() {
            return;
        }
        let (before, best) = (base.fitted.sum_of_squares, left(best));
        tried
            .par_iter_mut()
            .filter(|tried| tried.passes() && before - left(tried) > AS_GOOD * (before - best))
            .for_each(|tried| {
                let is_far = is_far_anywhere(&tried.member.fitted);
                let drawn = is_far.then(|| self.fitted_from_drawing(&tried.member, Effort::TRIAL)).flatten();
                let there = std::iter::once(self.finished(tried.member.clone())).chain(drawn);
                let settled =
                    there.min_by(|a, b| a.fitted.sum_of_squares.total_cmp(&b.fitted.sum_of_squares));
                if let Some(settled) = settled.filter(|settled| settled.fitted.sum_of_squares < left(tried)) {
                    *tried = self.judged_on(base, settled, tried.candidate);
                }
            });
    }

    /// The way from no friction to dry friction may be barred, a damper that has made up for it standing in
    /// between, and open to the richer law that contains it. Where that leaves less, even friction is begun
    /// from its mean, unless the set has it or its place is to be `taken`.
    pub(super) fn begin_even_friction_at_uneven(
        &self,
        base: &Member,
        taken: Option<usize>,
        tried: &mut Vec<Tried>,
    ) {
        if self.is_over() {
            return;
        }
        let left = |tried: &Tried| tried.member.fitted.sum_of_squares;
        let even = tried.iter().filter_map(|richer| {
            let place = richer.member.laws.len() - 1;
            let candidate = self.even_for(&richer.member, place)?;
            if base.laws.contains(&candidate) || taken == Some(candidate) {
                return None;
            }
            let known = tried.iter().find(|known| known.candidate == candidate).map_or(f64::INFINITY, left);
            // Two forces always do a little better than one.
            if left(richer) > BARRED * known {
                return None;
            }
            let even = self.even_instead(&richer.member, place)?;
            (even.fitted.sum_of_squares < known).then(|| self.judged_on(base, even, candidate))
        });
        if let Some(best) = even.min_by(by_fit) {
            tried.retain(|known| known.candidate != best.candidate);
            tried.push(best);
        }
    }

    /// Whether a fit leaves more than noise of the training recordings. By innovations none does: what they
    /// are made of is as loud as noise by definition.
    pub(super) fn is_louder_than_noise(&self, fitted: &Fitted) -> bool {
        fitted.sum_of_squares > LOUD * self.study.stack(Role::Train).present() as f64
    }

    /// Two shapes may do the same to the recordings that a law is fitted to, and not to others: two waves
    /// over a travel of less than a period, say. The best of those that were tried is begun at its other
    /// shapes too before it is given up.
    pub(super) fn begin_the_best_elsewhere(
        &self,
        base: &Member,
        rival: &Member,
        screened: &[Screened],
        tried: &mut [Tried],
    ) {
        let Some(best) = tried.iter_mut().min_by(|a, b| by_fit(a, b)) else { return };
        let seen = screened.iter().find(|seen| seen.candidate == best.candidate);
        let Some(seen) = seen.filter(|_| self.deserves_more(best)) else { return };
        let (absorbing, own) = directions(&self.study.stack(Role::Train), base);
        let elsewhere = seen.others.par_iter().filter_map(|(trial, factor)| {
            let at = Screened { trial: trial.clone(), factor: *factor, others: Vec::new(), ..seen.clone() };
            let physics = self.sketch(base, &at, Others::Absorb(&absorbing))?.physics;
            let begun = self.begun(base, &at, &physics, Others::Known(&own))?;
            self.try_on(rival, &at, &begun).filter(Tried::passes)
        });
        let elsewhere = elsewhere.collect::<Vec<Tried>>().into_iter().min_by(by_fit);
        if let Some(found) = elsewhere.or_else(|| self.at_another_period(rival, best)) {
            *best = found;
        }
    }

    /// A wave as it passes at a simple ratio of its period: over a travel of a few periods one does much of
    /// what the other does, and a fit ends in the one beside which it began.
    fn at_another_period(&self, rival: &Member, wave: &Tried) -> Option<Tried> {
        let place = wave.member.laws.len() - 1;
        let law = wave.member.fitted.hypothesis.model.setup().physics.get(self.given_laws + place)?;
        let at_ratio = |ratios: &[f64; 2]| {
            let begun: Vec<Member> = other_periods(law, ratios)
                .par_iter()
                .filter_map(|other| self.exchanged(&wave.member, place, wave.candidate, other))
                .collect();
            let best = begun
                .into_iter()
                .min_by(|a, b| a.fitted.sum_of_squares.total_cmp(&b.fitted.sum_of_squares))
                .filter(|best| best.fitted.sum_of_squares < wave.member.fitted.sum_of_squares)?;
            Some(self.judged_on(rival, self.finished(best), wave.candidate)).filter(Tried::passes)
        };
        PERIOD_RATIOS.iter().take_while(|_| !self.is_over()).find_map(at_ratio)
    }

    /// Whether a law that does not pass is beyond doubt in training, and all that speaks against it may be
    /// that its fit is no good yet.
    fn deserves_more(&self, tried: &Tried) -> bool {
        let beyond_doubt = tried.training.t() > DOUBT * self.options.training_gate;
        !tried.passes() && tried.may_lack_another() && beyond_doubt && !self.is_over()
    }
}

/// Ratios at which a wave does much of what another does, the likeliest first.
const PERIOD_RATIOS: [[f64; 2]; 2] = [[2.0, 0.5], [1.5, 2.0 / 3.0]];

/// A wave at these multiples of its period, wherever it begins; none of what is no wave.
fn other_periods(law: &Physics, ratios: &[f64; 2]) -> Vec<Physics> {
    let Some(&period) = law.parameters.get("period") else { return Vec::new() };
    let wave = |times: f64, quarter: i32| {
        law.clone().with("period", times * period).with("phase", FRAC_PI_2 * f64::from(quarter))
    };
    ratios.iter().flat_map(|&times| (0..4).map(move |quarter| wave(times, quarter))).collect()
}

/// A fit of even friction has stopped on its way where a richer law leaves less than this share of what it
/// leaves.
const BARRED: f64 = 0.9;
/// Share of what the best law takes away that another has to take to be fitted to the end as well.
const AS_GOOD: f64 = 0.95;

/// Takes over what is better of what was found, law by law.
pub(super) fn take_better(tried: &mut Vec<Tried>, around: Vec<Tried>) {
    for found in around {
        let known = tried.iter().position(|tried| tried.candidate == found.candidate);
        match known.map(|place| &mut tried[place]) {
            Some(known) if is_better(&found, known) => *known = found,
            Some(_) => {}
            None => tried.push(found),
        }
    }
}

/// Whether a law does better, the gates first.
fn is_better(found: &Tried, known: &Tried) -> bool {
    let left = |tried: &Tried| tried.member.fitted.sum_of_squares;
    match (found.passes(), known.passes()) {
        (true, false) => true,
        (false, true) => false,
        _ => left(found) < left(known),
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::catalogue::Trial;

    use super::*;
    use crate::naming::on_a_spring::{fitted_with, machine, noisy_runs, searched, stopped_at};
    use crate::result::Gate;

    #[test]
    fn a_wave_that_fails_held_out_is_begun_at_its_other_periods() {
        let wave = |period: f64, force: f64| {
            Physics::new("cogging", "mass").with("force", force).with("period", period).with("phase", 0.4)
        };
        let mut truth = machine();
        truth.setup_mut().physics = vec![wave(0.025, 0.7)];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
            let wrong = fitted_with(search, &refitted, &wave(0.11, 0.5));
            let candidate = wrong.laws[0];
            let mut tried = [search.judged_on(&refitted, wrong, candidate)];
            assert!(tried[0].gates.iter().any(|gate| gate.name == "held out" && !gate.passed));
            // As if training left no doubt, as it does where it shows less than a period.
            tried[0].training.z = 50.0;
            tried[0].gates.retain(|gate| gate.name != "training");
            assert!(search.deserves_more(&tried[0]), "{:?}", tried[0].gates);
            let trial = |period: f64| Trial {
                amplitudes: vec![("force", 0.5)],
                shapes: vec![("period", period), ("phase", 0.4)],
            };
            let seen = Screened {
                candidate,
                trial: trial(0.11),
                factor: 1.0,
                t: 10.0,
                hidden: 0.0,
                explained: 1.0,
                direction: Vec::new(),
                others: vec![(trial(0.06), 1.0), (trial(0.0255), 1.0)],
            };
            search.begin_the_best_elsewhere(&refitted, &refitted, &[seen], &mut tried);
            let law = &tried[0].member.fitted.hypothesis.model.setup().physics[0];
            assert!(tried[0].passes(), "{:?}", tried[0].gates);
            assert!((law.parameters["period"] / 0.025 - 1.0).abs() < 1e-2, "{law:?}");
        });
    }

    fn friction(force: f64) -> Physics {
        Physics::new("coulomb_friction", "mass").with("force", force)
    }

    /// Does something beside the refit to runs of a machine with this law.
    fn beside_the_refit<T>(law: Physics, look: impl FnOnce(&mut Search<'_>, Member) -> T) -> T {
        let mut truth = machine();
        truth.setup_mut().physics = vec![law];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), look)
    }

    #[test]
    fn what_passes_and_leaves_more_than_noise_is_fitted_to_the_end() {
        let spring = |stiffness: f64| Physics::new("cubic_stiffness", "mass").with("stiffness", stiffness);
        beside_the_refit(spring(3e4), |search, refitted| {
            let right = fitted_with(search, &refitted, &spring(2e4));
            let right = search.weighed_again(right);
            let refitted = search.reweighted(refitted).unwrap();
            let short =
                stopped_at(search, &right, |path| if path.starts_with("physics.") { 0.95 } else { 1.0 });
            let candidate = right.laws[0];
            let mut tried = [search.judged_on(&refitted, short, candidate)];
            assert!(tried[0].passes(), "{:?}", tried[0].gates);
            assert!(search.is_louder_than_noise(&tried[0].member.fitted));
            search.settle_those_as_good(&refitted, &mut tried);
            assert!(!search.is_louder_than_noise(&tried[0].member.fitted));
            let law = &tried[0].member.fitted.hypothesis.model.setup().physics[0];
            assert!((law.parameters["stiffness"] / 3e4 - 1.0).abs() < 0.01, "{law:?}");
        });
    }

    #[test]
    fn even_friction_is_begun_where_uneven_friction_has_found_its_way() {
        let uneven = |forward: f64, backward: f64| {
            Physics::new("asymmetric_friction", "mass")
                .with("force_forward", forward)
                .with("force_backward", backward)
        };
        beside_the_refit(friction(1.2), |search, refitted| {
            let there = fitted_with(search, &refitted, &uneven(1.0, 1.0));
            let candidate = there.laws[0];
            let richer = search.judged_on(&refitted, there, candidate);
            let begun_again = |tried: &[Tried], taken: Option<usize>| {
                let mut tried = tried.to_vec();
                search.begin_even_friction_at_uneven(&refitted, taken, &mut tried);
                tried
            };
            let found = begun_again(std::slice::from_ref(&richer), None);
            let even = found.iter().find(|tried| tried.candidate != richer.candidate).expect("even friction");
            let law = &even.member.fitted.hypothesis.model.setup().physics[0];
            assert_eq!(law.id, "coulomb_friction");
            assert!((law.parameters["force"] / 1.2 - 1.0).abs() < 0.01, "{law:?}");
            assert!(even.passes(), "{:?}", even.gates);
            assert_eq!(
                begun_again(std::slice::from_ref(&richer), Some(even.candidate)).len(),
                1,
                "its place is taken"
            );
            assert_eq!(begun_again(&found, None).len(), 2, "as good as it gets already");
        });
    }

    #[test]
    fn a_wave_at_a_ratio_of_its_period_is_left_for_the_one_that_passes() {
        let wave = |period: f64, force: f64| {
            Physics::new("cogging", "mass").with("force", force).with("period", period).with("phase", 0.4)
        };
        for (truth, times) in [(0.06, 0.5), (0.03, 2.0), (0.03, 1.5), (0.06, 2.0 / 3.0)] {
            beside_the_refit(wave(truth, 0.7), |search, refitted| {
                let found = fitted_with(search, &refitted, &wave(truth, 0.5));
                let at_ratio = |path: &str| if path.ends_with("period") { times } else { 1.0 };
                let wrong = stopped_at(search, &found, at_ratio);
                let law = |set: &Member| set.fitted.hypothesis.model.setup().physics[0].clone();
                let candidate = wrong.laws[0];
                let mut tried = [search.judged_on(&refitted, wrong, candidate)];
                // As if it had been fitted there, and only what is held out spoke against it.
                tried[0].training.z = 50.0;
                tried[0].gates =
                    vec![Gate { name: "held out".to_owned(), passed: false, detail: String::new() }];
                let seen = Screened {
                    candidate,
                    trial: Trial { amplitudes: vec![("force", 0.5)], shapes: vec![("period", truth)] },
                    factor: 1.0,
                    t: 10.0,
                    hidden: 0.0,
                    explained: 1.0,
                    direction: Vec::new(),
                    others: Vec::new(),
                };
                search.begin_the_best_elsewhere(&refitted, &refitted, &[seen], &mut tried);
                assert!(tried[0].passes(), "{:?}", tried[0].gates);
                let period = law(&tried[0].member).parameters["period"];
                assert!((period / truth - 1.0).abs() < 1e-2, "{period} m");
            });
        }
    }

    #[test]
    fn what_is_no_wave_has_no_other_period() {
        assert!(other_periods(&friction(1.0), &PERIOD_RATIOS[0]).is_empty());
    }
}
