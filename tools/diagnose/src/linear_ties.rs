//! Laws that do the same as what was found of a linear machine: a tie, whatever the verdict.

use rayon::prelude::*;
use stillbeam_identify::tall::Orthonormal;
use stillbeam_recording::Role;

use crate::fit::Fitted;
use crate::looked_at::{LookedAt, square};
use crate::naming::trials::Candidate;
use crate::result::Tie;
use crate::simulation::simulate;
use crate::stacking::Stack;
use crate::study::Study;

/// A law does the same when less than this share of its effect is left beside the finding.
const SAME: f64 = 0.05;

/// The tie of a linear finding, which is the empty set, with every law that does the same; `None` without
/// any. `plain` is the study and the refit before the finding, `found` the study with it.
pub(crate) fn tie(
    (plain, refitted): (&Study, &Fitted),
    found: &Study,
    candidates: &[Candidate],
) -> Option<Tie> {
    let looked_at = LookedAt::new(plain, refitted)?;
    let finding = effect_of(&looked_at, found);
    let is_same = |candidate: &&Candidate| {
        let first = candidate.trials.first().and_then(|trial| looked_at.effect(candidate, trial));
        first.is_some_and(|(_, effect)| {
            let mut beside = effect.clone();
            finding.remove_from(&mut beside);
            square(&beside) < SAME * square(&effect)
        })
    };
    let same: Vec<String> = candidates.par_iter().filter(is_same).map(Candidate::name).collect();
    if same.is_empty() {
        return None;
    }
    let sentence = format!(
        "These recordings cannot tell apart: {}, and nothing missing; or {}.",
        FINDING,
        same.join("; or ")
    );
    let sets = std::iter::once(Vec::new()).chain(same.into_iter().map(|name| vec![name]));
    Some(Tie { candidates: sets.collect(), sentence })
}

/// The caps say what it is.
const FINDING: &str = "what is said of the input and of further modes";

/// What the finding frees, or changes, on the recording that is looked at.
fn effect_of(looked_at: &LookedAt<'_>, found: &Study) -> Orthonormal {
    let (stack, record) = (&looked_at.stack, looked_at.record);
    let then = Stack { records: found.stack(Role::Train).records, ..stack.clone() };
    let mut columns = then.beyond_the_model(record);
    let initial = &looked_at.fitted.records[record].initial;
    let simulated =
        |stack: &Stack<'_>| simulate(&looked_at.fitted.hypothesis, stack.records[record], initial);
    if then.records[record].between != stack.records[record].between
        && let (Some(before), Some(after)) = (simulated(stack), simulated(&then))
    {
        let difference = |(before, after): (&Vec<f64>, &Vec<f64>)| {
            after.iter().zip(before).map(|(after, before)| after - before).collect::<Vec<f64>>()
        };
        columns.push(stack.weighted(record, &before.iter().zip(&after).map(difference).collect::<Vec<_>>()));
    }
    let mut finding = Orthonormal::default();
    for column in columns {
        finding.push(looked_at.own(column));
    }
    finding
}
