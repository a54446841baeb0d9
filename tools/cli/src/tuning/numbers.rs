//! The recommendation for programs.

use serde::Serialize;
use stillbeam_identify::UncertaintyBox;

use super::between_recordings::Movement;
use super::box_origin::BoxOrigin;
use super::left_out::LeftOut;
use super::outcome::Tuning;
use super::reasons::Reasons;
use super::usable_modes::UsableMode;
use crate::shaping::Candidate;

/// The JSON of `tune`.
#[derive(Debug, Serialize)]
pub struct TuningNumbers {
    schema_version: u32,
    rate_hz: f64,
    tolerance: f64,
    recommended: ShaperNumbers,
    reasons: Vec<String>,
    modes: Vec<ModeNumbers>,
    left_out: Vec<LeftOutNumbers>,
    doubts: Vec<String>,
    shapers: Vec<ShaperNumbers>,
}

#[derive(Debug, Serialize)]
struct ShaperNumbers {
    #[serde(rename = "type")]
    kind: String,
    duration_s: f64,
    delay_s: f64,
    worst_over_box: Vec<f64>,
    within_tolerance: bool,
}

#[derive(Debug, Serialize)]
struct ModeNumbers {
    number: usize,
    frequency_hz: f64,
    damping_ratio: f64,
    uncertainty_box: UncertaintyBox,
    box_from: BoxOrigin,
    moved: Option<MovedNumbers>,
}

#[derive(Debug, Serialize)]
struct MovedNumbers {
    fraction: f64,
    lowest: SightingNumbers,
    highest: SightingNumbers,
}

#[derive(Debug, Serialize)]
struct SightingNumbers {
    recording: String,
    frequency_hz: f64,
}

#[derive(Debug, Serialize)]
struct LeftOutNumbers {
    frequency_hz: f64,
    reason: String,
}

impl TuningNumbers {
    /// Of a recommendation.
    pub fn of(tuning: &Tuning) -> Self {
        let recommendation = &tuning.recommendation;
        let shaper = |candidate: &Candidate| ShaperNumbers {
            kind: candidate.name.clone(),
            duration_s: candidate.table.duration_s(),
            delay_s: candidate.table.delay_s(),
            worst_over_box: candidate.worst_over_box().to_vec(),
            within_tolerance: candidate.holds(recommendation.tolerance()),
        };
        Self {
            schema_version: 1,
            rate_hz: tuning.request.rate_hz,
            tolerance: recommendation.tolerance(),
            recommended: shaper(recommendation.best()),
            reasons: Reasons::of(tuning).all(),
            modes: tuning.modes.modes.iter().map(|mode| ModeNumbers::of(mode, tuning)).collect(),
            left_out: tuning.modes.left_out.iter().map(LeftOutNumbers::of).collect(),
            doubts: tuning.doubts.clone(),
            shapers: recommendation.candidates().iter().map(shaper).collect(),
        }
    }
}

impl ModeNumbers {
    fn of(mode: &UsableMode, tuning: &Tuning) -> Self {
        let movement = tuning.movement(mode.number);
        Self {
            number: mode.number,
            frequency_hz: mode.area.nominal_hz(),
            damping_ratio: mode.area.nominal_damping_ratio(),
            uncertainty_box: UncertaintyBox {
                frequency_hz: mode.area.frequency_hz(),
                damping_ratio: mode.area.damping_ratio(),
            },
            box_from: BoxOrigin::of(mode, tuning.request.floor, movement),
            moved: movement.map(MovedNumbers::of),
        }
    }
}

impl MovedNumbers {
    fn of(movement: &Movement) -> Self {
        let [lowest, highest] = [&movement.lowest, &movement.highest].map(|sighting| SightingNumbers {
            recording: sighting.recording.clone(),
            frequency_hz: sighting.frequency_hz.value,
        });
        Self { fraction: movement.fraction(), lowest, highest }
    }
}

impl LeftOutNumbers {
    fn of(mode: &LeftOut) -> Self {
        Self { frequency_hz: mode.frequency_hz, reason: mode.why.clone() }
    }
}
