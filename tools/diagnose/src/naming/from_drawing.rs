//! Where the first law is looked for when the refit has run away.
//!
//! The screen looks around a fitted model, and a refit that makes up for what is missing by making another machine of it is no place to
//! look around at: what a saturated drive does to a base of twice the mass looks like nothing in the catalogue. Recordings that
//! the refit was not fitted to tell: where they are predicted worse than by the model as given, the refit has learnt nothing of the
//! machine, and the drawing is the better place. What is found there has to pass its gates against the refit all the same.

use stillbeam_identify::tall::dot;
use stillbeam_recording::Role;

use super::selection::Search;
use super::sets::Member;
use crate::fit::Fitted;
use crate::stacking::RecordFit;

impl Search<'_> {
    /// The model as given, its parameters as free as the refit's, where it predicts the held-out recordings better than the refit does.
    pub(crate) fn better_drawing(&self, refitted: &Member) -> Option<Member> {
        if self.study.held_out.is_empty() {
            return None;
        }
        let fitted = &refitted.fitted;
        let values: Vec<f64> = fitted.free.iter().map(|parameter| parameter.given).collect();
        let hypothesis = fitted.hypothesis.with_values(&fitted.free, &values)?;
        let records = self.study.stack(Role::Train).evaluate(&hypothesis, &fitted.initial_states())?;
        let sum_of_squares = squares(&records);
        let drawn = Fitted { hypothesis, free: fitted.free.clone(), values, records, sum_of_squares };
        let drawn = self.member(Vec::new(), drawn)?;
        (squares(&drawn.held_out) < squares(&refitted.held_out)).then_some(drawn)
    }
}

fn squares(fits: &[RecordFit]) -> f64 {
    fits.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum()
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::{Model, Physics};

    use super::*;
    use crate::comparison::compare;
    use crate::naming::on_a_spring::{machine, runs};
    use crate::options::Options;
    use crate::patience::Patience;
    use crate::simulation::Hypothesis;
    use crate::study::Study;

    /// Where the first law is looked for on a machine, beside the refit to runs at 10 and 12 N; the run that is held out is at 1 N.
    fn looked_for_at(truth: &Model) -> (Model, Option<Member>) {
        let given = machine();
        let mut study = Study::new(&given, &runs(truth, &[10.0, 12.0]), &runs(truth, &[1.0])).unwrap();
        let compared = compare(&mut study, &Hypothesis::given(&given)).unwrap();
        let options = Options::default();
        let search = Search {
            given_laws: 0,
            given: &given,
            candidates: &[],
            options: &options,
            floors: compared.floors.clone(),
            weighed_again: false,
            patience: Patience::new(&options),
            rounds: std::sync::Mutex::default(),
            held_out_starts: Vec::new(),
            study: &mut study,
        };
        let refitted = search.member(Vec::new(), compared.refitted).unwrap();
        let drawing = search.better_drawing(&refitted);
        (refitted.fitted.hypothesis.model, drawing)
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
}
