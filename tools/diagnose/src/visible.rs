//! How small an effect of every kind would have been seen.

use rayon::prelude::*;
use stillbeam_identify::tall::{Orthonormal, dot};
use stillbeam_plant::Motion;
use stillbeam_recording::Role;

use crate::fit::Fitted;
use crate::naming::screening::small_effect_on;
use crate::naming::trials::{Candidate, Trial};
use crate::options::Options;
use crate::result::SmallestVisible;
use crate::simulation::{first_effect, motion};
use crate::stacking::Stack;
use crate::study::Study;

/// Standard errors at which an effect counts as seen.
const SEEN: f64 = 5.0;

/// Per candidate the size at which its effect, what the model's own parameters could absorb taken out, has the least share of the
/// noise's power that is a finding, and is beyond chance: on the training recording with most samples, in proportion to a small one.
pub(crate) fn smallest_visible(
    study: &Study,
    fitted: &Fitted,
    candidates: &[Candidate],
    options: &Options,
) -> Vec<SmallestVisible> {
    let lengths = fitted.records.iter().map(|record| record.residuals.len());
    let Some((record, samples)) = lengths.enumerate().max_by_key(|(_, samples)| *samples) else {
        return Vec::new();
    };
    let stack = study.stack(Role::Train);
    let start: usize = fitted.records[..record].iter().map(|record| record.residuals.len()).sum();
    let mut absorbing = Orthonormal::default();
    for column in fitted.sensitivities(&stack) {
        absorbing.push(column[start..start + samples].to_vec());
    }
    let motion = motion(&fitted.hypothesis, stack.records[record], &fitted.records[record].initial);
    let looked_at = LookedAt { stack, fitted, record, motion };
    let wanted = (options.least_excess_share * samples as f64).max(SEEN * SEEN);
    let model = &fitted.hypothesis.model;
    candidates
        .par_iter()
        .filter_map(|candidate| {
            let trial = candidate.trials.first()?;
            let (name, amplitude) = trial.amplitudes.first()?;
            let (size, mut effect) = looked_at.effect(candidate, trial)?;
            absorbing.remove_from(&mut effect);
            absorbing.remove_from(&mut effect);
            let smallest = (amplitude * size).abs() * (wanted / dot(&effect, &effect)).sqrt();
            let units = stillbeam_plant::catalogue::parameters_of(model, candidate.law, &candidate.location);
            let unit = units.iter().find(|(spec, _)| spec.name == *name).map(|(_, unit)| unit.clone());
            smallest.is_finite().then(|| SmallestVisible {
                id: candidate.law.id().to_owned(),
                location: candidate.location.clone(),
                parameter: (*name).to_owned(),
                size: smallest,
                unit: unit.unwrap_or_default(),
            })
        })
        .collect()
}

/// One recording under the refitted model.
struct LookedAt<'s> {
    stack: Stack<'s>,
    fitted: &'s Fitted,
    record: usize,
    motion: Option<Motion>,
}

impl LookedAt<'_> {
    /// What a law does, and at how many times the trial's amplitudes: a force along the motion that there is without it, anything else
    /// simulated.
    fn effect(&self, candidate: &Candidate, trial: &Trial) -> Option<(f64, Vec<f64>)> {
        let along = self.motion.as_ref().and_then(|motion| {
            let law = candidate.physics(trial, 1.0);
            let signals =
                first_effect(&self.fitted.hypothesis, self.stack.records[self.record], &law, motion)?;
            let mut effect = self.stack.weighted(self.record, &signals);
            self.fitted.records[self.record].nuisances.remove_from(&mut effect);
            Some((1.0, effect))
        });
        let simulated =
            || small_effect_on(&self.stack, self.fitted, candidate, trial, self.record..self.record + 1);
        along.or_else(simulated)
    }
}
