//! `stillbeam model`: what a model file says about vibration.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use stillbeam_plant::modes::{clamped_modes, coupled_modes};
use stillbeam_plant::{Beside, Lag, Model, PlantError, StateSpace};

use crate::error::CliError;
use crate::outputs::keep_apart;
use crate::streams::{Streams, json_on_stdout};

/// Frequencies, damping ratios and participations of a model.
///
/// For a beam on a base: with the base held (what vibrates after a servo has stopped, hence what shapers are
/// designed for) and with the base free (what a force-driven sweep shows).
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
    /// What the outputs of a modal model have beside modes in phase.
    #[serde(skip_serializing_if = "Option::is_none")]
    beside: Option<BesideEntry>,
}

/// Lists of one number per output.
#[derive(Serialize)]
struct BesideEntry {
    /// Per mode, the share a quarter of a period off.
    quadrature: Vec<Vec<f64>>,
    real_poles: Vec<RealPoleEntry>,
    /// Shares of a free body's displacement and velocity.
    rigid: Option<[Vec<f64>; 2]>,
    /// Shares of the input at once.
    feedthrough: Vec<f64>,
}

#[derive(Serialize)]
struct RealPoleEntry {
    time_constant_s: f64,
    participation: Vec<f64>,
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
        let modes = Modes::of(&model).map_err(CliError::plant(self.model.display().to_string()))?;
        if !json_on_stdout(self.json.as_deref()) {
            let title = if modes.kind == "beam_on_base" { "modes with the base held" } else { "modes" };
            print(streams, title, &modes.base_held)?;
            if let Some(beside) = &modes.beside {
                beside.print(streams)?;
            }
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

impl Modes {
    /// The modes of a model of any kind.
    fn of(model: &Model) -> Result<Self, PlantError> {
        Ok(match model {
            Model::BeamOnBase(beam) => Self {
                schema_version: 1,
                kind: "beam_on_base",
                base_held: clamped_modes(beam)?
                    .into_iter()
                    .map(|mode| ModeEntry::from(mode.to_mode()))
                    .collect(),
                beside: None,
                base_free: coupled_modes(beam)?
                    .flexible()
                    .into_iter()
                    .map(|(frequency_hz, damping_ratio)| ModeEntry {
                        frequency_hz,
                        damping_ratio,
                        participation: Vec::new(),
                    })
                    .collect(),
            },
            Model::Modal(modal) => Self {
                schema_version: 1,
                kind: "modal",
                base_held: modal.modes.iter().cloned().map(ModeEntry::from).collect(),
                base_free: Vec::new(),
                beside: (!modal.beside.is_empty()).then(|| BesideEntry::from(&modal.beside)),
            },
            _ => Self {
                schema_version: 1,
                kind: "lumped",
                base_held: StateSpace::new(model)?
                    .natural_modes()?
                    .into_iter()
                    .map(|(frequency_hz, damping_ratio)| ModeEntry {
                        frequency_hz,
                        damping_ratio,
                        participation: Vec::new(),
                    })
                    .collect(),
                base_free: Vec::new(),
                beside: None,
            },
        })
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

impl From<&Beside> for BesideEntry {
    fn from(beside: &Beside) -> Self {
        let lag = |lag: &Lag| RealPoleEntry {
            time_constant_s: lag.time_constant_s,
            participation: lag.participation.clone(),
        };
        Self {
            quadrature: beside.quadrature.clone(),
            real_poles: beside.lags.iter().map(lag).collect(),
            rigid: beside.rigid.as_ref().map(|rigid| [rigid.displacement.clone(), rigid.velocity.clone()]),
            feedthrough: beside.feedthrough.clone(),
        }
    }
}

impl BesideEntry {
    fn print(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        for (number, shares) in (1..).zip(&self.quadrature) {
            writeln!(streams.out, "mode {number}, a quarter of a period off: {}", listed(shares))?;
        }
        if !self.real_poles.is_empty() {
            writeln!(streams.out, "real poles")?;
            writeln!(streams.out, "{:>4}{:>21}  participation", "", "time constant (s)")?;
        }
        for (number, pole) in (1..).zip(&self.real_poles) {
            let shares = listed(&pole.participation);
            writeln!(streams.out, "{number:>4}{:>21.6}  {shares}", pole.time_constant_s)?;
        }
        if let Some([displacement, velocity]) = &self.rigid {
            let (displacement, velocity) = (listed(displacement), listed(velocity));
            writeln!(streams.out, "free motion: displacement {displacement}; velocity {velocity}")?;
        }
        if !self.feedthrough.is_empty() {
            writeln!(streams.out, "share of the input at once: {}", listed(&self.feedthrough))?;
        }
        Ok(())
    }
}

/// One number per output.
fn listed(shares: &[f64]) -> String {
    let one = |share: &f64| match share.abs() {
        size if size > 0.0 && !(1e-3..1e6).contains(&size) => format!("{share:.4e}"),
        _ => format!("{share:.5}"),
    };
    shares.iter().map(one).collect::<Vec<_>>().join(", ")
}

fn print(streams: &mut Streams<'_>, title: &str, modes: &[ModeEntry]) -> Result<(), CliError> {
    writeln!(streams.out, "{title}")?;
    writeln!(streams.out, "{:>4}{:>16}{:>16}  participation", "", "frequency (Hz)", "damping ratio")?;
    for (number, mode) in (1..).zip(modes) {
        let participation =
            if mode.participation.is_empty() { "-".to_owned() } else { listed(&mode.participation) };
        writeln!(
            streams.out,
            "{number:>4}{:>16.5}{:>16.6}  {participation}",
            mode.frequency_hz, mode.damping_ratio
        )?;
    }
    Ok(())
}
