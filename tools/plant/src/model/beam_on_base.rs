//! A beam clamped to a translating base: its parameters and their limits.

use std::collections::BTreeMap;

use super::invalid::{
    InvalidParameter, Problem, distinct_columns, finite, not_negative, positive, underdamped,
};
use super::{Input, Setup};
use crate::drive::ServoDrive;
use crate::profile::Profile;

/// Column of the tip's deflection relative to the base: the paper's `w(l, t)`.
pub const TIP_DEFLECTION: &str = "tip_deflection_m";
/// Column of the tip's absolute position: base position plus deflection.
pub const TIP_POSITION: &str = "tip_position_m";
/// Column of the base's position: the paper's `y(t)`.
pub const BASE_POSITION: &str = "base_position_m";
/// Column of the position commanded to the drive.
pub const SETPOINT: &str = "setpoint_m";
/// Column of the force on the base: the paper's `u(t)`.
pub const FORCE: &str = "force_N";

/// The most beam modes that a model may keep.
pub const MAX_MODES: usize = 8;

/// Parameters of the beam: `[beam]` of a model file.
#[derive(Debug, Clone, PartialEq)]
pub struct BeamParameters {
    /// Free length `l` from clamp to tip, metres, above 0.
    pub length_m: f64,
    /// Mass density `rho`, kg/m³, above 0.
    pub density_kg_m3: f64,
    /// Young's modulus `E`, pascals, above 0.
    pub young_pa: f64,
    /// Width of the rectangular section, across the bending direction.
    pub width_m: Profile,
    /// Thickness of the rectangular section, in the bending direction.
    pub thickness_m: Profile,
    /// Number of beam modes kept, 1 to [`MAX_MODES`].
    pub modes: usize,
    /// Damping of the clamped beam.
    pub damping: BeamDamping,
    /// What is there besides a rectangular strip in a rigid clamp.
    pub fittings: BeamFittings,
}

/// Optional parts of a beam; by default there are none.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BeamFittings {
    /// `tip_mass_kg`: a point mass at the tip, at least 0.
    pub tip_mass_kg: f64,
    /// `clamp_stiffness_N_m_rad`: rotational stiffness of the clamp, above 0; `None` is rigid.
    pub clamp_stiffness_n_m_rad: Option<f64>,
    /// Section given directly; width and thickness are then not used.
    pub section: Option<SectionTables>,
}

/// Area and second moment of area along the beam, for sections that are not rectangular.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionTables {
    /// `A(x)` in m², above 0.
    pub area_m2: Profile,
    /// `I(x)` in m⁴ about the bending axis, above 0.
    pub second_moment_m4: Profile,
}

/// Damping of the beam relative to its base.
#[derive(Debug, Clone, PartialEq)]
pub enum BeamDamping {
    /// Damping ratio of each kept mode *with the base held*, 0 to below 1.
    Ratios(Vec<f64>),
    /// `[alpha1 (1/s), alpha2 (s)]`, both at least 0: eq. 22 gives the ratio of every mode with the base
    /// held.
    ///
    /// Eq. 21 taken to the letter also damps the motion of the base against the ground (`alpha1 J`) and
    /// lets the base's speed push on the beam; here it acts on the beam's motion relative to its base only,
    /// which is what eq. 22 describes.
    Rayleigh([f64; 2]),
}

/// A signal that a beam on a base can give out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BeamSignal {
    /// [`TIP_DEFLECTION`].
    TipDeflection,
    /// [`TIP_POSITION`].
    TipPosition,
    /// [`BASE_POSITION`].
    BasePosition,
}

impl BeamSignal {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::TipDeflection, Self::TipPosition, Self::BasePosition];

    /// The injection point whose motion it is.
    pub(crate) fn point(self) -> &'static str {
        match self {
            Self::TipDeflection => "beam",
            Self::TipPosition => "tip",
            Self::BasePosition => "base",
        }
    }

    /// Its column name.
    pub fn column(self) -> &'static str {
        match self {
            Self::TipDeflection => TIP_DEFLECTION,
            Self::TipPosition => TIP_POSITION,
            Self::BasePosition => BASE_POSITION,
        }
    }
}

/// A beam clamped to a translating base: `kind = "beam_on_base"`.
#[derive(Debug, Clone, PartialEq)]
pub struct BeamOnBase {
    /// The beam.
    pub beam: BeamParameters,
    /// Mass `m` of the base alone, kg, above 0.
    pub base_mass_kg: f64,
    /// Viscous friction of the base against the ground, N·s/m, at least 0.
    pub base_viscous_n_s_m: f64,
    /// Servo between setpoint and base; `None` is ideal. Only the input `setpoint_m` passes through it.
    pub drive: Option<ServoDrive>,
    /// `force_N`, `base_position_m` or `setpoint_m`; `None` is a free decay.
    pub input: Option<Input>,
    /// What a simulation computes, at least one.
    pub outputs: Vec<BeamSignal>,
    /// Parameters that a refit must not move, by path.
    pub fixed: BTreeMap<String, bool>,
    /// Controller, initial state, sensors, left-out physics.
    pub setup: Setup,
}

impl BeamOnBase {
    /// Paths that `[fixed]` may name.
    pub fn parameter_paths(&self) -> Vec<String> {
        let mut paths = vec![
            "beam.length_m",
            "beam.density_kg_m3",
            "beam.young_Pa",
            if self.beam.fittings.section.is_some() { "beam.area_m2" } else { "beam.width_m" },
            if self.beam.fittings.section.is_some() { "beam.second_moment_m4" } else { "beam.thickness_m" },
            match self.beam.damping {
                BeamDamping::Ratios(_) => "beam.damping_ratio",
                BeamDamping::Rayleigh(_) => "beam.rayleigh",
            },
            "base.mass_kg",
            "base.viscous_N_s_m",
            "beam.tip_mass_kg",
        ];
        if self.beam.fittings.clamp_stiffness_n_m_rad.is_some() {
            paths.push("beam.clamp_stiffness_N_m_rad");
        }
        if self.drive.is_some() {
            paths.extend(ServoDrive::PARAMETER_PATHS);
        }
        if self.input.as_ref().is_some_and(|input| !input.is_motion()) {
            paths.push("input.gain");
        }
        paths.into_iter().map(str::to_owned).collect()
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first [`InvalidParameter`] found.
    pub fn check(&self) -> Result<(), InvalidParameter> {
        self.beam.check()?;
        positive("base.mass_kg", self.base_mass_kg)?;
        not_negative("base.viscous_N_s_m", self.base_viscous_n_s_m)?;
        if let Some(drive) = &self.drive {
            drive.check()?;
        }
        if let Some(input) = &self.input {
            check_input(input, &[FORCE, BASE_POSITION, SETPOINT])?;
        }
        if self.outputs.is_empty() {
            return Err(InvalidParameter::new("output", Problem::Missing));
        }
        // Base position may be both: the input handed through.
        distinct_columns(
            (1..)
                .zip(&self.outputs)
                .map(|(number, signal)| (format!("output.{number}.column"), signal.column())),
        )?;
        let columns: Vec<String> = self.outputs.iter().map(|signal| signal.column().to_owned()).collect();
        self.setup.check(self.input.as_ref(), &columns)?;
        Ok(())
    }
}

impl BeamParameters {
    /// Damping ratio of mode `index` (0-based) of `omega_rad_s`, with the base held.
    ///
    /// Modes beyond the listed ratios, which enter only through the coupling with a free base, take the last.
    pub fn damping_ratio(&self, index: usize, omega_rad_s: f64) -> f64 {
        match &self.damping {
            BeamDamping::Ratios(ratios) => ratios.get(index).or(ratios.last()).copied().unwrap_or(0.0),
            // Eq. 22.
            BeamDamping::Rayleigh([alpha1, alpha2]) => 0.5 * (alpha1 / omega_rad_s + alpha2 * omega_rad_s),
        }
    }

    fn check(&self) -> Result<(), InvalidParameter> {
        positive("beam.length_m", self.length_m)?;
        positive("beam.density_kg_m3", self.density_kg_m3)?;
        positive("beam.young_Pa", self.young_pa)?;
        if let Some(section) = &self.fittings.section {
            check_profile("beam.area_m2", &section.area_m2, self.length_m)?;
            check_profile("beam.second_moment_m4", &section.second_moment_m4, self.length_m)?;
        }
        check_profile("beam.width_m", &self.width_m, self.length_m)?;
        check_profile("beam.thickness_m", &self.thickness_m, self.length_m)?;
        not_negative("beam.tip_mass_kg", self.fittings.tip_mass_kg)?;
        let clamp = self.fittings.clamp_stiffness_n_m_rad;
        clamp.map_or(Ok(()), |stiffness| positive("beam.clamp_stiffness_N_m_rad", stiffness))?;
        if !(1..=MAX_MODES).contains(&self.modes) {
            let found = i64::try_from(self.modes).unwrap_or(i64::MAX);
            return Err(invalid_mode_count(found));
        }
        match &self.damping {
            BeamDamping::Ratios(ratios) => {
                let key = "beam.damping_ratio";
                if ratios.len() != self.modes {
                    let (modes, found) = (self.modes, ratios.len());
                    return Err(InvalidParameter::new(key, Problem::DampingCount { modes, found }));
                }
                (1..).zip(ratios).try_for_each(|(mode, &ratio)| underdamped(key, mode, ratio))
            }
            BeamDamping::Rayleigh(alphas) => {
                alphas.iter().try_for_each(|&alpha| not_negative("beam.rayleigh", alpha))
            }
        }
    }
}

/// The error about a number of modes that is out of range.
pub(crate) fn invalid_mode_count(found: i64) -> InvalidParameter {
    let most = MAX_MODES;
    InvalidParameter::new("beam.modes", Problem::ModeCount { found, most })
}

fn check_profile(key: &str, profile: &Profile, length_m: f64) -> Result<(), InvalidParameter> {
    let corners = match profile {
        Profile::Uniform(value) => return positive(key, *value),
        Profile::Corners(corners) => corners,
    };
    let invalid = |problem| Err(InvalidParameter::new(key, problem));
    let (Some(first), Some(last)) = (corners.first(), corners.last()) else {
        return invalid(Problem::ProfileCorners { found: 0 });
    };
    if corners.len() < 2 {
        return invalid(Problem::ProfileCorners { found: 1 });
    }
    let mut previous_m = f64::NEG_INFINITY;
    for (corner, &[x_m, value_m]) in (1..).zip(corners) {
        finite(key, x_m)?;
        if x_m <= previous_m {
            return invalid(Problem::ProfileOrder { corner, x_m });
        }
        if !(value_m.is_finite() && value_m > 0.0) {
            return invalid(Problem::ProfileValue { corner, value_m });
        }
        previous_m = x_m;
    }
    // A nanometre, for lengths that were computed rather than typed.
    if first[0].abs() > 1e-9 || (last[0] - length_m).abs() > 1e-9 {
        return invalid(Problem::ProfileCover { first_m: first[0], last_m: last[0], length_m });
    }
    Ok(())
}

/// Checks an input against the columns that can drive a model; an empty list allows any.
pub(crate) fn check_input(input: &Input, allowed: &[&str]) -> Result<(), InvalidParameter> {
    let key = "input.column";
    if input.column.is_empty() {
        return Err(InvalidParameter::new(key, Problem::EmptyColumn));
    }
    if !allowed.is_empty() && !allowed.contains(&input.column.as_str()) {
        let problem = Problem::InputColumn {
            found: input.column.clone(),
            allowed: allowed.iter().map(|&name| name.to_owned()).collect(),
        };
        return Err(InvalidParameter::new(key, problem));
    }
    finite("input.gain", input.gain)?;
    if let Some(noise_rms) = input.noise_rms {
        positive("input.noise_rms", noise_rms)?;
    }
    if input.is_motion() && input.gain != 1.0 {
        let gain = input.gain;
        return Err(InvalidParameter::new("input.gain", Problem::GainOnMotion { gain }));
    }
    Ok(())
}
