//! Rounded readings as sharp as the recordings show them.
//!
//! Fits need steps that noise before the rounding has made round, a twentieth of a step at least. Where there
//! was less the mean over such noise misses readings at every step.

use stillbeam_identify::tall::dot;
use stillbeam_recording::Role;

use super::selection::Search;
use super::sets::Member;

/// Shares of a step that the noise before the rounding may have, sharper than those that are fitted.
const SHARPER: [f64; 3] = [0.0, 0.025, 0.035];

impl Search<'_> {
    /// The set with the steps of every rounding that it found as sharp as fits the training recordings best,
    /// all else as it is.
    pub(super) fn with_sharper_steps(&self, member: Member) -> Member {
        let count = member.fitted.hypothesis.model.setup().physics.len();
        (self.given_laws..count).fold(member, |member, law| self.sharpened(&member, law).unwrap_or(member))
    }

    /// The same with one law; `None` for what is no rounding or is as sharp as it should be.
    fn sharpened(&self, member: &Member, law: usize) -> Option<Member> {
        let stack = self.study.stack(Role::Train);
        let sharper = |share: &f64| {
            let mut fitted = member.fitted.clone();
            let law = fitted.hypothesis.model.setup_mut().physics.get_mut(law)?;
            if law.id != "quantisation" {
                return None;
            }
            let dither = share * law.parameters.get("step")?;
            if law.parameters.insert("dither".to_owned(), dither)? <= dither {
                return None;
            }
            fitted.records = stack.evaluate(&fitted.hypothesis, &member.fitted.initial_states())?;
            fitted.sum_of_squares =
                fitted.records.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum();
            (fitted.sum_of_squares < member.fitted.sum_of_squares).then_some(fitted)
        };
        let fitted = SHARPER.iter().filter_map(sharper);
        let best = fitted.min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))?;
        self.member(member.laws.clone(), best)
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;

    use super::*;
    use crate::naming::on_a_spring::{fitted_with, machine, rounded_runs, searched};

    #[test]
    fn steps_are_as_sharp_as_the_noise_before_them_left_them() {
        let step = 2e-3;
        for noise in [0.01, 0.2] {
            let rounded = |amplitudes: &[f64]| rounded_runs(&machine(), amplitudes, noise * step, step);
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
}
