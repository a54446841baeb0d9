//! How far two frequencies determine the beam: other sections with the same two.

use std::f64::consts::TAU;

use stillbeam_plant::modes::{ClampedMode, clamped_modes, coupled_modes};
use stillbeam_plant::{BeamDamping, BeamOnBase, Mode, Model, PlantError, Profile};

use super::printed::DESIGN;
use crate::demo::rig::Rig;
use crate::error::CliError;

/// Mean width of every section, metres. The frequencies do not depend on it.
pub const MEAN_WIDTH_M: f64 = 0.025;

/// Tip over root width of the sections that are tried.
const WIDTH_RATIOS: [f64; 5] = [0.5, 0.8, 1.0, 1.5, 2.5];

/// What a uniform strip may carry besides itself, in proportion to itself.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fitting {
    /// A mass at the tip, as a share of the beam's.
    TipMass(f64),
    /// A clamp that turns: the compliance of its spring over that of the beam, `E I / (k l)`.
    Clamp(f64),
}

/// A section and what it would make of the testbed.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// What it is.
    pub name: String,
    /// Width at root and tip, metres.
    pub width_m: [f64; 2],
    /// Thickness at root and tip, metres.
    pub thickness_m: [f64; 2],
    /// Mass of the beam, kg, with what it carries.
    pub beam_kg: f64,
    /// First three frequencies with the base held, hertz.
    pub held_hz: [f64; 3],
    /// First two frequencies with the base free, hertz.
    pub free_hz: [f64; 2],
    /// Tip participations of the first two modes.
    pub participation: [f64; 2],
}

/// The shipped beam, a uniform strip, and straight tapers of width and thickness, all tuned as far as they
/// can be.
///
/// # Errors
/// [`CliError::Plant`]; [`CliError::Internal`] when the rig's model is no beam of straight tapers.
pub fn run(rig: &Rig) -> Result<Vec<Section>, CliError> {
    let Model::BeamOnBase(shipped) = &rig.model else {
        return Err(CliError::Internal("the paper's model has no beam".to_owned()));
    };
    family(shipped).map_err(CliError::plant("sections"))
}

/// The first three modes of the rig's beam, base held; the third with the damping of the second.
///
/// # Errors
/// As [`run`].
pub fn three_modes(rig: &Rig) -> Result<Vec<Mode>, CliError> {
    let Model::BeamOnBase(shipped) = &rig.model else {
        return Err(CliError::Internal("the paper's model has no beam".to_owned()));
    };
    let mut beam = shipped.clone();
    if let BeamDamping::Ratios(ratios) = &mut beam.beam.damping {
        let last = ratios.last().copied().unwrap_or(0.0);
        ratios.resize(3, last);
    }
    beam.beam.modes = 3;
    let modes = clamped_modes(&beam).map_err(CliError::plant("three modes"))?;
    Ok(modes.into_iter().map(ClampedMode::to_mode).collect())
}

fn family(shipped: &BeamOnBase) -> Result<Vec<Section>, PlantError> {
    let ends = |profile: &Profile| [profile.at(0.0), profile.at(shipped.beam.length_m)];
    let (width_m, thickness_m) = (ends(&shipped.beam.width_m), ends(&shipped.beam.thickness_m));
    let as_shipped = with_section(shipped, width_m, thickness_m);
    let mut sections = vec![section("models/paper_beam.toml".to_owned(), as_shipped)?];
    let uniform = tuned(shipped, [MEAN_WIDTH_M; 2], [1.0, 1.0], None)?;
    sections.push(section("uniform strip".to_owned(), uniform)?);
    for fitting in [Fitting::TipMass as fn(f64) -> Fitting, Fitting::Clamp] {
        let strip = uniform_with(shipped, fitting)?;
        let name = match (strip.beam.fittings.tip_mass_kg, strip.beam.fittings.clamp_stiffness_n_m_rad) {
            (_, Some(stiffness)) => format!("uniform, clamp of {stiffness:.0} N·m/rad"),
            (mass_kg, None) => format!("uniform, {:.1} g at the tip", 1e3 * mass_kg),
        };
        sections.push(section(name, strip)?);
    }
    for ratio in WIDTH_RATIOS {
        let root = 2.0 / (1.0 + ratio);
        let width_m = [MEAN_WIDTH_M * root, MEAN_WIDTH_M * root * ratio];
        let name = if ratio == 1.0 { "uniform width".to_owned() } else { format!("width 1 to {ratio}") };
        sections.push(section(name, tapered(shipped, width_m)?)?);
    }
    Ok(sections)
}

/// Halvings of an interval: more than the digits of a frequency.
const HALVINGS: u32 = 40;

/// The root of a function that rises, between two bounds.
fn root_of(
    (mut low, mut high): (f64, f64),
    is_below: impl Fn(f64) -> Result<bool, PlantError>,
) -> Result<f64, PlantError> {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if is_below(middle)? { low = middle } else { high = middle }
    }
    Ok(0.5 * (low + high))
}

fn is_closer_than_the_papers(beam: &BeamOnBase) -> Result<bool, PlantError> {
    let modes = modes(beam)?;
    Ok(modes[1].omega_rad_s / modes[0].omega_rad_s < DESIGN[1].0 / DESIGN[0].0)
}

/// The strip of these widths whose thickness runs straight and that has both of the paper's frequencies. A
/// beam that thins has its frequencies closer together, over the whole range.
fn tapered(shipped: &BeamOnBase, width_m: [f64; 2]) -> Result<BeamOnBase, PlantError> {
    let taper = root_of((0.3, 3.0), |taper| {
        is_closer_than_the_papers(&with_section(shipped, width_m, [1e-3, 1e-3 * taper]))
    })?;
    tuned(shipped, width_m, [1.0, taper], None)
}

/// The uniform strip with as much of a fitting as makes it have both of the paper's frequencies.
fn uniform_with(shipped: &BeamOnBase, fitting: fn(f64) -> Fitting) -> Result<BeamOnBase, PlantError> {
    let share = root_of((1e-6, 0.1), |share| {
        is_closer_than_the_papers(&tuned(shipped, [MEAN_WIDTH_M; 2], [1.0, 1.0], Some(fitting(share)))?)
    })?;
    tuned(shipped, [MEAN_WIDTH_M; 2], [1.0, 1.0], Some(fitting(share)))
}

/// The strip with thicknesses in this proportion that has the paper's first frequency, which is proportional
/// to them: a fitting in proportion to the strip does not change that.
fn tuned(
    shipped: &BeamOnBase,
    width_m: [f64; 2],
    proportion: [f64; 2],
    fitting: Option<Fitting>,
) -> Result<BeamOnBase, PlantError> {
    let with_fitting = |thickness_m: [f64; 2]| {
        let mut beam = with_section(shipped, width_m, thickness_m);
        // Fittings are tried on uniform strips.
        let ([width_m, _], [thickness_m, _]) = (width_m, thickness_m);
        let strip = &beam.beam;
        match fitting {
            Some(Fitting::TipMass(share)) => {
                let beam_kg = strip.density_kg_m3 * width_m * thickness_m * strip.length_m;
                beam.beam.fittings.tip_mass_kg = share * beam_kg;
            }
            Some(Fitting::Clamp(share)) => {
                let bending_n_m = strip.young_pa * width_m * thickness_m.powi(3) / 12.0 / strip.length_m;
                beam.beam.fittings.clamp_stiffness_n_m_rad = Some(bending_n_m / share);
            }
            None => {}
        }
        beam
    };
    let trial_m = proportion.map(|share| 1e-3 * share);
    let first_hz = modes(&with_fitting(trial_m))?[0].omega_rad_s / TAU;
    Ok(with_fitting(trial_m.map(|metres| metres * DESIGN[0].0 / first_hz)))
}

fn with_section(beam: &BeamOnBase, width_m: [f64; 2], thickness_m: [f64; 2]) -> BeamOnBase {
    let taper = |[root, tip]: [f64; 2]| Profile::Corners(vec![[0.0, root], [beam.beam.length_m, tip]]);
    let mut changed = beam.clone();
    changed.beam.width_m = taper(width_m);
    changed.beam.thickness_m = taper(thickness_m);
    changed.beam.modes = 3;
    changed.beam.damping = BeamDamping::Rayleigh([0.0, 0.0]);
    changed
}

/// Three clamped modes.
fn modes(beam: &BeamOnBase) -> Result<[ClampedMode; 3], PlantError> {
    clamped_modes(beam)?.try_into().map_err(|_| PlantError::Degenerate)
}

fn section(name: String, beam: BeamOnBase) -> Result<Section, PlantError> {
    let modes = modes(&beam)?;
    let coupled = coupled_modes(&beam)?;
    // The translation's coordinate is mass-normalised: its inverse square is the whole mass.
    let whole_kg = coupled.base.first().map_or(f64::NAN, |base| base.powi(-2));
    let free = coupled.flexible();
    let free_hz = [0, 1].map(|mode| free.get(mode).map_or(f64::NAN, |(hz, _)| *hz));
    let ends = |profile: &Profile| [profile.at(0.0), profile.at(beam.beam.length_m)];
    Ok(Section {
        name,
        width_m: ends(&beam.beam.width_m),
        thickness_m: ends(&beam.beam.thickness_m),
        beam_kg: whole_kg - beam.base_mass_kg,
        held_hz: modes.map(|mode| mode.omega_rad_s / TAU),
        free_hz,
        participation: [modes[0].tip_participation(), modes[1].tip_participation()],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_sections_have_the_papers_two_frequencies() {
        let sections = run(&Rig::new().unwrap()).unwrap();
        for section in sections.iter().filter(|section| section.name != "uniform strip") {
            assert!((section.held_hz[0] - 1.1).abs() < 2e-4, "{section:?}");
            assert!((section.held_hz[1] - 6.9).abs() < 1e-3, "{section:?}");
        }
        // The uniform strip has what the paper prints, 1.1 and 6.9 Hz, after rounding.
        let uniform = &sections[1];
        assert!((uniform.held_hz[1] - 6.8936).abs() < 1e-3, "{uniform:?}");
    }
}
