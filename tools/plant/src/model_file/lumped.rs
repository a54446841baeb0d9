//! `kind = "lumped"` as it stands in a file.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::SCHEMA;
use super::setup::{ControllerTable, InitialTable, PhysicsTable, SensorTable, SetupTables};
use super::signals::{QuantityName, is_one, one};
use crate::model::{
    Body, Connection, Input, InvalidParameter, LumpedInput, LumpedModel, LumpedOutput, Problem, Quantity,
};
use crate::simulate::Hold;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    schema: i64,
    kind: String,
    #[serde(default)]
    body: Vec<BodyTable>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    spring: Vec<SpringTable>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    damper: Vec<DamperTable>,
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
struct BodyTable {
    name: String,
    #[serde(alias = "inertia", alias = "inductance")]
    mass: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SpringTable {
    between: [String; 2],
    stiffness: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DamperTable {
    between: [String; 2],
    #[serde(alias = "resistance")]
    damping: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct InputTable {
    column: String,
    body: String,
    #[serde(default = "one", skip_serializing_if = "is_one")]
    gain: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    hold: Option<Hold>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    noise_rms: Option<f64>,
    #[serde(default, skip_serializing_if = "InputQuantity::is_force")]
    quantity: InputQuantity,
}

#[derive(Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum InputQuantity {
    #[default]
    Force,
    Position,
}

impl InputQuantity {
    // serde calls it with a reference.
    #[allow(clippy::trivially_copy_pass_by_ref)]
    fn is_force(&self) -> bool {
        *self == Self::Force
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OutputTable {
    column: String,
    body: String,
    #[serde(default)]
    quantity: QuantityName,
    #[serde(skip_serializing_if = "Option::is_none")]
    relative_to: Option<String>,
}

impl File {
    pub(super) fn into_model(self) -> Result<LumpedModel, InvalidParameter> {
        let setup = SetupTables {
            controller: self.controller,
            initial: self.initial,
            sensor: self.sensor,
            physics: self.physics,
        };
        // A body is only ever the ground by that one name; everything else is checked with the model.
        if self.body.is_empty() {
            return Err(InvalidParameter::new("body", Problem::Missing));
        }
        Ok(LumpedModel {
            bodies: self.body.into_iter().map(|body| Body { name: body.name, mass: body.mass }).collect(),
            springs: self
                .spring
                .into_iter()
                .map(|spring| Connection { between: spring.between, constant: spring.stiffness })
                .collect(),
            dampers: self
                .damper
                .into_iter()
                .map(|damper| Connection { between: damper.between, constant: damper.damping })
                .collect(),
            input: self.input.map(|input| LumpedInput {
                signal: Input {
                    column: input.column,
                    gain: input.gain,
                    hold: input.hold,
                    noise_rms: input.noise_rms,
                },
                body: input.body,
                moves_body: input.quantity == InputQuantity::Position,
            }),
            outputs: self
                .output
                .into_iter()
                .map(|output| LumpedOutput {
                    column: output.column,
                    body: output.body,
                    quantity: Quantity::from(output.quantity),
                    relative_to: output.relative_to,
                })
                .collect(),
            fixed: self.fixed,
            setup: setup.into_setup(None),
        })
    }

    pub(super) fn from_model(model: &LumpedModel) -> Self {
        let setup = SetupTables::from_setup(&model.setup);
        Self {
            schema: SCHEMA,
            kind: "lumped".to_owned(),
            body: model
                .bodies
                .iter()
                .map(|body| BodyTable { name: body.name.clone(), mass: body.mass })
                .collect(),
            spring: model
                .springs
                .iter()
                .map(|spring| SpringTable { between: spring.between.clone(), stiffness: spring.constant })
                .collect(),
            damper: model
                .dampers
                .iter()
                .map(|damper| DamperTable { between: damper.between.clone(), damping: damper.constant })
                .collect(),
            input: model.input.as_ref().map(|input| InputTable {
                column: input.signal.column.clone(),
                body: input.body.clone(),
                gain: input.signal.gain,
                hold: input.signal.hold,
                noise_rms: input.signal.noise_rms,
                quantity: if input.moves_body { InputQuantity::Position } else { InputQuantity::Force },
            }),
            output: model
                .outputs
                .iter()
                .map(|output| OutputTable {
                    column: output.column.clone(),
                    body: output.body.clone(),
                    quantity: output.quantity.into(),
                    relative_to: output.relative_to.clone(),
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
