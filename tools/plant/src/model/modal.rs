//! Modes without geometry: what identification finds and any structure can be given as.

use std::collections::BTreeMap;

use super::beam_on_base::check_input;
use super::beside::Beside;
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

/// A velocity that is forgotten, beside the modes: what a force does to a base that slides against viscous
/// friction.
///
/// `p' + p / time constant = s(t)`; a position output has the participation times `p`, a velocity output
/// times `p'`.
#[derive(Debug, Clone, PartialEq)]
pub struct RealPole {
    /// Time by which it falls by e, s, above 0.
    pub time_constant_s: f64,
    /// One per output.
    pub participation: Vec<f64>,
    /// What the outputs have of the *rates* of the modes' coordinates, for every mode one per output: the
    /// friction that makes the real pole also keeps the modes from moving in phase.
    pub rate_participation: Vec<Vec<f64>>,
}

/// Independent modes `q_r'' + 2 zeta_r omega_r q_r' + omega_r² q_r = s(t)`: `kind = "modal"`.
///
/// `s` is the input times its gain when the input is a force, and minus the base's acceleration when it is a
/// motion of the base.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalModel {
    /// The modes, each with one participation per output; at least one where nothing is beside them.
    pub modes: Vec<Mode>,
    /// A real pole beside them; only where the input is a force, and no output an acceleration.
    pub real_pole: Option<RealPole>,
    /// What the outputs have beside the modes, of a system that was given as matrices; not with a
    /// `real_pole`.
    pub beside: Beside,
    /// The column of the output that moves where the force of the input acts: the place `driving_point` for
    /// laws.
    pub driving_point: Option<String>,
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
        if self.real_pole.is_some() {
            paths.extend(["time_constant_s", "participation"].map(|name| format!("real_pole.{name}")));
            paths.extend((1..=self.modes.len()).map(|number| format!("mode.{number}.rate_participation")));
        }
        paths.extend(self.beside.paths());
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
        if self.modes.is_empty() && self.beside.is_empty() {
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
        self.check_real_pole()?;
        self.beside.check(self)?;
        if let Some(drive) = &self.drive {
            drive.check()?;
        }
        if let Some(input) = &self.input {
            check_input(input, &[])?;
            self.check_quantities(input)?;
        }
        self.check_driving_point()?;
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
        Ok(())
    }

    fn check_real_pole(&self) -> Result<(), InvalidParameter> {
        let Some(real) = &self.real_pole else { return Ok(()) };
        let force = self.input.as_ref().is_none_or(|input| !input.is_motion());
        if !force || self.outputs.iter().any(|output| output.quantity == Quantity::Acceleration) {
            return Err(InvalidParameter::new("real_pole", Problem::RealPolePlace));
        }
        positive("real_pole.time_constant_s".to_owned(), real.time_constant_s)?;
        let lists = std::iter::once(("real_pole.participation".to_owned(), &real.participation));
        let rates = (1..).zip(&real.rate_participation);
        let rates = rates.map(|(number, list)| (format!("mode.{number}.rate_participation"), list));
        for (key, list) in lists.chain(rates) {
            let (outputs, found) = (self.outputs.len(), list.len());
            if found != outputs {
                return Err(InvalidParameter::new(key, Problem::ParticipationCount { outputs, found }));
            }
            list.iter().try_for_each(|&value| finite(key.clone(), value))?;
        }
        let (modes, found) = (self.modes.len(), real.rate_participation.len());
        match found == modes {
            true => Ok(()),
            false => Err(InvalidParameter::new("real_pole", Problem::RatesPerMode { modes, found })),
        }
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
