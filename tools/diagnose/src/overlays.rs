//! What was recorded beside what the models make of it.

use rayon::prelude::*;

use crate::noise::OutputResidual;
use crate::quality::role_of;
use crate::record::Record;
use crate::result::Overlay;
use crate::simulation::{Hypothesis, simulate};
use crate::stacking::RecordFit;
use crate::study::{OnAll, Study};

/// All outputs of all recordings under the given, the refitted and the extended model; the first `given_laws`
/// of the extended one are not found but given.
pub(crate) fn overlays(
    study: &Study,
    columns: &[String],
    [given, refitted]: [&OnAll; 2],
    extended: Option<(&Hypothesis, &OnAll)>,
    given_laws: usize,
) -> Vec<Overlay> {
    let bare =
        extended.and_then(|(found, on_all)| without_found(study, &found.with_first_laws(given_laws), on_all));
    let mut overlays = Vec::new();
    for (index, column) in columns.iter().enumerate() {
        let extended = extended.map(|(_, on_all)| study.parts(on_all, index));
        let bare = bare.as_ref().map(|on_all| study.parts(on_all, index));
        let refitted = study.parts(refitted, index);
        for (place, part) in study.parts(given, index).into_iter().enumerate() {
            let recorded = &part.record.outputs[part.output].samples;
            let without_effects = extended.as_ref().zip(bare.as_ref()).map(|(extended, bare)| {
                let OutputResidual { residual, simulated, .. } = &extended[place];
                let change = bare[place].simulated.iter().zip(*simulated).map(|(bare, with)| bare - with);
                let fitted = recorded.iter().zip(residual).map(|(recorded, residual)| recorded - residual);
                fitted.zip(change).map(|(fitted, change)| fitted + change).collect()
            });
            overlays.push(Overlay {
                recording: part.record.name.clone(),
                role: role_of(part.record.role),
                output: column.clone(),
                time_s: part.record.times_s(part.output),
                recorded: recorded.clone(),
                refitted_residual: refitted[place].residual.clone(),
                extended_residual: extended.as_ref().map(|parts| parts[place].residual.clone()),
                without_effects,
                given_residual: part.residual,
            });
        }
    }
    overlays
}

/// The same starts simulated by the machine without the laws that were found; `None` where that cannot be.
fn without_found(study: &Study, bare: &Hypothesis, on_all: &OnAll) -> Option<OnAll> {
    let simulated = |(record, fit): (&Record, &RecordFit)| {
        let simulated = simulate(bare, record, &fit.initial)?;
        let is_finite = simulated.iter().flatten().all(|value| value.is_finite());
        is_finite.then(|| RecordFit { simulated, ..fit.clone() })
    };
    let all = |records: &[Record], fits: &[RecordFit]| {
        let pairs: Vec<(&Record, &RecordFit)> = records.iter().zip(fits).collect();
        pairs.into_par_iter().map(simulated).collect::<Option<Vec<RecordFit>>>()
    };
    Some(OnAll {
        train: all(&study.train, &on_all.train)?,
        held_out: all(&study.held_out, &on_all.held_out)?,
    })
}
