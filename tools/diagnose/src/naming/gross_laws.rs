//! Laws that do so much that no linear machine comes near the recordings.
//!
//! A sensor that loses the sign, a drive that clips or play as wide as the motion leave a refit nothing to
//! fit: it ends anywhere, and around it no law does what it does. The model as given, with the law at a size
//! that cannot be overlooked, is nearer to the recordings than without, whatever its parameters are wrong by.
//! Where a refit leaves most of an output, all laws are looked at in this way, and the nearest are fitted
//! from there.

use rayon::prelude::*;
use stillbeam_identify::tall::dot;
use stillbeam_plant::Physics;
use stillbeam_recording::Role;

use super::rounds::Tried;
use super::selection::Search;
use super::sets::Member;
use crate::effort::Effort;
use crate::fit::{Fitted, Others};
use crate::frequency_scan::{IN_STEP, largest_share};
use crate::parameters::free_parameters;
use crate::simulation::Hypothesis;
use crate::stacking::RecordFit;

/// A law's first guess is a small effect: so many times that is looked at.
const SIZES: [f64; 4] = [1.0, 4.0, 16.0, 64.0];
/// A law is gross where the model as given leaves no more than this share of the squares with it that it
/// leaves without, ...
pub(super) const NEARER: f64 = 0.8;
/// ... of which the nearest are fitted.
const FITTED: usize = 4;

impl Search<'_> {
    /// Laws that bring the model as given nearer to the recordings, fitted from there and judged against the
    /// refit; none where the refit is in step with them.
    pub(super) fn gross_laws(&self, refitted: &Member) -> Vec<Tried> {
        let stack = self.study.stack(Role::Train);
        let is_driven = stack.records.iter().all(|record| record.input.is_some());
        if !is_driven || self.is_over() || largest_share(&stack, &refitted.fitted.records) < IN_STEP {
            return Vec::new();
        }
        let Some(drawing) = self.as_drawn() else { return Vec::new() };
        // A wave along the travel is no gross effect, and has a hundred trials.
        let mut near: Vec<(f64, usize, Physics)> = (0..self.candidates.len())
            .into_par_iter()
            .filter(|&candidate| !self.is_wave(candidate))
            .filter_map(|candidate| {
                let (left, physics) = self.nearest(&drawing, candidate)?;
                (left < NEARER * drawing.fitted.sum_of_squares).then_some((left, candidate, physics))
            })
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.truncate(FITTED);
        let fitted = |(_, candidate, physics): &(f64, usize, Physics)| {
            let amplitudes = self.candidates[*candidate].amplitude_names();
            let number = 1 + self.given_laws;
            let begun =
                self.extended(&drawing, *candidate, physics, number, &amplitudes, Others::Searched)?;
            let fitted = self.fitted_on(&begun, Effort::BENT).unwrap_or(begun);
            Some(self.judged_on(refitted, self.member(vec![*candidate], fitted)?, *candidate))
        };
        near.par_iter().filter_map(fitted).collect()
    }

    /// The model as given, all of its parameters free.
    pub(super) fn as_drawn(&self) -> Option<Member> {
        let hypothesis = Hypothesis::given(self.given);
        let free = free_parameters(&hypothesis);
        let values = free.iter().map(|parameter| parameter.given).collect();
        let records = self.study.stack(Role::Train).evaluate(&hypothesis, &[])?;
        let sum_of_squares = squares(&records);
        self.member(Vec::new(), Fitted { hypothesis, free, values, records, sum_of_squares })
    }

    /// The size and shape of a law that leaves least beside the model as given, and what it leaves.
    pub(super) fn nearest(&self, drawing: &Member, candidate: usize) -> Option<(f64, Physics)> {
        let stack = self.study.stack(Role::Train);
        let law = &self.candidates[candidate];
        let sizes = |trial| SIZES.map(|size| law.physics_within_bounds(trial, size));
        let looked_at = law.trials.iter().flat_map(sizes).filter_map(|physics| {
            if self.is_over() {
                return None;
            }
            let hypothesis = drawing.fitted.hypothesis.with_law(physics.clone());
            Some((squares(&stack.begin_near(&hypothesis, &drawing.fitted.records)?), physics))
        });
        looked_at.filter(|(left, _)| left.is_finite()).min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

pub(super) fn squares(fits: &[RecordFit]) -> f64 {
    fits.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum()
}
