//! `kind = "modal"` as it stands in a file.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::SCHEMA;
use super::setup::{ControllerTable, InitialTable, PhysicsTable, SensorTable, SetupTables, is_zero};
use super::signals::{DriveTable, InputTable, QuantityName};
use crate::model::{Beside, InvalidParameter, Lag, ModalModel, ModalOutput, Problem, RealPole, Rigid};
use crate::modes::Mode;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    schema: i64,
    kind: String,
    #[serde(default)]
    mode: Vec<ModeTable>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    real_pole: Option<RealPoleTable>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    lag: Vec<LagTable>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rigid: Option<RigidTable>,
    #[serde(skip_serializing_if = "Option::is_none")]
    drive: Option<DriveTable>,
    #[serde(skip_serializing_if = "Option::is_none")]
    input: Option<InputTable>,
    #[serde(default)]
    output: Vec<OutputTable>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    fixed: BTreeMap<String, bool>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    controller: Option<ControllerTable>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    initial: BTreeMap<String, InitialTable>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    sensor: Vec<SensorTable>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    physics: Vec<PhysicsTable>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ModeTable {
    frequency_hz: f64,
    damping_ratio: f64,
    participation: Vec<f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    rate_participation: Vec<f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    quadrature: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LagTable {
    time_constant_s: f64,
    participation: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RigidTable {
    displacement: Vec<f64>,
    velocity: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RealPoleTable {
    time_constant_s: f64,
    participation: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OutputTable {
    column: String,
    #[serde(default)]
    quantity: QuantityName,
    #[serde(default, skip_serializing_if = "is_zero")]
    feedthrough: f64,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    driving_point: bool,
}

impl File {
    pub(super) fn into_model(self) -> Result<ModalModel, InvalidParameter> {
        let beside = self.beside();
        let setup = SetupTables {
            controller: self.controller,
            initial: self.initial,
            sensor: self.sensor,
            physics: self.physics,
        };
        let rates: Vec<Vec<f64>> = self.mode.iter().map(|mode| mode.rate_participation.clone()).collect();
        if self.real_pole.is_none() && rates.iter().any(|rate| !rate.is_empty()) {
            return Err(InvalidParameter::new("real_pole", Problem::Missing));
        }
        // A mode that says nothing of its rate has none.
        let rate = |rate: Vec<f64>| if rate.is_empty() { vec![0.0; self.output.len()] } else { rate };
        let rate_participation = rates.into_iter().map(rate).collect();
        let driving = self.output.iter().find(|output| output.driving_point);
        Ok(ModalModel {
            beside,
            driving_point: driving.map(|output| output.column.clone()),
            real_pole: self.real_pole.map(|real| RealPole {
                time_constant_s: real.time_constant_s,
                participation: real.participation,
                rate_participation,
            }),
            modes: self
                .mode
                .into_iter()
                .map(|mode| Mode {
                    frequency_hz: mode.frequency_hz,
                    damping_ratio: mode.damping_ratio,
                    participation: mode.participation,
                })
                .collect(),
            drive: self.drive.as_ref().and_then(DriveTable::servo),
            input: self.input.map(Into::into),
            outputs: self
                .output
                .into_iter()
                .map(|output| ModalOutput { column: output.column, quantity: output.quantity.into() })
                .collect(),
            fixed: self.fixed,
            setup: setup.into_setup(self.drive.as_ref()),
        })
    }

    fn beside(&self) -> Beside {
        let nothing = || vec![0.0; self.output.len()];
        let shares = |mode: &ModeTable| {
            if mode.quadrature.is_empty() { nothing() } else { mode.quadrature.clone() }
        };
        let quadrature: Vec<Vec<f64>> = self.mode.iter().map(shares).collect();
        let feedthrough: Vec<f64> = self.output.iter().map(|output| output.feedthrough).collect();
        let is_zero = |list: &Vec<f64>| list.iter().all(|share| *share == 0.0);
        Beside {
            quadrature: if quadrature.iter().all(is_zero) { Vec::new() } else { quadrature },
            lags: self
                .lag
                .iter()
                .map(|lag| Lag {
                    time_constant_s: lag.time_constant_s,
                    participation: lag.participation.clone(),
                })
                .collect(),
            rigid: self.rigid.as_ref().map(|rigid| Rigid {
                displacement: rigid.displacement.clone(),
                velocity: rigid.velocity.clone(),
            }),
            feedthrough: if is_zero(&feedthrough) { Vec::new() } else { feedthrough },
        }
    }

    pub(super) fn from_model(model: &ModalModel) -> Self {
        let beside = &model.beside;
        let setup = SetupTables::from_setup(&model.setup);
        let rates =
            model.real_pole.as_ref().map(|real| real.rate_participation.as_slice()).unwrap_or_default();
        let rate_of = |mode: usize| rates.get(mode).cloned().unwrap_or_default();
        Self {
            schema: SCHEMA,
            kind: "modal".to_owned(),
            mode: model
                .modes
                .iter()
                .enumerate()
                .map(|(index, mode)| ModeTable {
                    frequency_hz: mode.frequency_hz,
                    damping_ratio: mode.damping_ratio,
                    participation: mode.participation.clone(),
                    rate_participation: rate_of(index),
                    quadrature: beside.quadrature.get(index).cloned().unwrap_or_default(),
                })
                .collect(),
            real_pole: model.real_pole.as_ref().map(|real| RealPoleTable {
                time_constant_s: real.time_constant_s,
                participation: real.participation.clone(),
            }),
            lag: beside
                .lags
                .iter()
                .map(|lag| LagTable {
                    time_constant_s: lag.time_constant_s,
                    participation: lag.participation.clone(),
                })
                .collect(),
            rigid: beside.rigid.as_ref().map(|rigid| RigidTable {
                displacement: rigid.displacement.clone(),
                velocity: rigid.velocity.clone(),
            }),
            drive: DriveTable::from_parts(model.drive.as_ref(), &model.setup.drive_limits),
            input: model.input.as_ref().map(Into::into),
            output: model
                .outputs
                .iter()
                .enumerate()
                .map(|(index, output)| OutputTable {
                    column: output.column.clone(),
                    quantity: output.quantity.into(),
                    feedthrough: beside.feedthrough_of(index),
                    driving_point: model.driving_point.as_ref() == Some(&output.column),
                })
                .collect(),
            fixed: model.fixed.clone(),
            controller: setup.controller,
            initial: setup.initial,
            sensor: setup.sensor,
            physics: setup.physics,
        }
    }
}
