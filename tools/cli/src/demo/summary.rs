//! `summary.json`: the demo's results for programs.

use serde::{Deserialize, Serialize};
use stillbeam_identify::{Estimate, IdentifiedModes};

/// The whole summary.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Version of this shape: 1.
    pub schema_version: u32,
    /// `core`, `qemu` or the port.
    pub board: String,
    /// The identified modes, lowest first.
    pub modes: Vec<ModeSummary>,
    /// The moves in the order in which they were made.
    pub moves: Vec<MoveSummary>,
    /// How long the whole demo took, seconds of real time.
    pub seconds: f64,
}

/// One identified mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModeSummary {
    /// Undamped natural frequency, hertz.
    pub frequency_hz: Estimate,
    /// Damping ratio.
    pub damping_ratio: Estimate,
}

/// One move.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MoveSummary {
    /// `none`, `single-mode zv`, ..., `two-mode zvdd`.
    pub shaper: String,
    /// Seconds from the start of the command until the tip stays within 2 % of the move around its target;
    /// `null` when it does not.
    pub settling_time_s: Option<f64>,
    /// Furthest of the tip beyond its target, percent of the move.
    pub overshoot_pct: f64,
    /// Residual vibration of the tip in percent of that of the unshaped move.
    pub percentage_vibration_pct: f64,
    /// The same for every mode alone.
    pub mode_vibration_pct: Vec<f64>,
    /// CRC of the table, reported by the board and equal to the host's.
    pub crc32: String,
    /// The file with the streamed setpoints and the simulated tip.
    pub setpoint_csv: String,
}

impl ModeSummary {
    /// The modes of an identification.
    pub fn of(modes: &IdentifiedModes) -> Vec<Self> {
        let modes = modes.modes.iter();
        modes
            .map(|mode| Self { frequency_hz: mode.frequency_hz, damping_ratio: mode.damping_ratio })
            .collect()
    }
}
