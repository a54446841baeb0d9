//! `kind = "beam_on_base"` as it stands in a file.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::SCHEMA;
use super::setup::{ControllerTable, InitialTable, PhysicsTable, SensorTable, SetupTables, is_zero};
use super::signals::{DriveTable, InputTable};
use crate::model::{
    BeamDamping, BeamFittings, BeamOnBase, BeamParameters, BeamSignal, InvalidParameter, Problem,
    SectionTables, invalid_mode_count,
};
use crate::profile::Profile;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    schema: i64,
    kind: String,
    beam: BeamTable,
    base: BaseTable,
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
struct BeamTable {
    length_m: f64,
    density_kg_m3: f64,
    #[serde(rename = "young_Pa")]
    young_pa: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    width_m: Option<ProfileValue>,
    #[serde(skip_serializing_if = "Option::is_none")]
    thickness_m: Option<ProfileValue>,
    #[serde(skip_serializing_if = "Option::is_none")]
    area_m2: Option<ProfileValue>,
    #[serde(skip_serializing_if = "Option::is_none")]
    second_moment_m4: Option<ProfileValue>,
    modes: i64,
    #[serde(skip_serializing_if = "Option::is_none")]
    damping_ratio: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rayleigh: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "is_zero")]
    tip_mass_kg: f64,
    #[serde(rename = "clamp_stiffness_N_m_rad", skip_serializing_if = "Option::is_none")]
    clamp_stiffness_n_m_rad: Option<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BaseTable {
    mass_kg: f64,
    #[serde(default, rename = "viscous_N_s_m")]
    viscous_n_s_m: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OutputTable {
    column: String,
}

#[derive(Serialize, Deserialize)]
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

impl From<&Profile> for ProfileValue {
    fn from(profile: &Profile) -> Self {
        match profile {
            Profile::Uniform(value) => Self::Uniform(*value),
            Profile::Corners(corners) => Self::Corners(corners.clone()),
        }
    }
}

impl File {
    pub(super) fn into_model(self) -> Result<BeamOnBase, InvalidParameter> {
        let setup = SetupTables {
            controller: self.controller,
            initial: self.initial,
            sensor: self.sensor,
            physics: self.physics,
        };
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
            drive: self.drive.as_ref().and_then(DriveTable::servo),
            input: self.input.map(Into::into),
            outputs,
            fixed: self.fixed,
            setup: setup.into_setup(self.drive.as_ref()),
        })
    }

    pub(super) fn from_model(model: &BeamOnBase) -> Self {
        let setup = SetupTables::from_setup(&model.setup);
        Self {
            schema: SCHEMA,
            kind: "beam_on_base".to_owned(),
            beam: BeamTable::from_parameters(&model.beam),
            base: BaseTable { mass_kg: model.base_mass_kg, viscous_n_s_m: model.base_viscous_n_s_m },
            drive: DriveTable::from_parts(model.drive.as_ref(), &model.setup.drive_limits),
            input: model.input.as_ref().map(Into::into),
            output: model
                .outputs
                .iter()
                .map(|signal| OutputTable { column: signal.column().to_owned() })
                .collect(),
            fixed: model.fixed.clone(),
            controller: setup.controller,
            initial: setup.initial,
            sensor: setup.sensor,
            physics: setup.physics,
        }
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
        let (width_m, thickness_m, section) =
            match (self.width_m, self.thickness_m, self.area_m2, self.second_moment_m4) {
                (Some(width), Some(thickness), None, None) => (width.into(), thickness.into(), None),
                (None, None, Some(area), Some(moment)) => {
                    let tables = SectionTables { area_m2: area.into(), second_moment_m4: moment.into() };
                    // No rectangle is meant; one is there because every beam has one.
                    (Profile::Uniform(1.0), Profile::Uniform(1.0), Some(tables))
                }
                _ => return Err(InvalidParameter::new("beam", Problem::SectionChoice)),
            };
        Ok(BeamParameters {
            length_m: self.length_m,
            density_kg_m3: self.density_kg_m3,
            young_pa: self.young_pa,
            width_m,
            thickness_m,
            modes: usize::try_from(self.modes).map_err(|_| invalid_mode_count(self.modes))?,
            damping,
            fittings: BeamFittings {
                tip_mass_kg: self.tip_mass_kg,
                clamp_stiffness_n_m_rad: self.clamp_stiffness_n_m_rad,
                section,
            },
        })
    }

    fn from_parameters(beam: &BeamParameters) -> Self {
        let (damping_ratio, rayleigh) = match &beam.damping {
            BeamDamping::Ratios(ratios) => (Some(ratios.clone()), None),
            BeamDamping::Rayleigh(alphas) => (None, Some(*alphas)),
        };
        let section = beam.fittings.section.as_ref();
        Self {
            length_m: beam.length_m,
            density_kg_m3: beam.density_kg_m3,
            young_pa: beam.young_pa,
            width_m: section.is_none().then(|| (&beam.width_m).into()),
            thickness_m: section.is_none().then(|| (&beam.thickness_m).into()),
            area_m2: section.map(|tables| (&tables.area_m2).into()),
            second_moment_m4: section.map(|tables| (&tables.second_moment_m4).into()),
            modes: i64::try_from(beam.modes).unwrap_or(i64::MAX),
            damping_ratio,
            rayleigh,
            tip_mass_kg: beam.fittings.tip_mass_kg,
            clamp_stiffness_n_m_rad: beam.fittings.clamp_stiffness_n_m_rad,
        }
    }
}
