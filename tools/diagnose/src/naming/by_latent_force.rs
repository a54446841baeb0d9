//! Laws begun from the force that would explain the rest.
//!
//! The screen simulates a law's effect on the outputs. Where a law changes the motion beyond recognition, an
//! effect that is a little off in place or size has nothing to do with what is left: after the first bounce
//! off a stop every further one comes at another moment. The force itself has not: a smoother of the refitted
//! model says what force at a place would explain the recordings, and along the smoothed motion each law's
//! force is a function of that motion. The best values of that regression are biased, by the noise in the
//! motion and the smoother's own bandwidth; they begin a fit by simulation, which decides.
//!
//! A wave needs no smoother where its place was recorded: it is read off there first
//! ([`super::waves_as_recorded`]).

use rayon::prelude::*;
use stillbeam_identify::tall::dot;
use stillbeam_plant::catalogue::Trial;
use stillbeam_plant::{Physics, StateSpace};
use stillbeam_recording::Role;

use super::rounds::Tried;
use super::second_tries::take_better;
use super::selection::Search;
use super::sets::Member;
use super::trials::Candidate;
use crate::adequacy::Rest;
use crate::effort::Effort;
use crate::fit::{LOUD, Others};
use crate::locate::latent_force::{Moment, law_forces, motions_from_rest};
use crate::record::Record;
use crate::verdict::MOST_OF_ITS_OWN;

/// A law's force has at least this share of the power of the force that is asked for at its place.
const ALIKE: f64 = 0.5;
/// Waves that are fitted, and other laws, the most alike first.
const FITTED: usize = 3;
/// Distances of a stop that are tried: shares of the farthest that the place was.
const STOPS: [f64; 16] =
    [0.998, 0.995, 0.99, 0.98, 0.96, 0.94, 0.92, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6, 0.5, 0.4];

/// A law's likeness to the force that is asked for.
pub(super) struct Alike {
    pub(super) candidate: usize,
    pub(super) physics: Physics,
    /// Share of the power of that force.
    pub(super) share: f64,
}

/// A law whose force is compared with the one that is asked for at a place.
pub(super) struct AtPlace<'c> {
    /// The set that lacks the force.
    around: &'c Member,
    /// The candidate.
    pub(super) index: usize,
    /// Motion and force, run by run.
    pub(super) moments: &'c [Vec<Moment>],
    point: usize,
}

impl Search<'_> {
    /// Takes over laws that look like the force which a refit lacks, where nothing that was tried around it
    /// takes so much away that it would be named by itself.
    pub(super) fn take_laws_alike(&self, refitted: &Member, tried: &mut Vec<Tried>) {
        let is_missing_most = self.rest(refitted) != Rest::Noise && !self.takes_most(refitted, tried);
        if is_missing_most && !self.is_over() {
            take_better(tried, self.tried_by_latent_force(refitted, refitted));
        }
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

    /// Laws that look like the force which `around`, a refit, lacks, fitted and judged against `refitted`. A
    /// wave that the recorded travel shows, and that leaves nothing to look for, is the only one.
    fn tried_by_latent_force(&self, around: &Member, refitted: &Member) -> Vec<Tried> {
        let waves = (0..self.candidates.len()).into_par_iter().filter(|&law| self.is_wave(law));
        let read_off = waves.filter(|_| !self.is_over()).filter_map(|law| self.wave_read_off(around, law));
        let read_off: Vec<Member> = read_off.collect();
        let judged = |set: Member| {
            let law = *set.laws.last()?;
            Some(self.judged_on(refitted, set, law))
        };
        let is_quiet = |set: &Member| !self.is_louder_than_noise(&set.fitted);
        let is_explained = read_off.iter().any(is_quiet);
        let mut tried: Vec<Tried> = read_off.into_iter().filter_map(judged).collect();
        if !is_explained {
            take_better(&mut tried, self.tried_alike(around, refitted));
        }
        tried.retain(|tried| tried.training.t() > self.options.training_gate);
        tried
    }

    fn tried_alike(&self, around: &Member, refitted: &Member) -> Vec<Tried> {
        let mut alike = self.laws_alike(around);
        alike.sort_by(|a, b| b.share.total_cmp(&a.share));
        // A wave has as many lines as it has, and they are shares of another power: they take no other law's
        // place.
        let (waves, others): (Vec<Alike>, Vec<Alike>) =
            alike.into_iter().partition(|law| self.is_wave(law.candidate));
        let alike: Vec<Alike> =
            waves.into_iter().take(FITTED).chain(others.into_iter().take(FITTED)).collect();
        let number = 1 + self.given_laws;
        let fitted = |law: &Alike| {
            let amplitudes = self.candidates[law.candidate].amplitude_names();
            let begun =
                self.extended(around, law.candidate, &law.physics, number, &amplitudes, Others::Searched)?;
            let fitted = self.fitted_on(&begun, Effort::BENT).unwrap_or(begun);
            Some(self.judged_on(refitted, self.member(vec![law.candidate], fitted)?, law.candidate))
        };
        alike.par_iter().filter_map(fitted).collect()
    }

    pub(super) fn is_wave(&self, candidate: usize) -> bool {
        self.candidates[candidate].trials.iter().any(|trial| trial.period().is_some())
    }

    fn laws_alike(&self, around: &Member) -> Vec<Alike> {
        let Ok(space) = StateSpace::new(&around.fitted.hypothesis.model) else { return Vec::new() };
        // The noise around this refit: beside another one that explains no recording it would be far too
        // large, and the force smooth.
        let floors = self.study.floors(&around.on_all());
        let of_point = |point: usize| -> Vec<Alike> {
            let name = &space.points()[point].name;
            let here = (0..self.candidates.len()).filter(|&index| self.candidates[index].location == *name);
            let here: Vec<usize> = here.collect();
            if here.is_empty() || self.is_over() {
                return Vec::new();
            }
            let linear = &around.fitted.hypothesis;
            let Some(moments) = motions_from_rest(self.study, linear, &floors, point, &|_| true) else {
                return Vec::new();
            };
            let alike = |index: usize| {
                let compared = AtPlace { around, index, moments: &moments, point };
                if self.is_over() {
                    return Vec::new();
                }
                if self.is_wave(index) { self.waves_alike(&compared) } else { self.most_alike(&compared) }
            };
            here.into_iter().flat_map(alike).collect()
        };
        (0..space.points().len()).into_par_iter().flat_map_iter(of_point).collect()
    }

    /// The trial of a law whose force is most like the one that is asked for, at the size that makes it so.
    fn most_alike(&self, compared: &AtPlace<'_>) -> Vec<Alike> {
        let candidate = &self.candidates[compared.index];
        let wanted: Vec<f64> = compared.moments.iter().flatten().map(|moment| moment[2]).collect();
        let power = dot(&wanted, &wanted);
        let alike = |trial: &Trial| {
            let force = self.force_of(compared, trial)?.concat();
            let along = dot(&force, &wanted);
            let factor = along / dot(&force, &force);
            let share = factor * along / power;
            let is_possible = factor > 0.0 || candidate.is_signed(trial);
            let physics = candidate.physics(trial, factor);
            (share > ALIKE && is_possible).then_some(Alike { candidate: compared.index, physics, share })
        };
        let trials = trials_along(candidate, compared.moments);
        trials.iter().filter_map(alike).max_by(|a, b| a.share.total_cmp(&b.share)).into_iter().collect()
    }

    /// The force of a law along each recording.
    pub(super) fn force_of(&self, compared: &AtPlace<'_>, trial: &Trial) -> Option<Vec<Vec<f64>>> {
        let AtPlace { around, index, moments, point } = *compared;
        let law = self.candidates[index].physics(trial, 1.0);
        let stack = self.study.stack(Role::Train);
        let along = |(moments, record): (&Vec<Moment>, &&Record)| {
            law_forces(&around.fitted.hypothesis, std::slice::from_ref(&law), moments, record, point)
        };
        moments.iter().zip(&stack.records).map(along).collect()
    }
}

/// The trials of a law along a motion that is known: stops are looked for where it went.
fn trials_along(candidate: &Candidate, moments: &[Vec<Moment>]) -> Vec<Trial> {
    let reach = moments.iter().flatten().fold(0.0_f64, |reach, moment| reach.max(moment[0].abs()));
    let Some(stop) = candidate.trials.first().filter(|_| candidate.law.id() == "end_stop") else {
        return candidate.trials.clone();
    };
    let at = |share: f64| Trial { shapes: vec![("distance", share * reach)], ..stop.clone() };
    STOPS.map(at).to_vec()
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::{Model, Physics};

    use super::*;
    use crate::naming::on_a_spring::{fitted_with, machine, noisy_runs, searched, stopped_at};

    const NOISE_M: f64 = 1e-5;

    /// The machine 3 % softer than given, with laws.
    fn softer(laws: Vec<Physics>) -> Model {
        let mut truth = machine();
        truth.set_parameter("spring.mass-ground.stiffness", 291.0).unwrap();
        truth.setup_mut().physics = laws;
        truth
    }

    #[test]
    fn a_stop_that_is_bounced_off_is_known_by_its_force_and_fitted_from_there() {
        let stiffness = 3e3;
        let mut truth = machine();
        let stop = Physics::new("end_stop", "mass").with("distance", 0.06).with("stiffness", stiffness);
        truth.setup_mut().physics = vec![stop];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[1.0, 9.0]), &noisy(&[7.0]), |search, refitted| {
            // The screen looks around the drawing here, which is the truth but for the stop.
            let drawing = search.drawing(&refitted).unwrap();
            let tried = search.tried_by_latent_force(&drawing, &refitted);
            let stop = tried.iter().find(|tried| search.candidates[tried.candidate].law.id() == "end_stop");
            let stop = stop.expect("it looks like the force that is asked for");
            let (_, value, stderr, ..) = &stop.parameters[1];
            assert!(stop.passes(), "{:?}", stop.gates);
            assert!(
                (value - stiffness).abs() < 4.0 * stderr && *stderr < 0.05 * stiffness,
                "{value} ± {stderr}"
            );
        });
    }

    #[test]
    fn no_law_looks_like_the_force_that_is_asked_for_where_nothing_is_missing() {
        let noisy = |amplitudes: &[f64]| noisy_runs(&machine(), amplitudes, 1e-5);
        searched(&noisy(&[1.0, 9.0]), &noisy(&[7.0]), |search, refitted| {
            assert!(search.laws_alike(&refitted).is_empty());
        });
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
}
