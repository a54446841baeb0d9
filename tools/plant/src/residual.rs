//! Residual vibration after a command, and the percentage vibration of the paper's Table 2.

use crate::error::PlantError;
use crate::modes::Mode;
use crate::prescribed_base::{ModalState, PrescribedBase};

/// The vibration that a command leaves behind.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualVibration {
    /// Per mode: amplitude of the decaying envelope of the tip's vibration at the end of the command, metres.
    /// Exact ([`ModalState::envelope`] times the tip's participation).
    pub mode_amplitudes_m: Vec<f64>,
    /// Peak of the tip's deflection, all modes together, during the window that follows the end of the
    /// command: [`ResidualVibration::WINDOW_PERIODS`] periods of the slowest mode. Metres.
    pub tip_peak_m: f64,
    /// Index of the first tick from which on the setpoint does not change any more.
    pub end_tick: usize,
}

/// Shaped against unshaped: residual amplitudes in percent.
#[derive(Debug, Clone, PartialEq)]
pub struct PercentageVibration {
    /// Per mode.
    pub modes_pct: Vec<f64>,
    /// Of the tip's peak, all modes together.
    pub tip_pct: f64,
}

impl ResidualVibration {
    /// Length of the window in which the tip's peak is sought, in periods of the slowest mode. The fastest
    /// mode has many periods in it, so the peak is where they add up.
    pub const WINDOW_PERIODS: f64 = 2.0;

    /// Samples per period of the fastest mode in the search for the peak: it is missed by less than 0.01 %.
    const SAMPLES_PER_PERIOD: f64 = 256.0;

    /// Runs a plant at rest through the setpoints (metres, one per tick, starting from `plant`'s position)
    /// and takes the vibration that is left at the end of the command.
    ///
    /// Behind a servo the base goes on moving after the setpoint has stopped; then the amplitudes are taken
    /// when the servo has arrived, the same time later for every command, so that ratios are not touched.
    ///
    /// # Errors
    /// [`PlantError::Measure`] when there is no setpoint; [`PlantError::TooFast`] behind a servo so slow that
    /// the fastest mode cannot be followed until it has settled.
    pub fn after(mut plant: PrescribedBase, setpoint_m: &[f64]) -> Result<Self, PlantError> {
        let Some(&target_m) = setpoint_m.last() else {
            return Err(PlantError::Measure { what: "there is no setpoint", remedy: "give at least one" });
        };
        let end_tick =
            setpoint_m.iter().rposition(|&setpoint_m| setpoint_m != target_m).map_or(0, |last| last + 1);
        for &setpoint_m in setpoint_m.iter().take(end_tick + 1) {
            plant.step(setpoint_m);
        }
        if let Some(drive) = plant.drive() {
            let settling_s = drive.settling_time_s(1e-9);
            plant.hold(settling_s)?;
        }
        let (states, modes) = (plant.modal_states(), plant.modes());
        Ok(Self {
            mode_amplitudes_m: states
                .iter()
                .zip(modes)
                .map(|(state, mode)| tip_participation(mode).abs() * state.envelope(mode))
                .collect(),
            tip_peak_m: tip_peak(&states, modes),
            end_tick,
        })
    }

    /// This vibration in percent of that of the `unshaped` command, each at the end of its own command.
    ///
    /// That is the residual vibration `V` of the shaping literature, decay during the shaper included. A mode
    /// that the unshaped command leaves at rest gives infinity, or NaN if the shaped one does too.
    pub fn relative_to(&self, unshaped: &Self) -> PercentageVibration {
        let pairs = self.mode_amplitudes_m.iter().zip(&unshaped.mode_amplitudes_m);
        PercentageVibration {
            modes_pct: pairs.map(|(shaped, unshaped)| 100.0 * shaped / unshaped).collect(),
            tip_pct: 100.0 * self.tip_peak_m / unshaped.tip_peak_m,
        }
    }
}

fn tip_participation(mode: &Mode) -> f64 {
    mode.participation.first().copied().unwrap_or(0.0)
}

/// Peak of the free vibration of all modes together, from the closed form of each.
fn tip_peak(states: &[ModalState], modes: &[Mode]) -> f64 {
    let frequencies_hz = modes.iter().map(|mode| mode.frequency_hz);
    let slowest_hz = frequencies_hz.clone().fold(f64::INFINITY, f64::min);
    let fastest_hz = frequencies_hz.fold(0.0, f64::max);
    let window_s = ResidualVibration::WINDOW_PERIODS / slowest_hz;
    let samples = (window_s * fastest_hz * ResidualVibration::SAMPLES_PER_PERIOD).ceil();
    (0..=samples as usize)
        .map(|index| {
            let time_s = window_s * index as f64 / samples;
            let modes = states.iter().zip(modes);
            modes.map(|(state, mode)| tip_participation(mode) * state.after(mode, time_s)).sum::<f64>().abs()
        })
        .fold(0.0, f64::max)
}
