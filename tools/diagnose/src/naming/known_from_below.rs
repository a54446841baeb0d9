//! A strength that is known from below.
//!
//! How hard a stop is that was touched once is known to one side only: softer the base would have gone
//! further, harder it would hardly have gone less far. Its standard error is the curvature at the best value,
//! which says little of either side, and where that is as large as the value it looks as if the law might as
//! well not be there. Whether it might is asked outright: a tenth of the strength is held, all else is fitted
//! again, and what is left is compared.

use stillbeam_recording::Role;

use super::gates::{DETERMINED, DOUBT, fails_only, only_strength};
use super::rounds::Tried;
use super::selection::Search;
use super::sets::Member;
use crate::effort::Effort;
use crate::fit::fit;
use crate::result::Gate;

/// Share of its strength with which a law must not do as well.
const WEAK: f64 = 0.1;

impl Search<'_> {
    /// The gate of the strength, passed, where a law whose parameters start with `own` fails no other and a
    /// tenth of its only strength does clearly worse.
    pub(super) fn known_from_below(&self, tried: &Tried, own: &str) -> Option<Gate> {
        let is_certain = tried.training.t() > DOUBT * self.options.training_gate;
        if !fails_only(&tried.gates, DETERMINED) || !is_certain || self.is_over() {
            return None;
        }
        let amplitudes = self.candidates[tried.candidate].amplitude_names();
        let strength = only_strength(&tried.parameters, &amplitudes, self.options)?;
        let path = format!("{own}{strength}");
        let weak = self.weakened(&tried.member, &path)?;
        // Of two fits of which one has a parameter more, the gain is half of that many standard errors of the
        // parameter.
        let worse = 2.0 * self.better_by(&weak, &tried.member);
        (worse > self.options.training_gate).then(|| Gate {
            name: DETERMINED.to_owned(),
            passed: true,
            detail: format!(
                "{strength} is known from below: a tenth of it does worse by {worse:.1} standard errors"
            ),
        })
    }

    /// The set with one parameter at a tenth of its value, the others fitted again.
    fn weakened(&self, member: &Member, path: &str) -> Option<Member> {
        let fitted = &member.fitted;
        let place = fitted.free.iter().position(|parameter| parameter.path == path)?;
        let (mut free, mut values) = (fitted.free.clone(), fitted.values.clone());
        let (weakened, value) = (free.remove(place), values.remove(place));
        let hypothesis = fitted.hypothesis.with_values(&[weakened], &[WEAK * value])?;
        let stack = self.study.stack(Role::Train);
        let weak = fit(&stack, &hypothesis, &free, &values, &fitted.initial_states(), Effort::TRIAL)?;
        self.member(member.laws.clone(), weak)
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;

    use super::*;
    use crate::naming::on_a_spring::{fitted_with, machine, noisy_runs, searched, stopped_at};

    /// What the gate of strengths says of a law, fitted from its true values, if its strength's standard
    /// error were as large as itself.
    fn said_of(law: Physics, noise_m: f64) -> Option<Gate> {
        let mut truth = machine();
        truth.setup_mut().physics = vec![law.clone()];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, noise_m);
        searched(&noisy(&[3.0, 6.0]), &noisy(&[5.0]), |search, refitted| {
            let as_given = |path: &str| {
                let mut own = refitted.fitted.free.iter().zip(&refitted.fitted.values);
                own.find(|(free, _)| free.path == path).map_or(1.0, |(free, value)| free.given / value)
            };
            // The refit is out of step; the law is fitted from the machine as it is.
            let drawn = stopped_at(search, &refitted, as_given);
            let fitted = fitted_with(search, &drawn, &law);
            let candidate = fitted.laws[0];
            let mut tried = search.judged_on(&refitted, fitted, candidate);
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

    #[test]
    fn a_law_whose_shape_is_not_clear_is_not_known_from_below() {
        // A stiff hysteresis is dry friction: neither how stiff nor when it yields can be told, and friction
        // is no part of it.
        let stiff = Physics::new("hysteresis", "mass").with("stiffness", 1e5).with("beta", 1e5);
        assert_eq!(said_of(stiff, 1e-4), None);
    }
}
