//! `stillbeam identify`: modes from recordings.

use std::path::{Path, PathBuf};

use clap::Args;
use stillbeam_identify::frf::UniformRecord;
use stillbeam_identify::poles::{Survey, survey_decay_of, survey_forced};
use stillbeam_identify::{
    ForcedOptions, FreeDecayOptions, IdentifiedMode, IdentifiedModes, identify_forced, identify_free_decay,
};

use crate::error::CliError;
use crate::identification::columns::output_column;
use crate::identification::combined::combine;
use crate::identification::modal_file::modal_model_text;
use crate::outputs::keep_apart;
use crate::reading::ReadArgs;
use crate::report::identify_page::identify_page;
use crate::streams::{Streams, json_on_stdout};

/// Natural frequencies and damping ratios, with standard errors, from recordings.
///
/// With --input the record is a forced one (a sweep, say) and the input may be a base position (unit m), a base
/// acceleration (m_s2) or a force (N). Without it the record is a free decay.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam identify sweep.csv --input setpoint_m --modes 2 --json modes.json --report modes.html
  stillbeam identify ringdown.csv --modes 3")]
pub struct IdentifyArgs {
    /// Recordings of the same structure
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// The column that drives the structure; without it, a free decay
    #[arg(long, value_name = "COLUMN")]
    input: Option<String>,
    /// The column that responds; by default the tip's, or the only one there is
    #[arg(long, value_name = "COLUMN")]
    output: Option<String>,
    #[command(flatten)]
    reading: ReadArgs,
    /// How many modes; by default all that stand out. Of a free decay the lowest, of a forced record those that
    /// explain most of it
    #[arg(long, value_name = "N")]
    modes: Option<usize>,
    /// Write JSON to this file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<String>,
    /// Write a report with plots to this file
    #[arg(long, value_name = "FILE.html")]
    report: Option<String>,
    /// Write a modal model for `simulate` to this file, from the first recording
    #[arg(long, value_name = "FILE.toml")]
    model_out: Option<String>,
}

impl IdentifyArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        keep_apart(
            self.recordings.iter().map(PathBuf::as_path),
            [self.json.as_deref(), self.report.as_deref(), self.model_out.as_deref()],
        )?;
        let results: Vec<IdentifiedModes> =
            self.recordings.iter().map(|path| self.identify(path, streams)).collect::<Result<_, _>>()?;
        let combined = combine(&results);
        for warning in &combined.warnings {
            streams.say(&format!("warning: {}", warning.message));
        }
        if !json_on_stdout(self.json.as_deref()) {
            for result in &results {
                print_modes(streams, &result.recording, &result.modes)?;
            }
            if results.len() > 1 {
                print_modes(streams, "all recordings together", &combined.modes)?;
            }
        }
        if let Some(file) = &self.json {
            match results.as_slice() {
                [only] => streams.write_json(file, only)?,
                _ => streams.write_json(file, &combined)?,
            }
        }
        if let Some(file) = &self.report {
            let pairs = self.recordings.iter().zip(&results);
            let surveys: Vec<Survey> =
                pairs.map(|(path, result)| self.survey(path, result)).collect::<Result<_, _>>()?;
            streams.write_text(file, &identify_page(&results, &surveys))?;
        }
        match (&self.model_out, results.first()) {
            (Some(file), Some(first)) => {
                let text = modal_model_text(first)?;
                if first.input.is_none() {
                    streams.say("a free decay does not show participations: the model has 1 for each");
                }
                streams.write_text(file, &text)
            }
            _ => Ok(()),
        }
    }

    /// What the classical methods see in a recording that was identified.
    fn survey(&self, path: &Path, result: &IdentifiedModes) -> Result<Survey, CliError> {
        // Whatever there is to say about the file was said when it was read for the fit.
        let mut quiet = Streams { out: &mut std::io::sink(), messages: &mut std::io::sink() };
        let recording = self.reading.read(path, &mut quiet)?;
        let highest_hz = result.modes.iter().map(|mode| mode.frequency_hz.value).fold(0.0, f64::max);
        Ok(match &result.input {
            Some(input) => {
                survey_forced(&UniformRecord::from_recording(&recording, input, &result.output)?, None)
            }
            None => survey_decay_of(&recording, &result.output, result.window_s, 1.3 * highest_hz)?,
        })
    }

    fn identify(&self, path: &Path, streams: &mut Streams<'_>) -> Result<IdentifiedModes, CliError> {
        let recording = self.reading.read(path, streams)?;
        let input = self.input.as_deref();
        let output = output_column(&recording, input, self.output.as_deref())?;
        let chosen = if self.output.is_none() { " (chosen; --output names another)" } else { "" };
        let kind = input.map_or_else(|| "free decay".to_owned(), |input| format!("input {input}"));
        streams.say(&format!("{}: {kind}, output {output}{chosen}", recording.name));
        let identified = match input {
            Some(input) => identify_forced(
                &recording,
                &ForcedOptions { modes: self.modes, ..ForcedOptions::new(input, output) },
            )?,
            None => identify_free_decay(
                &recording,
                &FreeDecayOptions { modes: self.modes, ..FreeDecayOptions::new(output) },
            )?,
        };
        Ok(identified)
    }
}

fn print_modes(streams: &mut Streams<'_>, title: &str, modes: &[IdentifiedMode]) -> Result<(), CliError> {
    let out = &mut streams.out;
    writeln!(out, "{title}")?;
    writeln!(out, "{:>4}{:>16}{:>12}{:>16}{:>12}", "mode", "frequency (Hz)", "±", "damping ratio", "±")?;
    for (number, mode) in (1..).zip(modes) {
        writeln!(
            out,
            "{number:>4}{:>16.6}{:>12.1e}{:>16.6}{:>12.1e}",
            mode.frequency_hz.value,
            mode.frequency_hz.stderr,
            mode.damping_ratio.value,
            mode.damping_ratio.stderr
        )?;
    }
    Ok(())
}
