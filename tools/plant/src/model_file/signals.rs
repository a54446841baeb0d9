//! The parts that all kinds of model file share: `[input]`, `[[output]]`, `[drive]`.

use serde::{Deserialize, Serialize};

use crate::drive::ServoDrive;
use crate::model::{Input, Quantity};

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InputTable {
    column: String,
    #[serde(default = "one", skip_serializing_if = "is_one")]
    gain: f64,
}

fn one() -> f64 {
    1.0
}

// serde calls it with a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_one(gain: &f64) -> bool {
    *gain == 1.0
}

impl From<InputTable> for Input {
    fn from(table: InputTable) -> Self {
        Self { column: table.column, gain: table.gain }
    }
}

impl From<&Input> for InputTable {
    fn from(input: &Input) -> Self {
        Self { column: input.column.clone(), gain: input.gain }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DriveTable {
    bandwidth_hz: f64,
    #[serde(default = "default_servo_damping")]
    damping_ratio: f64,
}

fn default_servo_damping() -> f64 {
    ServoDrive::DEFAULT_DAMPING_RATIO
}

impl From<DriveTable> for ServoDrive {
    fn from(table: DriveTable) -> Self {
        Self { bandwidth_hz: table.bandwidth_hz, damping_ratio: table.damping_ratio }
    }
}

impl From<&ServoDrive> for DriveTable {
    fn from(drive: &ServoDrive) -> Self {
        Self { bandwidth_hz: drive.bandwidth_hz, damping_ratio: drive.damping_ratio }
    }
}

#[derive(Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum QuantityName {
    #[default]
    Position,
    Velocity,
    Acceleration,
}

impl From<QuantityName> for Quantity {
    fn from(name: QuantityName) -> Self {
        match name {
            QuantityName::Position => Self::Position,
            QuantityName::Velocity => Self::Velocity,
            QuantityName::Acceleration => Self::Acceleration,
        }
    }
}

impl From<Quantity> for QuantityName {
    fn from(quantity: Quantity) -> Self {
        match quantity {
            Quantity::Position => Self::Position,
            Quantity::Velocity => Self::Velocity,
            Quantity::Acceleration => Self::Acceleration,
        }
    }
}
