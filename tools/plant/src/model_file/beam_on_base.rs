//! `kind = "beam_on_base"` as it stands in a file.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::signals::{DriveTable, InputTable};
use crate::model::{
    BeamDamping, BeamOnBase, BeamParameters, BeamSignal, InvalidParameter, Problem, invalid_mode_count,
};
use crate::profile::Profile;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    // Read with the head of the file; listed so that they are not unknown here.
    #[serde(rename = "schema")]
    _schema: i64,
    #[serde(rename = "kind")]
    _kind: String,
    beam: BeamTable,
    base: BaseTable,
    drive: Option<DriveTable>,
    input: Option<InputTable>,
    #[serde(default)]
    output: Vec<OutputTable>,
    #[serde(default)]
    fixed: BTreeMap<String, bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BeamTable {
    length_m: f64,
    density_kg_m3: f64,
    #[serde(rename = "young_Pa")]
    young_pa: f64,
    width_m: ProfileValue,
    thickness_m: ProfileValue,
    modes: i64,
    damping_ratio: Option<Vec<f64>>,
    rayleigh: Option<[f64; 2]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BaseTable {
    mass_kg: f64,
    #[serde(default, rename = "viscous_N_s_m")]
    viscous_n_s_m: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OutputTable {
    column: String,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a number in metres or a list of [x_m, value_m] corners")]
enum ProfileValue {
    Uniform(f64),
    Corners(Vec<[f64; 2]>),
}

impl From<ProfileValue> for Profile {
    fn from(value: ProfileValue) -> Self {
        match value {
            ProfileValue::Uniform(value) => Self::Uniform(value),
            ProfileValue::Corners(corners) => Self::Corners(corners),
        }
    }
}

impl File {
    pub(super) fn into_model(self) -> Result<BeamOnBase, InvalidParameter> {
        let outputs = (1..).zip(self.output).map(|(number, output)| {
            BeamSignal::ALL.into_iter().find(|signal| signal.column() == output.column).ok_or_else(|| {
                InvalidParameter::new(
                    format!("output.{number}.column"),
                    Problem::OutputColumn {
                        found: output.column,
                        allowed: BeamSignal::ALL.map(|signal| signal.column().to_owned()).to_vec(),
                    },
                )
            })
        });
        let outputs = outputs.collect::<Result<Vec<_>, _>>()?;
        Ok(BeamOnBase {
            beam: self.beam.into_parameters()?,
            base_mass_kg: self.base.mass_kg,
            base_viscous_n_s_m: self.base.viscous_n_s_m,
            drive: self.drive.map(Into::into),
            input: self.input.map(Into::into),
            outputs,
            fixed: self.fixed,
        })
    }
}

impl BeamTable {
    fn into_parameters(self) -> Result<BeamParameters, InvalidParameter> {
        let damping = match (self.damping_ratio, self.rayleigh) {
            (Some(ratios), None) => BeamDamping::Ratios(ratios),
            (None, Some(alphas)) => BeamDamping::Rayleigh(alphas),
            (Some(_), Some(_)) => {
                return Err(InvalidParameter::new("beam.rayleigh", Problem::DampingChoice));
            }
            (None, None) => return Err(InvalidParameter::new("beam", Problem::DampingChoice)),
        };
        Ok(BeamParameters {
            length_m: self.length_m,
            density_kg_m3: self.density_kg_m3,
            young_pa: self.young_pa,
            width_m: self.width_m.into(),
            thickness_m: self.thickness_m.into(),
            modes: usize::try_from(self.modes).map_err(|_| invalid_mode_count(self.modes))?,
            damping,
        })
    }
}
