//! Whether a shaper with negative weights keeps the setpoint within what the machine can do.
//!
//! With G the sum of the magnitudes of the weights, the setpoint's velocity and acceleration are at most G
//! times the command's. The board plans its own moves slower by G; commands from elsewhere must leave that
//! room.

use std::str::FromStr;

use stillbeam_firmware::motion::SweepSpec;
use stillbeam_firmware::settings::Settings;
use stillbeam_firmware::shaper::ShaperTable;

use crate::command_signal::{MotionCommand, shaped_setpoints_m};
use crate::error::CliError;

/// A velocity and an acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MachineLimits {
    /// mm/s, above 0.
    pub velocity_mm_s: f64,
    /// mm/s², above 0.
    pub acceleration_mm_s2: f64,
}

impl Default for MachineLimits {
    /// The board's settings as they come.
    fn default() -> Self {
        let limits = Settings::default().limits();
        Self { velocity_mm_s: limits.velocity_mm_s, acceleration_mm_s2: limits.acceleration_mm_s2 }
    }
}

impl FromStr for MachineLimits {
    type Err = CliError;

    /// `VELOCITY,ACCELERATION` in mm/s and mm/s².
    fn from_str(text: &str) -> Result<Self, CliError> {
        let numbers: Vec<Option<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
        match numbers.as_slice() {
            [Some(velocity_mm_s), Some(acceleration_mm_s2)]
                if [velocity_mm_s, acceleration_mm_s2]
                    .iter()
                    .all(|limit| limit.is_finite() && **limit > 0.0) =>
            {
                Ok(Self { velocity_mm_s: *velocity_mm_s, acceleration_mm_s2: *acceleration_mm_s2 })
            }
            _ => Err(CliError::Usage(format!(
                "limits `{text}`: write VELOCITY,ACCELERATION in mm/s and mm/s², both above 0, such as 500,5000"
            ))),
        }
    }
}

/// Where a machine may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    /// One end, mm.
    pub from_mm: f64,
    /// The other end, mm, above it.
    pub to_mm: f64,
}

impl FromStr for Travel {
    type Err = CliError;

    /// `FROM,TO` in mm.
    fn from_str(text: &str) -> Result<Self, CliError> {
        let numbers: Vec<Option<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
        match numbers.as_slice() {
            [Some(from_mm), Some(to_mm)] if from_mm < to_mm && from_mm.is_finite() && to_mm.is_finite() => {
                Ok(Self { from_mm: *from_mm, to_mm: *to_mm })
            }
            _ => Err(CliError::Usage(format!(
                "travel `{text}`: write FROM,TO in mm, the first below the second, such as -100,100"
            ))),
        }
    }
}

/// A move of the board through a table, and what it asked of the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MoveCheck {
    /// From the first to the last change of the setpoint, seconds.
    pub duration_s: f64,
    /// Largest velocity of the setpoint, mm/s.
    pub velocity_mm_s: f64,
    /// Largest acceleration of the setpoint, mm/s².
    pub acceleration_mm_s2: f64,
}

/// The move that is tried, in metres.
const TRIED_M: f64 = 0.05;

impl MoveCheck {
    /// Plays the board's 50 mm move through a table, in the firmware's integers.
    ///
    /// # Errors
    /// [`CliError::Usage`] when the board would refuse the move.
    pub fn of(table: &ShaperTable) -> Result<Self, CliError> {
        let rate_hz = table.tick_rate().hz();
        let command: MotionCommand = format!("move {TRIED_M}").parse()?;
        let setpoints_m = shaped_setpoints_m(&command, rate_hz, Some(table))?;
        let differences =
            |of: &[f64]| -> Vec<f64> { of.windows(2).map(|pair| (pair[1] - pair[0]) * rate_hz).collect() };
        let velocity = differences(&setpoints_m);
        let acceleration = differences(&velocity);
        let largest = |of: &[f64]| 1e3 * of.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        Ok(Self {
            duration_s: setpoints_m.len().saturating_sub(1) as f64 / rate_hz,
            velocity_mm_s: largest(&velocity),
            acceleration_mm_s2: largest(&acceleration),
        })
    }
}

impl MachineLimits {
    /// What an excitation about the middle of a travel may ask for, by default of the board's as it comes.
    pub fn of_an_excitation(self, travel: Option<Travel>) -> stillbeam_diagnose::MachineLimits {
        let board = Settings::default().limits();
        let (from_mm, to_mm) = travel.map_or(board.travel_mm, |Travel { from_mm, to_mm }| (from_mm, to_mm));
        let reach_mm = 0.5 * (to_mm - from_mm) / SweepSpec::STOP_REACH;
        stillbeam_diagnose::MachineLimits {
            half_travel_m: 1e-3 * reach_mm.min(SweepSpec::AMPLITUDE_RANGE_MM.1),
            velocity_m_s: 1e-3 * self.velocity_mm_s,
            acceleration_m_s2: 1e-3 * self.acceleration_mm_s2,
            jerk_m_s3: 1e-3 * board.jerk_mm_s3,
        }
    }
}

impl MachineLimits {
    /// Refuses a table whose setpoints could ask for more than the machine can do: of commands within
    /// `command`, or, where the board plans its moves itself, of its own 50 mm move.
    ///
    /// # Errors
    /// [`CliError::Usage`] with the largest limit of negative weights that would do.
    pub fn check(&self, table: &ShaperTable, command: Option<&Self>) -> Result<Option<MoveCheck>, CliError> {
        let gain = table.absolute_gain();
        if let Some(command) = command {
            let room = (self.velocity_mm_s / command.velocity_mm_s)
                .min(self.acceleration_mm_s2 / command.acceleration_mm_s2);
            if gain <= room * (1.0 + 1e-9) {
                return Ok(None);
            }
            return Err(CliError::Usage(format!(
                "the setpoint could reach {:.1} mm/s and {:.0} mm/s² where the machine can do {} mm/s and {} mm/s²; \
                 --allow-negative {:.3} leaves it within, or slower commands",
                gain * command.velocity_mm_s,
                gain * command.acceleration_mm_s2,
                self.velocity_mm_s,
                self.acceleration_mm_s2,
                (0.5 * (room - 1.0)).max(0.0)
            )));
        }
        let tried = MoveCheck::of(table)?;
        // Two roundings to the nanometre in each difference of a difference.
        let rate_hz = table.tick_rate().hz();
        let rounding = [2e-6 * rate_hz, 4e-6 * rate_hz * rate_hz];
        if tried.velocity_mm_s > self.velocity_mm_s + rounding[0]
            || tried.acceleration_mm_s2 > self.acceleration_mm_s2 + rounding[1]
        {
            return Err(CliError::Usage(format!(
                "the board's 50 mm move would reach {:.1} mm/s and {:.0} mm/s² where the machine can do {} mm/s and {} mm/s²; \
                 lower the board's limits (`set move.velocity_mm_s`, `set move.acceleration_mm_s2`) or leave --allow-negative out",
                tried.velocity_mm_s, tried.acceleration_mm_s2, self.velocity_mm_s, self.acceleration_mm_s2
            )));
        }
        Ok(Some(tried))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_excitation_stays_within_the_travel_of_the_machine() {
        let limits = MachineLimits::default();
        let short = limits.of_an_excitation(Some(Travel { from_mm: -4.0, to_mm: 6.0 }));
        assert!(
            (short.half_travel_m - 0.005 / SweepSpec::STOP_REACH).abs() < 1e-12,
            "{}",
            short.half_travel_m
        );
        // The board's travel reaches as far to either side.
        let (from_mm, to_mm) = Settings::default().limits().travel_mm;
        let board = limits.of_an_excitation(Some(Travel { from_mm, to_mm }));
        assert_eq!(board, limits.of_an_excitation(None));
    }

    #[test]
    fn a_travel_that_does_not_go_upwards_is_refused() {
        assert_eq!("-5,80.5".parse::<Travel>().unwrap(), Travel { from_mm: -5.0, to_mm: 80.5 });
        for text in ["80,-5", "5,5", "5", "a,b", "nan,3", ""] {
            assert!(text.parse::<Travel>().is_err(), "{text}");
        }
    }
}
