//! `kind = "modal"` as it stands in a file.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::SCHEMA;
use super::signals::{DriveTable, InputTable, QuantityName};
use crate::model::{InvalidParameter, ModalModel, ModalOutput};
use crate::modes::Mode;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    schema: i64,
    kind: String,
    #[serde(default)]
    mode: Vec<ModeTable>,
    #[serde(skip_serializing_if = "Option::is_none")]
    drive: Option<DriveTable>,
    #[serde(skip_serializing_if = "Option::is_none")]
    input: Option<InputTable>,
    #[serde(default)]
    output: Vec<OutputTable>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    fixed: BTreeMap<String, bool>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ModeTable {
    frequency_hz: f64,
    damping_ratio: f64,
    participation: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OutputTable {
    column: String,
    #[serde(default)]
    quantity: QuantityName,
}

impl File {
    // The other kind can fail here; both are used alike.
    #[allow(clippy::unnecessary_wraps)]
    pub(super) fn into_model(self) -> Result<ModalModel, InvalidParameter> {
        Ok(ModalModel {
            modes: self
                .mode
                .into_iter()
                .map(|mode| Mode {
                    frequency_hz: mode.frequency_hz,
                    damping_ratio: mode.damping_ratio,
                    participation: mode.participation,
                })
                .collect(),
            drive: self.drive.map(Into::into),
            input: self.input.map(Into::into),
            outputs: self
                .output
                .into_iter()
                .map(|output| ModalOutput { column: output.column, quantity: output.quantity.into() })
                .collect(),
            fixed: self.fixed,
        })
    }

    pub(super) fn from_model(model: &ModalModel) -> Self {
        Self {
            schema: SCHEMA,
            kind: "modal".to_owned(),
            mode: model
                .modes
                .iter()
                .map(|mode| ModeTable {
                    frequency_hz: mode.frequency_hz,
                    damping_ratio: mode.damping_ratio,
                    participation: mode.participation.clone(),
                })
                .collect(),
            drive: model.drive.as_ref().map(Into::into),
            input: model.input.as_ref().map(Into::into),
            output: model
                .outputs
                .iter()
                .map(|output| OutputTable { column: output.column.clone(), quantity: output.quantity.into() })
                .collect(),
            fixed: model.fixed.clone(),
        }
    }
}
