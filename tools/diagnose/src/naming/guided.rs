//! Where laws are looked for beside a machine that is held to what was recorded.
//!
//! A law that changes the motion beyond recognition, a spring that hardens by as much as it has for one, is
//! not seen around a refit: that is out of step with the recordings, and small changes of it are out of step
//! as well. Springs and dampers to the recorded motion hold the machine as drawn in step
//! ([`Guide`](stillbeam_plant::Guide)). What they have to pull is what is missing, and the law that pulls
//! like it is begun there. Then they are loosened from fit to fit until nothing holds any more
//! ([`letting_go`](super::letting_go)).
//!
//! A machine without mass and without springs, moved by its guide alone, would leave little: while a guide
//! holds, the model's own parameters stay near the drawing.

use std::sync::Mutex;

use stillbeam_identify::tall::dot;
use stillbeam_recording::Role;

use super::letting_go::Followed;
use super::scales::Scales;
use super::screening::{Leaving, Screened, screen};
use super::selection::Search;
use super::sets::Member;
use super::sketches::Sketched;
use super::trials::{Candidate, all_candidates};
use crate::effort::Effort;
use crate::fit::{Fitted, Others, fit};
use crate::parameters::{FreeParameter, free_parameters};
use crate::simulation::Hypothesis;
use crate::study::Study;

/// No law that leaves more than this share of what the held machine leaves is what has it out of step.
const MOST_LEFT: f64 = 0.5;
/// A law whose first effect takes less than this share of what the held machine leaves is not simulated.
const LEAST_TAKEN: f64 = 0.02;
/// Laws that are sketched, the most promising first, ...
const SKETCHED: usize = 8;
/// ... and that are followed, those whose sketches leave least.
const FOLLOWED: usize = 3;

/// A law found beside a guide and fitted to the whole of the training recordings without one.
pub(super) struct FoundGuided {
    pub(super) law: usize,
    pub(super) fitted: Fitted,
    /// What the screen saw of all laws beside the guide.
    pub(super) screened: Vec<Screened>,
    /// Sums of squares that the other laws would leave that were followed as well.
    pub(super) others_left: Vec<f64>,
}

impl Search<'_> {
    /// The law found beside a guide; `None` where nothing drives the recordings, where no guide holds the
    /// machine in step, and where no law is found.
    pub(super) fn found_guided(&self, refitted: &Member) -> Option<FoundGuided> {
        if self.study.train.iter().any(|record| record.input.is_none()) {
            return None;
        }
        let (mut guided, base) = self.held_in_step(refitted)?;
        let records = guided.train.clone();
        let base = Member {
            laws: Vec::new(),
            fitted: self.refitted_while_held(&guided, base),
            held_out: Vec::new(),
        };
        let candidates = self.candidates_while_held(&guided, &base)?;
        let search = Search { candidates: &candidates, ..self.held(&mut guided) };
        let mut screened = search.seen_beside(&base);
        let sketched = search.sketched_while_held(&base, &screened);
        let mut begun = search.begun_while_held(&base, &sketched);
        screened.retain_mut(|seen| self.is_known(&candidates, &mut seen.candidate));
        begun.retain_mut(|begun| self.is_known(&candidates, &mut begun.law));
        let (found, others_left) = self.let_go(&records, begun)?;
        let own = free_parameters(&Hypothesis::given(self.given));
        let free = found.fitted.free.iter().map(|held| unheld(held, &own)).collect();
        let fitted = Fitted { free, ..found.fitted };
        let fitted = self.fitted_on(&fitted, Effort::FULL).unwrap_or(fitted);
        Some(FoundGuided { law: found.law, fitted, screened, others_left })
    }

    /// The same search on recordings of a held machine.
    fn held<'s>(&'s self, study: &'s mut Study) -> Search<'s> {
        Search {
            study,
            floors: self.floors.clone(),
            held_out_starts: Vec::new(),
            rounds: Mutex::default(),
            ..*self
        }
    }

    /// All laws, as large as a held machine asks: how far one moves that is out of step says nothing of them.
    fn candidates_while_held(&self, guided: &Study, base: &Member) -> Option<Vec<Candidate>> {
        let Fitted { hypothesis, .. } = &base.fitted;
        let scales = Scales::new(hypothesis, &guided.train, &base.fitted.initial_states())?;
        Some(all_candidates(hypothesis, &scales, &guided.train, &[], &self.options.without))
    }

    /// Whether this search has a candidate of others too; it has its number then.
    fn is_known(&self, others: &[Candidate], candidate: &mut usize) -> bool {
        let Candidate { law, location, column, .. } = &others[*candidate];
        let is_it =
            |own: &Candidate| own.law.id() == law.id() && own.location == *location && own.column == *column;
        let found = self.candidates.iter().position(is_it);
        *candidate = found.unwrap_or(*candidate);
        found.is_some()
    }

    /// The linear machine near the drawing that leaves least: what it explains is no law's.
    fn refitted_while_held(&self, guided: &Study, drawn: Fitted) -> Fitted {
        let Fitted { hypothesis, free, values, .. } = &drawn;
        let own = fit(&guided.stack(Role::Train), hypothesis, free, values, &[], Effort::TRIAL);
        own.filter(|own| own.sum_of_squares < drawn.sum_of_squares).unwrap_or(drawn)
    }

    /// What the screen sees of all laws that take something off what a machine leaves, the most promising
    /// first.
    pub(super) fn seen_beside(&self, base: &Member) -> Vec<Screened> {
        let is_given_up = || self.is_over();
        let least_explained = LEAST_TAKEN * base.fitted.sum_of_squares;
        let leaving = Leaving { least_explained, is_given_up: &is_given_up };
        let stack = self.study.stack(Role::Train);
        let mut screened = screen(&stack, &base.fitted, self.candidates, self.study.slowest_hz, &leaving);
        screened.sort_by(|a, b| b.explained.total_cmp(&a.explained));
        screened
    }

    /// The most promising of these laws sketched in the recording of a held machine that lacks most, those
    /// that leave least first. The model's own parameters are searched along: they have moved too far for
    /// straight lines.
    fn sketched_while_held<'s>(&self, base: &Member, screened: &'s [Screened]) -> Vec<Sketched<'s>> {
        let train = &self.study.train;
        let power = |index: &usize| {
            let residuals = &base.fitted.records[*index].residuals;
            dot(residuals, residuals)
        };
        let lacks_most = (0..train.len()).max_by(|a, b| power(a).total_cmp(&power(b)));
        let Some(most) = lacks_most else { return Vec::new() };
        let mut study = Study { train: vec![train[most].clone()], ..self.study.clone() };
        let records = vec![base.fitted.records[most].clone()];
        let fitted = Fitted { records, sum_of_squares: power(&most), ..base.fitted.clone() };
        let base = Member { fitted, ..base.clone() };
        let search = self.held(&mut study);
        let promising = screened.iter().take(SKETCHED).take_while(|_| !self.is_over());
        let mut sketched: Vec<Sketched<'s>> =
            promising.filter_map(|seen| search.sketch(&base, seen, Others::Searched)).collect();
        sketched.sort_by(|a, b| a.left.total_cmp(&b.left));
        sketched
    }

    /// The best of these laws fitted to all recordings of a held machine, each at the place that suits it
    /// best: what a law does at one place of a machine that moves as one it does at others.
    fn begun_while_held(&self, base: &Member, sketched: &[Sketched<'_>]) -> Vec<Followed> {
        let id = |sketched: &Sketched<'_>| self.candidates[sketched.screened.candidate].law.id();
        let is_first = |at: &usize| sketched[..*at].iter().all(|better| id(better) != id(&sketched[*at]));
        let most = MOST_LEFT * base.fitted.sum_of_squares;
        let best = (0..sketched.len()).filter(is_first).take(FOLLOWED);
        best.filter_map(|at| self.begun_from(base, &sketched[at]))
            .filter(|begun| begun.fitted.sum_of_squares < most)
            .collect()
    }

    /// A law fitted from where its sketch ended, all of its parameters free.
    fn begun_from(&self, base: &Member, sketched: &Sketched<'_>) -> Option<Followed> {
        let own = &base.fitted.free;
        let values = sketched.begun.as_ref()?.values[..own.len()].to_vec();
        let hypothesis = base.fitted.hypothesis.with_values(own, &values)?;
        let base = Member { fitted: Fitted { hypothesis, values, ..base.fitted.clone() }, ..base.clone() };
        let fitted = self.begun(&base, sketched.screened, &sketched.physics, Others::Searched)?;
        let fitted = self.fitted_on(&fitted, Effort::TRIAL).unwrap_or(fitted);
        Some(Followed { law: sketched.screened.candidate, fitted })
    }
}

/// The same parameter as it is free where nothing holds the machine.
fn unheld(held: &FreeParameter, own: &[FreeParameter]) -> FreeParameter {
    own.iter().find(|free| free.path == held.path).unwrap_or(held).clone()
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Model;

    use super::{Candidate, Member};
    use crate::naming::on_a_spring::{
        hardening, let_go, machine, noisy_runs, searched, searched_around, unpushed,
    };
    use stillbeam_plant::catalogue::BEYOND_REACH;

    const STIFFNESS: f64 = 2e5;

    /// A machine 10 % off the drawing whose spring hardens by a few times what it has.
    fn hardening_a_lot(mut machine: Model) -> Model {
        machine.set_parameter("spring.mass-ground.stiffness", 270.0).unwrap();
        hardening(machine, STIFFNESS)
    }

    #[test]
    fn a_law_that_puts_every_refit_out_of_phase_is_found_beside_a_held_machine() {
        let noisy = |amplitudes: &[f64]| noisy_runs(&hardening_a_lot(machine()), amplitudes, 1e-4);
        searched(&noisy(&[20.0, 40.0]), &noisy(&[30.0]), |search, refitted| {
            assert!(search.is_out_of_phase(&refitted));
            let found = search.found_guided(&refitted).expect("a guide keeps it in step");
            assert_eq!(search.candidates[found.law].law.id(), "cubic_stiffness");
            let law = &found.fitted.hypothesis.model.setup().physics[0];
            assert!((law.parameters["stiffness"] / STIFFNESS - 1.0).abs() < 0.01, "{law:?}");
            assert!(found.fitted.sum_of_squares < 0.01 * refitted.fitted.sum_of_squares);
            let mass = found.fitted.free.iter().find(|free| free.path == "body.mass.mass").unwrap();
            assert!(mass.upper > 5.0 * mass.given, "it is free again");
        });
    }

    /// How far away a stop may be at most.
    fn furthest_stop(candidates: &[Candidate]) -> f64 {
        let stop = candidates.iter().find(|one| one.law.id() == "end_stop").unwrap();
        stop.ranges.iter().find(|(name, ..)| *name == "distance").unwrap().2
    }

    #[test]
    fn laws_are_as_large_as_a_held_machine_asks_however_far_a_refit_goes() {
        let recorded = noisy_runs(&hardening_a_lot(machine()), &[20.0, 40.0], 1e-4);
        let samples = recorded.iter().flat_map(|run| run.column("position_m").unwrap());
        let reach = samples.fold(0.0_f64, |most, value| most.max(value.abs()));
        let held_out = noisy_runs(&hardening_a_lot(machine()), &[30.0], 1e-4);
        searched(&recorded, &held_out, |search, refitted| {
            let (guided, drawn) = search.held_in_step(&refitted).unwrap();
            let base = Member { laws: Vec::new(), fitted: drawn, held_out: Vec::new() };
            let held = search.candidates_while_held(&guided, &base).unwrap();
            assert!((furthest_stop(&held) / (BEYOND_REACH * reach) - 1.0).abs() < 0.2);
            let (mut known, mut unknown) = (0, held.len());
            assert!(search.is_known(&held, &mut known));
            let id = |candidate: &Candidate| (candidate.law.id(), candidate.location.clone());
            assert_eq!(id(&search.candidates[known]), id(&held[0]));
            let mut others = held.clone();
            others.push(Candidate { location: "nowhere".to_owned(), ..held[0].clone() });
            assert!(!search.is_known(&others, &mut unknown), "not a law of this search");
            let of_refit = furthest_stop(search.candidates) / (BEYOND_REACH * reach);
            assert!((of_refit - 1.0).abs() > 0.2, "{of_refit}: else nothing is shown");
        });
    }

    /// A law that leaves most of what holds the machine out of step is not followed.
    #[test]
    fn nothing_is_found_beside_a_guide_where_no_law_does_what_is_missing() {
        let noisy = |amplitudes: &[f64]| noisy_runs(&hardening_a_lot(machine()), amplitudes, 1e-4);
        searched(&noisy(&[20.0, 40.0]), &noisy(&[30.0]), |search, refitted| {
            let all = search.candidates;
            let is_other = |id: &str| id == "crosstalk" || id == "servo_lag" || id == "dead_time";
            let others: Vec<_> = all.iter().filter(|one| is_other(one.law.id())).cloned().collect();
            assert!(others.len() > 2);
            let mut study = search.study.clone();
            let mut search = search.held(&mut study);
            search.candidates = &others;
            assert!(search.found_guided(&refitted).is_none());
        });
    }

    #[test]
    fn a_decay_is_held_by_no_guide() {
        let decays = |from_m: &[f64]| let_go(&hardening_a_lot(machine()), from_m, 1e-4);
        searched_around(&unpushed(), &decays(&[0.1, 0.05]), &decays(&[0.07]), |search, refitted| {
            assert!(search.found_guided(&refitted).is_none());
        });
    }
}
