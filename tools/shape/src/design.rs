//! A designed shaper in the shape of `stillbeam shape --json`.

use serde::{Deserialize, Serialize};
use stillbeam_firmware::machine::HISTORY_SAMPLES;
use stillbeam_firmware::shaper::stage::WEIGHT_ONE;
use stillbeam_firmware::shaper::{Mode, ShaperTable, ShaperType};
use stillbeam_firmware::units::TickRate;

use crate::checksum::Crc32;
use crate::error::ShapeError;
use crate::impulse_sequence::impulse_sequence;
use crate::residual::{cascade_residual, worst_residual};

/// Version of the JSON shape.
pub const SCHEMA_VERSION: u32 = 1;

/// What a design is judged by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignOptions {
    /// How far every mode's true frequency may be off, as a fraction of the one designed for; at least 0, below 1.
    pub frequency_box: f64,
}

impl Default for DesignOptions {
    /// ±5 %.
    fn default() -> Self {
        Self { frequency_box: 0.05 }
    }
}

/// A shaper: what the board runs, what it is in continuous time, and what vibration it leaves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShaperDesign {
    /// Version of this shape, [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Ticks per second that the stages are meant for.
    pub rate_hz: f64,
    /// From a change of the command to the end of its effect, seconds; of the stages as they run.
    pub duration_s: f64,
    /// How far a ramp is delayed: the centroid of the stages as they run, seconds.
    pub delay_s: f64,
    /// CRC over the stages, the same that the board reports after `apply`.
    pub crc32: Crc32,
    /// The shaper in continuous time, sorted, equal times merged (eqs. 30–32).
    pub impulses: Vec<ImpulseEntry>,
    /// The cascade as the board runs it, one stage per mode.
    pub stages: Vec<StageEntry>,
    /// Vibration that the stages leave in every mode.
    pub residual: Residual,
}

/// One impulse.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImpulseEntry {
    /// Dimensionless; all of them sum to one.
    pub amplitude: f64,
    /// Seconds after the first.
    pub time_s: f64,
}

/// One mode's stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageEntry {
    /// Undamped natural frequency of the mode, hertz.
    pub frequency_hz: f64,
    /// Damping ratio of the mode.
    pub damping_ratio: f64,
    /// The type of the shaper.
    #[serde(rename = "type", with = "type_name")]
    pub shaper: ShaperType,
    /// The weight that stands for one.
    pub weight_one: i32,
    /// The taps, delays increasing from zero; weights sum to `weight_one` exactly.
    pub taps: Vec<TapEntry>,
}

/// One tap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TapEntry {
    /// How many ticks ago the sample was taken that this tap weighs.
    pub delay_ticks: u32,
    /// Its weight, `weight_one` being one.
    pub weight: i32,
}

/// Residual vibration per mode, as a fraction of what the unshaped command leaves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Residual {
    /// With the modes exactly as designed for.
    pub nominal: Vec<f64>,
    /// The worst with the mode's frequency anywhere in the box.
    pub worst_over_box: Vec<f64>,
}

impl ShaperDesign {
    /// Designs one stage per mode for a tick rate in hertz, and judges it.
    ///
    /// # Errors
    /// [`ShapeError`]: no or too many modes, a mode at or above half the rate, a rate or a box outside its range,
    /// or delay lines longer than the board's memory.
    pub fn new(modes: &[Mode], rate_hz: f64, options: &DesignOptions) -> Result<Self, ShapeError> {
        let table = design_table(modes, rate_hz)?;
        let fraction = options.frequency_box;
        if !(0.0..1.0).contains(&fraction) {
            return Err(ShapeError::Box { fraction });
        }
        let stages: Vec<StageEntry> = modes
            .iter()
            .zip(table.stages())
            .map(|(mode, stage)| StageEntry::new(mode, stage.taps()))
            .collect();
        let per_mode = |residual: &dyn Fn(&Mode) -> f64| modes.iter().map(residual).collect();
        Ok(Self {
            schema_version: SCHEMA_VERSION,
            rate_hz,
            duration_s: table.duration_s(),
            delay_s: table.delay_s(),
            crc32: Crc32(table.crc32()),
            impulses: impulse_sequence(modes)
                .into_iter()
                .map(|impulse| ImpulseEntry { amplitude: impulse.amplitude, time_s: impulse.time_s })
                .collect(),
            stages,
            residual: Residual {
                nominal: per_mode(&|mode| {
                    cascade_residual(&table, mode.frequency_hz(), mode.damping_ratio())
                }),
                worst_over_box: per_mode(&|mode| {
                    worst_residual(&table, mode.frequency_hz(), mode.damping_ratio(), fraction)
                }),
            },
        })
    }

    /// The JSON text, for people too: indented, ending in a line break.
    pub fn to_json(&self) -> String {
        // Strings, finite numbers and lists of them always serialise.
        serde_json::to_string_pretty(self).map(|text| text + "\n").unwrap_or_default()
    }
}

impl StageEntry {
    fn new(mode: &Mode, taps: &[stillbeam_firmware::shaper::Tap]) -> Self {
        let taps = taps.iter().map(|tap| TapEntry { delay_ticks: tap.delay_ticks, weight: tap.weight });
        Self {
            frequency_hz: mode.frequency_hz(),
            damping_ratio: mode.damping_ratio(),
            shaper: mode.shaper(),
            weight_one: WEIGHT_ONE,
            taps: taps.collect(),
        }
    }
}

/// The core's table for modes at a rate, if the board could run it.
pub(crate) fn design_table(modes: &[Mode], rate_hz: f64) -> Result<ShaperTable, ShapeError> {
    if modes.is_empty() {
        return Err(ShapeError::NoModes);
    }
    let rate = TickRate::from_hz(rate_hz).ok_or(ShapeError::Rate { rate_hz })?;
    let table = ShaperTable::design(modes, rate).map_err(ShapeError::Table)?;
    let (needed, available) = (table.history_samples(), HISTORY_SAMPLES);
    if needed > available {
        return Err(ShapeError::History { needed, available, rate_hz });
    }
    Ok(table)
}

mod type_name {
    use serde::{Deserialize, Deserializer, Serializer};
    use stillbeam_firmware::shaper::ShaperType;

    pub(super) fn serialize<S: Serializer>(shaper: &ShaperType, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(shaper.name())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<ShaperType, D::Error> {
        let text = String::deserialize(deserializer)?;
        crate::mode_spec::parse_type(&text).map_err(serde::de::Error::custom)
    }
}
