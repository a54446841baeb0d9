//! What laws would do to one recording under the refitted model, beyond what its own parameters could make up
//! for.

use stillbeam_identify::tall::{Orthonormal, dot};
use stillbeam_plant::Motion;
use stillbeam_plant::catalogue::Trial;
use stillbeam_recording::Role;

use crate::fit::Fitted;
use crate::naming::screening::small_effect_on;
use crate::naming::trials::Candidate;
use crate::simulation::{first_effect, motion};
use crate::stacking::Stack;
use crate::study::Study;

/// The training recording with most samples.
pub(crate) struct LookedAt<'s> {
    pub(crate) stack: Stack<'s>,
    pub(crate) fitted: &'s Fitted,
    pub(crate) record: usize,
    pub(crate) samples: usize,
    motion: Option<Motion>,
    /// What the model's parameters could make up for.
    absorbing: Orthonormal,
}

impl<'s> LookedAt<'s> {
    /// `None` without a recording.
    pub(crate) fn new(study: &'s Study, fitted: &'s Fitted) -> Option<Self> {
        let lengths = fitted.records.iter().map(|record| record.residuals.len());
        let (record, samples) = lengths.enumerate().max_by_key(|(_, samples)| *samples)?;
        let stack = study.stack(Role::Train);
        let start: usize = fitted.records[..record].iter().map(|record| record.residuals.len()).sum();
        let mut absorbing = Orthonormal::default();
        for column in fitted.sensitivities(&stack) {
            absorbing.push(column[start..start + samples].to_vec());
        }
        let motion = motion(&fitted.hypothesis, stack.records[record], &fitted.records[record].initial);
        Some(Self { stack, fitted, record, samples, motion, absorbing })
    }

    /// What is left of weighted values once nuisances and the model's parameters have made up for all they
    /// can.
    pub(crate) fn own(&self, mut values: Vec<f64>) -> Vec<f64> {
        self.fitted.records[self.record].nuisances.remove_from(&mut values);
        // Twice: of nearly all of it rounding is left, too.
        self.absorbing.remove_from(&mut values);
        self.absorbing.remove_from(&mut values);
        values
    }

    /// What is left of a law's effect, and at how many times the trial's amplitudes it is that large: a force
    /// along the motion that there is without it, anything else simulated.
    pub(crate) fn effect(&self, candidate: &Candidate, trial: &Trial) -> Option<(f64, Vec<f64>)> {
        let along = self.motion.as_ref().and_then(|motion| {
            let law = candidate.physics(trial, 1.0);
            let signals =
                first_effect(&self.fitted.hypothesis, self.stack.records[self.record], &law, motion)?;
            Some((1.0, self.stack.weighted(self.record, &signals)))
        });
        let simulated =
            || small_effect_on(&self.stack, self.fitted, candidate, trial, self.record..self.record + 1);
        let (size, effect) = along.or_else(simulated)?;
        Some((size, self.own(effect)))
    }
}

/// Sum of squares.
pub(crate) fn square(values: &[f64]) -> f64 {
    dot(values, values)
}
