//! Modes without geometry: what identification finds and any structure can be given as.

use std::collections::BTreeMap;

use super::beam_on_base::{check_fixed, check_input};
use super::invalid::{InvalidParameter, Problem, distinct_columns, finite, positive, underdamped};
use super::{Input, Setup};
use crate::drive::ServoDrive;
use crate::modes::Mode;

/// Which time derivative of the modal coordinates an output sums up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quantity {
    /// `q_r`.
    #[default]
    Position,
    /// `q_r'`.
    Velocity,
    /// `q_r''`; not with an input that is a motion.
    Acceleration,
}

/// One output of a modal model: the sum over modes of participation times [`Quantity`].
#[derive(Debug, Clone, PartialEq)]
pub struct ModalOutput {
    /// Its column, ending in its unit.
    pub column: String,
    /// What is summed.
    pub quantity: Quantity,
}

/// Independent modes `q_r'' + 2 zeta_r omega_r q_r' + omega_r² q_r = s(t)`: `kind = "modal"`.
///
/// `s` is the input times its gain when the input is a force, and minus the base's acceleration when it is a
/// motion of the base.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalModel {
    /// The modes, at least one, each with one participation per output.
    pub modes: Vec<Mode>,
    /// Servo between setpoint and base; `None` is ideal. Only the input `setpoint_m` passes through it.
    pub drive: Option<ServoDrive>,
    /// `base_position_m`, `setpoint_m`, or any other column, which then is a force; `None` is a free decay.
    pub input: Option<Input>,
    /// What a simulation computes, at least one.
    pub outputs: Vec<ModalOutput>,
    /// Parameters that a refit must not move, by path.
    pub fixed: BTreeMap<String, bool>,
    /// Controller, initial state, sensors, left-out physics.
    pub setup: Setup,
}

impl ModalModel {
    /// Paths that `[fixed]` may name; modes count from 1.
    pub fn parameter_paths(&self) -> Vec<String> {
        let mut paths = Vec::new();
        for number in 1..=self.modes.len() {
            for parameter in ["frequency_hz", "damping_ratio", "participation"] {
                paths.push(format!("mode.{number}.{parameter}"));
            }
        }
        if self.drive.is_some() {
            paths.extend(ServoDrive::PARAMETER_PATHS.map(str::to_owned));
        }
        if self.input.as_ref().is_some_and(|input| !input.is_motion()) {
            paths.push("input.gain".to_owned());
        }
        paths
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first [`InvalidParameter`] found.
    pub fn check(&self) -> Result<(), InvalidParameter> {
        if self.modes.is_empty() {
            return Err(InvalidParameter::new("mode", Problem::Missing));
        }
        if self.outputs.is_empty() {
            return Err(InvalidParameter::new("output", Problem::Missing));
        }
        for (number, mode) in (1..).zip(&self.modes) {
            let key = |parameter: &str| format!("mode.{number}.{parameter}");
            positive(key("frequency_hz"), mode.frequency_hz)?;
            underdamped(key("damping_ratio"), number, mode.damping_ratio)?;
            let (outputs, found) = (self.outputs.len(), mode.participation.len());
            if found != outputs {
                return Err(InvalidParameter::new(
                    key("participation"),
                    Problem::ParticipationCount { outputs, found },
                ));
            }
            mode.participation.iter().try_for_each(|&value| finite(key("participation"), value))?;
        }
        if let Some(drive) = &self.drive {
            drive.check()?;
        }
        if let Some(input) = &self.input {
            check_input(input, &[])?;
            self.check_quantities(input)?;
        }
        let input = self.input.iter().map(|input| ("input.column".to_owned(), input.column.as_str()));
        distinct_columns(
            input.chain(
                (1..)
                    .zip(&self.outputs)
                    .map(|(number, output)| (format!("output.{number}.column"), output.column.as_str())),
            ),
        )?;
        let columns: Vec<String> = self.outputs.iter().map(|output| output.column.clone()).collect();
        self.setup.check(self.input.as_ref(), &columns)?;
        check_fixed(&self.fixed, self.parameter_paths())
    }

    fn check_quantities(&self, input: &Input) -> Result<(), InvalidParameter> {
        for (number, output) in (1..).zip(&self.outputs) {
            if input.is_motion() && output.quantity == Quantity::Acceleration {
                return Err(InvalidParameter::new(
                    format!("output.{number}.quantity"),
                    Problem::AccelerationFromMotion,
                ));
            }
        }
        Ok(())
    }
}
