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
