//! Laws of which a sketch shows too little: the refit has taken over nearly all of them, or they do much more
//! than straight lines hold for.
//!
//! A mass at a beam's tip does to its first two frequencies what a taper does that no calliper would miss.
//! Around a refit that has become that beam the mass does nothing new but for a trace, by which the screen is
//! sure of it. A sketch, in which the refitted parameters follow along straight lines, cannot tell what the
//! mass is good for: they have a long way back, on which frequencies are off by more than a resonance's width
//! if they follow straight. What promises more than was found is fitted with everything searched, to the end.
//! So is what the screen sees as well as the best, where that was not tried in the end.

use rayon::prelude::*;
use stillbeam_recording::Role;

use super::rounds::{CONTENDS, Tried, directions};
use super::screening::Screened;
use super::selection::Search;
use super::sets::Member;
use crate::effort::Effort;
use crate::fit::{Fitted, Others, fit};

/// A law is hidden when the refit makes at least this share of the power of what it does.
const HIDDEN: f64 = 0.9;
/// Share of what the screen sees of the best law from which another is seen as well.
pub(super) const AS_WELL: f64 = 0.8;
/// Laws that are fitted so, those that promise most first.
const FITTED: usize = 2;

impl Search<'_> {
    /// Hidden laws that promise no less than what was tried, and were not tried for their sketches.
    pub(super) fn hidden_laws(&self, base: &Member, screened: &[Screened], tried: &[Tried]) -> Vec<Tried> {
        let gains = tried.iter().map(|tried| base.fitted.sum_of_squares - tried.member.fitted.sum_of_squares);
        let best = gains.fold(0.0, f64::max);
        let promises = |s: &Screened| s.hidden > HIDDEN && s.explained > CONTENDS * best;
        self.fitted_to_the_end(base, screened, tried, promises)
    }

    /// Laws of which the screen sees as much as of any, and were not tried for their sketches.
    pub(super) fn laws_seen_as_well(
        &self,
        base: &Member,
        screened: &[Screened],
        tried: &[Tried],
    ) -> Vec<Tried> {
        let most = screened.iter().map(|seen| seen.explained).fold(0.0, f64::max);
        self.fitted_to_the_end(base, screened, tried, |s| s.explained > AS_WELL * most)
    }

    /// Those that promise something, were not tried and are no chance, the best of them fitted to the end
    /// whatever their sketches say.
    fn fitted_to_the_end(
        &self,
        base: &Member,
        screened: &[Screened],
        tried: &[Tried],
        promises: impl Fn(&Screened) -> bool,
    ) -> Vec<Tried> {
        let is_new = |s: &Screened| tried.iter().all(|tried| tried.candidate != s.candidate);
        let is_sure = |s: &Screened| s.t.abs() > self.options.training_gate;
        let mut new: Vec<&Screened> =
            screened.iter().filter(|s| promises(s) && is_sure(s) && is_new(s)).collect();
        new.sort_by(|a, b| b.explained.total_cmp(&a.explained));
        new.truncate(FITTED);
        let fitted = |screened: &&Screened| {
            let found = self.everything_searched(base, screened)?;
            (found.sum_of_squares < base.fitted.sum_of_squares)
                .then(|| self.try_on(base, screened, &found))?
        };
        new.par_iter().filter_map(fitted).collect()
    }

    /// A law fitted around the refit, all that is free searched to the end.
    fn everything_searched(&self, base: &Member, screened: &Screened) -> Option<Fitted> {
        let stack = self.study.stack(Role::Train);
        let (absorbing, own) = directions(&stack, base);
        let physics = self.sketch(base, screened, Others::Absorb(&absorbing))?.physics;
        let begun = self.begun(base, screened, &physics, Others::Known(&own))?;
        let Fitted { hypothesis, free, values, .. } = &begun;
        fit(&stack, hypothesis, free, values, &begun.initial_states(), Effort::FULL)
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;

    use super::*;
    use crate::naming::on_a_spring::{machine, noisy_runs, searched};
    use crate::naming::screening::{Leaving, screen};

    #[test]
    fn a_law_that_promises_more_than_was_found_is_fitted_though_the_refit_hides_it() {
        let mut truth = machine();
        let contact =
            Physics::new("bilinear_stiffness", "mass").with("contact", 0.0).with("stiffness", 120.0);
        truth.setup_mut().physics = vec![contact];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
            let stack = search.study.stack(Role::Train);
            let leaving = Leaving { least_explained: 0.0, is_given_up: &|| false };
            let mut screened =
                screen(&stack, &refitted.fitted, search.candidates, search.study.slowest_hz, &leaving);
            let is_it = |s: &Screened| search.candidates[s.candidate].law.id() == "bilinear_stiffness";
            screened.retain(is_it);
            assert!(
                screened[0].hidden > HIDDEN,
                "a one-sided spring is a stiffer spring: {}",
                screened[0].hidden
            );
            let found = search.hidden_laws(&refitted, &screened, &[]);
            assert!(found[0].passes(), "{:?}", found[0].gates);
            let stiffness =
                found[0].member.fitted.hypothesis.model.setup().physics[0].parameters["stiffness"];
            assert!((stiffness / 120.0 - 1.0).abs() < 0.02, "{stiffness} N/m");
            assert!(search.hidden_laws(&refitted, &screened, &found).is_empty(), "it was tried");
            let hidden = std::mem::replace(&mut screened[0].hidden, 0.5);
            assert!(search.hidden_laws(&refitted, &screened, &[]).is_empty(), "a sketch tells");
            screened[0].hidden = hidden;
            screened[0].t = 1.0;
            assert!(search.hidden_laws(&refitted, &screened, &[]).is_empty(), "not sure");
        });
    }
}
