//! Initial states that are searched together with the parameters.
//!
//! Where laws act, what an initial state does depends on the parameters as well as on the state: through a
//! decay whose frequency goes with its amplitude, a little of either moves the phase of every later period.
//! Taken out of the residuals as straight lines (variable projection) the state lags behind the parameters,
//! and a search creeps along a bent valley. Where rest is no state to begin from, the two are moved together.

use stillbeam_identify::levenberg_marquardt::Parameter;
use stillbeam_identify::tall::dot;

use crate::simulation::{Hypothesis, free_responses};
use crate::stacking::{RecordFit, Stack};

/// Differences of a state change the outputs by this much, root mean square in units of the noise, ...
const STATE_CHANGE: f64 = 0.3;
/// ... and, where a recording begins in motion, by no more than this share of it, whatever its noise is said
/// to be.
const SMALL: f64 = 1e-3;
/// The largest step, as a share of the recording.
const LARGEST_STEP: f64 = 0.3;

/// One value of the initial state of one recording.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MovingStart {
    pub(crate) record: usize,
    state: usize,
    /// Change of the value that changes the outputs by as much as they are, root mean square.
    unit: f64,
    /// Difference, in these units, by which derivatives are taken.
    pub(crate) difference: f64,
}

impl MovingStart {
    /// Where the search for it starts: as it is.
    pub(crate) fn as_search() -> Parameter {
        Parameter { start: 0.0, lower: f64::NEG_INFINITY, upper: f64::INFINITY, max_step: LARGEST_STEP }
    }
}

impl Stack<'_> {
    /// By how much, root mean square, the outputs of a recording are changed where derivatives by its initial
    /// state are taken; and what was recorded. Both in units of the noise.
    pub(crate) fn state_change(&self, index: usize, hypothesis: &Hypothesis) -> [f64; 2] {
        let outputs = &self.records[index].outputs;
        let nothing: Vec<Vec<f64>> = outputs.iter().map(|output| vec![0.0; output.at.len()]).collect();
        let recorded = rms(&self.departure(index, &nothing));
        let most = if self.never_rests(index, hypothesis) { SMALL * recorded } else { f64::INFINITY };
        [STATE_CHANGE.min(most), recorded]
    }

    /// The initial values that are searched: of recordings that never rest, where laws act.
    pub(crate) fn moving_starts(&self, hypothesis: &Hypothesis) -> Option<Vec<MovingStart>> {
        let mut found = Vec::new();
        for (index, record) in self.records.iter().enumerate() {
            if self.adds_free_responses(index, hypothesis) || !self.never_rests(index, hypothesis) {
                continue;
            }
            let [change, recorded] = self.state_change(index, hypothesis);
            for (state, response) in free_responses(hypothesis, record)?.iter().enumerate() {
                let unit = recorded / rms(&self.weighted(index, response));
                if unit.is_finite() && unit > 0.0 {
                    found.push(MovingStart { record: index, state, unit, difference: change / recorded });
                }
            }
        }
        Some(found)
    }

    /// Fits of the same recordings from the same states, nothing but offsets taken out of those that are
    /// searched.
    pub(crate) fn with_starts_to_move(
        &self,
        hypothesis: &Hypothesis,
        near: Vec<RecordFit>,
        moving: &[MovingStart],
    ) -> Option<Vec<RecordFit>> {
        let is_moved = |index: usize| moving.iter().any(|start| start.record == index);
        let rows = near.into_iter().enumerate().map(|(index, fit)| {
            if is_moved(index) { self.run_from(index, hypothesis, fit.initial) } else { Some(fit) }
        });
        rows.collect()
    }
}

/// The initial state of a recording with its values moved to these search coordinates.
pub(crate) fn moved_start(moving: &[MovingStart], search: &[f64], record: usize, from: &[f64]) -> Vec<f64> {
    let mut moved = from.to_vec();
    for (start, value) in moving.iter().zip(search).filter(|(start, _)| start.record == record) {
        if moved.len() <= start.state {
            moved.resize(start.state + 1, 0.0);
        }
        moved[start.state] += start.unit * value;
    }
    moved
}

fn rms(column: &[f64]) -> f64 {
    (dot(column, column) / column.len().max(1) as f64).sqrt()
}
