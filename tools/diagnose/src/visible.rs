//! How small an effect of every kind would have been seen.

use rayon::prelude::*;

use crate::fit::Fitted;
use crate::looked_at::{LookedAt, square};
use crate::naming::trials::Candidate;
use crate::options::Options;
use crate::result::SmallestVisible;
use crate::study::Study;

/// Standard errors at which an effect counts as seen.
const SEEN: f64 = 5.0;
/// Of an effect at least this share must be left beside what the model's parameters make up for; rounding is
/// less.
const LEFT: f64 = 1e-9;

/// Per candidate the size at which its effect, what the model's own parameters could absorb taken out, has
/// the least share of the noise's power that is a finding, and is beyond chance: on the training recording
/// with most samples, in proportion to a small one.
pub(crate) fn smallest_visible(
    study: &Study,
    fitted: &Fitted,
    candidates: &[Candidate],
    options: &Options,
) -> Vec<SmallestVisible> {
    let Some(looked_at) = LookedAt::new(study, fitted) else { return Vec::new() };
    let wanted = (options.least_excess_share * looked_at.samples as f64).max(SEEN * SEEN);
    let model = &fitted.hypothesis.model;
    candidates
        .par_iter()
        .filter_map(|candidate| {
            let trial = candidate.trials.first()?;
            let (name, amplitude) = trial.amplitudes.first()?;
            let (size, effect) = looked_at.effect(candidate, trial)?;
            let left = square(&effect);
            if left < LEFT {
                return None;
            }
            let smallest = (amplitude * size).abs() * (wanted / left).sqrt();
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
