//! Modes that change within a record, in the choice of a model: with their amplitude, in time, or because the
//! recorder's clock jumps. A further mode beside one would only stand in for that.

use super::{Chosen, SHARE_OF_A_MODE, apart, evidence};
use crate::amplitude_law::{
    Change, Dependence, again, dependence, in_time, judged, may_depend, nearest_mode,
};
use crate::forced_model::{ForcedModel, pole};
use crate::levenberg_marquardt::Minimum;
use crate::modal_response::Pole;
use crate::mode_gates::is_impact_test;
use crate::separable::Projected;
use crate::time_shifts::{ClockJumps, refitted};

/// What a further mode stands in for.
pub(super) enum StandsIn {
    /// A mode that goes with its amplitude, which is known by now.
    ForAmplitude,
    /// Something else, in words.
    For(String),
}

/// Share of what a second mode within the band of another explains that a dependence on amplitude must.
const MOST_OF_A_TWIN: f64 = 0.8;
/// How far apart two modes of a structure that goes with its amplitude are one.
const WITHIN_THE_PEAK: f64 = 0.25;
/// Share of what is left of an impact test that a change of a mode must explain.
const OF_BLOWS: f64 = 0.8;

impl Chosen<'_> {
    /// What a further mode would stand in for, where that explains more than it does: a mode that goes with
    /// its amplitude, with which the choice has to begin anew, or something else, in words.
    pub(super) fn stands_in(&mut self, wide: &Minimum<Projected>, new: Pole) -> Option<StandsIn> {
        if !self.looks_for_more {
            return None;
        }
        let mode = nearest_mode(&self.model, &self.minimum, new.frequency_hz)?;
        let own = pole(&self.minimum.parameters, mode);
        // A second mode within the first one's band brings three more numbers.
        let enough = if apart(own, new) < 1.0 { MOST_OF_A_TWIN } else { 1.0 };
        let explained = self.minimum.sum_of_squares - wide.sum_of_squares;
        let (known, change) = self.change_of(mode, enough * explained)?;
        let hz = own.frequency_hz;
        Some(match change {
            Change::WithAmplitude(one) | Change::Unclear(one) => {
                self.new_dependence = Some((known, *one));
                StandsIn::ForAmplitude
            }
            Change::InTime(one) => {
                self.in_time.push(one);
                StandsIn::For(format!(
                    "it is beside the mode at {hz:.4} Hz, which changes while the record runs: it stands in for that"
                ))
            }
            Change::Clock => StandsIn::For(format!(
                "it is beside the mode at {hz:.4} Hz, and samples that were lost explain more: it stands in for that"
            )),
        })
    }

    /// What changes a mode, where that explains more than a share of the sum of squares; with the place of
    /// the dependence on amplitude that is known of it.
    fn change_of(&self, mode: usize, least: f64) -> Option<(Option<usize>, Change)> {
        let before = self.minimum.sum_of_squares;
        let hz = pole(&self.minimum.parameters, mode).frequency_hz;
        if let Some(index) = self.dependences.iter().position(|known| known.is_near(hz)) {
            let found = again(&self.model, &self.minimum, mode, &self.dependences[index])?;
            let change = if found.is_unclear { Change::Unclear } else { Change::WithAmplitude };
            return (before - found.sum_of_squares > least).then(|| (Some(index), change(Box::new(found))));
        }
        let of_amplitude = dependence(&self.model, &self.minimum, mode);
        let of_time = in_time(&self.model, &self.minimum, mode);
        let clock = ClockJumps::of(&self.model, &self.minimum);
        let (change, explained) = judged(before, of_amplitude, of_time, &clock)?;
        // What the samples of a blow miss of it changes from blow to blow.
        let least = if is_impact_test(&self.model) { least.max(OF_BLOWS * before) } else { least };
        (explained > least.max(0.0)).then_some((None, change))
    }

    /// Why a mode beside one that goes with its amplitude is none.
    pub(super) fn beside_a_dependence(&self, new: Pole, explained: f64, asked_for: bool) -> Option<String> {
        let hz = new.frequency_hz;
        let twin = self.poles().into_iter().find(|own| apart(*own, new) < WITHIN_THE_PEAK);
        if let Some(own) = twin.filter(|_| !asked_for && !self.dependences.is_empty()) {
            return Some(format!(
                "it is within the peak of the mode at {:.4} Hz, and the structure goes with its amplitude: it stands in for that",
                own.frequency_hz
            ));
        }
        let is_its = |known: &&Dependence| known.is_near(hz) || explained < known.missed_near(hz);
        let known = self.dependences.iter().find(is_its)?;
        let has_own = self.poles().iter().any(|pole| known.is_near(pole.frequency_hz));
        (has_own && !asked_for).then(|| {
            format!(
                "it is beside the mode at {:.4} Hz, which goes with its amplitude: it stands in for what is left of that",
                known.mean.frequency_hz
            )
        })
    }

    /// The first mode of the complete fit that goes with its amplitude, clearly and enough to matter.
    pub(super) fn dependence_that_matters(&mut self) -> Option<(Option<usize>, Dependence)> {
        if self.is_explained() || !self.looks_for_more {
            return None;
        }
        let matters = |one: &Dependence| {
            let (before, after) = (self.minimum.sum_of_squares, one.sum_of_squares);
            let share = 1.0 - after / before.max(f64::MIN_POSITIVE);
            !one.changes.is_empty()
                && share > SHARE_OF_A_MODE
                && evidence(before, after, self.rows(), 2) > 10.0
        };
        let mut in_time = Vec::new();
        let found = (0..self.model.modes).find_map(|mode| {
            let hz = pole(&self.minimum.parameters, mode).frequency_hz;
            let known = self.dependences.iter().any(|known| known.is_near(hz));
            if !known && !may_depend(&self.model, &self.minimum, mode) {
                return None;
            }
            let (known, change) = self.change_of(mode, SHARE_OF_A_MODE * self.minimum.sum_of_squares)?;
            match change {
                Change::WithAmplitude(one) | Change::Unclear(one) if matters(&one) => Some((known, *one)),
                Change::InTime(one) => {
                    let before = self.minimum.sum_of_squares;
                    let is_clear = evidence(before, one.sum_of_squares, self.rows(), 3) > 10.0;
                    in_time.extend(is_clear.then_some(one));
                    None
                }
                _ => None,
            }
        });
        self.in_time.extend(in_time);
        found
    }

    /// Asks once more, beside all modes, about what was unclear when some of them were still missing.
    pub(super) fn settle(&mut self) {
        for index in 0..self.dependences.len() {
            if !self.dependences[index].is_unclear {
                continue;
            }
            match self.judged_again(index) {
                Some(Change::WithAmplitude(_)) => self.dependences[index].is_unclear = false,
                Some(Change::InTime(one)) => {
                    self.dependences[index].is_unclear = false;
                    self.dependences[index].changes.clear();
                    self.in_time.push(one);
                }
                _ => {}
            }
        }
    }

    /// What changes the mode of a known dependence, in the records as they were before it was taken out.
    fn judged_again(&self, index: usize) -> Option<Change> {
        let known = &self.dependences[index];
        let mode = nearest_mode(&self.model, &self.minimum, known.mean.frequency_hz)?;
        let of_amplitude = again(&self.model, &self.minimum, mode, known);
        let mut records = self.model.records.to_vec();
        known.give_back_to(&mut records);
        let model = ForcedModel { records: &records, ..self.model };
        let found = refitted(&model, &self.minimum)?;
        let clock = ClockJumps::of(&model, &found);
        let of_time = in_time(&model, &found, mode);
        judged(found.sum_of_squares, of_amplitude, of_time, &clock).map(|(change, _)| change)
    }
}
