//! Other valleys of a law that was found.
//!
//! What a law leaves over as a function of its shape has more than one valley: a wave of another period that stays in step for part of the
//! travel, a contact on the other side of the rest, friction that is stronger the other way. The screen picks the valley from
//! around a model that lacks the law, and that model moves otherwise than the machine. With the law, even in the wrong valley, the
//! motion is nearly right: what is left then shows the law a second time, at another shape. Each law of a set that leaves more than noise is
//! begun there, and turned around, and the set is kept in whichever valley fits best.

use std::slice::from_ref;

use stillbeam_plant::Physics;
use stillbeam_recording::Role;

use super::screening::{Leaving, Screened, screen};
use super::selection::Search;
use super::sets::Member;
use crate::adequacy::Rest;

/// A second instance of a law is begun where the screen is so many standard errors certain of it.
const SEEN_AGAIN: f64 = 3.0;

impl Search<'_> {
    /// The set with its laws in the valleys that fit best, of those that can be seen from here.
    pub(super) fn in_the_deepest_valleys(&self, mut member: Member) -> Member {
        for candidate in member.laws.clone() {
            if self.is_over() {
                break;
            }
            member = self.in_a_deeper_valley(&member, candidate).unwrap_or(member);
        }
        member
    }

    /// The set with one of its laws in another valley that fits better; `None` where none is seen, and where the set leaves
    /// no more than noise.
    fn in_a_deeper_valley(&self, member: &Member, candidate: usize) -> Option<Member> {
        let place = member.laws.iter().position(|law| *law == candidate)?;
        if self.rest(member) == Rest::Noise {
            return None;
        }
        let others = self.seen_again(member, place).into_iter().chain(self.turned_around(member, place));
        let best = others.min_by(|a, b| a.fitted.sum_of_squares.total_cmp(&b.fitted.sum_of_squares))?;
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
        self.exchanged(member, place, candidate, &physics)
    }

    /// The set with the law as it would be on a machine turned around.
    fn turned_around(&self, member: &Member, place: usize) -> Option<Member> {
        let law = member.fitted.hypothesis.model.setup().physics.get(self.given_laws + place)?;
        self.exchanged(member, place, member.laws[place], &turned(law)?)
    }
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
    use crate::fit::Others;
    use crate::naming::on_a_spring::{machine, noisy_runs, searched};
    use crate::naming::trials::Candidate;

    const NOISE_M: f64 = 1e-5;

    /// A set of one law: as fitted from `begun` to runs of a machine that has `true_law`, and in the deepest valley seen from there.
    fn from_a_wrong_valley(true_law: &Physics, begun: &Physics) -> [Physics; 2] {
        let mut truth = machine();
        truth.setup_mut().physics = vec![true_law.clone()];
        let train = noisy_runs(&truth, &[3.0, 9.0], NOISE_M);
        searched(&train, &noisy_runs(&truth, &[5.0], NOISE_M), |search, refitted| {
            let is_it = |c: &Candidate| c.law.id() == begun.id && c.location == begun.location;
            let candidate = search.candidates.iter().position(is_it).unwrap();
            let names = search.candidates[candidate].amplitude_names();
            let fitted = search.extended(&refitted, candidate, begun, 1, &names, Others::Searched).unwrap();
            let wrong = search.finished(search.member(vec![candidate], fitted).unwrap());
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
