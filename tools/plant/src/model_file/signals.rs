//! The parts that all kinds of model file share: `[input]`, `[[output]]`, `[drive]`.

use serde::{Deserialize, Serialize};

use super::setup::is_zero;
use crate::drive::ServoDrive;
use crate::model::{DriveLimits, Input, Quantity};
use crate::simulate::Hold;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InputTable {
    column: String,
    #[serde(default = "one", skip_serializing_if = "is_one")]
    gain: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    hold: Option<Hold>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    noise_rms: Option<f64>,
}

pub(super) fn one() -> f64 {
    1.0
}

// serde calls it with a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
pub(super) fn is_one(gain: &f64) -> bool {
    *gain == 1.0
}

impl From<InputTable> for Input {
    fn from(table: InputTable) -> Self {
        Self { column: table.column, gain: table.gain, hold: table.hold, noise_rms: table.noise_rms }
    }
}

impl From<&Input> for InputTable {
    fn from(input: &Input) -> Self {
        Self { column: input.column.clone(), gain: input.gain, hold: input.hold, noise_rms: input.noise_rms }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DriveTable {
    #[serde(skip_serializing_if = "Option::is_none")]
    bandwidth_hz: Option<f64>,
    #[serde(default = "default_servo_damping")]
    damping_ratio: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    dead_time_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    acceleration_limit_m_s2: Option<f64>,
}

fn default_servo_damping() -> f64 {
    ServoDrive::DEFAULT_DAMPING_RATIO
}

impl DriveTable {
    /// The linear servo; without a bandwidth the drive follows at once.
    pub(super) fn servo(&self) -> Option<ServoDrive> {
        let damping_ratio = self.damping_ratio;
        self.bandwidth_hz.map(|bandwidth_hz| ServoDrive { bandwidth_hz, damping_ratio })
    }

    pub(super) fn limits(&self) -> DriveLimits {
        let Self { dead_time_s, limit, acceleration_limit_m_s2, .. } = *self;
        DriveLimits { dead_time_s, limit, acceleration_limit_m_s2 }
    }

    /// `None` for an ideal drive without limits.
    pub(super) fn from_parts(servo: Option<&ServoDrive>, limits: &DriveLimits) -> Option<Self> {
        let there = servo.is_some() || *limits != DriveLimits::default();
        there.then(|| Self {
            bandwidth_hz: servo.map(|servo| servo.bandwidth_hz),
            damping_ratio: servo.map_or_else(default_servo_damping, |servo| servo.damping_ratio),
            dead_time_s: limits.dead_time_s,
            limit: limits.limit,
            acceleration_limit_m_s2: limits.acceleration_limit_m_s2,
        })
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
