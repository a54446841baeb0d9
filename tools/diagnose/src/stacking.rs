//! Residuals of many recordings as one long vector, each output in units of its noise.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use stillbeam_identify::tall::{Orthonormal, add_scaled, dot};

use crate::patience::Patience;
use crate::record::Record;
use crate::simulation::{Hypothesis, free_responses, frequency_range_hz, simulate, state_count};
use crate::weighting::Weighting;

/// What is fitted jointly, and in which unit each output counts.
#[derive(Debug, Clone)]
pub(crate) struct Stack<'r> {
    pub(crate) records: Vec<&'r Record>,
    /// Per record and recorded output: how its residuals count.
    pub(crate) weights: Vec<Vec<Weighting>>,
    /// When fits end where they are; `None`: when they have settled.
    pub(crate) patience: Option<Patience>,
}

/// One output of one recording in the long vector.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Segment {
    pub(crate) record: usize,
    pub(crate) output: usize,
    pub(crate) range: Range<usize>,
    /// Samples per second.
    pub(crate) rate_hz: f64,
}

/// One recording under one hypothesis.
#[derive(Debug, Clone)]
pub(crate) struct RecordFit {
    /// Outputs simulated from `initial`, without offsets, one per recorded output, in the output's unit.
    pub(crate) simulated: Vec<Vec<f64>>,
    /// What the nuisances (offsets, initial state) span, in weighted units.
    pub(crate) nuisances: Arc<Orthonormal>,
    /// Weighted residuals with the nuisances taken out; outputs one after another.
    pub(crate) residuals: Vec<f64>,
    /// The initial state that was simulated from.
    pub(crate) initial: Vec<f64>,
}

/// Corrections of an initial state are made at most this often, ...
const MOST_CORRECTIONS: usize = 4;
/// ... until the sum of squares changes by less than this many mean squares.
const SETTLED: f64 = 0.05;
/// Periods of a free decay from which a linear model says where it began, ...
const FIRST_PERIODS: f64 = 2.0;
/// ... this share of it at least, ...
const LEAST_SHARE: f64 = 1.0 / 64.0;
/// ... and by how much the part is lengthened for a model with laws.
const LONGER: f64 = 3.0;
/// Share of an offset's power that no initial state makes, from which it counts as an offset.
const OWN: f64 = 1e-6;
/// A start other than rest has to be this many mean squares better.
const CLEAR: f64 = 10.0;

impl Stack<'_> {
    /// Whether no further fit is to be begun.
    pub(crate) fn is_over(&self) -> bool {
        self.patience.is_some_and(|patience| patience.is_over())
    }

    /// Whether fits are to end where they are.
    pub(crate) fn is_spent(&self) -> bool {
        self.patience.is_some_and(|patience| patience.is_spent())
    }

    /// Number of samples.
    pub(crate) fn present(&self) -> usize {
        self.segments().iter().map(|segment| segment.range.len()).sum()
    }

    /// The stretches of the long vector, one per recorded output of every recording.
    pub(crate) fn segments(&self) -> Vec<Segment> {
        let mut segments = Vec::new();
        let mut start = 0;
        for (record, described) in self.records.iter().enumerate() {
            for (output, signal) in described.outputs.iter().enumerate() {
                let end = start + signal.at.len();
                let rate_hz = described.rate_hz(output);
                segments.push(Segment { record, output, range: start..end, rate_hz });
                start = end;
            }
        }
        segments
    }

    /// Sum of squares of fits of all recordings had their samples been weighted evenly.
    pub(crate) fn even_square(&self, fits: &[RecordFit]) -> f64 {
        let segments = self.segments();
        let starts: Vec<usize> = fits
            .iter()
            .scan(0, |end, fit| {
                let start = *end;
                *end += fit.residuals.len();
                Some(start)
            })
            .collect();
        segments
            .iter()
            .map(|segment| {
                let range =
                    segment.range.start - starts[segment.record]..segment.range.end - starts[segment.record];
                self.weights[segment.record][segment.output]
                    .even_square(&fits[segment.record].residuals[range])
            })
            .sum()
    }

    /// Weighted departure of the recording from a simulation.
    pub(crate) fn departure(&self, index: usize, simulated: &[Vec<f64>]) -> Vec<f64> {
        let outputs = self.records[index].outputs.iter().zip(&self.weights[index]).zip(simulated);
        outputs
            .flat_map(|((output, weighting), simulated)| {
                let departure = output.samples.iter().zip(simulated).map(|(m, s)| m - s);
                weighting.applied(&departure.collect::<Vec<f64>>())
            })
            .collect()
    }

    /// Weighted values of signals that are simulated where the outputs have samples.
    pub(crate) fn weighted(&self, index: usize, signals: &[Vec<f64>]) -> Vec<f64> {
        let outputs = self.weights[index].iter().zip(signals);
        outputs.flat_map(|(weighting, signal)| weighting.applied(signal)).collect()
    }

    /// What offsets and initial state could change: one column per state first, then the offsets. Where both
    /// do the same (an encoder of a base that nothing holds), what was read is where the base is.
    fn nuisances(&self, index: usize, hypothesis: &Hypothesis, initial: &[f64]) -> Option<Arc<Orthonormal>> {
        let responses = free_responses(hypothesis, self.records[index])?;
        self.nuisances_of(index, hypothesis, initial, &responses)
    }

    /// The same from the linear model's free responses.
    fn nuisances_of(
        &self,
        index: usize,
        hypothesis: &Hypothesis,
        initial: &[f64],
        responses: &[Vec<Vec<f64>>],
    ) -> Option<Arc<Orthonormal>> {
        let mut columns: Vec<Vec<f64>> =
            responses.iter().map(|response| self.weighted(index, response)).collect();
        let mut linear = Orthonormal::default();
        columns.iter().for_each(|column| linear.push(column.clone()));
        if !self.adds_free_responses(index, hypothesis) {
            columns = self.state_responses(index, hypothesis, initial, columns)?;
        }
        columns.extend(self.offsets(index, hypothesis, &linear));
        let mut nuisances = Orthonormal::default();
        for column in columns {
            if !column.iter().all(|value| value.is_finite()) {
                return None;
            }
            nuisances.push(column);
        }
        Some(Arc::new(nuisances))
    }

    /// What an unknown zero of each sensor changes; not where the free responses of the `linear` model do the
    /// same.
    pub(crate) fn offsets(
        &self,
        index: usize,
        hypothesis: &Hypothesis,
        linear: &Orthonormal,
    ) -> Vec<Vec<f64>> {
        let record = self.records[index];
        let mut columns = Vec::new();
        for (which, output) in record.outputs.iter().enumerate() {
            if output.zero.is_some() || hypothesis.zero_is_known(&output.column) {
                continue;
            }
            let outputs = record.outputs.iter().enumerate();
            let signals: Vec<Vec<f64>> =
                outputs.map(|(k, output)| vec![f64::from(k == which); output.at.len()]).collect();
            let offset = self.weighted(index, &signals);
            let mut own = offset.clone();
            linear.remove_from(&mut own);
            // Judged by the linear model without its controller: beside a force that depends on position an
            // offset would be its phase, and in a loop the controller makes the reading follow, wherever the
            // sensor of a body that nothing holds has its zero.
            if dot(&own, &own) > OWN * dot(&offset, &offset) {
                columns.push(offset);
            }
        }
        columns.extend(self.beyond_the_model(index));
        columns
    }

    /// What modes beyond those of the model add to every output, where it is freed.
    pub(crate) fn beyond_the_model(&self, index: usize) -> Vec<Vec<f64>> {
        let record = self.records[index];
        let of_output = |(column, which): (&Vec<f64>, usize)| {
            let signals: Vec<Vec<f64>> = (record.outputs.iter().enumerate())
                .map(|(k, output)| {
                    let share = f64::from(k == which);
                    output.at.iter().map(|&stamp| share * column[stamp]).collect()
                })
                .collect();
            self.weighted(index, &signals)
        };
        let columns = record.remainder.iter();
        columns
            .flat_map(|column| (0..record.outputs.len()).map(move |which| (column, which)))
            .map(of_output)
            .collect()
    }

    /// What the initial state changes where laws act, by differences that change little beside the noise and
    /// beside the motion; `linear` are the responses of the linear model, which say how much state that is.
    fn state_responses(
        &self,
        index: usize,
        hypothesis: &Hypothesis,
        initial: &[f64],
        linear: Vec<Vec<f64>>,
    ) -> Option<Vec<Vec<f64>>> {
        let hypothesis = hypothesis.unrounded().unwrap_or_else(|| hypothesis.clone());
        let base = self.prediction(index, &hypothesis, initial)?;
        let count = base.len().max(1) as f64;
        let [change, _] = self.state_change(index, &hypothesis);
        linear
            .into_iter()
            .enumerate()
            .map(|(state, response)| {
                let rms = (dot(&response, &response) / count).sqrt();
                if !(rms.is_finite() && rms > 0.0) {
                    return Some(response);
                }
                let step = change / rms;
                let mut moved = initial.to_vec();
                moved.resize(moved.len().max(state + 1), 0.0);
                moved[state] += step;
                let mut change = self.prediction(index, &hypothesis, &moved)?;
                add_scaled(&mut change, -1.0, &base);
                change.iter_mut().for_each(|value| *value /= step);
                Some(change)
            })
            .collect()
    }

    /// One recording under a hypothesis, simulated from `start`; `None` where it cannot be simulated. What
    /// initial states and offsets could change is taken out of the residual; the corrections of the state
    /// that this amounts to are returned.
    pub(crate) fn evaluate_from(
        &self,
        index: usize,
        hypothesis: &Hypothesis,
        start: &[f64],
        nuisances: &Arc<Orthonormal>,
    ) -> Option<(RecordFit, Vec<f64>)> {
        let record = self.records[index];
        let states = start.len();
        let initial = start.to_vec();
        let simulated = simulate(hypothesis, record, &initial)?;
        let mut residuals = self.departure(index, &simulated);
        if !residuals.iter().all(|value| value.is_finite()) {
            return None;
        }
        let components = nuisances.remove_from(&mut residuals);
        let mut corrections = nuisances.coefficients(&components);
        corrections.truncate(states);
        Some((RecordFit { simulated, nuisances: Arc::clone(nuisances), residuals, initial }, corrections))
    }

    /// The same from the likeliest state: from rest or from the one given, each corrected as the linear model
    /// says.
    fn evaluate_record(&self, index: usize, hypothesis: &Hypothesis, start: &[f64]) -> Option<RecordFit> {
        let mut start: Vec<f64> =
            (0..state_count(hypothesis)?).map(|state| start.get(state).copied().unwrap_or(0.0)).collect();
        let never_rests = !hypothesis.is_linear() && self.never_rests(index, hypothesis);
        if never_rests && start.iter().all(|value| *value == 0.0) {
            start = self.begun_beside_laws(index, hypothesis)?;
        }
        let start = &start[..];
        if self.adds_free_responses(index, hypothesis) {
            let responses = free_responses(hypothesis, self.records[index])?;
            let nuisances = self.nuisances_of(index, hypothesis, start, &responses)?;
            let (mut fit, corrections) = self.evaluate_from(index, hypothesis, start, &nuisances)?;
            // A linear model is corrected exactly.
            for (response, factor) in responses.iter().zip(&corrections) {
                for (signal, part) in fit.simulated.iter_mut().zip(response) {
                    add_scaled(signal, *factor, part);
                }
            }
            add_scaled(&mut fit.initial, 1.0, &corrections);
            return Some(fit);
        }
        if never_rests {
            return self.corrected_from(index, hypothesis, start);
        }
        let power = |fit: &RecordFit| dot(&fit.residuals, &fit.residuals);
        let rest = self.corrected_from(index, hypothesis, &vec![0.0; start.len()]);
        if start.iter().all(|value| *value == 0.0) {
            return rest;
        }
        // States fitted together with a wrong model make up for what it lacks; only a clear gain speaks for
        // them.
        match (rest, self.corrected_from(index, hypothesis, start)) {
            (Some(rest), Some(given)) => {
                let square = power(&given) / given.residuals.len().max(1) as f64;
                Some(if power(&rest) < power(&given) + CLEAR * square { rest } else { given })
            }
            (rest, given) => rest.or(given),
        }
    }

    /// A free decay from the state that its beginning shows, whatever state another model ended with.
    pub(crate) fn begun_anew(&self, index: usize, hypothesis: &Hypothesis) -> Option<RecordFit> {
        let start = self.begun_beside_laws(index, hypothesis)?;
        self.corrected_from(index, hypothesis, &start)
    }

    /// The state that a free decay begins in beside laws. Friction holds at rest whatever a small step away
    /// from it would do, and a linear model of the whole decay, whose frequency or damping goes with the
    /// amplitude, is soon out of step with it: of the first periods it says well enough where the motion
    /// began, and the laws say it better and better of longer and longer parts.
    fn begun_beside_laws(&self, index: usize, hypothesis: &Hypothesis) -> Option<Vec<f64>> {
        let record = self.records[index];
        let (slowest_hz, _) = frequency_range_hz(&hypothesis.model).ok()?;
        let periods = slowest_hz.map_or(1.0, |hz| hz * record.duration_s());
        let mut share = (FIRST_PERIODS / periods).clamp(LEAST_SHARE, 1.0);
        let on = |share: f64, look: &dyn Fn(&Stack<'_>) -> Option<RecordFit>| {
            let part = record.up_to(share);
            look(&Stack { records: vec![&part], weights: vec![self.weights[index].clone()], ..self.clone() })
        };
        let linear = hypothesis.without_laws();
        let mut start = on(share, &|first| first.evaluate_record(0, &linear, &[]))?.initial;
        while share < 1.0 {
            start = on(share, &|part| part.corrected_from(0, hypothesis, &start))?.initial;
            share *= LONGER;
        }
        Some(start)
    }

    /// Whether an initial state only adds the model's free response to a recording: without laws, and where
    /// no controller makes up for it.
    pub(crate) fn adds_free_responses(&self, index: usize, hypothesis: &Hypothesis) -> bool {
        hypothesis.is_linear() && !self.records[index].rerun.is_in_loop()
    }

    /// Whether initial states only add free responses to all recordings.
    pub(crate) fn all_add_free_responses(&self, hypothesis: &Hypothesis) -> bool {
        (0..self.records.len()).all(|index| self.adds_free_responses(index, hypothesis))
    }

    /// Whether rest is no state to begin a recording from: nothing but its initial state moves the machine,
    /// or it moved before.
    pub(crate) fn never_rests(&self, index: usize, hypothesis: &Hypothesis) -> bool {
        let record = self.records[index];
        record.begins_moving || (record.input.is_none() && hypothesis.model.setup().initial.is_empty())
    }

    /// From a state, corrected a few times; the best that was met.
    fn corrected_from(&self, index: usize, hypothesis: &Hypothesis, start: &[f64]) -> Option<RecordFit> {
        let power = |fit: &RecordFit| dot(&fit.residuals, &fit.residuals);
        let nuisances = self.nuisances(index, hypothesis, start)?;
        let (mut best, mut corrections) = self.evaluate_from(index, hypothesis, start, &nuisances)?;
        let mut last = best.initial.clone();
        for _ in 0..MOST_CORRECTIONS {
            let moved: Vec<f64> = last.iter().zip(&corrections).map(|(state, c)| state + c).collect();
            let Some((fit, next)) = self.evaluate_from(index, hypothesis, &moved, &nuisances) else { break };
            (corrections, last) = (next, fit.initial.clone());
            // A correction may change nothing but what a law sees of the position: the later state is the
            // better founded.
            let square = power(&best) / best.residuals.len().max(1) as f64;
            let settled = (power(&fit) - power(&best)).abs() < SETTLED * square;
            if power(&fit) < power(&best) + SETTLED * square {
                best = fit;
            }
            if settled {
                break;
            }
        }
        Some(best)
    }

    /// All recordings under a hypothesis, in order, whatever the number of threads.
    pub(crate) fn evaluate(&self, hypothesis: &Hypothesis, starts: &[Vec<f64>]) -> Option<Vec<RecordFit>> {
        let start = |index: usize| starts.get(index).map_or(&[][..], Vec::as_slice);
        (0..self.records.len())
            .into_par_iter()
            .map(|index| self.evaluate_record(index, hypothesis, start(index)))
            .collect()
    }

    /// The same from exactly the initial states of fits nearby, with what those could change.
    pub(crate) fn evaluate_at(&self, hypothesis: &Hypothesis, near: &[RecordFit]) -> Option<Vec<RecordFit>> {
        (0..self.records.len())
            .into_par_iter()
            .map(|index| {
                let near = &near[index];
                if self.adds_free_responses(index, hypothesis) {
                    return self.evaluate_record(index, hypothesis, &near.initial);
                }
                self.evaluate_from(index, hypothesis, &near.initial, &near.nuisances).map(|(fit, _)| fit)
            })
            .collect()
    }

    /// Whether every sample counts for itself.
    pub(crate) fn is_even(&self) -> bool {
        self.weights.iter().flatten().all(|weighting| matches!(weighting, Weighting::Even(_)))
    }

    /// The same of many long recordings from what the initial states of fits nearby could change: a look at
    /// models that differ from them.
    pub(crate) fn seen_from(&self, hypothesis: &Hypothesis, near: &[RecordFit]) -> Option<Vec<RecordFit>> {
        (0..self.records.len())
            .into_par_iter()
            .map(|index| {
                let near = &near[index];
                Some(self.evaluate_from(index, hypothesis, &near.initial, &near.nuisances)?.0)
            })
            .collect()
    }

    /// A model with laws, begun from the fits of one without or with fewer: from rest or from their initial
    /// states, whichever is better, and with what theirs could change. A look; [`Stack::evaluate`] is the
    /// answer.
    pub(crate) fn begin_near(&self, hypothesis: &Hypothesis, near: &[RecordFit]) -> Option<Vec<RecordFit>> {
        let power = |fit: &RecordFit| dot(&fit.residuals, &fit.residuals);
        (0..self.records.len())
            .into_par_iter()
            .map(|index| {
                let near = &near[index];
                let from = |start: &[f64]| {
                    let found = self.evaluate_from(index, hypothesis, start, &near.nuisances);
                    found.map(|(fit, _)| fit)
                };
                if self.never_rests(index, hypothesis) {
                    return from(&near.initial);
                }
                let rest = from(&vec![0.0; near.initial.len()]);
                if near.initial.iter().all(|value| *value == 0.0) {
                    return rest;
                }
                match (rest, from(&near.initial)) {
                    (Some(rest), Some(given)) => {
                        Some(if power(&rest) < power(&given) { rest } else { given })
                    }
                    (rest, given) => rest.or(given),
                }
            })
            .collect()
    }

    /// Weighted simulated outputs of one recording from a given initial state, nothing taken out.
    pub(crate) fn prediction(
        &self,
        index: usize,
        hypothesis: &Hypothesis,
        initial: &[f64],
    ) -> Option<Vec<f64>> {
        let simulated = simulate(hypothesis, self.records[index], initial)?;
        Some(self.weighted(index, &simulated))
    }
}
