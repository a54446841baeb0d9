//! Sets of laws as their readings would be without rounding: where laws beside a rounding are looked for.

use stillbeam_identify::tall::dot;
use stillbeam_recording::Role;

use super::selection::Search;
use super::sets::Member;
use crate::fit::Fitted;

impl Search<'_> {
    /// The set as its readings would be without rounding, where they are rounded: next to a step what another
    /// law and the parameters that follow do is no straight line, and a law that they hide for the most part
    /// looks like nothing.
    pub(super) fn without_rounding(&self, base: &Member) -> Option<Member> {
        let hypothesis = base.fitted.hypothesis.unrounded()?;
        let stack = self.study.stack(Role::Train);
        let records = stack.evaluate(&hypothesis, &base.fitted.initial_states())?;
        let sum_of_squares = records.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum();
        Some(Member {
            fitted: Fitted { hypothesis, records, sum_of_squares, ..base.fitted.clone() },
            ..base.clone()
        })
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;

    use super::*;
    use crate::naming::on_a_spring::{fitted_with, machine, rounded_runs, searched};
    use crate::naming::rounds::Tried;
    use crate::naming::screening::{Leaving, Screened, screen};

    #[test]
    fn beside_a_rounding_laws_are_looked_for_as_if_readings_had_no_steps() {
        const SPRING: f64 = -100.0;
        let step = 2e-3;
        let mut truth = machine();
        truth.setup_mut().physics = vec![Physics::new("cubic_stiffness", "mass").with("stiffness", SPRING)];
        let rounded = |amplitudes: &[f64]| rounded_runs(&truth, amplitudes, 0.05 * step, step);
        searched(&rounded(&[3.0, 9.0]), &rounded(&[5.0]), |search, refitted| {
            let law = Physics::new("quantisation", "sensor").with("step", step).with("dither", 0.05 * step);
            let rounding = fitted_with(search, &refitted, &law);
            let rounding = search.weighed_again(rounding);
            assert!(search.without_rounding(&refitted).is_none(), "nothing rounds");
            let smooth = search.without_rounding(&rounding).expect("it rounds");
            assert!(smooth.fitted.hypothesis.unrounded().is_none(), "no steps");
            let (screened, tried) = search.round(&rounding);
            let is_given_up = || false;
            let leaving = Leaving { least_explained: 0.0, is_given_up: &is_given_up };
            let stack = search.study.stack(Role::Train);
            let slowest_hz = search.study.slowest_hz;
            let without_steps = screen(&stack, &smooth.fitted, search.candidates, slowest_hz, &leaving);
            let explained = |seen: &[Screened]| seen.iter().map(|seen| seen.explained).collect::<Vec<f64>>();
            assert_eq!(explained(&screened), explained(&without_steps), "screened as if there were none");
            let is_cubic = |t: &&Tried| search.candidates[t.candidate].law.id() == "cubic_stiffness";
            let cubic = tried.iter().find(is_cubic).expect("it is fitted");
            assert!(cubic.passes(), "{:?}", cubic.gates);
            let smooth = search.without_rounding(&cubic.member).unwrap();
            let left = |set: &Member| set.fitted.sum_of_squares;
            assert!(left(&smooth) > 1.5 * left(&cubic.member), "the steps are left");
            let (_, stiffness, stderr, ..) = &cubic.parameters[0];
            assert!((stiffness - SPRING).abs() < 4.0 * stderr, "{stiffness} ± {stderr}");
        });
    }
}
