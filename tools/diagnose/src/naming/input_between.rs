//! What the input does between its samples, asked again beside a law.
//!
//! No samples tell for certain whether a force goes in straight lines or along a smooth curve. Before a law
//! is found the difference drowns in what the law does; beside it, a wrong guess leaves a rest that goes with
//! the input, and further laws (a share of the input in a sensor, a dead time) would make up for it.

use stillbeam_recording::Role;

use super::selection::Search;
use super::sets::Member;
use crate::adequacy::Rest;
use crate::between_samples::BetweenSamples;
use crate::fit::Fitted;
use crate::linear_findings::others_between;
use crate::refit::refit_from_there;
use crate::simulation::Hypothesis;
use crate::study::Study;

impl Search<'_> {
    /// A set fitted with another guess of the input between its samples, where that is beyond doubt better;
    /// the search goes on with it then, and what was found with the first guess is looked for anew. An input
    /// that is held is left out: it comes late, as laws do that a set may still lack.
    pub(super) fn between_samples_again(&mut self, member: Member) -> Member {
        let is_asked = !self.in_pieces && !self.study.is_coloured() && !self.is_over();
        if !is_asked || member.laws.is_empty() || self.rest(&member) == Rest::Noise {
            return member;
        }
        let member = self.with_own_parameters_anew(member);
        if self.rest(&member) == Rest::Noise {
            return member;
        }
        let others = others_between(self.study, self.given);
        let read = others
            .into_iter()
            .filter(|(between, _)| *between != BetweenSamples::Held)
            .filter_map(|(between, words)| {
                let study = self.study.between(between, self.given)?;
                Some((self.fitted_as_read(&study, &member)?, study, words))
            })
            .min_by(|(a, ..), (b, ..)| a.fitted.sum_of_squares.total_cmp(&b.fitted.sum_of_squares));
        let Some((better, study, words)) = read else { return member };
        if self.better_by(&member, &better) < self.options.separation {
            return member;
        }
        *self.study = study;
        self.study.caps.push(words.to_owned());
        // The refit without laws is compared on the same reading of the input.
        self.weighed_again = true;
        self.forget_rounds();
        better
    }

    /// A set with those of the model's own parameters free that show beside its laws, where that is beyond
    /// doubt better: one that the refit without laws could not tell may do what else a further law would be
    /// taken for.
    fn with_own_parameters_anew(&self, member: Member) -> Member {
        let anew = self.refitted_on(self.study, &member);
        let anew = anew.and_then(|fitted| self.member(member.laws.clone(), fitted));
        anew.filter(|anew| self.better_by(&member, anew) > self.options.separation).unwrap_or(member)
    }

    /// The same laws fitted to recordings whose input is read otherwise; friction that turns at other
    /// instants is followed from the beginnings of the recordings on.
    fn fitted_as_read(&self, study: &Study, member: &Member) -> Option<Member> {
        let stack = study.stack(Role::Train);
        let fitted = self.refitted_on(study, member)?;
        let longer =
            fitted.is_jagged(&stack).then(|| fitted.over_a_lengthening_horizon(&stack, 0.0)).flatten();
        let fitted = longer.filter(|longer| longer.sum_of_squares < fitted.sum_of_squares).unwrap_or(fitted);
        let held_out = study.stack(Role::HeldOut);
        let held_out = held_out.evaluate_held_out(&fitted.hypothesis, &self.held_out_starts)?;
        Some(Member { laws: member.laws.clone(), fitted, held_out })
    }

    /// The laws of a set fitted to these recordings, which of the model's own parameters are free decided
    /// anew.
    fn refitted_on(&self, study: &Study, member: &Member) -> Option<Fitted> {
        let mut hypothesis = Hypothesis::given(self.given);
        hypothesis.model.setup_mut().physics = member.fitted.hypothesis.model.setup().physics.clone();
        refit_from_there(&study.stack(Role::Train), &hypothesis, &member.fitted)
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;
    use stillbeam_recording::Role;

    use crate::fit::Fitted;
    use crate::naming::on_a_spring::{fitted_with, machine, noisy_runs, searched, stopped_at};
    use crate::naming::sets::Member;
    use crate::{Options, diagnose};

    const DAMPER: &str = "damper.mass-ground.damping";

    /// A set whose damper is held at twice the value that fits, as if the refit without laws could not tell
    /// it.
    fn with_damper_held(found: &Member) -> Member {
        let rows = found.fitted.free.iter().cloned().zip(found.fitted.values.iter().copied());
        let (free, values) = rows.filter(|(free, _)| free.path != DAMPER).unzip();
        Member { fitted: Fitted { free, values, ..found.fitted.clone() }, ..found.clone() }
    }

    #[test]
    fn a_damper_that_shows_only_beside_a_law_is_freed_there() {
        let drag = Physics::new("quadratic_drag", "mass").with("drag", 12.0);
        let mut truth = machine();
        truth.setup_mut().physics = vec![drag.clone()];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
            let found = fitted_with(search, &refitted, &drag);
            let off = stopped_at(search, &found, |path| if path == DAMPER { 2.0 } else { 1.0 });
            let held = with_damper_held(&off);
            let freed = search.with_own_parameters_anew(held.clone());
            assert!(freed.fitted.free.iter().any(|free| free.path == DAMPER));
            let noise = search.study.stack(Role::Train).present() as f64;
            assert!(freed.fitted.sum_of_squares < 0.2 * held.fitted.sum_of_squares);
            assert!(freed.fitted.sum_of_squares < found.fitted.sum_of_squares + noise);
        });
    }

    #[test]
    fn a_force_in_straight_lines_that_looks_smooth_is_read_as_such_once_a_law_is_found() {
        let mut truth = machine();
        truth.setup_mut().physics = vec![Physics::new("quadratic_drag", "mass").with("drag", 12.0)];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 2e-6);
        let (train, held_out) = (noisy(&[3.0, 9.0]), noisy(&[5.0]));
        let found = diagnose(&machine(), &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
        let named: Vec<&str> = found.effects.iter().map(|effect| effect.id.as_str()).collect();
        assert_eq!(named, ["quadratic_drag"], "{}", found.sentence);
        assert!(found.caps.iter().any(|cap| cap.contains("straight lines")), "{:?}", found.caps);
    }
}
