//! Other valleys of a law that was found.
//!
//! What a law leaves over as a function of its shape has more than one valley: a wave of another period that
//! stays in step for part of the travel, a contact on the other side of the rest, friction that is stronger
//! the other way. The screen picks the valley from around a model that lacks the law, and that model moves
//! otherwise than the machine. With the law, even in the wrong valley, the motion is nearly right: what is
//! left then shows the law a second time, at another shape. Each law of a set that leaves more than noise is
//! begun there, and turned around, and the set is kept in whichever valley fits best. So are a cable that
//! pulls towards another place and friction with a dip at low speed, begun from the cable and the dry
//! friction that were found: begun from nothing, the fit of the richer law often stops on its way.
//!
//! So is the law at another place of the machine, where most of what is recorded may look the same.
//!
//! A law that decides when something happens, play or a stop, has as many valleys as moments: the fit is made
//! anew from the beginnings of the recordings, where few have come, and led across them by large differences.
//!
//! The model's own parameters have valleys too: a beam that is twice as thick at one end and half as stiff
//! rings at nearly the same two frequencies. Where one went there to make up for a law that was not found
//! yet, the laws are fitted from the drawing.

use std::slice::from_ref;

use stillbeam_plant::{Model, Physics, StateSpace};
use stillbeam_recording::Role;

use super::screening::{Leaving, Screened, screen};
use super::selection::Search;
use super::sets::Member;
use super::trials::Candidate;
use crate::adequacy::Rest;
use crate::effort::Effort;
use crate::fit::Others;
use crate::refit::{is_far_anywhere, refit_from_drawing};
use crate::simulation::Hypothesis;

/// Friction with a dip is begun with forces this share of dry friction below it and above.
const DIP: f64 = 0.3;

/// A law in another place is fitted to the end where so far it leaves less than this many times the squares.
const NEAR: f64 = 4.0;

/// A second instance of a law is begun where the screen is so many standard errors certain of it.
const SEEN_AGAIN: f64 = 3.0;

impl Search<'_> {
    /// The set with its laws in the valleys that fit best, of those that can be seen from here.
    pub(super) fn in_the_deepest_valleys(&self, member: Member) -> Member {
        let member = self.nearer_the_drawing(&member).unwrap_or(member);
        let mut member = self.across_the_jags(&member).unwrap_or(member);
        for candidate in member.laws.clone() {
            if self.is_over() {
                break;
            }
            member = self.in_a_deeper_valley(&member, candidate).unwrap_or(member);
        }
        member
    }

    /// The set fitted to the beginnings of the recordings first, and by differences so large that they look
    /// across the jags of its laws; `None` where it has none and drifts over no wave, leaves no more than
    /// noise, or gains nothing by it. A wave has no jags: where the travel was recorded it is read off there;
    /// else its fit is finished first, being in the right valley already, perhaps.
    pub(super) fn across_the_jags(&self, member: &Member) -> Option<Member> {
        if self.is_over() || self.rest(member) == Rest::Noise {
            return None;
        }
        if !self.drifts_over_a_wave(member) {
            let is_jagged = member.fitted.is_jagged(&self.study.stack(Role::Train));
            return if is_jagged { self.fitted_to_beginnings_first(member) } else { None };
        }
        if let Some(as_recorded) = self.waves_as_recorded(member) {
            return Some(self.finished(as_recorded));
        }
        let settled = self.finished(member.clone());
        if self.rest(&settled) == Rest::Noise {
            return Some(settled);
        }
        // From where it was: a fit that ends in a wrong valley is further from the right one.
        let longer = self.fitted_to_beginnings_first(member);
        let is_better = |longer: &Member| longer.fitted.sum_of_squares < settled.fitted.sum_of_squares;
        longer.filter(is_better).or(Some(settled))
    }

    /// The set fitted over a lengthening horizon, and across jags where that does not arrive; `None` where
    /// neither leaves less.
    fn fitted_to_beginnings_first(&self, member: &Member) -> Option<Member> {
        let stack = self.study.stack(Role::Train);
        let longer = member.fitted.over_a_lengthening_horizon(&stack, 0.0);
        let arrived = longer.as_ref().is_some_and(|longer| !self.is_louder_than_noise(longer));
        let rough = (!arrived).then(|| member.fitted.across_the_jags(&stack));
        let best = longer
            .into_iter()
            .chain(rough)
            .min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))
            .filter(|best| best.sum_of_squares < member.fitted.sum_of_squares)?;
        self.member(member.laws.clone(), best)
    }

    /// Whether a law of the set pushes by a wave over position a machine of which nothing holds the whole:
    /// see [`is_held`].
    fn drifts_over_a_wave(&self, member: &Member) -> bool {
        let model = &member.fitted.hypothesis.model;
        let mut laws = model.setup().physics.iter().skip(self.given_laws);
        laws.any(|law| law.parameters.contains_key("period")) && !is_held(model)
    }

    /// The set fitted from the drawing, where a parameter has moved by more than it can be wrong and need
    /// not, or fits worse for it.
    fn nearer_the_drawing(&self, member: &Member) -> Option<Member> {
        if member.laws.is_empty() || !is_far_anywhere(&member.fitted) || self.is_over() {
            return None;
        }
        let drawn = self.fitted_from_drawing(member, Effort::BENT)?;
        let gain = self.better_by(member, &drawn);
        let is_near = !is_far_anywhere(&drawn.fitted);
        (gain > self.options.separation || (is_near && gain > -self.options.separation)).then_some(drawn)
    }

    /// The set fitted from the drawing and the values that its laws have.
    pub(super) fn fitted_from_drawing(&self, member: &Member, effort: Effort) -> Option<Member> {
        let mut hypothesis = Hypothesis::given(self.given);
        hypothesis.model.setup_mut().physics = member.fitted.hypothesis.model.setup().physics.clone();
        let stack = self.study.stack(Role::Train);
        let drawn = refit_from_drawing(&stack, &hypothesis, &member.fitted, effort)?;
        self.member(member.laws.clone(), drawn)
    }

    /// The set with one of its laws in another valley that fits better; `None` where none is seen, and where
    /// the set leaves no more than noise.
    fn in_a_deeper_valley(&self, member: &Member, candidate: usize) -> Option<Member> {
        let place = member.laws.iter().position(|law| *law == candidate)?;
        if self.rest(member) == Rest::Noise {
            return None;
        }
        let others = self.seen_again(member, place).into_iter().chain(self.turned_around(member, place));
        let best = others
            .chain(self.with_a_dip(member, place))
            .chain(self.begun_anew(member, place))
            .min_by(|a, b| a.fitted.sum_of_squares.total_cmp(&b.fitted.sum_of_squares))?;
        (self.better_by(member, &best) > self.options.separation).then_some(best)
    }

    /// The set with the law where what is left shows it a second time.
    fn seen_again(&self, member: &Member, place: usize) -> Option<Member> {
        let candidate = member.laws[place];
        let own = &self.candidates[candidate];
        let has_shapes = own.trials.iter().any(|trial| !trial.shapes.is_empty());
        if !has_shapes {
            return None;
        }
        let stack = self.study.stack(Role::Train);
        let leaving = Leaving { least_explained: 0.0, is_given_up: &|| false };
        let seen = screen(&stack, &member.fitted, from_ref(own), self.study.slowest_hz, &leaving);
        let seen = Screened { candidate, ..seen.into_iter().next()? };
        if seen.t.abs() < SEEN_AGAIN {
            return None;
        }
        let physics = self.sketched_on_top(member, &seen)?;
        let own = member.fitted.hypothesis.model.setup().physics.get(self.given_laws + place)?;
        self.exchanged(member, place, candidate, &cables_together(own, &physics).unwrap_or(physics))
    }

    /// The set with dry friction as friction with a dip at low speed, the sharpness of which is tried as it
    /// is in a screen.
    fn with_a_dip(&self, member: &Member, place: usize) -> Option<Member> {
        let even = &self.candidates[member.laws[place]];
        let friction = member.fitted.hypothesis.model.setup().physics.get(self.given_laws + place)?;
        if friction.id != "coulomb_friction" {
            return None;
        }
        let force = *friction.parameters.get("force")?;
        let dip = self
            .candidates
            .iter()
            .position(|other| other.law.id() == "stribeck_friction" && other.location == even.location)?;
        let begun = self.candidates[dip].trials.iter().filter_map(|trial| {
            let mut law = self.candidates[dip].physics(trial, 1.0);
            law.parameters.insert("force".to_owned(), (1.0 - DIP) * force);
            law.parameters.insert("static_force".to_owned(), (1.0 + DIP) * force);
            self.exchanged(member, place, dip, &law)
        });
        begun.min_by(|a, b| a.fitted.sum_of_squares.total_cmp(&b.fitted.sum_of_squares))
    }

    /// The set with the law as it would be on a machine turned around, begun from the values that the set
    /// has.
    fn turned_around(&self, member: &Member, place: usize) -> Option<Member> {
        let law = member.fitted.hypothesis.model.setup().physics.get(self.given_laws + place)?;
        self.exchanged(member, place, member.laws[place], &turned(law)?)
    }

    /// The set with the law, as strong as it is, at another place of the machine or turned around, begun on
    /// top of the refit without it: what the model's own parameters have made up for at the wrong place, or
    /// on the wrong side, is no start at the right one. In a base's sweeps a spring at the tip does nearly
    /// what one between tip and base does, and the screen may rank the wrong one first; a base that stands
    /// elsewhere after a move tells them apart.
    fn begun_anew(&self, member: &Member, place: usize) -> Option<Member> {
        let law = member.fitted.hypothesis.model.setup().physics.get(self.given_laws + place)?;
        let here = member.laws[place];
        let own = &self.candidates[here];
        let is_it = |other: &Candidate| other.law.id() == own.law.id() && other.location != own.location;
        let elsewhere = (0..self.candidates.len())
            .filter(|&other| is_it(&self.candidates[other]) && !member.laws.contains(&other))
            .map(|other| {
                (other, Physics { location: self.candidates[other].location.clone(), ..law.clone() })
            });
        let laws: Vec<(usize, Physics)> = elsewhere.chain(turned(law).map(|turned| (here, turned))).collect();
        if laws.is_empty() {
            return None;
        }
        let without = self.without(member, place)?;
        let number = self.given_laws + without.laws.len() + 1;
        let there = laws.into_iter().filter_map(|(candidate, law)| {
            let amplitudes = self.candidates[candidate].amplitude_names();
            let begun = self.extended(&without, candidate, &law, number, &amplitudes, Others::Searched)?;
            let fitted = self.fitted_on(&begun, Effort::TRIAL).unwrap_or(begun);
            self.member([&without.laws[..], &[candidate]].concat(), fitted)
        });
        let best = there.min_by(|a, b| a.fitted.sum_of_squares.total_cmp(&b.fitted.sum_of_squares))?;
        let is_near = best.fitted.sum_of_squares < NEAR * member.fitted.sum_of_squares;
        is_near.then(|| self.finished(best))
    }
}

/// Whether springs hold all of a machine. Where it comes to lie on a wave depends on all the pushes before
/// otherwise, and a wave that is a little too short fits the later ones of a recording in one of many ways.
/// So does one from the hollows of which a loop pulls it.
pub(super) fn is_held(model: &Model) -> bool {
    let modes = StateSpace::new(model).and_then(|space| space.natural_modes());
    !modes.is_ok_and(|modes| modes.iter().any(|(frequency_hz, _)| *frequency_hz == 0.0))
}

/// Two cables at one place are one that pulls towards a place between; `None` for what is no cable.
fn cables_together(one: &Physics, other: &Physics) -> Option<Physics> {
    if one.id != "cable_spring" || other.id != one.id {
        return None;
    }
    let value = |law: &Physics, name: &str| law.parameters.get(name).copied().unwrap_or(0.0);
    let [k, other_k] = [one, other].map(|law| value(law, "stiffness"));
    let pulls = |law: &Physics| value(law, "stiffness") * value(law, "rest_position");
    let rest = (pulls(one) + pulls(other)) / (k + other_k);
    rest.is_finite().then(|| one.clone().with("stiffness", k + other_k).with("rest_position", rest))
}

/// A law on a machine whose axis points the other way; `None` where it is the same.
fn turned(law: &Physics) -> Option<Physics> {
    const CHANGE_SIGN: [&str; 4] = ["contact", "phase", "rest_position", "quadratic"];
    let mut turned = law.clone();
    // Stiffer on the one side is softer on the other, beside a stiffer spring.
    let is_one_sided = law.parameters.contains_key("contact");
    for name in CHANGE_SIGN.into_iter().chain(is_one_sided.then_some("stiffness")) {
        turned.parameters.entry(name.to_owned()).and_modify(|value| *value = -*value);
    }
    for kind in ["force", "viscous"] {
        let [forward, backward] = ["forward", "backward"].map(|way| format!("{kind}_{way}"));
        if let (Some(one), Some(other)) = (law.parameters.get(&forward), law.parameters.get(&backward)) {
            turned.parameters.insert(forward, *other);
            turned.parameters.insert(backward, *one);
        }
    }
    (turned != *law).then_some(turned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::naming::on_a_spring::{
        fitted_with, machine, noisy_runs, searched, searched_around, stopped_at, unheld,
    };
    use crate::two_bodies::{driven, slide, swept};

    const NOISE_M: f64 = 1e-5;

    /// A set of one law: as fitted from `begun` to runs of a machine that has `true_law`, and in the deepest
    /// valley seen from there.
    fn from_a_wrong_valley(true_law: &Physics, begun: &Physics) -> [Physics; 2] {
        let mut truth = machine();
        truth.setup_mut().physics = vec![true_law.clone()];
        let train = noisy_runs(&truth, &[3.0, 9.0], NOISE_M);
        searched(&train, &noisy_runs(&truth, &[5.0], NOISE_M), |search, refitted| {
            let wrong = fitted_with(search, &refitted, begun);
            let law = |member: &Member| member.fitted.hypothesis.model.setup().physics[0].clone();
            let right = search.finished(search.in_the_deepest_valleys(wrong.clone()));
            [law(&wrong), law(&right)]
        })
    }

    fn departure(law: &Physics, from: &Physics, name: &str) -> f64 {
        (law.parameters[name] / from.parameters[name] - 1.0).abs()
    }

    #[test]
    fn a_wave_of_the_wrong_period_is_left_for_the_one_that_the_rest_shows() {
        let wave = |period: f64, force: f64| {
            Physics::new("cogging", "mass").with("force", force).with("period", period).with("phase", 0.4)
        };
        let truth = wave(0.025, 0.7);
        for period in [0.11, 0.06] {
            let [wrong, right] = from_a_wrong_valley(&truth, &wave(period, 0.5));
            assert!(departure(&wrong, &truth, "period") > 0.1, "no other valley: {wrong:?}");
            assert!(departure(&right, &truth, "period") < 1e-3, "{right:?}");
            assert!(departure(&right, &truth, "force") < 1e-2, "{right:?}");
        }
    }

    /// Fitted to all at once, the period ends percents short.
    #[test]
    fn a_wave_over_the_travel_of_a_body_that_nothing_holds_is_found_from_the_beginnings_of_its_recordings() {
        let wave = |period: f64| {
            Physics::new("cogging", "mass").with("force", 0.37).with("period", period).with("phase", 0.2)
        };
        let truth = wave(0.047);
        let mut real = unheld();
        real.setup_mut().physics = vec![truth.clone()];
        let train = noisy_runs(&real, &[2.0, 4.0], 1e-4);
        searched_around(&unheld(), &train, &noisy_runs(&real, &[3.0], 1e-4), |search, refitted| {
            let law = |set: &Member| set.fitted.hypothesis.model.setup().physics[0].clone();
            for period in [0.030, 0.041] {
                let stuck = fitted_with(search, &refitted, &wave(period));
                assert!(departure(&law(&stuck), &truth, "period") > 0.03, "no other valley: {period}");
                let found = law(&search.fitted_to_beginnings_first(&stuck).unwrap());
                assert!(departure(&found, &truth, "period") < 1e-3, "{period}: {found:?}");
                assert!(departure(&found, &truth, "force") < 1e-2, "{period}: {found:?}");
            }
        });
    }

    #[test]
    fn only_a_machine_that_nothing_holds_drifts_over_a_wave() {
        let wave = Physics::new("cogging", "mass").with("force", 0.3).with("period", 0.05).with("phase", 0.2);
        let drag = Physics::new("quadratic_drag", "mass").with("drag", 2.0);
        for (given, law, drifts) in
            [(unheld(), &wave, true), (machine(), &wave, false), (unheld(), &drag, false)]
        {
            let mut real = given.clone();
            real.setup_mut().physics = vec![law.clone()];
            let train = noisy_runs(&real, &[2.0, 4.0], 1e-4);
            searched_around(&given, &train, &noisy_runs(&real, &[3.0], 1e-4), |search, refitted| {
                let set = fitted_with(search, &refitted, law);
                assert_eq!(search.drifts_over_a_wave(&set), drifts, "{law:?}");
            });
        }
    }

    #[test]
    fn a_contact_on_the_wrong_side_is_turned_around() {
        let contact = |at: f64, stiffness: f64| {
            Physics::new("bilinear_stiffness", "mass").with("contact", at).with("stiffness", stiffness)
        };
        for truth in [contact(0.02, 40.0), contact(-0.01, 60.0)] {
            let begun = turned(&truth).unwrap();
            let [wrong, right] = from_a_wrong_valley(&truth, &begun);
            assert!(departure(&wrong, &truth, "contact") > 0.5, "no other valley: {wrong:?}");
            assert!(departure(&right, &truth, "contact") < 0.02, "{right:?}");
            assert!(departure(&right, &truth, "stiffness") < 0.02, "{right:?}");
        }
    }

    /// With a joint that gives way on the wrong side the model's own parameters go where the law turned
    /// around finds no way.
    #[test]
    fn a_law_turned_around_is_begun_beside_the_machine_without_it_too() {
        let truth = Physics::new("bilinear_stiffness", "mass").with("contact", 0.02).with("stiffness", 40.0);
        let mut real = machine();
        real.setup_mut().physics = vec![truth.clone()];
        let train = noisy_runs(&real, &[3.0, 9.0], NOISE_M);
        searched(&train, &noisy_runs(&real, &[5.0], NOISE_M), |search, refitted| {
            let around = turned(&truth).unwrap();
            let wrong = fitted_with(search, &refitted, &around);
            let law = |set: &Member| set.fitted.hypothesis.model.setup().physics[0].clone();
            for times in [0.5, 1.4, 2.0] {
                let gone = |path: &str| if path.starts_with("spring.") { times } else { 1.0 };
                let astray = stopped_at(search, &wrong, gone);
                let at_once = search.turned_around(&astray, 0).unwrap();
                assert!(departure(&law(&at_once), &truth, "stiffness") > 0.5, "found anyway");
                let right = law(&search.begun_anew(&astray, 0).unwrap());
                assert!(departure(&right, &truth, "stiffness") < 0.02, "{right:?}");
                assert!(departure(&right, &truth, "contact") < 0.02, "{right:?}");
            }
        });
    }

    #[test]
    fn two_cables_are_one_that_pulls_towards_a_place_between() {
        let cable = |stiffness: f64, rest: f64| {
            Physics::new("cable_spring", "mass").with("stiffness", stiffness).with("rest_position", rest)
        };
        let both = cables_together(&cable(600.0, 0.0), &cable(0.05, -120.0)).unwrap();
        assert!((both.parameters["stiffness"] - 600.05).abs() < 1e-9);
        assert!((both.parameters["rest_position"] + 6.0 / 600.05).abs() < 1e-12, "the pull is that of both");
        let unmoved = Physics::new("cable_spring", "mass").with("stiffness", 600.0);
        assert_eq!(cables_together(&unmoved, &cable(200.0, 0.04)).unwrap().parameters["rest_position"], 0.01);
        assert_eq!(cables_together(&unmoved, &Physics::new("cubic_stiffness", "mass")), None);
    }

    #[test]
    fn dry_friction_that_leaves_more_than_noise_is_tried_with_a_dip() {
        let mut truth = machine();
        let dip = Physics::new("stribeck_friction", "mass")
            .with("force", 0.6)
            .with("static_force", 1.4)
            .with("velocity", 0.05);
        truth.setup_mut().physics = vec![dip];
        let train = noisy_runs(&truth, &[3.0, 9.0], NOISE_M);
        let (id, parameters) = searched(&train, &noisy_runs(&truth, &[5.0], NOISE_M), |search, refitted| {
            let law = Physics::new("coulomb_friction", "mass").with("force", 0.8);
            let set = fitted_with(search, &refitted, &law);
            let found = search.finished(search.in_the_deepest_valleys(set));
            let law = found.fitted.hypothesis.model.setup().physics[0].clone();
            (law.id, law.parameters)
        });
        assert_eq!(id, "stribeck_friction");
        assert!((parameters["static_force"] / 1.4 - 1.0).abs() < 0.05, "{parameters:?}");
    }

    #[test]
    fn a_parameter_that_went_far_before_its_law_was_found_comes_back_to_the_drawing() {
        let mut truth = machine();
        truth.set_parameter("body.mass.mass", 2.1).unwrap();
        let friction = Physics::new("coulomb_friction", "mass").with("force", 1.2);
        truth.setup_mut().physics = vec![friction.clone()];
        let train = noisy_runs(&truth, &[3.0, 9.0], NOISE_M);
        searched(&train, &noisy_runs(&truth, &[5.0], NOISE_M), |search, refitted| {
            let near = fitted_with(search, &refitted, &friction);
            assert!(search.nearer_the_drawing(&near).is_none(), "nothing went far");
            let far = stopped_at(search, &near, |_| 1.6);
            let back = search.nearer_the_drawing(&far).expect("the drawing is a better start");
            let mass = back.fitted.hypothesis.model.parameter("body.mass.mass").unwrap();
            let force = back.fitted.hypothesis.model.setup().physics[0].parameters["force"];
            assert!((mass / 2.1 - 1.0).abs() < 0.01, "{mass} kg");
            assert!((force / 1.2 - 1.0).abs() < 0.02, "{force} N");
        });
    }

    #[test]
    fn a_law_found_at_the_wrong_place_is_tried_at_the_others() {
        let spring = |location: &str, k: f64| Physics::new("cubic_stiffness", location).with("stiffness", k);
        let truth = slide(20_000.0, &[spring("motor", 3e6)]);
        let run = |amplitude: f64, seed: u64| driven(&truth, &swept(amplitude), None, seed);
        let (train, held_out) = ([run(40.0, 1), run(120.0, 2)], [run(80.0, 3)]);
        searched_around(&slide(20_000.0, &[]), &train, &held_out, |search, refitted| {
            let wrong = fitted_with(search, &refitted, &spring("load", 2e6));
            let law = |member: &Member| member.fitted.hypothesis.model.setup().physics[0].clone();
            assert_eq!(law(&wrong).location, "load");
            let right = search.finished(search.in_the_deepest_valleys(wrong));
            assert_eq!(law(&right).location, "motor");
            assert!(departure(&law(&right), &spring("motor", 3e6), "stiffness") < 0.02, "{:?}", law(&right));
        });
    }

    #[test]
    fn a_law_turned_around_twice_is_the_law_and_what_looks_the_same_is_not_begun_again() {
        let law = Physics::new("asymmetric_friction", "mass")
            .with("force_forward", 1.0)
            .with("force_backward", 3.0);
        let around = turned(&law).unwrap();
        assert_eq!((around.parameters["force_forward"], around.parameters["force_backward"]), (3.0, 1.0));
        assert_eq!(turned(&around).unwrap(), law);
        assert_eq!(turned(&Physics::new("coulomb_friction", "mass").with("force", 1.0)), None);
    }
}
