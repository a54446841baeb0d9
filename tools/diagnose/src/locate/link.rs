//! In which link of the chain: every arrow whose two ends were recorded, simulated on its own.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stillbeam_identify::tall::dot;
use stillbeam_plant::{
    BASE_POSITION, BeamSignal, Hold, Input, Model, SETPOINT, StateSpace, TIP_DEFLECTION, TIP_POSITION,
};
use stillbeam_recording::{Recording, Role};

use crate::effort::Effort;
use crate::fit::{Fitted, fit};
use crate::noise::NoiseFloor;
use crate::parameters::{FreeParameter, free_parameters};
use crate::record::Record;
use crate::simulation::Hypothesis;
use crate::stacking::Stack;
use crate::study::{OnAll, Study};
use crate::weighting::Weighting;

/// A link is in order when its residual is at most this many times what noise explains.
const IN_ORDER: f64 = 1.3;
/// Draws of the base's noise; the most that one of them makes of the tip is taken for what it may make.
/// Through a lightly damped mode that scatters widely from one recording to the next.
const DRAWS: u64 = 19;

/// The link that the mismatch belongs to, with a sentence; `None` when the recordings cannot tell. The beam
/// is begun from the parameters of each of `beams`: a refit of the whole chain bends those of the beam to
/// make up for what its base lacks.
pub(crate) fn link(
    study: &Study,
    model: &Model,
    beams: &[&Model],
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
    let alone = beams
        .iter()
        .filter_map(|model| BeamAlone::new(study, model, (base, tip), &columns[tip], tip_floor.rms))
        .min_by(|a, b| a.over_noise().total_cmp(&b.over_noise()))?;
    let (beam_ratio, by_noise) = (alone.over_noise(), alone.by_noise(base_floor.rms));
    let numbers = format!(
        "simulated from the recorded base the beam leaves {beam_ratio:.2} times its noise, of which the base's noise explains up to {by_noise:.2}, and the base itself {base_ratio:.2} times"
    );
    Some(if beam_ratio < IN_ORDER * by_noise {
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
    // A base that the simulation follows exactly has no noise, and nothing is left of it.
    (count > 0.0).then(|| if sum > 0.0 { (sum / count).sqrt() / floor } else { 0.0 })
}

/// The beam driven by the recorded base, its own parameters refitted.
struct BeamAlone {
    records: Vec<Record>,
    fitted: Fitted,
    /// Root mean square of the tip's noise.
    floor: f64,
}

impl BeamAlone {
    fn new(
        study: &Study,
        model: &Model,
        (base, tip): (usize, usize),
        tip_column: &str,
        floor: f64,
    ) -> Option<Self> {
        let Model::BeamOnBase(mut beam) = model.clone() else { return None };
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
        let cut = Hypothesis::given(&cut);
        let free: Vec<FreeParameter> = free_parameters(&cut)
            .into_iter()
            .filter(|parameter| {
                parameter.path.starts_with("beam.young") || parameter.path.contains("beam.damping")
            })
            .collect();
        let start: Vec<f64> = free.iter().map(|parameter| parameter.given).collect();
        let fitted = {
            let weights = vec![vec![Weighting::Even(1.0 / floor)]; records.len()];
            let stack = Stack { records: records.iter().collect(), weights, patience: study.patience };
            fit(&stack, &cut, &free, &start, &[], Effort::COMPARE)?
        };
        Some(Self { records, fitted, floor })
    }

    fn stack(&self) -> Stack<'_> {
        let weights = vec![vec![Weighting::Even(1.0 / self.floor)]; self.records.len()];
        Stack { records: self.records.iter().collect(), weights, patience: None }
    }

    /// Root mean square of what is left over the tip's noise.
    fn over_noise(&self) -> f64 {
        (self.fitted.sum_of_squares / self.stack().present().max(1) as f64).sqrt()
    }

    /// What the noise of tip and recorded base together may leave, likewise: 1 or more.
    fn by_noise(&self, base_floor: f64) -> f64 {
        let drawn = (0..DRAWS).filter_map(|seed| self.noise_through(base_floor, seed));
        (1.0 + drawn.fold(0.0, f64::max) / self.stack().present().max(1) as f64).sqrt()
    }

    /// What white noise of this size on the base's motion makes of the tip: sum of the squared weighted
    /// readings.
    fn noise_through(&self, noise_rms: f64, seed: u64) -> Option<f64> {
        let (stack, fitted) = (self.stack(), &self.fitted);
        let space = StateSpace::new(&fitted.hypothesis.model).ok()?;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut sum = 0.0;
        for (index, (record, fit)) in stack.records.iter().zip(&fitted.records).enumerate() {
            let noise: Vec<f64> = record
                .time_s
                .iter()
                // Uniform, with this root mean square.
                .map(|_| {
                    noise_rms * 12.0_f64.sqrt() * ((random.next_u64() >> 11) as f64 * 2.0_f64.powi(-53) - 0.5)
                })
                .collect();
            let start = space.rest_at(*noise.first()?);
            let trace = space.run(&record.time_s, &noise, Hold::FirstOrder, &[], &start).ok()?;
            let read: Vec<Vec<f64>> = record
                .outputs
                .iter()
                .map(|output| output.at.iter().map(|&k| trace.outputs[output.index][k]).collect())
                .collect();
            let mut weighted = stack.weighted(index, &read);
            fit.nuisances.remove_from(&mut weighted);
            sum += dot(&weighted, &weighted);
        }
        Some(sum)
    }
}
