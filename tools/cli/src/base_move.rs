//! A move of the base by given setpoints, simulated, and how good it was.

use stillbeam_plant::{
    Model, Move, MoveMetrics, PercentageVibration, PlantError, PrescribedBase, ResidualVibration,
    measure_move,
};

use crate::extended_move::simulate_extended;

/// How long the setpoint is held after the move, in periods of the slowest mode: at a damping ratio of 0.005
/// an undisturbed vibration has fallen to 2 % by then.
const HOLD_PERIODS: f64 = 125.0;

/// Ticks for which the setpoint is held after a move.
pub(crate) fn hold_ticks(slowest_hz: f64, rate_hz: f64) -> usize {
    (HOLD_PERIODS / slowest_hz * rate_hz).ceil() as usize
}

/// A simulated move.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseMove {
    /// Samples per second.
    pub rate_hz: f64,
    /// The setpoints that were given, then the last one held; metres.
    pub setpoint_m: Vec<f64>,
    /// Deflection of the tip relative to the base, at the same times; metres.
    pub tip_deflection_m: Vec<f64>,
    /// Absolute position of the tip, at the same times; metres.
    pub tip_position_m: Vec<f64>,
    /// Settling time and overshoot.
    pub metrics: MoveMetrics,
    /// What is left to vibrate when the setpoint has come to rest; for a model with left-out physics the peak
    /// only.
    pub residual: ResidualVibration,
}

impl BaseMove {
    /// Drives `model`, at rest where the setpoints (metres) start, through them, and holds the last one until
    /// an unshaped move would have settled.
    ///
    /// # Errors
    /// [`PlantError`]: the model's input is no motion of the base, the rate is none, or there is no move.
    pub fn simulate(model: &Model, rate_hz: f64, setpoints_m: &[f64]) -> Result<Self, PlantError> {
        let (Some(&from_m), Some(&to_m)) = (setpoints_m.first(), setpoints_m.last()) else {
            return Err(PlantError::Measure { what: "there is no setpoint", remedy: "give at least one" });
        };
        if !model.is_linear() {
            return simulate_extended(model, rate_hz, setpoints_m);
        }
        let mut plant = PrescribedBase::new(model, rate_hz, from_m)?;
        let residual = ResidualVibration::after(plant.clone(), setpoints_m)?;
        let slowest_hz = plant.modes().iter().map(|mode| mode.frequency_hz).fold(f64::INFINITY, f64::min);
        let held = hold_ticks(slowest_hz, rate_hz);
        let mut setpoint_m = setpoints_m.to_vec();
        setpoint_m.resize(setpoints_m.len() + held, to_m);
        let mut tip_deflection_m = vec![plant.tip_deflection_m()];
        let mut tip_position_m = vec![plant.tip_position_m()];
        for setpoint_m in setpoint_m.iter().skip(1) {
            tip_deflection_m.push(plant.step(*setpoint_m));
            tip_position_m.push(plant.tip_position_m());
        }
        let time_s: Vec<f64> = (0..setpoint_m.len()).map(|index| index as f64 / rate_hz).collect();
        let metrics = measure_move(&time_s, &tip_position_m, &Move::new(0.0, from_m, to_m))?;
        Ok(Self { rate_hz, setpoint_m, tip_deflection_m, tip_position_m, metrics, residual })
    }

    /// Residual vibration in percent of that of `unshaped`.
    pub fn percentage_vibration(&self, unshaped: &Self) -> PercentageVibration {
        self.residual.relative_to(&unshaped.residual)
    }

    /// `(seconds, value)` pairs of one of the signals up to `end_s`.
    pub fn points(&self, signal: &[f64], end_s: f64, scale: f64) -> Vec<(f64, f64)> {
        let times = (0..).map(|index| f64::from(index) / self.rate_hz);
        times
            .zip(signal.iter().map(|value| scale * value))
            .take_while(|(time_s, _)| *time_s <= end_s)
            .collect()
    }
}
