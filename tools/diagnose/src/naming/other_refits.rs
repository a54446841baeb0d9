//! Refits around which the first law is looked for when little came of looking around the refit.
//!
//! The screen looks around a fitted model. Two ways in which the refit of everything to all recordings is no
//! good place for that, and what is fitted instead:
//!
//! - It has made up for the law with another machine: a beam whose frequencies rise with the amplitude became
//!   one of another taper, around which the cubic spring does nothing. *Within the drawing* no parameter
//!   leaves the range in which its given value can be wrong; what the law does then stays visible.
//! - One recording shows the law so strongly that no parameters explain any recording any more: a base that
//!   hits its stop in one run of three ends metres from where a linear one would. *Of the linear recordings*
//!   is the refit to those that one linear machine explains, as somebody would who identifies at small
//!   amplitudes and then looks at the large ones.
//!
//! Last, where nothing that was found takes away so much that it would be named by itself, the force that the
//! refit of everything lacks is looked at itself ([`super::by_latent_force`]).
//!
//! What is found there has to pass its gates against the refit to everything all the same.

use rayon::prelude::*;
use stillbeam_identify::tall::dot;
use stillbeam_recording::Role;

use super::rounds::{Beside, Tried};
use super::selection::Search;
use super::sets::Member;
use crate::adequacy::Rest;
use crate::fit::{Fitted, LOUD};
use crate::parameters::free_parameters;
use crate::refit::{refit, refit_within_drawing};
use crate::simulation::Hypothesis;
use crate::stacking::{RecordFit, Stack};
use crate::verdict::MOST_OF_ITS_OWN;

/// Recordings that a refit of their own explains so many times better, in mean squares, have been spoilt by
/// the others.
const SPOILT: f64 = 4.0;
/// Recordings are explained by one linear machine when together they leave no more than this many times what
/// each leaves alone.
const TOGETHER: f64 = 2.0;

impl Search<'_> {
    /// What was tried around the refit, and what is better around others, where nothing that was tried will
    /// do.
    pub(super) fn tried_around_other_refits(&self, refitted: &Member, mut tried: Vec<Tried>) -> Vec<Tried> {
        for other in [Self::within_the_drawing, Self::of_the_linear_recordings] {
            if self.is_over() || self.is_explained(&tried) {
                break;
            }
            let Some(other) = other(self, refitted) else { continue };
            let beside = Beside { rival: refitted, drawing: None, place: None };
            let (_, around) = self.tried_around(&other, beside);
            take_better(&mut tried, around);
            if !self.is_explained(&tried) {
                take_better(&mut tried, self.tried_by_latent_force(&other, refitted));
            }
        }
        let is_missing_most = self.rest(refitted) != Rest::Noise && !self.takes_most(refitted, &tried);
        if is_missing_most && !self.is_over() {
            take_better(&mut tried, self.tried_by_latent_force(refitted, refitted));
        }
        tried
    }

    /// Whether one of the laws passes its gates and takes so much away that it would be named by itself.
    fn takes_most(&self, refitted: &Member, tried: &[Tried]) -> bool {
        let samples = self.study.stack(Role::Train).present() as f64;
        let left = |member: &Member| member.fitted.sum_of_squares;
        // Where the noise is known from the refit alone, what that leaves is as loud as noise, whatever it
        // is.
        let noise = if left(refitted) > LOUD * samples { samples } else { 0.0 };
        let most = MOST_OF_ITS_OWN * (left(refitted) - noise);
        tried.iter().any(|tried| tried.passes() && left(refitted) - left(&tried.member) > most)
    }

    /// Whether one of the laws passes its gates, and leaves nothing to explain or the machine as drawn: then
    /// another law is missing beside it, which is looked for in the next round. What is louder than noise may
    /// be a law's that looks like none beside another machine.
    fn is_explained(&self, tried: &[Tried]) -> bool {
        let leaves_little = |member: &Member| {
            self.rest(member) != Rest::Structured && !self.is_louder_than_noise(&member.fitted)
        };
        let settles = |member: &Member| leaves_little(member) || !self.moved_far(&member.fitted);
        tried.iter().any(|tried| tried.passes() && settles(&tried.member))
    }

    /// The refit that stays where the drawing can be wrong, where the refit of everything did not.
    fn within_the_drawing(&self, refitted: &Member) -> Option<Member> {
        if !self.moved_far(&refitted.fitted) {
            return None;
        }
        let stack = self.study.stack(Role::Train);
        let within = refit_within_drawing(&stack, &Hypothesis::given(self.given))?;
        self.member(Vec::new(), within)
    }

    /// The refit to the training recordings that one linear machine explains; `None` where the refit to all
    /// of them explains each as well, as it does where it leaves nothing but noise.
    fn of_the_linear_recordings(&self, refitted: &Member) -> Option<Member> {
        if self.rest(refitted) == Rest::Noise {
            return None;
        }
        let all = self.study.stack(Role::Train);
        let alone: Vec<Option<Fitted>> =
            (0..all.records.len()).into_par_iter().map(|number| self.refit_to(&all, &[number])).collect();
        // Mean squares that each recording's own refit leaves of it.
        let own: Vec<f64> = alone
            .iter()
            .map(|fitted| fitted.as_ref().map_or(f64::INFINITY, |fitted| mean_square(&fitted.records[0])))
            .collect();
        let best = (0..own.len()).min_by(|&a, &b| own[a].total_cmp(&own[b]))?;
        if mean_square(&refitted.fitted.records[best]) < SPOILT * own[best] {
            return None;
        }
        let mut fitted = alone.into_iter().nth(best)??;
        let mut chosen = vec![best];
        for number in (0..own.len()).filter(|&number| number != best && own[number].is_finite()) {
            let more = [&chosen[..], &[number]].concat();
            let Some(joint) = self.refit_to(&all, &more) else { continue };
            let mut explained = more.iter().zip(&joint.records);
            if explained.all(|(&number, fit)| mean_square(fit) < TOGETHER * own[number]) {
                (fitted, chosen) = (joint, more);
            }
        }
        if chosen.len() == own.len() {
            return None;
        }
        let records = all.evaluate(&fitted.hypothesis, &[])?;
        let sum_of_squares = records.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum();
        self.member(Vec::new(), Fitted { records, sum_of_squares, ..fitted })
    }

    /// The model refitted to some of the recordings.
    fn refit_to(&self, all: &Stack<'_>, numbers: &[usize]) -> Option<Fitted> {
        let given = Hypothesis::given(self.given);
        refit(&part(all, numbers), &given, &free_parameters(&given)).ok().map(|(fitted, _)| fitted)
    }
}

fn mean_square(fit: &RecordFit) -> f64 {
    dot(&fit.residuals, &fit.residuals) / fit.residuals.len().max(1) as f64
}

/// Some of the recordings of a stack.
fn part<'r>(all: &Stack<'r>, numbers: &[usize]) -> Stack<'r> {
    Stack {
        records: numbers.iter().map(|&number| all.records[number]).collect(),
        weights: numbers.iter().map(|&number| all.weights[number].clone()).collect(),
        patience: all.patience,
    }
}

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
    use stillbeam_plant::{Model, Physics};

    use super::*;
    use crate::naming::on_a_spring::{fitted_with, machine, noisy_runs, searched, stopped_at};
    use crate::noise::NoiseFloor;

    const NOISE_M: f64 = 1e-5;

    /// The machine 3 % softer than given, with laws.
    fn softer(laws: Vec<Physics>) -> Model {
        let mut truth = machine();
        truth.set_parameter("spring.mass-ground.stiffness", 291.0).unwrap();
        truth.setup_mut().physics = laws;
        truth
    }

    #[test]
    fn a_run_that_hits_a_stop_is_left_out_of_the_refit_to_the_linear_ones() {
        let stop = Physics::new("end_stop", "mass").with("distance", 0.06).with("stiffness", 3e4);
        let refit_of_linear = |laws: Vec<Physics>| {
            let truth = softer(laws);
            let train = noisy_runs(&truth, &[1.0, 9.0, 1.5], NOISE_M);
            searched(&train, &noisy_runs(&truth, &[8.0], NOISE_M), |search, refitted| {
                let stiffness = |member: &Member| {
                    member.fitted.hypothesis.model.parameter("spring.mass-ground.stiffness").unwrap()
                };
                (stiffness(&refitted), search.of_the_linear_recordings(&refitted).as_ref().map(stiffness))
            })
        };
        let (of_all, of_linear) = refit_of_linear(vec![stop]);
        assert!((of_all - 291.0).abs() > 5.0, "all runs: {of_all} N/m");
        let of_linear = of_linear.expect("two runs do not touch the stop");
        assert!((of_linear - 291.0).abs() < 0.5, "{of_linear} N/m");
        assert_eq!(refit_of_linear(Vec::new()).1, None, "nothing is missing");
    }

    #[test]
    fn a_refit_within_the_drawing_stays_there_and_is_made_where_the_other_did_not() {
        let within = |damping: f64| {
            let mut truth = softer(Vec::new());
            truth.set_parameter("damper.mass-ground.damping", damping).unwrap();
            let train = noisy_runs(&truth, &[1.0, 2.0], NOISE_M);
            searched(&train, &noisy_runs(&truth, &[1.5], NOISE_M), |search, refitted| {
                let damping = |member: Member| {
                    assert!(
                        member.fitted.free.iter().all(|free| free.upper > 3.0 * free.given),
                        "free again"
                    );
                    member.fitted.hypothesis.model.parameter("damper.mass-ground.damping").unwrap()
                };
                search.within_the_drawing(&refitted).map(damping)
            })
        };
        let bound = within(9.0).expect("three times the damping is another damper");
        assert!((bound - 6.0).abs() < 1e-6, "damping is known to a factor of two: {bound} N s/m");
        assert_eq!(within(4.0), None, "the refit did not go that far");
    }

    #[test]
    fn a_law_takes_most_away_where_it_takes_three_quarters_and_passes() {
        let spring = Physics::new("cubic_stiffness", "mass").with("stiffness", 3e4);
        let truth = softer(vec![spring.clone()]);
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, NOISE_M);
        searched(&noisy(&[3.0, 6.0]), &noisy(&[4.5]), |search, refitted| {
            let settled = fitted_with(search, &refitted, &spring);
            let judged = |set: Member| {
                let candidate = set.laws[0];
                let mut tried = search.judged_on(&refitted, set, candidate);
                tried.gates.iter_mut().for_each(|gate| gate.passed = true);
                tried
            };
            let stopped_by = |part: f64| {
                let of_law = |path: &str| if path.starts_with("physics.") { part } else { 1.0 };
                judged(stopped_at(search, &settled, of_law))
            };
            let (most, little) = (stopped_by(1.0), stopped_by(0.85));
            let share =
                |tried: &Tried| 1.0 - tried.member.fitted.sum_of_squares / refitted.fitted.sum_of_squares;
            assert!(share(&most) > 0.9 && (0.1..0.7).contains(&share(&little)));
            assert!(search.takes_most(&refitted, std::slice::from_ref(&most)));
            assert!(!search.takes_most(&refitted, &[little]));
            let mut refused = most;
            refused.gates[0].passed = false;
            assert!(!search.takes_most(&refitted, &[refused]), "it does not pass");
        });
    }

    #[test]
    fn a_law_beside_another_machine_explains_nothing_that_is_louder_than_noise() {
        let spring = Physics::new("cubic_stiffness", "mass").with("stiffness", 3e4);
        let is_explained = |damping: f64| {
            let mut truth = machine();
            truth.set_parameter("damper.mass-ground.damping", damping).unwrap();
            truth.setup_mut().physics = vec![spring.clone()];
            // Louder than what a spline through the force's samples and straight lines between them make of
            // it.
            let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 30.0 * NOISE_M);
            searched(&noisy(&[3.0, 6.0]), &noisy(&[4.5]), |search, refitted| {
                let set = search.weighed_again(fitted_with(search, &refitted, &spring));
                // As if repeats had shown that the noise is a third of what is left.
                let third = |floor: &NoiseFloor| NoiseFloor { rms: floor.rms / 3.0, ..*floor };
                let floors: Vec<Option<NoiseFloor>> =
                    search.floors.iter().map(|floor| floor.as_ref().map(third)).collect();
                search.study.weigh_by_floors(&floors);
                let [set, refitted] = [set, refitted].map(|member| search.reweighted(member).unwrap());
                assert!(search.is_louder_than_noise(&set.fitted));
                assert_ne!(search.rest(&set), Rest::Structured);
                let candidate = set.laws[0];
                let tried = search.judged_on(&refitted, set, candidate);
                assert!(tried.passes(), "{:?}", tried.gates);
                search.is_explained(&[tried])
            })
        };
        assert!(is_explained(3.0), "the machine as drawn");
        assert!(!is_explained(9.0), "a damper three times the drawn one");
    }
}
