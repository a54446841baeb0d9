//! The given model and its refit on all recordings, outputs weighted by their noise.

use stillbeam_identify::tall::dot;
use stillbeam_recording::Role;

use crate::adequacy::is_adequate;
use crate::error::DiagnoseError;
use crate::fit::Fitted;
use crate::noise::NoiseFloor;
use crate::options::Options;
use crate::parameters::{FreeParameter, free_parameters};
use crate::refit::{refit, refit_from};
use crate::simulation::Hypothesis;
use crate::study::{OnAll, Study};

/// The given model and its refit, on all recordings.
#[derive(Clone)]
pub(crate) struct Compared {
    pub(crate) given: OnAll,
    pub(crate) refitted: Fitted,
    pub(crate) refitted_on_all: OnAll,
    pub(crate) floors: Vec<Option<NoiseFloor>>,
    /// Paths of parameters that the recordings cannot determine.
    pub(crate) undetermined: Vec<String>,
}

/// Given and refitted model: outputs weighted by their noise, outliers set aside.
pub(crate) fn compare(study: &mut Study, given: &Hypothesis) -> Result<Compared, DiagnoseError> {
    let candidates: Vec<FreeParameter> = free_parameters(given);
    study.check_units(given)?;
    let given_on_all = study.on_all(given, &[], &[])?;
    study.weigh_by(&given_on_all);
    let (first, _) = refit(&study.stack(Role::Train), given, &candidates)?;
    let first = study.in_phase(first, given);
    let first_on_all = study.on_all(&first.hypothesis, &first.initial_states(), &[])?;
    study.clean(&first_on_all);
    let first_on_all = study.on_all(&first.hypothesis, &first.initial_states(), &[])?;
    let floors = study.floors(&first_on_all);
    study.trim_zeros(&first_on_all, &floors);
    settle(study, given, &first, floors)
}

/// The comparison on a study of the same recordings that frees more; `before` is where the search starts.
pub(crate) fn compare_from(
    study: &mut Study,
    given: &Hypothesis,
    before: &Compared,
) -> Result<Compared, DiagnoseError> {
    let (first, _) = refit_from(&study.stack(Role::Train), given, &free_parameters(given), &before.refitted)?;
    let first_on_all = study.on_all(&first.hypothesis, &first.initial_states(), &[])?;
    let floors = study.floors(&first_on_all);
    settle(study, given, &first, floors)
}

/// The comparison with a model that was refitted on the held-out recordings too, where that leaves nothing
/// but noise, and the study with the noise that is seen then.
///
/// Training recordings may not show all of a machine: a mode that only a later sweep reaches is wherever
/// noise has put it, and a right model fails on the held-out ones. Where one set of parameters leaves nothing
/// but noise everywhere, nothing is missing.
pub(crate) fn adequate_on_everything(
    study: &Study,
    given: &Hypothesis,
    before: &Compared,
    options: &Options,
) -> Result<Option<(Study, Compared)>, DiagnoseError> {
    let mut study = study.clone();
    let candidates = free_parameters(given);
    let (mut fitted, mut undetermined) = refit(&study.everything(), given, &candidates)?;
    let mut floors = before.floors.clone();
    let seen = study.floors(&study.split(&fitted));
    // What a refit leaves of recordings on which it fails is taken for noise, at least in part.
    if study.much_lower(&seen, &floors) {
        study.weigh_by_floors(&seen);
        (fitted, undetermined) = refit_from(&study.everything(), given, &candidates, &fitted)?;
        floors = seen;
    }
    let refitted_on_all = study.split(&fitted);
    if !is_adequate(&study.adequacies(&refitted_on_all, &floors), options) {
        return Ok(None);
    }
    let records = refitted_on_all.train.clone();
    let sum_of_squares = records.iter().map(|record| dot(&record.residuals, &record.residuals)).sum();
    let given = study.without_remainders().on_all(given, &[], &[])?;
    let refitted = Fitted { records, sum_of_squares, ..fitted };
    Ok(Some((study, Compared { given, refitted, refitted_on_all, floors, undetermined })))
}

impl Study {
    /// The parts of a fit to everything.
    fn split(&self, fitted: &Fitted) -> OnAll {
        let mut train = fitted.records.clone();
        let held_out = train.split_off(self.train.len());
        OnAll { train, held_out }
    }
}

/// The comparison with outputs weighted by these noise floors, which parameters are free decided anew: an
/// output whose noise is smaller than thought shows more of them. `before` is where the search starts.
pub(crate) fn settle(
    study: &mut Study,
    given: &Hypothesis,
    before: &Fitted,
    floors: Vec<Option<NoiseFloor>>,
) -> Result<Compared, DiagnoseError> {
    study.weigh_by_floors(&floors);
    study.halve_steps(before);
    let candidates: Vec<FreeParameter> = free_parameters(given);
    let (refitted, undetermined) = refit_from(&study.stack(Role::Train), given, &candidates, before)?;
    let refitted_on_all = study.on_all(&refitted.hypothesis, &refitted.initial_states(), &[])?;
    let given = study.without_remainders().on_all(given, &[], &[])?;
    Ok(Compared { given, refitted, refitted_on_all, floors, undetermined })
}
