//! In which link of the chain: every arrow whose two ends were recorded, simulated on its own.

use stillbeam_plant::{BASE_POSITION, BeamSignal, Input, Model, SETPOINT, TIP_DEFLECTION, TIP_POSITION};
use stillbeam_recording::{Recording, Role};

use crate::fit::{Effort, fit};
use crate::noise::NoiseFloor;
use crate::parameters::{FreeParameter, free_parameters};
use crate::record::Record;
use crate::simulation::Hypothesis;
use crate::stacking::Stack;
use crate::study::{OnAll, Study};

/// A link is in order when its residual is at most this many times the noise: the recorded base brings noise of its own.
const IN_ORDER: f64 = 1.3;

/// The link that the mismatch belongs to, with a sentence; `None` when the recordings cannot tell.
pub(crate) fn link(
    study: &Study,
    model: &Model,
    refitted: &Hypothesis,
    on_all: &OnAll,
    floors: &[Option<NoiseFloor>],
) -> Option<(String, String)> {
    let Model::BeamOnBase(beam) = model else { return None };
    let input = beam.input.as_ref()?;
    if input.column == BASE_POSITION {
        let sentence =
            "The base's motion was given, so the mismatch lies behind it: in the beam or in the sensor.";
        return Some(("beam".to_owned(), sentence.to_owned()));
    }
    let before = if input.column == SETPOINT { "drive" } else { "base" };
    let columns = model.output_columns();
    let base = columns.iter().position(|column| column == BASE_POSITION)?;
    let tip = columns.iter().position(|column| column == TIP_DEFLECTION || column == TIP_POSITION)?;
    let (base_floor, tip_floor) = (floors[base].as_ref()?, floors[tip].as_ref()?);
    let base_ratio = ratio(study, on_all, base, base_floor.rms)?;
    let beam_ratio = beam_alone(study, refitted, (base, tip), &columns[tip], tip_floor.rms)?;
    let numbers = format!(
        "simulated from the recorded base the beam leaves {beam_ratio:.2} times the noise, and the base itself {base_ratio:.2} times"
    );
    Some(if beam_ratio < IN_ORDER {
        let sentence = format!("The mismatch comes in between the input and the base: {numbers}.");
        (before.to_owned(), sentence)
    } else {
        ("beam".to_owned(), format!("The mismatch is in the beam or its sensor: {numbers}."))
    })
}

/// Root mean square of the training residuals of an output over its noise.
fn ratio(study: &Study, on_all: &OnAll, output: usize, floor: f64) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for part in study.parts(on_all, output).iter().filter(|part| part.record.role == Role::Train) {
        sum += part.residual.iter().map(|value| value * value).sum::<f64>();
        count += part.residual.len() as f64;
    }
    (count > 0.0).then(|| (sum / count).sqrt() / floor)
}

/// The same of the tip when the beam alone is driven by the recorded base, its own parameters refitted.
fn beam_alone(
    study: &Study,
    refitted: &Hypothesis,
    (base, tip): (usize, usize),
    tip_column: &str,
    floor: f64,
) -> Option<f64> {
    let Model::BeamOnBase(mut beam) = refitted.model.clone() else { return None };
    beam.input = Some(Input::new(BASE_POSITION));
    beam.drive = None;
    beam.outputs.retain(|signal| *signal != BeamSignal::BasePosition);
    let cut = Model::BeamOnBase(beam);
    let records: Vec<Record> = study
        .train
        .iter()
        .filter_map(|record| {
            let moved = record.outputs.iter().find(|output| output.index == base)?;
            let seen = record.outputs.iter().find(|output| output.index == tip)?;
            // Both from the same stamps: the base between them is not known.
            let times_s: Vec<f64> = moved.at.iter().map(|&k| record.time_s[k]).collect();
            let mut tips = vec![f64::NAN; times_s.len()];
            for (k, value) in seen.at.iter().zip(&seen.samples) {
                if let Ok(place) = moved.at.binary_search(k) {
                    tips[place] = *value;
                }
            }
            let recording = Recording::new(record.name.clone(), times_s)
                .with_column(BASE_POSITION, moved.samples.clone())
                .with_column(tip_column, tips);
            Record::new(&recording, Role::Train, &cut, None, study.fastest_hz).ok()
        })
        .collect();
    let weights = records.iter().map(|_| vec![1.0 / floor]).collect();
    let stack = Stack { records: records.iter().collect(), weights };
    let free: Vec<FreeParameter> = free_parameters(&cut)
        .into_iter()
        .filter(|parameter| {
            parameter.path.starts_with("beam.young") || parameter.path.contains("beam.damping")
        })
        .collect();
    let start: Vec<f64> = free.iter().map(|parameter| parameter.given).collect();
    let fitted = fit(&stack, &Hypothesis { model: cut }, &free, &start, &[], Effort::FULL)?;
    Some((fitted.sum_of_squares / stack.present().max(1) as f64).sqrt())
}
