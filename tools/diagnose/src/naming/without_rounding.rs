//! Sets of laws as their readings would be without rounding: where laws beside a rounding are looked for.

use stillbeam_identify::tall::dot;
use stillbeam_recording::Role;

use super::selection::Search;
use super::sets::Member;
use crate::fit::Fitted;

impl Search<'_> {
    /// The set as its readings would be without rounding, where they are rounded: next to a step what another law and the parameters
    /// that follow do is no straight line, and a law that they hide for the most part looks like nothing.
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

    /// The set with rounded readings as sharp as the recordings show them. Fits need steps that some noise has made round; where there was
    /// less, readings are missed at every step.
    pub(super) fn with_sharper_steps(&self, member: Member) -> Member {
        let stack = self.study.stack(Role::Train);
        let sharper = |share: &f64| {
            let mut fitted = member.fitted.clone();
            let physics = &mut fitted.hypothesis.model.setup_mut().physics;
            let law = physics.iter_mut().skip(self.given_laws).find(|law| law.id == "quantisation")?;
            let step = *law.parameters.get("step")?;
            let dither = law.parameters.insert("dither".to_owned(), share * step)?;
            if dither <= share * step {
                return None;
            }
            fitted.records = stack.evaluate(&fitted.hypothesis, &member.fitted.initial_states())?;
            fitted.sum_of_squares =
                fitted.records.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum();
            (fitted.sum_of_squares < member.fitted.sum_of_squares).then_some(fitted)
        };
        let fitted = SHARPER.iter().filter_map(sharper);
        let best = fitted.min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares));
        best.and_then(|fitted| self.member(member.laws.clone(), fitted)).unwrap_or(member)
    }
}

/// Shares of a step that the noise before the rounding may have, sharper than those that are fitted.
const SHARPER: [f64; 3] = [0.0, 0.025, 0.035];

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;
    use stillbeam_recording::Recording;

    use super::*;
    use crate::naming::on_a_spring::{fitted_with, machine, noisy_runs, searched};
    use crate::naming::rounds::Tried;
    use crate::naming::screening::{Leaving, Screened, screen};

    #[test]
    fn steps_are_as_sharp_as_the_noise_before_them_left_them() {
        let step = 2e-3;
        for noise in [0.01, 0.2] {
            let round = |recording: Recording| {
                let position = recording.column("position_m").unwrap().iter();
                let read = position.map(|x| (x / step).round() * step).collect();
                let force = recording.column("force_N").unwrap().to_vec();
                Recording::new(recording.name, recording.time_s)
                    .with_column("force_N", force)
                    .with_column("position_m", read)
            };
            let rounded = |amplitudes: &[f64]| -> Vec<Recording> {
                noisy_runs(&machine(), amplitudes, noise * step).into_iter().map(round).collect()
            };
            searched(&rounded(&[3.0, 9.0]), &rounded(&[5.0]), |search, refitted| {
                let dither = noise.max(0.05) * step;
                let law = Physics::new("quantisation", "sensor").with("step", step).with("dither", dither);
                let fitted = fitted_with(search, &refitted, &law);
                let sharper = search.with_sharper_steps(fitted.clone());
                let of = |set: &Member| set.fitted.hypothesis.model.setup().physics[0].parameters["dither"];
                let is_sharper = of(&sharper) < of(&fitted);
                assert_eq!(is_sharper, noise < 0.05, "{} of {}", of(&sharper), of(&fitted));
                let left = |set: &Member| set.fitted.sum_of_squares;
                assert!(left(&sharper) < if is_sharper { 0.9 } else { 1.000_001 } * left(&fitted));
            });
        }
    }

    #[test]
    fn beside_a_rounding_laws_are_looked_for_as_if_readings_had_no_steps() {
        const SPRING: f64 = -100.0;
        let step = 2e-3;
        let mut truth = machine();
        truth.setup_mut().physics = vec![Physics::new("cubic_stiffness", "mass").with("stiffness", SPRING)];
        let rounded = |amplitudes: &[f64]| -> Vec<Recording> {
            let round = |recording: Recording| {
                let position = recording.column("position_m").unwrap().iter();
                let read = position.map(|x| (x / step).round() * step).collect();
                let force = recording.column("force_N").unwrap().to_vec();
                Recording::new(recording.name, recording.time_s)
                    .with_column("force_N", force)
                    .with_column("position_m", read)
            };
            noisy_runs(&truth, amplitudes, 0.05 * step).into_iter().map(round).collect()
        };
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
