//! How far the modes moved from one recording to another.

use stillbeam_identify::{Estimate, IdentifiedMode, IdentifiedModes};

use super::left_out::LeftOut;
use crate::identification::combined::twin;

/// Standard errors beyond which two frequencies differ.
const CLEAR: f64 = 3.0;

/// The frequency of a mode in one recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// Name of the recording.
    pub recording: String,
    /// The frequency there, Hz.
    pub frequency_hz: Estimate,
}

/// A mode where it was lowest and where it was highest.
#[derive(Clone, Debug, PartialEq)]
pub struct Movement {
    /// Its number in the file of modes, counted from 1.
    pub number: usize,
    /// The recording with the lowest frequency.
    pub lowest: Sighting,
    /// The recording with the highest frequency.
    pub highest: Sighting,
}

impl Movement {
    /// From the lowest to the highest, as a fraction of the lowest.
    pub fn fraction(&self) -> f64 {
        self.highest.frequency_hz.value / self.lowest.frequency_hz.value - 1.0
    }

    /// Whether the frequencies differ by more than their errors allow.
    pub fn is_clear(&self) -> bool {
        self.highest.frequency_hz.distance(&self.lowest.frequency_hz) > CLEAR
    }
}

/// The movements of the modes with these numbers, as far as two recordings or more show them.
pub(super) fn movements(
    numbers: &[usize],
    modes: &[IdentifiedMode],
    results: &[IdentifiedModes],
) -> Vec<Movement> {
    let movement = |number: &usize| {
        let mode = modes.get(number - 1)?;
        let mut seen: Vec<Sighting> = results
            .iter()
            .filter_map(|result| {
                let alone = twin(mode, modes, &result.modes)?;
                Some(Sighting { recording: result.recording.clone(), frequency_hz: alone.frequency_hz })
            })
            .collect();
        seen.sort_by(|a, b| a.frequency_hz.value.total_cmp(&b.frequency_hz.value));
        let highest = seen.pop()?;
        let lowest = seen.into_iter().next()?;
        Some(Movement { number: *number, lowest, highest })
    };
    numbers.iter().filter_map(movement).collect()
}

/// Modes of single recordings that are none of all recordings together.
pub(super) fn not_in_all(modes: &[IdentifiedMode], results: &[IdentifiedModes]) -> Vec<LeftOut> {
    let alone = results.iter().flat_map(|result| {
        let strange = result.modes.iter().filter(|mode| twin(mode, &result.modes, modes).is_none());
        strange.map(|mode| LeftOut {
            frequency_hz: mode.frequency_hz.value,
            why: format!(
                "mode at {:.4} Hz: {} shows it, but not every recording; tune that one alone to shape for it",
                mode.frequency_hz.value, result.recording
            ),
        })
    });
    alone.collect()
}
