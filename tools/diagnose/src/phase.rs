//! How much of what was recorded a model leaves: whether the two are in phase.

use stillbeam_identify::tall::dot;
use stillbeam_recording::Role;

use crate::noise::OutputResidual;
use crate::study::{OnAll, Study, reach};

/// A refit is out of phase where it leaves more than this share, root mean square, of a recording.
pub(crate) const OUT_OF_PHASE: f64 = 0.4;

impl Study {
    /// The largest share, root mean square, that a model leaves of any output of any training recording.
    pub(crate) fn most_left(&self, on_all: &OnAll) -> f64 {
        self.shares_left(on_all)
            .into_iter()
            .flatten()
            .map(|[left, whole]| (left / whole).sqrt())
            .fold(0.0, f64::max)
    }

    /// The same of any output of all training recordings together.
    pub(crate) fn left_of_all(&self, on_all: &OnAll) -> f64 {
        let of_output = |parts: Vec<[f64; 2]>| {
            let [left, whole] = [0, 1].map(|which| parts.iter().map(|part| part[which]).sum::<f64>());
            (left / whole).sqrt()
        };
        self.shares_left(on_all).into_iter().map(of_output).fold(0.0, f64::max)
    }

    /// What a model leaves of every output of every training recording, and what there was: mean squares.
    fn shares_left(&self, on_all: &OnAll) -> Vec<Vec<[f64; 2]>> {
        let of_output = |output: usize| {
            let parts = self.parts(on_all, output).into_iter().filter(|part| part.record.role == Role::Train);
            let share = |part: OutputResidual<'_>| {
                let left = dot(&part.residual, &part.residual) / part.residual.len().max(1) as f64;
                let whole = reach(&part.record.outputs[part.output].samples).powi(2);
                [left, whole.max(f64::MIN_POSITIVE)]
            };
            parts.map(share).collect()
        };
        (0..self.weights.len()).map(of_output).collect()
    }
}
