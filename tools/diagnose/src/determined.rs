//! Which of a model's own parameters the recordings determine.
//!
//! What recordings say less of than the drawing does stays as drawn: beside a law that is missing, directions
//! that hardly show are where a refit runs away to make up for it.

use stillbeam_identify::tall::{Orthonormal, dot};

use crate::fit::Fitted;
use crate::parameters::FreeParameter;
use crate::stacking::Stack;

/// A parameter is refitted when a change of a twentieth of its value, or more, would show: its own part of
/// the sensitivity in residual standard deviations. What is known worse than that is known better from the
/// drawing.
const VISIBLE: f64 = 20.0;
/// Beside laws, and where the recordings ask for it, when they know it so many times better than the drawing
/// does: its standard error beside the factor within which its given value is right. A law that was missing
/// has hidden what the model does: a damper that is known to a factor of two is refitted though a twentieth
/// of it would not show.
const SURER: f64 = 2.8;
/// Free decays, in which nothing but the machine sets how fast a motion dies away, ask for a parameter that
/// leaves more by this share of the squares where it stays as given, ...
const ASKED_FOR: f64 = 0.01;
/// ... and by so many times the square of one residual at least. Where a machine is driven, a law that is
/// missing looks like damping at its resonances, and would be given to a parameter that hardly shows.
const SEEN: f64 = 16.0;

/// Which parameters are free, by their indices.
#[derive(Default)]
pub(crate) struct Determined {
    /// Those that add a direction of their own, ...
    pub(crate) kept: Vec<usize>,
    /// ... and the others.
    pub(crate) dropped: Vec<usize>,
}

impl Determined {
    /// Of the parameters of a fit those that add a direction of their own.
    pub(crate) fn of(stack: &Stack<'_>, fitted: &Fitted) -> Self {
        let columns = fitted.sensitivities(stack);
        let residuals = fitted.residuals();
        let mut basis = Orthonormal::default();
        let mut choice = Self::default();
        let may_ask = stack.records.iter().all(|record| record.input.is_none());
        // Weighted residuals have about unit size only if the weights are the noise's: judge by what is left
        // now. A refit without laws may use all that shows in the noise; beside laws that are not fitted yet,
        // directions that hardly show are where a fit runs away to make up for them.
        let left = (fitted.sum_of_squares / stack.present().max(1) as f64).sqrt();
        let has_added = fitted.free.iter().any(|parameter| parameter.is_added);
        let level = if has_added { left } else { left.min(1.0) };
        for (index, column) in columns.into_iter().enumerate() {
            let whole = dot(&column, &column).sqrt();
            let mut rest = column.clone();
            basis.remove_from(&mut rest);
            let own = dot(&rest, &rest).sqrt();
            let free = &fitted.free[index];
            let moved = free.to_search(fitted.values[index]) - free.to_search(free.given);
            // What it leaves more, where it stays as given, than where the others have it best.
            let loss = (dot(&rest, &residuals) / own + own * moved).powi(2);
            let is_asked_for =
                may_ask && loss > (ASKED_FOR * fitted.sum_of_squares).max(SEEN * level * level);
            let least = if has_added || is_asked_for { SURER / free.known_within().ln() } else { VISIBLE };
            if (free.is_added || own > least * level) && own > 1e-5 * whole {
                basis.push(column);
                choice.kept.push(index);
            } else {
                choice.dropped.push(index);
            }
        }
        choice
    }

    /// Paths of the candidates that stay as they are.
    pub(crate) fn paths_left(&self, candidates: &[FreeParameter]) -> Vec<String> {
        self.dropped.iter().map(|&index| candidates[index].path.clone()).collect()
    }
}
