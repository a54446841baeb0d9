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
/// does: its standard error beside the factor within which its given value is right. A law that was missing has
/// hidden what the model does: a damper that is known to a factor of two is refitted though a twentieth of it
/// would not show.
const SURER: f64 = 2.8;
/// Free decays, in which nothing but the machine sets how fast a motion dies away, ask for a parameter that
/// leaves more by this share of the squares where it stays as given, ...
const ASKED_FOR: f64 = 0.01;
/// ... and by so many times the square of one residual at least. ...
const SEEN: f64 = 16.0;
/// ... Where a law is missing they ask for whatever does a part of its work: what goes further, in logarithms,
/// than so many times what its given value can be wrong by was asked to do that, and stays as given.
const STRAYED: f64 = 3.0;

/// Which parameters are free, by their indices.
#[derive(Default)]
pub(crate) struct Determined {
    /// Those that add a direction of their own, ...
    pub(crate) kept: Vec<usize>,
    /// ... and the others.
    pub(crate) dropped: Vec<usize>,
    /// Of those kept, the ones that a small change of would not show, and that the recordings ask for.
    asked_for: Vec<usize>,
}

impl Determined {
    /// Of the parameters of a fit those that add a direction of their own; those `barred` are not asked for.
    pub(crate) fn of(stack: &Stack<'_>, fitted: &Fitted, barred: &[usize]) -> Self {
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
            let is_asked_for = may_ask
                && !barred.contains(&index)
                && loss > (ASKED_FOR * fitted.sum_of_squares).max(SEEN * level * level);
            let sure = own > SURER / free.known_within().ln() * level;
            let shows = if has_added { sure } else { own > VISIBLE * level };
            if (free.is_added || shows || (is_asked_for && sure)) && own > 1e-5 * whole {
                basis.push(column);
                choice.kept.push(index);
                if !free.is_added && !shows {
                    choice.asked_for.push(index);
                }
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

    /// Those that were asked for and went further from the drawing than that can be wrong.
    pub(crate) fn strayed(&self, fitted: &Fitted) -> Vec<usize> {
        let ended = self.kept.iter().zip(fitted.free.iter().zip(&fitted.values));
        let strayed = ended.filter(|(index, (parameter, value))| {
            let moved = parameter.to_search(**value) - parameter.to_search(parameter.given);
            self.asked_for.contains(index) && moved.abs() > STRAYED * parameter.known_within().ln()
        });
        strayed.map(|(index, _)| *index).collect()
    }
}
