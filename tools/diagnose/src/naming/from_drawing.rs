//! Where the first law is looked for when the refit has run away.
//!
//! The screen looks around a fitted model, and a refit that makes up for what is missing by making another
//! machine of it is no place to look around at: what a saturated drive does to a base of twice the mass looks
//! like nothing in the catalogue. Recordings that the refit was not fitted to tell: where they are predicted
//! worse than by the model as given, the refit has learnt nothing of the machine, and the drawing is the
//! better place. Where they are not, but a parameter had to move by far more than it can be wrong, the
//! drawing is looked around when nothing is found around the refit. What is found there has to pass its gates
//! against the refit all the same.

use stillbeam_identify::tall::dot;
use stillbeam_recording::Role;

use super::selection::Search;
use super::sets::Member;
use crate::adequacy::Rest;
use crate::fit::Fitted;
use crate::stacking::RecordFit;

impl Search<'_> {
    /// The model as given, where it predicts the held-out recordings better than the refit does.
    pub(crate) fn better_drawing(&self, refitted: &Member) -> Option<Member> {
        if self.study.held_out.is_empty() {
            return None;
        }
        let drawn = self.drawing(refitted)?;
        (squares(&drawn.held_out) < squares(&refitted.held_out)).then_some(drawn)
    }

    /// The model as given, where the refit needs another machine for what it explains, and leaves more than
    /// noise even so: dry friction that holds a beam fast is not seen around a beam of which the damper is a
    /// hundred times as strong.
    pub(crate) fn drawing_of_another_machine(&self, refitted: &Member) -> Option<Member> {
        let is_needed =
            self.needs_another_machine(&refitted.fitted) && self.rest(refitted) == Rest::Structured;
        if is_needed { self.drawing(refitted) } else { None }
    }

    /// The model as given, where a parameter of the refit moved by more than its given value can be wrong:
    /// fits of laws are begun there too, for the way back from where the refit went may be a valley that
    /// bends.
    pub(crate) fn drawing_of_far_refit(&self, refitted: &Member) -> Option<Member> {
        if self.moved_far(&refitted.fitted) { self.drawing(refitted) } else { None }
    }

    /// The model as given, its parameters as free as the refit's.
    pub(super) fn drawing(&self, refitted: &Member) -> Option<Member> {
        let fitted = &refitted.fitted;
        let values: Vec<f64> = fitted.free.iter().map(|parameter| parameter.given).collect();
        let hypothesis = fitted.hypothesis.with_values(&fitted.free, &values)?;
        let records = self.study.stack(Role::Train).evaluate(&hypothesis, &fitted.initial_states())?;
        let sum_of_squares = squares(&records);
        let drawn = Fitted { hypothesis, free: fitted.free.clone(), values, records, sum_of_squares };
        self.member(Vec::new(), drawn)
    }
}

fn squares(fits: &[RecordFit]) -> f64 {
    fits.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum()
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::{Model, Physics};

    use super::*;
    use crate::naming::on_a_spring::{machine, noisy_runs, runs, searched};

    /// Where the first law is looked for on a machine, beside the refit to runs at 10 and 12 N; the run that
    /// is held out is at 1 N.
    fn looked_for_at(truth: &Model) -> (Model, Option<Member>) {
        searched(&runs(truth, &[10.0, 12.0]), &runs(truth, &[1.0]), |search, refitted| {
            let drawing = search.better_drawing(&refitted);
            (refitted.fitted.hypothesis.model, drawing)
        })
    }

    #[test]
    fn a_refit_that_has_run_away_gives_way_to_the_drawing() {
        let mut truth = machine();
        truth.setup_mut().physics = vec![Physics::new("saturation", "drive").with("limit", 3.0)];
        let (refitted, drawing) = looked_for_at(&truth);
        let heavier = refitted.parameter("body.mass.mass").unwrap();
        assert!(heavier > 3.0, "the refit makes a limited drive a heavy body: {heavier} kg");
        let drawing = drawing.expect("the run that no limit touches tells");
        for (parameter, value) in drawing.fitted.free.iter().zip(&drawing.fitted.values) {
            assert!((value - parameter.given).abs() < 1e-12 * parameter.given, "{}", parameter.path);
        }
        assert!(!drawing.fitted.free.is_empty(), "as free as the refit");
    }

    #[test]
    fn a_refit_that_has_learnt_the_machine_stays() {
        let mut truth = machine();
        truth.set_parameter("body.mass.mass", 2.2).unwrap();
        let (refitted, drawing) = looked_for_at(&truth);
        assert!((refitted.parameter("body.mass.mass").unwrap() - 2.2).abs() < 0.01);
        assert!(drawing.is_none());
    }

    #[test]
    fn the_drawing_is_the_last_resort_where_another_machine_leaves_more_than_noise() {
        let looked_for = |damping: f64, laws: Vec<Physics>| {
            let mut truth = machine();
            truth.set_parameter("damper.mass-ground.damping", damping).unwrap();
            truth.setup_mut().physics = laws;
            let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-4);
            searched(&noisy(&[10.0, 12.0]), &noisy(&[1.0]), |search, refitted| {
                search.drawing_of_another_machine(&refitted).is_some()
            })
        };
        let stiff = || vec![Physics::new("cubic_stiffness", "mass").with("stiffness", 3e6)];
        assert!(!looked_for(3.0, stiff()), "something is missing, and the machine is the same");
        assert!(!looked_for(90.0, Vec::new()), "another damper explains everything");
        assert!(looked_for(90.0, stiff()), "another damper, and something is missing");
    }
}
