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

/// A section and what it would make of the testbed.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// What it is.
    pub name: String,
    /// Width at root and tip, metres.
    pub width_m: [f64; 2],
    /// Thickness at root and tip, metres.
    pub thickness_m: [f64; 2],
    /// Mass of the beam, kg.
    pub beam_kg: f64,
    /// First three frequencies with the base held, hertz.
    pub held_hz: [f64; 3],
    /// First two frequencies with the base free, hertz.
    pub free_hz: [f64; 2],
    /// Tip participations of the first two modes.
    pub participation: [f64; 2],
}

/// The shipped beam, a uniform strip, and straight tapers of width and thickness, all tuned as far as they can be.
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
    let mut sections = vec![section("models/paper_beam.toml", shipped, width_m, thickness_m)?];
    let uniform = tuned(shipped, [MEAN_WIDTH_M; 2], [1.0, 1.0])?;
    sections.push(section("uniform strip", shipped, [MEAN_WIDTH_M; 2], uniform)?);
    for ratio in WIDTH_RATIOS {
        let root = 2.0 / (1.0 + ratio);
        let width_m = [MEAN_WIDTH_M * root, MEAN_WIDTH_M * root * ratio];
        let thickness_m = thickness_for(shipped, width_m)?;
        let name = if ratio == 1.0 { "uniform width".to_owned() } else { format!("width 1 to {ratio}") };
        sections.push(section(&name, shipped, width_m, thickness_m)?);
    }
    Ok(sections)
}

/// The thicknesses at root and tip that, with these widths, have both of the paper's frequencies.
fn thickness_for(shipped: &BeamOnBase, width_m: [f64; 2]) -> Result<[f64; 2], PlantError> {
    let wanted = DESIGN[1].0 / DESIGN[0].0;
    let ratio = |taper: f64| -> Result<f64, PlantError> {
        let modes = modes(&with_section(shipped, width_m, [1e-3, 1e-3 * taper]))?;
        Ok(modes[1].omega_rad_s / modes[0].omega_rad_s)
    };
    // A beam that thins has its frequencies closer together, over the whole range.
    let (mut low, mut high) = (0.3, 3.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if ratio(middle)? < wanted { low = middle } else { high = middle }
    }
    tuned(shipped, width_m, [1.0, 0.5 * (low + high)])
}

/// Thicknesses in this proportion with the paper's first frequency, to which they are proportional.
fn tuned(beam: &BeamOnBase, width_m: [f64; 2], proportion: [f64; 2]) -> Result<[f64; 2], PlantError> {
    let trial_m = proportion.map(|share| 1e-3 * share);
    let first_hz = modes(&with_section(beam, width_m, trial_m))?[0].omega_rad_s / TAU;
    Ok(trial_m.map(|metres| metres * DESIGN[0].0 / first_hz))
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

fn section(
    name: &str,
    shipped: &BeamOnBase,
    width_m: [f64; 2],
    thickness_m: [f64; 2],
) -> Result<Section, PlantError> {
    let beam = with_section(shipped, width_m, thickness_m);
    let modes = modes(&beam)?;
    let coupled = coupled_modes(&beam)?;
    // The translation's coordinate is mass-normalised: its inverse square is the whole mass.
    let whole_kg = coupled.base.first().map_or(f64::NAN, |base| base.powi(-2));
    let free = coupled.flexible();
    let free_hz = [0, 1].map(|mode| free.get(mode).map_or(f64::NAN, |(hz, _)| *hz));
    Ok(Section {
        name: name.to_owned(),
        width_m,
        thickness_m,
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
