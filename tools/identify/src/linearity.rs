//! Whether the structure answered as a linear one.

use serde::{Deserialize, Serialize};

use crate::result::IdentifiedMode;
use crate::warnings::{Warning, WarningKind};

/// Whether the structure answered as a linear one, as far as the records can tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LinearityVerdict {
    /// No mode was seen at amplitudes far enough apart to tell.
    #[default]
    NotTested,
    /// Modes were seen at different amplitudes and stayed the same.
    Linear,
    /// A mode's frequency or damping goes with its amplitude, or may do so.
    NotLinear,
    /// A mode's frequency or damping changes while the record runs, whatever its amplitude.
    NotConstant,
}

/// The verdict, and a sentence with its numbers.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Linearity {
    /// The verdict.
    pub verdict: LinearityVerdict,
    /// The sentence.
    pub statement: String,
}

impl Linearity {
    /// What modes say by their course over amplitude.
    pub fn of(modes: &[IdentifiedMode]) -> Self {
        let changes: Vec<String> = modes
            .iter()
            .flat_map(|mode| {
                let hz = mode.frequency_hz.value;
                mode.amplitude_changes.iter().map(move |change| change.words(hz))
            })
            .collect();
        let spans = |mode: &&IdentifiedMode| {
            let sizes = mode.by_amplitude.iter().map(|point| point.amplitude);
            let largest = sizes.clone().fold(0.0, f64::max);
            largest > 2.0 * sizes.fold(f64::INFINITY, f64::min)
        };
        let tested = modes.iter().filter(spans).count();
        let (verdict, statement) = if !changes.is_empty() {
            let what = changes.join("; ");
            (
                LinearityVerdict::NotLinear,
                format!("The structure is not linear: {what}. `stillbeam diagnose` looks for the reason."),
            )
        } else if tested > 0 {
            (
                LinearityVerdict::Linear,
                format!(
                    "No change with amplitude in the {tested} modes that were seen at amplitudes a factor of two or more apart."
                ),
            )
        } else {
            (
                LinearityVerdict::NotTested,
                "No mode was seen at amplitudes far enough apart to tell whether the structure is linear; record at two levels of excitation.".to_owned(),
            )
        };
        Self { verdict, statement }
    }

    /// The same, with the places at which the record shows something that no linear mode does.
    #[must_use]
    pub(crate) fn and_near(self, places: &[Warning]) -> Self {
        match (self.verdict, places.first()) {
            (LinearityVerdict::NotLinear, _) | (_, None) => self,
            (_, Some(Warning { kind: WarningKind::BlowsOfFewSamples { samples, .. }, .. })) => Self {
                verdict: LinearityVerdict::NotTested,
                statement: format!(
                    "Whether the structure is linear cannot be told: a blow lasts {samples} samples of the force; sample it faster, or strike with a softer tip."
                ),
            },
            (_, Some(place)) => Self {
                verdict: match place.kind {
                    WarningKind::NotConstantNear { .. } => LinearityVerdict::NotConstant,
                    _ => LinearityVerdict::NotLinear,
                },
                statement: format!("The structure is {}.", place.message),
            },
        }
    }
}
