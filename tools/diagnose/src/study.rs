//! The recordings of one diagnosis and the three models on them.

use std::sync::Arc;

use stillbeam_identify::tall::dot;
use stillbeam_plant::Model;
use stillbeam_recording::{Recording, Role};

use crate::adequacy::{Adequacy, InputError, Resonance, Series, adequacy};
use crate::between_samples::BetweenSamples;
use crate::common_motion::own_rms;
use crate::cost::Work;
use crate::drawn_error::{DrawnError, drawn_beside_a_fit, tell_floor};
use crate::error::DiagnoseError;
use crate::fit::Fitted;
use crate::noise::{NoiseFloor, NoiseSource, OutputResidual, noise_floor};
use crate::outliers::{lone_outliers, set_aside};
use crate::patience::Patience;
use crate::record::Record;
use crate::remainder::{remainder, shares};
use crate::simulation::{Hypothesis, frequency_range_hz, resonances, simulate};
use crate::stacking::{RecordFit, Stack};
use crate::stated_noise::stated_noise;
use crate::stretches::stretches;
use crate::weighting::{Colour, Weighting};

/// The recordings, sorted by what they are for.
#[derive(Debug, Clone)]
pub(crate) struct Study {
    pub(crate) train: Vec<Record>,
    pub(crate) held_out: Vec<Record>,
    /// Lines about samples set aside.
    pub(crate) set_aside: Vec<String>,
    /// What keeps the verdict from saying more.
    pub(crate) caps: Vec<String>,
    /// Whether all recordings were driven equally hard.
    pub(crate) one_amplitude: bool,
    /// Per output of the model: one over the scale of its residuals.
    pub(crate) weights: Vec<f64>,
    /// Per output of the model: the colour by which its residuals count instead, if any does.
    pub(crate) colours: Vec<Option<Arc<Colour>>>,
    /// Lowest and highest frequency of the model, hertz.
    pub(crate) slowest_hz: Option<f64>,
    pub(crate) fastest_hz: Option<f64>,
    /// What errors of the recorded inputs do, recording by recording, training recordings first; empty before
    /// it was looked for.
    pub(crate) input_errors: Vec<Option<DrawnError>>,
    /// Per output of the model: the noise of its sensor, in its unit, if the model states it.
    pub(crate) stated_noise: Vec<Option<f64>>,
    /// Modes of the refitted model, which an unrecorded force shakes; empty before it was refitted.
    pub(crate) resonances: Vec<Resonance>,
    /// When fits begin no more, and when they end where they are.
    pub(crate) patience: Option<Patience>,
}

/// A model on all recordings.
#[derive(Debug, Clone)]
pub(crate) struct OnAll {
    pub(crate) train: Vec<RecordFit>,
    pub(crate) held_out: Vec<RecordFit>,
}

/// Whether less is left of an output than is looked for.
fn is_resolved(part: &OutputResidual<'_>) -> bool {
    let share = if part.record.rerun.is_in_loop() { RESOLVED_IN_LOOP } else { RESOLVED };
    reach(&part.residual) <= share * reach(&part.record.outputs[part.output].samples)
}

impl Study {
    /// With all its simulations counted there.
    pub(crate) fn counted_by(mut self, work: &Arc<Work>) -> Self {
        self.train.iter_mut().chain(&mut self.held_out).for_each(|record| record.work = Arc::clone(work));
        self
    }

    /// Whether no further search is to be begun.
    pub(crate) fn is_over(&self) -> bool {
        self.patience.is_some_and(|patience| patience.is_over())
    }

    /// Whether even fits that are under way are to end where they are.
    pub(crate) fn is_spent(&self) -> bool {
        self.patience.is_some_and(|patience| patience.is_spent())
    }

    /// Whether all recordings, held out or not, have the same single output.
    pub(crate) fn has_one_output(&self) -> bool {
        let mut outputs = self.train.iter().chain(&self.held_out).flat_map(|record| &record.outputs);
        outputs.next().is_some_and(|first| outputs.all(|other| other.index == first.index))
    }

    /// Sorts and checks the recordings.
    pub(crate) fn new(
        model: &Model,
        train: &[Recording],
        held_out: &[Recording],
    ) -> Result<Self, DiagnoseError> {
        let (slowest_hz, fastest_hz) = frequency_range_hz(model)?;
        let mut study = Self {
            train: Vec::new(),
            held_out: Vec::new(),
            set_aside: Vec::new(),
            caps: Vec::new(),
            one_amplitude: false,
            weights: vec![1.0; model.output_columns().len()],
            colours: vec![None; model.output_columns().len()],
            slowest_hz,
            fastest_hz,
            input_errors: Vec::new(),
            stated_noise: stated_noise(model),
            resonances: Vec::new(),
            patience: None,
        };
        let told = held_out.iter().map(|recording| (recording, Role::HeldOut));
        let by_side_file = train.iter().map(|recording| (recording, recording.role.unwrap_or(Role::Train)));
        for (recording, role) in by_side_file.chain(told) {
            let (records, missing) = stretches(recording, role, model, (slowest_hz, fastest_hz))?;
            study.set_aside.extend(missing);
            match role {
                Role::Train => study.train.extend(records),
                Role::HeldOut => study.held_out.extend(records),
            }
        }
        if study.train.is_empty() {
            return Err(DiagnoseError::NoTraining);
        }
        study.find_held_out(model, train)?;
        study.find_caps(model);
        Ok(study)
    }

    /// Without held-out recordings the last training one is held out, or half of the only one.
    fn find_held_out(&mut self, model: &Model, train: &[Recording]) -> Result<(), DiagnoseError> {
        if !self.held_out.is_empty() {
            return Ok(());
        }
        if self.train.len() > 1 {
            if let Some(last) = self.train.pop() {
                self.caps.push(format!(
                    "no recording was given as held out; {} was held out, so the others had to do for training",
                    last.name
                ));
                self.held_out.push(Record { role: Role::HeldOut, ..last });
            }
            return Ok(());
        }
        let Some(only) = train.first() else { return Ok(()) };
        let middle = only.len() / 2;
        let half = |from: usize, to: usize, which: &str| {
            let mut part = only.clone();
            part.name = format!("{}, {which} half", only.name);
            part.time_s = only.time_s[from..to].to_vec();
            for column in &mut part.columns {
                column.samples = column.samples[from..to].to_vec();
            }
            part
        };
        let first = Record::new(&half(0, middle, "first"), Role::Train, model, None, self.fastest_hz);
        let second =
            Record::new(&half(middle, only.len(), "second"), Role::HeldOut, model, None, self.fastest_hz);
        if let (Ok(first), Ok(second)) = (first, second) {
            self.train = vec![first];
            self.held_out = vec![second];
            self.caps.push(
                "only one recording was given: its second half was held out, and a law that depends on amplitude \
                 cannot be confirmed at another one; record a second run at another amplitude"
                    .to_owned(),
            );
        } else {
            self.caps.push("only one short recording was given: nothing could be held out".to_owned());
        }
        Ok(())
    }

    /// How residuals of one of the model's outputs count.
    pub(crate) fn weighting(&self, output: usize) -> Weighting {
        match &self.colours[output] {
            Some(colour) => Weighting::Innovations(Arc::clone(colour), self.weights[output]),
            None => Weighting::Even(self.weights[output]),
        }
    }

    /// Whether any output counts by its innovations.
    pub(crate) fn is_coloured(&self) -> bool {
        self.colours.iter().any(Option::is_some)
    }

    /// Weights every output by the innovations of what a model leaves of the training recordings. Whether
    /// that makes a difference.
    pub(crate) fn weigh_by_innovations(&mut self, on_all: &OnAll) -> bool {
        let train = OnAll { train: on_all.train.clone(), held_out: Vec::new() };
        let colours: Vec<Option<Arc<Colour>>> = (0..self.weights.len())
            .map(|output| {
                let parts = self.parts(&train, output);
                // A colour is by samples: those of all recordings have to be equally far apart.
                let all = self.train.iter().chain(&self.held_out);
                let mut rates_hz = all.flat_map(|record| {
                    let places = record.outputs.iter().enumerate();
                    places
                        .filter(|(_, signal)| signal.index == output)
                        .map(|(place, _)| record.rate_hz(place))
                });
                let first_hz = rates_hz.next()?;
                if !rates_hz.all(|rate_hz| (rate_hz / first_hz - 1.0).abs() < SAME_RATE) {
                    return None;
                }
                let series: Vec<&[f64]> = parts.iter().map(|part| part.residual.as_slice()).collect();
                Colour::of(&series).map(Arc::new)
            })
            .collect();
        self.colours = colours;
        self.colours.iter().flatten().any(|colour| colour.contrast() > COLOURED)
    }

    /// Weights every output evenly again.
    pub(crate) fn weigh_evenly(&mut self) {
        self.colours.fill(None);
    }

    /// The recordings of one role as one long vector.
    pub(crate) fn stack(&self, role: Role) -> Stack<'_> {
        let records = match role {
            Role::Train => &self.train,
            Role::HeldOut => &self.held_out,
        };
        let weights = records
            .iter()
            .map(|record| record.outputs.iter().map(|output| self.weighting(output.index)).collect())
            .collect();
        Stack { records: records.iter().collect(), weights, patience: self.patience }
    }

    /// All recordings as one long vector, training recordings first.
    pub(crate) fn everything(&self) -> Stack<'_> {
        let (train, held_out) = (self.stack(Role::Train), self.stack(Role::HeldOut));
        Stack {
            records: [train.records, held_out.records].concat(),
            weights: [train.weights, held_out.weights].concat(),
            patience: self.patience,
        }
    }

    /// A hypothesis on all recordings: offsets and initial states are fitted, nothing else.
    pub(crate) fn on_all(
        &self,
        hypothesis: &Hypothesis,
        train_starts: &[Vec<f64>],
        held_out_starts: &[Vec<f64>],
    ) -> Result<OnAll, DiagnoseError> {
        let diverged = |records: &[Record]| DiagnoseError::Diverged {
            recording: records.first().map_or_else(String::new, |record| record.name.clone()),
        };
        Ok(OnAll {
            train: self
                .stack(Role::Train)
                .evaluate(hypothesis, train_starts)
                .ok_or_else(|| diverged(&self.train))?,
            held_out: self
                .stack(Role::HeldOut)
                .evaluate_held_out(hypothesis, held_out_starts)
                .ok_or_else(|| diverged(&self.held_out))?,
        })
    }

    /// Refuses outputs whose size is out of all proportion to what the model computes from rest, alike in
    /// every recording: a unit is wrong everywhere, a base that dry friction holds fast stands still in the
    /// quiet recordings only.
    pub(crate) fn check_units(&self, given: &Hypothesis) -> Result<(), DiagnoseError> {
        // A body that nothing holds may drift anywhere.
        if self.slowest_hz.is_none() || given.model.input().is_none() {
            return Ok(());
        }
        let mut sizes: Vec<Vec<Size<'_>>> = vec![Vec::new(); self.weights.len()];
        for record in self.train.iter().chain(&self.held_out) {
            let Some(simulated) = simulate(given, record, &[]) else { continue };
            for (output, simulated) in record.outputs.iter().zip(&simulated) {
                let (largest, expected) = (reach(&output.samples), reach(simulated));
                if expected > 0.0 {
                    sizes[output.index].push(Size { record, column: &output.column, largest, expected });
                }
            }
        }
        for sizes in sizes {
            let ratios = || sizes.iter().map(|size| size.largest / size.expected);
            let (least, most) = (ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max));
            let out_of_proportion = least > UNIT || most < 1.0 / UNIT;
            if let Some(Size { record, column, largest, expected }) = sizes.first()
                && out_of_proportion
                && most < ALIKE * least
            {
                let (recording, column) = (record.name.clone(), (*column).to_owned());
                return Err(DiagnoseError::Unit {
                    recording,
                    column,
                    largest: *largest,
                    expected: *expected,
                });
            }
        }
        Ok(())
    }

    /// Weights every output by its residuals under a model.
    pub(crate) fn weigh_by(&mut self, on_all: &OnAll) {
        for output in 0..self.weights.len() {
            let (mut sum, mut count) = (0.0, 0);
            for part in self.parts(on_all, output) {
                sum += dot(&part.residual, &part.residual);
                count += part.residual.len();
            }
            let mean_square = sum / f64::from(u32::try_from(count.max(1)).unwrap_or(u32::MAX));
            let rms = mean_square.sqrt().max(self.rounding(output));
            if rms > 0.0 {
                self.weights[output] = 1.0 / rms;
            }
        }
    }

    /// What of an output is rounding, in its unit: a base that follows its setpoint exactly must not outweigh
    /// what sensors saw.
    fn rounding(&self, output: usize) -> f64 {
        let recorded = self.train.iter().chain(&self.held_out).flat_map(|record| &record.outputs);
        let sizes = recorded.filter(|signal| signal.index == output).map(|signal| reach(&signal.samples));
        ROUNDING * sizes.fold(0.0, f64::max)
    }

    /// Whether an output is read in steps, and rounding to them has at least this share of the rest of its
    /// noise: the readings themselves say so, whatever a model leaves over.
    pub(crate) fn is_read_in_steps(&self, floors: &[Option<NoiseFloor>], least_share: f64) -> bool {
        let recorded = self.train.iter().chain(&self.held_out).flat_map(|record| &record.outputs);
        recorded.into_iter().any(|signal| {
            let floor = floors.get(signal.index).and_then(Option::as_ref);
            let (Some(step), Some(floor)) = (signal.step, floor) else { return false };
            let rounding = step.value * step.value / 12.0;
            rounding >= least_share * (floor.rms * floor.rms - rounding)
        })
    }

    /// Weights every output by its noise.
    pub(crate) fn weigh_by_floors(&mut self, floors: &[Option<NoiseFloor>]) {
        for (weight, floor) in self.weights.iter_mut().zip(floors) {
            if let Some(floor) = floor.as_ref().filter(|floor| floor.rms > 0.0) {
                *weight = 1.0 / floor.rms;
            }
        }
    }

    /// Residuals of one of the model's outputs in its unit, training recordings first.
    pub(crate) fn parts<'s>(&'s self, on_all: &'s OnAll, output: usize) -> Vec<OutputResidual<'s>> {
        let records = self.train.iter().zip(&on_all.train).chain(self.held_out.iter().zip(&on_all.held_out));
        let mut parts = Vec::new();
        for (record, fit) in records {
            let mut start = 0;
            for (place, signal) in record.outputs.iter().enumerate() {
                let end = start + signal.at.len();
                if signal.index == output {
                    parts.push(OutputResidual {
                        record,
                        output: place,
                        residual: self.weighting(output).undone(&fit.residuals[start..end]),
                        simulated: &fit.simulated[place],
                    });
                }
                start = end;
            }
        }
        parts
    }

    /// Noise floors of the model's outputs, from what a model leaves over; `None` for outputs never recorded.
    pub(crate) fn floors(&self, on_all: &OnAll) -> Vec<Option<NoiseFloor>> {
        let parts: Vec<Vec<OutputResidual<'_>>> =
            (0..self.weights.len()).map(|output| self.parts(on_all, output)).collect();
        (0..parts.len())
            .map(|output| {
                let floor = noise_floor(&parts[output])?;
                let floor = NoiseFloor { rms: floor.rms.max(self.rounding(output)), ..floor };
                if let Some(stated) = self.stated_noise.get(output).copied().flatten() {
                    return Some(floor.stated(stated, &parts[output]));
                }
                // An upper bound where something is there all the time, which shakes a machine at rest and is
                // another in every repeat; other sensors may give a lower one.
                let others = (0..parts.len()).filter(|other| *other != output);
                let own = others.filter_map(|other| own_rms(&parts[output], &parts[other]));
                let lowest = own.filter(|own| own.0 < floor.rms).min_by(|a, b| a.0.total_cmp(&b.0));
                let (rms, samples) = lowest.unwrap_or((floor.rms, floor.samples));
                Some(NoiseFloor { rms, samples, ..floor })
            })
            .collect()
    }

    /// Whether any noise floor has fallen so far that the weights were wrong.
    pub(crate) fn much_lower(&self, now: &[Option<NoiseFloor>], before: &[Option<NoiseFloor>]) -> bool {
        let pairs = now.iter().flatten().zip(before.iter().flatten());
        pairs.into_iter().any(|(now, before)| now.rms < 0.85 * before.rms)
    }

    /// Draws errors as the recorded inputs have them, and what they do to a linear machine that was fitted to
    /// the training recordings.
    pub(crate) fn draw_input_errors(&mut self, fitted: &Fitted) {
        let machine = fitted.hypothesis.without_laws();
        let mut errors = drawn_beside_a_fit(&self.stack(Role::Train), fitted);
        errors.extend(self.held_out.iter().map(|record| DrawnError::of(record, &machine)));
        self.input_errors = errors;
        self.resonances = resonances(&machine.model);
    }

    /// What errors of the recorded input are in one part.
    fn input_error_of(&self, on_all: &OnAll, part: &OutputResidual<'_>) -> Option<InputError> {
        let mut records = self.train.iter().chain(&self.held_out);
        let number = records.position(|record| std::ptr::eq(record, part.record))?;
        let drawn = self.input_errors.get(number)?.as_ref()?;
        let (role, index, fits) = match number.checked_sub(self.train.len()) {
            None => (Role::Train, number, &on_all.train),
            Some(index) => (Role::HeldOut, index, &on_all.held_out),
        };
        drawn.on((&self.stack(role), index), fits.get(index)?, part.output)
    }

    /// The same recordings with what modes beyond those of a refitted `model` add freed; `None` where nothing
    /// drives them.
    pub(crate) fn with_remainders(&self, model: &Model) -> Option<Self> {
        let mut study = self.clone();
        for record in study.train.iter_mut().chain(&mut study.held_out) {
            record.remainder = remainder(record, model, self.fastest_hz)?;
        }
        Some(study)
    }

    /// The same recordings with nothing beyond the model freed.
    pub(crate) fn without_remainders(&self) -> Self {
        let mut study = self.clone();
        for record in study.train.iter_mut().chain(&mut study.held_out) {
            record.remainder.clear();
        }
        study
    }

    /// With what modes beyond the model add, and how much of every mode of the model an output shows.
    pub(crate) fn with_shares(&self, model: &Model) -> Option<Self> {
        let mut study = self.with_remainders(model)?;
        for record in study.train.iter_mut().chain(&mut study.held_out) {
            record.remainder.extend(shares(record, model, self.fastest_hz)?);
        }
        Some(study)
    }

    /// The same recordings with another guess of what their inputs do between samples; `None` where that is
    /// not asked.
    pub(crate) fn between(&self, between: BetweenSamples, model: &Model) -> Option<Self> {
        let mut study = self.clone();
        for record in study.train.iter_mut().chain(&mut study.held_out) {
            *record = record.between(between, model, self.fastest_hz)?;
        }
        Some(study)
    }

    /// The tests of every output of every recording, training first.
    pub(crate) fn adequacies(&self, on_all: &OnAll, floors: &[Option<NoiseFloor>]) -> Vec<(Role, Adequacy)> {
        let mut tests = Vec::new();
        for (output, floor) in floors.iter().enumerate() {
            let Some(floor) = floor else { continue };
            let mut parts = self.parts(on_all, output);
            // The base of a simulation that follows its setpoint: what is left is rounding, and its noise
            // nothing.
            parts.retain(|part| !is_resolved(part));
            let mut errors: Vec<Option<InputError>> =
                parts.iter().map(|part| self.input_error_of(on_all, part)).collect();
            tell_floor(&mut errors, floor);
            for (part, input_error) in parts.iter().zip(errors) {
                let signal = &part.record.outputs[part.output];
                let input = part.record.input.as_ref();
                let series = Series {
                    residual: &part.residual,
                    simulated: part.simulated,
                    input: input.map(|input| signal.at.iter().map(|&k| input[k]).collect()),
                    rate_hz: part.record.rate_hz(part.output),
                    noise_rms: floor.rms,
                    noise_samples: floor.samples,
                    noise_is_bound: floor.source == NoiseSource::QuietQuarter,
                    slowest_hz: self.slowest_hz.unwrap_or(0.0),
                    resonances: &self.resonances,
                    input_error,
                };
                tests.push((part.record.role, adequacy(&series)));
            }
        }
        tests
    }

    /// Whether a model leaves over no more than rounding and the reading of inputs between their samples do:
    /// recordings without noise, from a simulation. Their noise floor is no noise, and what stands out of it
    /// no physics.
    pub(crate) fn is_exact(&self, on_all: &OnAll) -> bool {
        (0..self.weights.len()).flat_map(|output| self.parts(on_all, output)).all(|part| is_resolved(&part))
    }

    /// Takes out lone outliers that a fitted model shows. Whether there were any.
    pub(crate) fn clean(&mut self, on_all: &OnAll) -> bool {
        let mut lines = Vec::new();
        let mut cleaned = |records: &[Record], stack: &Stack<'_>, fits: &[RecordFit]| -> Vec<Record> {
            records
                .iter()
                .enumerate()
                .map(|(index, record)| {
                    let (record, said) = set_aside(record, &lone_outliers(stack, index, &fits[index]));
                    lines.extend(said);
                    record
                })
                .collect()
        };
        let train = cleaned(&self.train, &self.stack(Role::Train), &on_all.train);
        let held_out = cleaned(&self.held_out, &self.stack(Role::HeldOut), &on_all.held_out);
        (self.train, self.held_out) = (train, held_out);
        let any = !lines.is_empty();
        self.set_aside.extend(lines);
        any
    }
}

/// A rest that is this many times as strong as its innovations is coloured enough to weigh it by those.
const COLOURED: f64 = 1.5;

/// Recordings are sampled at the same rate to within this share.
const SAME_RATE: f64 = 0.01;

/// Share of an output below which no sensor sees anything and simulations round.
const ROUNDING: f64 = 1e-9;

/// Share of an output below which nothing is looked for (80 dB): an input known at samples only leaves that
/// much open at the start of a recording and where it moves fast.
const RESOLVED: f64 = 1e-4;
/// The same of a closed loop, which follows straight lines between its reference's samples: nothing is open
/// there, and what friction does against a stiff controller is as small as this.
const RESOLVED_IN_LOOP: f64 = 1e-6;

/// A recorded output this many times larger or smaller than simulated is in another unit, ...
const UNIT: f64 = 200.0;
/// ... if all recordings agree about how many times to within this factor.
const ALIKE: f64 = 10.0;

/// How large an output was recorded and simulated, root mean square.
#[derive(Clone)]
struct Size<'r> {
    record: &'r Record,
    column: &'r str,
    largest: f64,
    expected: f64,
}

/// Root mean square about the mean.
pub(crate) fn reach(samples: &[f64]) -> f64 {
    let mean = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
    (samples.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / samples.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    use super::*;
    use crate::comparison::compare;
    use crate::naming::on_a_spring::turning;
    use crate::noise::NoiseSource;
    use crate::two_bodies::{NOISE_M, driven, slide, swept};

    #[test]
    fn what_shakes_a_machine_at_rest_is_no_noise_of_either_of_two_sensors() {
        let machine = slide(31000.0, &[]);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut run = |amplitude: f64, shaking: f64, seed: u64| {
            let force = [swept(amplitude), vec![0.0; 2000]].concat();
            let unrecorded = turning(shaking, force.len(), &mut random);
            driven(&machine, &force, Some(&unrecorded), seed)
        };
        for shaking in [0.0, 1.3] {
            let recordings = [run(8.0, shaking, 5), run(16.0, shaking, 6)];
            let mut study = Study::new(&machine, &recordings, &[]).unwrap();
            let compared = compare(&mut study, &Hypothesis::given(&machine)).unwrap();
            for floor in compared.floors.iter().flatten() {
                assert_eq!(floor.source, NoiseSource::QuietStretches);
                let times = floor.rms / NOISE_M;
                assert!((0.9..1.5).contains(&times), "{times} times the noise, shaken by {shaking} N");
            }
            assert_eq!(compared.floors.iter().flatten().count(), 2);
        }
    }
}
