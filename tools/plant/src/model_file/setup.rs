//! The optional parts that all kinds of model file share: `[controller]`, `[initial]`, `[[sensor]]`,
//! `[[physics]]`.

use std::collections::BTreeMap;
use std::num::NonZeroU8;

use serde::{Deserialize, Serialize};

use super::signals::DriveTable;
use crate::model::{Controller, InitialState, Physics, Sensor, SensorKind, Setup};

/// All of them, as one value.
pub(super) struct SetupTables {
    pub(super) controller: Option<ControllerTable>,
    pub(super) initial: BTreeMap<String, InitialTable>,
    pub(super) sensor: Vec<SensorTable>,
    pub(super) physics: Vec<PhysicsTable>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ControllerTable {
    kind: ControllerKind,
    kp: f64,
    kv: f64,
    sample_s: f64,
    reference_column: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity_samples: Option<NonZeroU8>,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ControllerKind {
    CascadePd,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InitialTable {
    #[serde(default)]
    displacement: f64,
    #[serde(default)]
    velocity: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SensorTable {
    column: String,
    #[serde(default)]
    kind: SensorKindName,
    #[serde(skip_serializing_if = "Option::is_none")]
    rate_hz: Option<f64>,
    #[serde(default, skip_serializing_if = "is_zero")]
    delay_s: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    exposure_s: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    noise_rms: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    quantum: f64,
    #[serde(default)]
    seed: u64,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    zero_known: bool,
}

#[derive(Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum SensorKindName {
    #[default]
    Camera,
    Encoder,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PhysicsTable {
    id: String,
    location: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    on: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    column: Option<String>,
    #[serde(default)]
    parameters: BTreeMap<String, f64>,
}

// serde calls it with a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
pub(super) fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl SetupTables {
    pub(super) fn into_setup(self, drive: Option<&DriveTable>) -> Setup {
        Setup {
            controller: self.controller.map(|table| Controller {
                kp: table.kp,
                kv: table.kv,
                sample_s: table.sample_s,
                reference_column: table.reference_column,
                limit: table.limit,
                velocity_samples: table.velocity_samples,
            }),
            drive_limits: drive.map(DriveTable::limits).unwrap_or_default(),
            initial: self
                .initial
                .into_iter()
                .map(|(name, table)| {
                    (name, InitialState { displacement: table.displacement, velocity: table.velocity })
                })
                .collect(),
            sensors: self
                .sensor
                .into_iter()
                .map(|table| Sensor {
                    column: table.column,
                    kind: match table.kind {
                        SensorKindName::Camera => SensorKind::Camera,
                        SensorKindName::Encoder => SensorKind::Encoder,
                    },
                    rate_hz: table.rate_hz,
                    delay_s: table.delay_s,
                    exposure_s: table.exposure_s,
                    noise_rms: table.noise_rms,
                    quantum: table.quantum,
                    seed: table.seed,
                    zero_known: table.zero_known,
                })
                .collect(),
            physics: self
                .physics
                .into_iter()
                .map(|table| Physics {
                    id: table.id,
                    location: table.location,
                    on: table.on,
                    column: table.column,
                    parameters: table.parameters,
                })
                .collect(),
        }
    }

    pub(super) fn from_setup(setup: &Setup) -> Self {
        Self {
            controller: setup.controller.as_ref().map(|controller| ControllerTable {
                kind: ControllerKind::CascadePd,
                kp: controller.kp,
                kv: controller.kv,
                sample_s: controller.sample_s,
                reference_column: controller.reference_column.clone(),
                limit: controller.limit,
                velocity_samples: controller.velocity_samples,
            }),
            initial: setup
                .initial
                .iter()
                .map(|(name, state)| {
                    let table = InitialTable { displacement: state.displacement, velocity: state.velocity };
                    (name.clone(), table)
                })
                .collect(),
            sensor: setup
                .sensors
                .iter()
                .map(|sensor| SensorTable {
                    column: sensor.column.clone(),
                    kind: match sensor.kind {
                        SensorKind::Camera => SensorKindName::Camera,
                        SensorKind::Encoder => SensorKindName::Encoder,
                    },
                    rate_hz: sensor.rate_hz,
                    delay_s: sensor.delay_s,
                    exposure_s: sensor.exposure_s,
                    noise_rms: sensor.noise_rms,
                    quantum: sensor.quantum,
                    seed: sensor.seed,
                    zero_known: sensor.zero_known,
                })
                .collect(),
            physics: setup
                .physics
                .iter()
                .map(|physics| PhysicsTable {
                    id: physics.id.clone(),
                    location: physics.location.clone(),
                    on: physics.on.clone(),
                    column: physics.column.clone(),
                    parameters: physics.parameters.clone(),
                })
                .collect(),
        }
    }
}
