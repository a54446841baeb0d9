//! A strength that is known from below.
//!
//! How hard a stop is that was touched once is known to one side only: softer the base would have gone
//! further, harder it would hardly have gone less far. Its standard error is the curvature at the best value,
//! which says little of either side, and where that is as large as the value it looks as if the law might as
//! well not be there. Whether it might is asked outright: a tenth of the strength is held, all else is fitted
//! again, and what is left is compared. Where the best value itself has wandered up, to where all do nearly
//! as well, a tenth of it may do as well too, and a hundredth is asked for.

use stillbeam_recording::Role;

use super::gates::{DETERMINED, DOUBT, fails_only, only_strength};
use super::rounds::Tried;
use super::selection::Search;
use super::sets::Member;
use crate::effort::Effort;
use crate::fit::fit;
use crate::result::Gate;

/// Shares of its strength of which a law must not do as well with one, and what they are called.
const WEAK: [(f64, &str); 2] = [(0.1, "a tenth"), (0.01, "a hundredth")];

impl Search<'_> {
    /// The gate of the strength, passed, where a law whose parameters start with `own` fails no other and a
    /// tenth of its only strength, or a hundredth, does clearly worse.
    pub(super) fn known_from_below(&self, tried: &Tried, own: &str) -> Option<Gate> {
        let is_certain = tried.training.t() > DOUBT * self.options.training_gate;
        if !fails_only(&tried.gates, DETERMINED) || !is_certain || self.is_over() {
            return None;
        }
        let amplitudes = self.candidates[tried.candidate].amplitude_names();
        let strength = only_strength(&tried.parameters, &amplitudes, self.options)?;
        let path = format!("{own}{strength}");
        let worse_with = |share: f64| {
            let weak = self.weakened(&tried.member, &path, share)?;
            // Of two fits of which one has a parameter more, the gain is half of that many standard errors of
            // the parameter.
            Some(2.0 * self.better_by(&weak, &tried.member))
        };
        WEAK.iter().find_map(|&(share, called)| {
            let worse = worse_with(share).filter(|worse| *worse > self.options.training_gate)?;
            Some(Gate {
                name: DETERMINED.to_owned(),
                passed: true,
                detail: format!(
                    "{strength} is known from below: {called} of it does worse by {worse:.1} standard errors"
                ),
            })
        })
    }

    /// The set with one parameter at a share of its value, the others fitted again.
    fn weakened(&self, member: &Member, path: &str, share: f64) -> Option<Member> {
        let fitted = &member.fitted;
        let place = fitted.free.iter().position(|parameter| parameter.path == path)?;
        let (mut free, mut values) = (fitted.free.clone(), fitted.values.clone());
        let (weakened, value) = (free.remove(place), values.remove(place));
        let hypothesis = fitted.hypothesis.with_values(&[weakened], &[share * value])?;
        let stack = self.study.stack(Role::Train);
        let weak = fit(&stack, &hypothesis, &free, &values, &fitted.initial_states(), Effort::TRIAL)?;
        self.member(member.laws.clone(), weak)
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;

    use super::*;
    use crate::naming::on_a_spring::{machine, noisy_runs, searched};

    /// What the gate of strengths says of a law, tried on top of the refit, if its strength's standard error
    /// were as large as itself.
    fn said_of(law: Physics, noise_m: f64) -> Option<Gate> {
        let mut truth = machine();
        let id = law.id.clone();
        truth.setup_mut().physics = vec![law];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, noise_m);
        searched(&noisy(&[3.0, 6.0]), &noisy(&[5.0]), |search, refitted| {
            let (_, tried) = search.round(&refitted);
            let of_law = |tried: &Tried| search.candidates[tried.candidate].law.id() == id;
            let mut tried = tried.into_iter().find(of_law).expect("the law is tried");
            let amplitudes = search.candidates[tried.candidate].amplitude_names();
            for row in tried.parameters.iter_mut().filter(|(name, ..)| amplitudes.contains(name)) {
                row.2 = row.1.abs();
            }
            for gate in &mut tried.gates {
                gate.passed = gate.name != DETERMINED;
            }
            search.known_from_below(&tried, "physics.1.")
        })
    }

    #[test]
    fn a_strength_of_which_a_tenth_does_clearly_worse_is_known_from_below() {
        let stop = || Physics::new("end_stop", "mass").with("distance", 0.06).with("stiffness", 3e3);
        let gate = said_of(stop(), 1e-4).expect("the stop is hit");
        assert!(gate.passed && gate.detail.contains("a tenth"), "{gate:?}");
    }

    /// From some stiffness up all fit, and the best value says little of where that begins.
    #[test]
    fn a_strength_of_which_only_a_hundredth_does_clearly_worse_is_known_from_below() {
        let stiff = Physics::new("end_stop", "mass").with("distance", 0.07).with("stiffness", 1e5);
        let gate = said_of(stiff, 3e-4).expect("the stop is hit");
        assert!(gate.passed && gate.detail.contains("a hundredth"), "{gate:?}");
    }

    #[test]
    fn a_law_whose_shape_is_not_clear_is_not_known_from_below() {
        // A stiff hysteresis is dry friction: neither how stiff nor when it yields can be told, and friction
        // is no part of it.
        let stiff = Physics::new("hysteresis", "mass").with("stiffness", 1e5).with("beta", 1e5);
        assert_eq!(said_of(stiff, 1e-4), None);
    }
}
