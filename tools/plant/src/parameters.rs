//! The numbers of a model by path, for refits: list, get, set.
//!
//! | kind | paths |
//! |---|---|
//! | beam on a base | `beam.length_m`, `beam.density_kg_m3`, `beam.young_Pa`, `beam.width_m.1` (corners count from 1; a uniform profile is its own corner 1), `beam.thickness_m.1`, `beam.damping_ratio.1` or `beam.rayleigh.1`, `beam.tip_mass_kg`, `beam.clamp_stiffness_N_m_rad`, `base.mass_kg`, `base.viscous_N_s_m` |
//! | modal | `mode.1.frequency_hz`, `mode.1.damping_ratio`, `mode.1.participation.1`; where they are not zero `mode.1.quadrature.1`, `lag.1.time_constant_s`, `lag.1.participation.1`, `rigid.displacement.1`, `rigid.velocity.1`, `output.1.feedthrough` |
//! | lumped | `body.slider.mass`, `spring.slider-ground.stiffness`, `damper.slider-ground.damping` |
//! | all | `drive.bandwidth_hz`, `drive.damping_ratio`, `input.gain`, `physics.1.force` |
//!
//! A path in `[fixed]` holds for everything below it: `beam.damping_ratio` fixes `beam.damping_ratio.1` and
//! `.2`.

use crate::catalogue;
use crate::model::{BeamDamping, InvalidParameter, Model, Problem, lies_below, pair};
use crate::profile::Profile;

/// One number of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its path.
    pub path: String,
    /// Its value.
    pub value: f64,
    /// Its unit; empty for a pure number.
    pub unit: String,
    /// Least sensible value, inclusive.
    pub lower: f64,
    /// Greatest sensible value, inclusive; may be infinite.
    pub upper: f64,
    /// Whether `[fixed]` keeps a refit from moving it.
    pub fixed: bool,
}

/// Below the least positive number that any model needs, above where squares underflow.
const TINY: f64 = 1e-12;

/// Just below one: the greatest damping ratio of an underdamped mode.
const NEARLY_ONE: f64 = 0.999;

/// A visit to a model's numbers: path, unit, bounds, place.
type Visit<'v> = &'v mut dyn FnMut(String, String, (f64, f64), &mut f64);

impl Model {
    /// All numbers that a refit may think of moving, with bounds and whether `[fixed]` forbids it.
    pub fn parameters(&self) -> Vec<Parameter> {
        let mut found = Vec::new();
        self.clone().visit(&mut |path, unit, (lower, upper), value| {
            found.push(Parameter { path, value: *value, unit, lower, upper, fixed: false });
        });
        for parameter in &mut found {
            parameter.fixed = self.is_fixed(&parameter.path);
        }
        found
    }

    /// The number at a path; `None` if there is none.
    pub fn parameter(&self, path: &str) -> Option<f64> {
        let mut found = None;
        self.clone().visit(&mut |candidate, _, _, value| {
            if candidate == path {
                found = Some(*value);
            }
        });
        found
    }

    /// Sets the number at a path. The model is not checked; building a plant from it does that.
    ///
    /// # Errors
    /// [`InvalidParameter`] when there is no such path.
    pub fn set_parameter(&mut self, path: &str, to: f64) -> Result<(), InvalidParameter> {
        let mut done = false;
        let mut paths = Vec::new();
        self.visit(&mut |candidate, _, _, value| {
            if candidate == path {
                *value = to;
                done = true;
            }
            paths.push(candidate);
        });
        if done {
            return Ok(());
        }
        Err(InvalidParameter::new(path, Problem::UnknownPath { allowed: paths }))
    }

    /// Whether `[fixed]` holds this path, or one that it lies below.
    pub fn is_fixed(&self, path: &str) -> bool {
        self.fixed().iter().any(|(fixed, is)| *is && lies_below(path, fixed))
    }

    fn visit(&mut self, visit: Visit<'_>) {
        let positive = (TINY, f64::INFINITY);
        let any = (f64::NEG_INFINITY, f64::INFINITY);
        let ratio = (0.0, NEARLY_ONE);
        let units: Vec<_> =
            self.setup().physics.iter().map(|physics| catalogue::bounds(self, physics)).collect();
        match self {
            Self::BeamOnBase(model) => {
                let beam = &mut model.beam;
                visit("beam.length_m".to_owned(), "m".to_owned(), positive, &mut beam.length_m);
                visit("beam.density_kg_m3".to_owned(), "kg/m³".to_owned(), positive, &mut beam.density_kg_m3);
                visit("beam.young_Pa".to_owned(), "Pa".to_owned(), positive, &mut beam.young_pa);
                match &mut beam.fittings.section {
                    Some(section) => {
                        visit_profile("beam.area_m2", "m²", &mut section.area_m2, visit);
                        visit_profile("beam.second_moment_m4", "m⁴", &mut section.second_moment_m4, visit);
                    }
                    None => {
                        visit_profile("beam.width_m", "m", &mut beam.width_m, visit);
                        visit_profile("beam.thickness_m", "m", &mut beam.thickness_m, visit);
                    }
                }
                match &mut beam.damping {
                    BeamDamping::Ratios(ratios) => {
                        for (number, value) in (1..).zip(ratios) {
                            visit(format!("beam.damping_ratio.{number}"), String::new(), ratio, value);
                        }
                    }
                    BeamDamping::Rayleigh([mass, stiffness]) => {
                        let not_negative = (0.0, f64::INFINITY);
                        visit("beam.rayleigh.1".to_owned(), "1/s".to_owned(), not_negative, mass);
                        visit("beam.rayleigh.2".to_owned(), "s".to_owned(), not_negative, stiffness);
                    }
                }
                let not_negative = (0.0, f64::INFINITY);
                let fittings = &mut beam.fittings;
                visit(
                    "beam.tip_mass_kg".to_owned(),
                    "kg".to_owned(),
                    not_negative,
                    &mut fittings.tip_mass_kg,
                );
                if let Some(stiffness) = &mut fittings.clamp_stiffness_n_m_rad {
                    let path = "beam.clamp_stiffness_N_m_rad".to_owned();
                    visit(path, "N·m/rad".to_owned(), positive, stiffness);
                }
                visit("base.mass_kg".to_owned(), "kg".to_owned(), positive, &mut model.base_mass_kg);
                let viscous = &mut model.base_viscous_n_s_m;
                visit("base.viscous_N_s_m".to_owned(), "N·s/m".to_owned(), not_negative, viscous);
            }
            Self::Modal(model) => {
                for (number, mode) in (1..).zip(&mut model.modes) {
                    let path = |name: &str| format!("mode.{number}.{name}");
                    visit(path("frequency_hz"), "Hz".to_owned(), positive, &mut mode.frequency_hz);
                    visit(path("damping_ratio"), String::new(), ratio, &mut mode.damping_ratio);
                    for (output, value) in (1..).zip(&mut mode.participation) {
                        visit(path(&format!("participation.{output}")), String::new(), any, value);
                    }
                }
                model.beside.visit(&mut |path, is_time, value| {
                    let (unit, bounds) = if is_time { ("s", positive) } else { ("", any) };
                    visit(path, unit.to_owned(), bounds, value);
                });
                if let Some(real) = &mut model.real_pole {
                    let path = |name: &str| format!("real_pole.{name}");
                    visit(path("time_constant_s"), "s".to_owned(), positive, &mut real.time_constant_s);
                    for (output, value) in (1..).zip(&mut real.participation) {
                        visit(path(&format!("participation.{output}")), String::new(), any, value);
                    }
                    for (number, rates) in (1..).zip(&mut real.rate_participation) {
                        for (output, value) in (1..).zip(rates) {
                            let path = format!("mode.{number}.rate_participation.{output}");
                            visit(path, "s".to_owned(), any, value);
                        }
                    }
                }
            }
            Self::Lumped(model) => {
                let (z, f) = (model.displacement_unit(), model.force_unit());
                let mass_unit = match z.as_str() {
                    "m" => "kg",
                    "rad" => "kg·m²",
                    _ => "",
                };
                for body in &mut model.bodies {
                    visit(format!("body.{}.mass", body.name), mass_unit.to_owned(), positive, &mut body.mass);
                }
                for spring in &mut model.springs {
                    let path = format!("spring.{}.stiffness", pair(spring));
                    visit(path, format!("{f}/{z}"), any, &mut spring.constant);
                }
                for damper in &mut model.dampers {
                    let path = format!("damper.{}.damping", pair(damper));
                    visit(path, format!("{f}·s/{z}"), (0.0, f64::INFINITY), &mut damper.constant);
                }
            }
        }
        let (drive, gain) = match self {
            Self::BeamOnBase(model) => (model.drive.as_mut(), model.input.as_mut()),
            Self::Modal(model) => (model.drive.as_mut(), model.input.as_mut()),
            Self::Lumped(model) => {
                (None, model.input.as_mut().filter(|input| !input.moves_body).map(|input| &mut input.signal))
            }
        };
        if let Some(drive) = drive {
            visit("drive.bandwidth_hz".to_owned(), "Hz".to_owned(), positive, &mut drive.bandwidth_hz);
            visit("drive.damping_ratio".to_owned(), String::new(), (TINY, 100.0), &mut drive.damping_ratio);
        }
        if let Some(input) = gain.filter(|input| !input.is_motion()) {
            visit("input.gain".to_owned(), String::new(), any, &mut input.gain);
        }
        for ((number, physics), known) in (1..).zip(&mut self.setup_mut().physics).zip(units) {
            for (name, unit, bounds, default) in known {
                let value = physics.parameters.entry(name.clone()).or_insert(default);
                visit(format!("physics.{number}.{name}"), unit, bounds, value);
            }
        }
    }
}

fn visit_profile(path: &str, unit: &str, profile: &mut Profile, visit: Visit<'_>) {
    let positive = (TINY, f64::INFINITY);
    match profile {
        Profile::Uniform(value) => visit(format!("{path}.1"), unit.to_owned(), positive, value),
        Profile::Corners(corners) => {
            for (number, corner) in (1..).zip(corners) {
                visit(format!("{path}.{number}"), unit.to_owned(), positive, &mut corner[1]);
            }
        }
    }
}
