//! What was recorded beside what the models make of it.

use rayon::prelude::*;

use crate::quality::role_of;
use crate::record::Record;
use crate::result::Overlay;
use crate::simulation::{Hypothesis, simulate};
use crate::study::{OnAll, Study};

/// All outputs of all recordings under the given, the refitted and the extended model; the first `given_laws` of the extended one are
/// not found but given.
pub(crate) fn overlays(
    study: &Study,
    columns: &[String],
    [given, refitted]: [&OnAll; 2],
    extended: Option<(&Hypothesis, &OnAll)>,
    given_laws: usize,
) -> Vec<Overlay> {
    let bare = extended.map(|(hypothesis, on_all)| bare_changes(study, hypothesis, on_all, given_laws));
    let mut overlays = Vec::new();
    for (index, column) in columns.iter().enumerate() {
        let extended = extended.map(|(_, on_all)| study.parts(on_all, index));
        let refitted = study.parts(refitted, index);
        for (place, part) in study.parts(given, index).into_iter().enumerate() {
            let recorded = &part.record.outputs[part.output].samples;
            let extended_residual = extended.as_ref().map(|parts| parts[place].residual.clone());
            let of_this =
                |(record, _): &&(&Record, Option<Vec<Vec<f64>>>)| std::ptr::eq(*record, part.record);
            let change = bare.iter().flatten().find(of_this).and_then(|(_, change)| change.as_ref());
            let without_effects = change.zip(extended_residual.as_ref()).map(|(change, residual)| {
                let fitted = recorded.iter().zip(residual).map(|(recorded, residual)| recorded - residual);
                fitted.zip(&change[part.output]).map(|(fitted, change)| fitted + change).collect()
            });
            overlays.push(Overlay {
                recording: part.record.name.clone(),
                role: role_of(part.record.role),
                output: column.clone(),
                time_s: part.record.times_s(part.output),
                recorded: recorded.clone(),
                refitted_residual: refitted[place].residual.clone(),
                extended_residual,
                without_effects,
                given_residual: part.residual,
            });
        }
    }
    overlays
}

/// How the recorded outputs would change without the laws that were found, by recording; `None` where that machine cannot be simulated.
fn bare_changes<'s>(
    study: &'s Study,
    found: &Hypothesis,
    on_all: &OnAll,
    given_laws: usize,
) -> Vec<(&'s Record, Option<Vec<Vec<f64>>>)> {
    let bare = found.with_first_laws(given_laws);
    let records = study.train.iter().zip(&on_all.train).chain(study.held_out.iter().zip(&on_all.held_out));
    let records: Vec<_> = records.collect();
    records
        .into_par_iter()
        .map(|(record, fit)| {
            let change = simulate(&bare, record, &fit.initial).map(|outputs| {
                let pairs = outputs.into_iter().zip(&fit.simulated);
                pairs.map(|(bare, with)| bare.iter().zip(with).map(|(b, w)| b - w).collect()).collect()
            });
            let is_finite =
                |change: &Vec<Vec<f64>>| change.iter().flatten().all(|value: &f64| value.is_finite());
            (record, change.filter(is_finite))
        })
        .collect()
}
