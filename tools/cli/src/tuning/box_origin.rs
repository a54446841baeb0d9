//! What made a mode's box as wide as it is.

use serde::Serialize;
use stillbeam_shape::ModeBox;

use super::between_recordings::Movement;
use super::figures::percent;
use super::usable_modes::UsableMode;
use crate::shaping::Spread;

/// What made the frequencies of a box as wide as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BoxOrigin {
    /// The floor: less was measured.
    Floor,
    /// What the recordings leave open, and what goes with amplitude.
    Measured,
    /// The recordings differ.
    BetweenRecordings,
}

impl BoxOrigin {
    /// Of a mode's box.
    pub fn of(mode: &UsableMode, floor: Spread, movement: Option<&Movement>) -> Self {
        let (hz, zeta) = (mode.area.nominal_hz(), mode.area.nominal_damping_ratio());
        let [low_hz, high_hz] = mode.filed.uncertainty_box.frequency_hz;
        let holds_measured = |floor: ModeBox| {
            let [floor_low_hz, floor_high_hz] = floor.frequency_hz();
            floor_low_hz <= low_hz && high_hz <= floor_high_hz
        };
        if ModeBox::around(hz, zeta, floor.frequency, floor.damping).is_ok_and(holds_measured) {
            return Self::Floor;
        }
        let apart_hz = movement
            .map_or(0.0, |movement| movement.highest.frequency_hz.value - movement.lowest.frequency_hz.value);
        if apart_hz > 0.5 * (high_hz - low_hz) { Self::BetweenRecordings } else { Self::Measured }
    }

    /// In words, for a table.
    pub fn words(self, floor: Spread) -> String {
        match self {
            Self::Floor => format!("the floor of ±{} (--box-floor)", percent(floor.frequency)),
            Self::Measured => "what was measured".to_owned(),
            Self::BetweenRecordings => "what differs between recordings".to_owned(),
        }
    }
}
