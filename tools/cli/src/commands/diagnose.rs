//! `stillbeam diagnose`: which physics a model left out.

use std::path::PathBuf;

use clap::Args;
use stillbeam_diagnose::{Diagnosis, Options, diagnose};
use stillbeam_plant::Model;
use stillbeam_recording::{Recording, read_csv};

use crate::error::CliError;
use crate::outputs::keep_apart;
use crate::report::diagnose_page::diagnose_page;
use crate::streams::{Streams, json_on_stdout};

/// Where a model and recordings differ, and which physics was left out.
///
/// The model is simulated on every recording, refitted within its own parameters, and what is then left is
/// located and compared with a catalogue of physics.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam diagnose beam.toml sweep-1mm.csv sweep-2mm.csv --held-out sweep-3mm.csv --json found.json")]
pub struct DiagnoseArgs {
    /// Model file
    #[arg(value_name = "MODEL.toml")]
    model: PathBuf,
    /// Recordings to train on; one whose side file says role = \"held_out\" is held out
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Recordings to judge on, never trained on
    #[arg(long, value_name = "RECORDING", num_args = 1..)]
    held_out: Vec<PathBuf>,
    /// Write JSON to this file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<String>,
    /// Write a report with plots to this file
    #[arg(long, value_name = "FILE.html")]
    report: Option<String>,
    /// Write the refitted model with the physics found to this file, for `simulate`
    #[arg(long, value_name = "FILE.toml")]
    extended_model: Option<String>,
}

impl DiagnoseArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        let inputs = std::iter::once(&self.model).chain(&self.recordings).chain(&self.held_out);
        keep_apart(
            inputs.map(PathBuf::as_path),
            [self.json.as_deref(), self.report.as_deref(), self.extended_model.as_deref()],
        )?;
        let model = Model::read(&self.model)?;
        let read = |paths: &[PathBuf]| -> Result<Vec<Recording>, CliError> {
            paths.iter().map(|path| Ok(read_csv(path)?)).collect()
        };
        let (recordings, held_out) = (read(&self.recordings)?, read(&self.held_out)?);
        let mut last = String::new();
        let found = diagnose(&model, &recordings, &held_out, &Options::default(), &mut |progress| {
            let line = format!("{:3.0} %  {}", 100.0 * progress.done, progress.step);
            if line != last {
                streams.say(&line);
                last = line;
            }
        })?;
        if !json_on_stdout(self.json.as_deref()) {
            print_summary(streams, &found)?;
        }
        if let Some(file) = &self.json {
            streams.write_json(file, &found)?;
        }
        if let Some(file) = &self.report {
            streams.write_text(file, &diagnose_page(&found))?;
        }
        match (&self.extended_model, &found.extended_model) {
            (Some(file), Some(extended)) => streams.write_text(file, &extended.to_toml()?)?,
            (Some(file), None) => {
                streams.say(&format!("nothing was named, so {file} was not written"));
            }
            _ => {}
        }
        Ok(())
    }
}

fn print_summary(streams: &mut Streams<'_>, found: &Diagnosis) -> Result<(), CliError> {
    let out = &mut streams.out;
    writeln!(out, "{}", found.sentence)?;
    for effect in &found.effects {
        writeln!(out, "  {} at {}: {}", effect.id, effect.location, effect.sentence)?;
    }
    if let Some(mismatch) = &found.mismatch {
        for sentence in &mismatch.sentences {
            writeln!(out, "  {sentence}")?;
        }
    }
    writeln!(
        out,
        "{:>10}  {:<22}{:>14}{:>14}{:>14}{:>14}",
        "role", "output", "given", "refitted", "extended", "noise floor"
    )?;
    for pooled in &found.fit.pooled {
        let role = match pooled.role {
            stillbeam_diagnose::RecordRole::Train => "train",
            stillbeam_diagnose::RecordRole::HeldOut => "held out",
        };
        let extended =
            pooled.fits.extended.map_or_else(|| "-".to_owned(), |quality| format!("{:.4e}", quality.rms));
        writeln!(
            out,
            "{role:>10}  {:<22}{:>14.4e}{:>14.4e}{extended:>14}{:>14.4e}",
            pooled.output,
            pooled.fits.given.rms,
            pooled.fits.refitted_linear.rms,
            pooled.fits.given.noise_floor
        )?;
    }
    for cap in &found.caps {
        writeln!(out, "note: {cap}")?;
    }
    Ok(())
}
