//! `stillbeam model`: what a model file says about vibration.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use stillbeam_plant::modes::{clamped_modes, coupled_modes};
use stillbeam_plant::{Model, StateSpace};

use crate::error::CliError;
use crate::outputs::keep_apart;
use crate::streams::{Streams, json_on_stdout};

/// Frequencies, damping ratios and participations of a model.
///
/// For a beam on a base: with the base held (what vibrates after a servo has stopped, hence what shapers are designed
/// for) and with the base free (what a force-driven sweep shows).
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam model models/paper_beam.toml")]
pub struct ModelArgs {
    /// The model file
    #[arg(value_name = "MODEL.toml")]
    model: PathBuf,
    /// Write JSON to this file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<String>,
}

#[derive(Serialize)]
struct Modes {
    schema_version: u32,
    kind: &'static str,
    /// With the base held; of a modal or lumped model, its modes (a rigid motion has 0 Hz).
    base_held: Vec<ModeEntry>,
    /// With the base free.
    base_free: Vec<ModeEntry>,
}

#[derive(Serialize)]
struct ModeEntry {
    frequency_hz: f64,
    damping_ratio: f64,
    /// Per output for a modal model, of the tip's deflection for a beam with its base held.
    participation: Vec<f64>,
}

impl ModelArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        keep_apart([self.model.as_path()], [self.json.as_deref()])?;
        let model = Model::read(&self.model)?;
        let file = self.model.display().to_string();
        let modes = match &model {
            Model::BeamOnBase(beam) => Modes {
                schema_version: 1,
                kind: "beam_on_base",
                base_held: clamped_modes(beam)
                    .map_err(CliError::plant(file.clone()))?
                    .into_iter()
                    .map(|mode| ModeEntry::from(mode.to_mode()))
                    .collect(),
                base_free: coupled_modes(beam)
                    .map_err(CliError::plant(file))?
                    .flexible()
                    .into_iter()
                    .map(|(frequency_hz, damping_ratio)| ModeEntry {
                        frequency_hz,
                        damping_ratio,
                        participation: Vec::new(),
                    })
                    .collect(),
            },
            Model::Modal(modal) => Modes {
                schema_version: 1,
                kind: "modal",
                base_held: modal.modes.iter().cloned().map(ModeEntry::from).collect(),
                base_free: Vec::new(),
            },
            _ => Modes {
                schema_version: 1,
                kind: "lumped",
                base_held: StateSpace::new(&model)
                    .and_then(|space| space.natural_modes())
                    .map_err(CliError::plant(file))?
                    .into_iter()
                    .map(|(frequency_hz, damping_ratio)| ModeEntry {
                        frequency_hz,
                        damping_ratio,
                        participation: Vec::new(),
                    })
                    .collect(),
                base_free: Vec::new(),
            },
        };
        if !json_on_stdout(self.json.as_deref()) {
            let title = if modes.kind == "beam_on_base" { "modes with the base held" } else { "modes" };
            print(streams, title, &modes.base_held)?;
            if !modes.base_free.is_empty() {
                print(streams, "modes with the base free", &modes.base_free)?;
            }
        }
        match &self.json {
            Some(file) => streams.write_json(file, &modes),
            None => Ok(()),
        }
    }
}

impl From<stillbeam_plant::Mode> for ModeEntry {
    fn from(mode: stillbeam_plant::Mode) -> Self {
        Self {
            frequency_hz: mode.frequency_hz,
            damping_ratio: mode.damping_ratio,
            participation: mode.participation,
        }
    }
}

fn print(streams: &mut Streams<'_>, title: &str, modes: &[ModeEntry]) -> Result<(), CliError> {
    writeln!(streams.out, "{title}")?;
    writeln!(streams.out, "{:>4}{:>16}{:>16}  participation", "", "frequency (Hz)", "damping ratio")?;
    for (number, mode) in (1..).zip(modes) {
        let participation: Vec<String> =
            mode.participation.iter().map(|value| format!("{value:.5}")).collect();
        let participation = if participation.is_empty() { "-".to_owned() } else { participation.join(", ") };
        writeln!(
            streams.out,
            "{number:>4}{:>16.5}{:>16.6}  {participation}",
            mode.frequency_hz, mode.damping_ratio
        )?;
    }
    Ok(())
}
