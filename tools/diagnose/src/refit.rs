//! Refit of a model within its own parameters: which of them are free, and where their search starts.

use rayon::prelude::*;
use stillbeam_identify::tall::{Orthonormal, dot};

use crate::error::DiagnoseError;
use crate::fit::{Effort, Fitted, fit};
use crate::parameters::{FreeParameter, free_parameters};
use crate::simulation::Hypothesis;
use crate::stacking::Stack;

/// A parameter is refitted when a change of a twentieth of its value, or more, would show: its own part of the
/// sensitivity in residual standard deviations. What is known worse than that is known better from the drawing.
const VISIBLE: f64 = 20.0;

/// Refits the model within its own parameters.
///
/// Parameters that the recordings cannot tell apart from those before them in the list stay as given; their
/// paths are returned too.
pub(crate) fn refit(
    stack: &Stack<'_>,
    given: &Hypothesis,
    candidates: &[FreeParameter],
) -> Result<(Fitted, Vec<String>), DiagnoseError> {
    let mut start: Vec<f64> = candidates.iter().map(|parameter| parameter.given).collect();
    scan_frequencies(stack, given, candidates, &mut start);
    refit_at(stack, given, candidates, start, &[])
}

/// The same from where an earlier refit ended.
pub(crate) fn refit_from(
    stack: &Stack<'_>,
    given: &Hypothesis,
    candidates: &[FreeParameter],
    before: &Fitted,
) -> Result<(Fitted, Vec<String>), DiagnoseError> {
    let start = started_from(candidates, before);
    refit_at(stack, given, candidates, start, &[])
}

/// A set of laws fitted again with the model's own parameters, which of those are free decided anew; those that are not
/// are at their given values, which `hypothesis` has.
pub(crate) fn refit_beside_laws(
    stack: &Stack<'_>,
    hypothesis: &Hypothesis,
    before: &Fitted,
) -> Option<Fitted> {
    let laws = before.free.iter().filter(|parameter| parameter.path.starts_with("physics.")).cloned();
    let candidates: Vec<FreeParameter> = laws.chain(free_parameters(&hypothesis.model)).collect();
    let start = started_from(&candidates, before);
    refit_at(stack, hypothesis, &candidates, start, &before.initial_states()).ok().map(|(fitted, _)| fitted)
}

/// Where an earlier fit ended, for the parameters that it had.
fn started_from(candidates: &[FreeParameter], before: &Fitted) -> Vec<f64> {
    let value = |parameter: &FreeParameter| {
        let place = before.free.iter().position(|free| free.path == parameter.path);
        place.map_or(parameter.given, |place| before.values[place])
    };
    candidates.iter().map(value).collect()
}

fn refit_at(
    stack: &Stack<'_>,
    given: &Hypothesis,
    candidates: &[FreeParameter],
    start: Vec<f64>,
    states: &[Vec<f64>],
) -> Result<(Fitted, Vec<String>), DiagnoseError> {
    let diverged = || DiagnoseError::Diverged {
        recording: stack.records.first().map_or_else(String::new, |record| record.name.clone()),
    };
    let moved = given.with_values(candidates, &start).ok_or_else(diverged)?;
    let records = stack.evaluate(&moved, states).ok_or_else(diverged)?;
    let sum_of_squares = records.iter().map(|record| dot(&record.residuals, &record.residuals)).sum();
    let at_start =
        Fitted { hypothesis: moved, free: candidates.to_vec(), values: start, records, sum_of_squares };
    let (kept, dropped) = distinguishable(stack, &at_start);
    let free: Vec<FreeParameter> = kept.iter().map(|&index| candidates[index].clone()).collect();
    let values: Vec<f64> = kept.iter().map(|&index| at_start.values[index]).collect();
    let base = at_start.hypothesis.with_given(&dropped, candidates).ok_or_else(diverged)?;
    let fitted = fit(stack, &base, &free, &values, states, Effort::FULL).ok_or_else(diverged)?;
    let paths = dropped.into_iter().map(|index| candidates[index].path.clone()).collect();
    Ok((fitted, paths))
}

/// Indices of the parameters that add a direction of their own, and of the others.
fn distinguishable(stack: &Stack<'_>, fitted: &Fitted) -> (Vec<usize>, Vec<usize>) {
    let columns = fitted.sensitivities(stack);
    let mut basis = Orthonormal::default();
    let (mut kept, mut dropped) = (Vec::new(), Vec::new());
    // Weighted residuals have about unit size only if the weights are the noise's: judge by what is left now.
    let level = (fitted.sum_of_squares / stack.present().max(1) as f64).sqrt().min(1.0);
    for (index, column) in columns.into_iter().enumerate() {
        let whole = dot(&column, &column).sqrt();
        let mut rest = column.clone();
        basis.remove_from(&mut rest);
        let own = dot(&rest, &rest).sqrt();
        let is_law = fitted.free[index].path.starts_with("physics.");
        if (is_law || own > VISIBLE * level) && own > 1e-5 * whole {
            basis.push(column);
            kept.push(index);
        } else {
            dropped.push(index);
        }
    }
    (kept, dropped)
}

/// A lightly damped structure responds in a narrow band, and a start beside it may end in the wrong valley: every
/// frequency is first looked for around its given value, the others standing still, twice round.
fn scan_frequencies(stack: &Stack<'_>, given: &Hypothesis, free: &[FreeParameter], values: &mut [f64]) {
    const REACH: f64 = 0.12;
    const STEPS: i32 = 24;
    for round in 0..2 {
        for (index, _) in free.iter().enumerate().filter(|(_, parameter)| parameter.sets_frequency()) {
            let reach = if round == 0 { REACH } else { 0.2 * REACH };
            let centre = values[index];
            let sums: Vec<(f64, f64)> = (-STEPS..=STEPS)
                .into_par_iter()
                .filter_map(|step| {
                    // Frequencies go with the root of a stiffness.
                    let power = if free[index].path.ends_with("frequency_hz") { 1.0 } else { 2.0 };
                    let value = centre * (power * reach * f64::from(step) / f64::from(STEPS)).exp();
                    let mut trial = values.to_vec();
                    trial[index] = value;
                    let records = stack.evaluate(&given.with_values(free, &trial)?, &[])?;
                    let sum: f64 = records.iter().map(|r| dot(&r.residuals, &r.residuals)).sum();
                    (value >= free[index].lower && value <= free[index].upper).then_some((sum, value))
                })
                .collect();
            if let Some((_, best)) = sums.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
                values[index] = best;
            }
        }
    }
}
