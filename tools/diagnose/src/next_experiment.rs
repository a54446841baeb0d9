//! Which run would tell tied candidates apart: every run of a list is simulated with every candidate, and
//! what the candidates' own parameters could make up for is taken out of the differences.

use rayon::prelude::*;
use stillbeam_identify::tall::{Orthonormal, add_scaled, dot};
use stillbeam_plant::Model;
use stillbeam_recording::{Recording, Role};

use crate::fit::Fitted;
use crate::options::Options;
use crate::record::Record;
use crate::simulation::{Hypothesis, simulate};
use crate::study::Study;
use crate::sweep::{Sweep, rounded};

/// Sweep amplitudes that are tried, in the largest that was recorded.
const AMPLITUDES: [f64; 4] = [0.3, 1.0, 2.0, 3.0];
/// Relative step of the differences by which parameters are taken out.
const DIFFERENCE: f64 = 1e-4;

/// A command and what is to be expected of it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Proposal {
    pub(crate) command: String,
    pub(crate) reason: String,
}

/// The run out of a list that best separates the first of these models from each of the others.
pub(crate) fn separating_run(study: &Study, tied: &[&Fitted], options: &Options) -> Option<Proposal> {
    let (chosen, rivals) = tied.split_first()?;
    let sweeps = sweeps(study, &chosen.hypothesis.model, options)?;
    let scored: Vec<(f64, Sweep)> = sweeps
        .par_iter()
        .filter_map(|sweep| Some((separation(study, chosen, rivals, *sweep)?, *sweep)))
        .collect();
    let (expected, sweep) = scored.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let command = sweep.command(chosen.hypothesis.model.input_is_motion());
    let reason = if expected > 4.0 {
        format!("would set the candidates {expected:.0} standard errors apart")
    } else {
        format!(
            "of the runs looked at this one tells them apart best, and still by {expected:.1} standard errors only: another sensor is needed"
        )
    };
    Some(Proposal { command, reason })
}

/// The run that a diagnosis without a second amplitude lacks: the largest recorded one doubled.
pub(crate) fn other_amplitude(study: &Study, model: &Model, options: &Options) -> Option<Proposal> {
    let sweeps = sweeps(study, model, options)?;
    let largest = sweeps.iter().max_by(|a, b| a.amplitude.total_cmp(&b.amplitude))?;
    Some(Proposal {
        command: largest.command(model.input_is_motion()),
        reason: "would show whether the effect depends on amplitude".to_owned(),
    })
}

fn sweeps(study: &Study, model: &Model, options: &Options) -> Option<Vec<Sweep>> {
    model.input()?;
    let (slowest_hz, fastest_hz) = (study.slowest_hz?, study.fastest_hz?);
    let mut recorded = 0.0_f64;
    let mut duration_s = 0.0_f64;
    for record in &study.train {
        let input = record.input.as_ref()?;
        let mean = input.iter().sum::<f64>() / input.len().max(1) as f64;
        recorded = input.iter().map(|value| (value - mean).abs()).fold(recorded, f64::max);
        duration_s = duration_s.max(record.duration_s());
    }
    let (low, high) = (rounded(0.3 * slowest_hz), rounded(1.3 * fastest_hz));
    let allowed = options.most_amplitude.unwrap_or(AMPLITUDES[AMPLITUDES.len() - 1] * recorded);
    // What is rounded to three digits may become a two-hundredth larger.
    let within = |sweep: &Sweep| match (&options.limits, moved_mass_kg(model)) {
        (Some(limits), mass_kg) if model.input_is_motion() || mass_kg.is_some() => {
            0.99 * sweep.most_within(limits, mass_kg.filter(|_| !model.input_is_motion()))
        }
        _ => f64::INFINITY,
    };
    let mut sweeps: Vec<Sweep> = Vec::new();
    for amplitude in AMPLITUDES.map(|times| times * recorded) {
        for exponential in [false, true] {
            for (from_hz, to_hz) in [(low, high), (high, low)] {
                let sweep = Sweep { exponential, from_hz, to_hz, duration_s: duration_s.round(), amplitude };
                let amplitude = rounded(amplitude.min(within(&sweep)));
                sweeps.push(Sweep { amplitude, ..sweep });
            }
        }
    }
    sweeps.retain(|sweep| sweep.amplitude > 0.0 && sweep.amplitude <= allowed * (1.0 + 1e-9));
    // Several amplitudes may have come down to the same limit.
    let all = std::mem::take(&mut sweeps);
    for sweep in all {
        if !sweeps.contains(&sweep) {
            sweeps.push(sweep);
        }
    }
    Some(sweeps)
}

/// The mass that a force moves at least: the base without its beam, the pushed body without what hangs on it.
fn moved_mass_kg(model: &Model) -> Option<f64> {
    match model {
        Model::BeamOnBase(beam) => Some(beam.base_mass_kg),
        Model::Lumped(lumped) => {
            let pushed = &lumped.input.as_ref()?.body;
            lumped.bodies.iter().find(|body| body.name == *pushed).map(|body| body.mass)
        }
        _ => None,
    }
}

/// Least distance, in standard errors, of the chosen model from a rival on one run.
fn separation(study: &Study, chosen: &Fitted, rivals: &[&Fitted], sweep: Sweep) -> Option<f64> {
    let record = imagined(study, &chosen.hypothesis.model, sweep)?;
    let flat = |hypothesis: &Hypothesis| -> Option<Vec<f64>> {
        let outputs = simulate(hypothesis, &record, &[])?;
        let weighted = outputs.iter().zip(&record.outputs).flat_map(|(samples, output)| {
            let weight = study.weights[output.index];
            samples.iter().map(move |value| weight * value)
        });
        Some(weighted.collect())
    };
    let base = flat(&chosen.hypothesis)?;
    let mut absorbing = Orthonormal::default();
    let mut start = 0;
    for output in &record.outputs {
        let end = start + output.at.len();
        absorbing.push((0..base.len()).map(|k| f64::from(start <= k && k < end)).collect::<Vec<f64>>());
        start = end;
    }
    for (index, parameter) in chosen.free.iter().enumerate() {
        let mut values = chosen.values.clone();
        let search = parameter.to_search(values[index]);
        values[index] = parameter.to_value(search + parameter.difference(search, DIFFERENCE));
        let Some(moved) = chosen.hypothesis.with_values(&chosen.free, &values) else { continue };
        let mut change = flat(&moved)?;
        add_scaled(&mut change, -1.0, &base);
        absorbing.push(change);
    }
    rivals
        .iter()
        .filter_map(|rival| {
            let mut difference = flat(&rival.hypothesis)?;
            add_scaled(&mut difference, -1.0, &base);
            absorbing.remove_from(&mut difference);
            Some(dot(&difference, &difference).sqrt())
        })
        .reduce(f64::min)
}

/// A recording with the sweep as input and the outputs that are recorded now.
fn imagined(study: &Study, model: &Model, sweep: Sweep) -> Option<Record> {
    let like = study.train.first()?;
    let interval_s = like.duration_s() / (like.time_s.len().max(2) - 1) as f64;
    let count = (sweep.duration_s / interval_s) as usize;
    let time_s: Vec<f64> = (0..=count).map(|k| k as f64 * interval_s).collect();
    let input: Vec<f64> = time_s.iter().map(|t| sweep.at(*t)).collect();
    let mut recording = Recording::new("next", time_s).with_column(model.input()?.column.clone(), input);
    for output in &like.outputs {
        // Only its length and its not standing still matter.
        let ramp = (0..=count).map(|k| k as f64).collect::<Vec<f64>>();
        recording = recording.with_column(output.column.clone(), ramp);
    }
    Record::new(&recording, Role::Train, model, study.slowest_hz, study.fastest_hz).ok()
}
