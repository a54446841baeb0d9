//! `stillbeam diagnose`: which physics a model left out.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use stillbeam_diagnose::{Diagnosis, Options, ParameterChange, Progress, Verdict, controls, diagnose};
use stillbeam_plant::{Controller, Model};
use stillbeam_recording::Recording;

use crate::error::CliError;
use crate::outputs::keep_apart;
use crate::reading::ReadArgs;
use crate::report::diagnose_page::diagnose_page;
use crate::shaping::{MachineLimits, Travel};
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
    /// Recordings to train on; one whose side file says role = "held_out" is held out
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Recordings to judge on, never trained on
    #[arg(long, value_name = "RECORDING", num_args = 1..)]
    held_out: Vec<PathBuf>,
    #[command(flatten)]
    reading: ReadArgs,
    /// Take the recorded input as it is, even if the model has a controller and the recordings its reference
    #[arg(long)]
    open_loop: bool,
    /// Write JSON to this file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<String>,
    /// Write a report with plots to this file
    #[arg(long, value_name = "FILE.html")]
    report: Option<String>,
    /// Write the refitted model, with the physics found, to this file, for `simulate`
    #[arg(long, value_name = "FILE.toml")]
    extended_model: Option<String>,
    /// Write the given model, only its own parameters refitted, those of the laws it has with them, to this
    /// file, whatever was found
    #[arg(long, value_name = "FILE.toml")]
    refitted_model: Option<String>,
    /// Also try the diagnosis on this very experiment with a known truth: this many times nothing missing,
    /// half as often the physics found present, once with it struck from the catalogue. Takes as many times
    /// longer
    #[arg(long, value_name = "RUNS", num_args = 0..=1, default_missing_value = "6")]
    controls: Option<usize>,
    /// The largest amplitude that the machine may be given, in the unit of the model's input, for the run
    /// proposed next [default: three times the largest recorded]
    #[arg(long, value_name = "AMPLITUDE")]
    most_amplitude: Option<f64>,
    /// Velocity and acceleration that the machine allows, in mm/s and mm/s², for the run proposed next; the
    /// board's own settings as they come if not given
    #[arg(long, value_name = "VELOCITY,ACCELERATION")]
    limits: Option<MachineLimits>,
    /// Where the machine may be, in mm, for the run proposed next, which starts in the middle; the board's
    /// own travel as it comes if not given
    #[arg(long, value_name = "FROM,TO", allow_hyphen_values = true)]
    travel: Option<Travel>,
    /// Begin no further search after this many seconds; the result then says what was not looked for, and no
    /// verdict is more certain than the whole search would make it
    #[arg(long, value_name = "SECONDS")]
    time_limit: Option<f64>,
    /// The same in processor seconds of all threads together, so that a busy computer changes no answer
    #[arg(long, value_name = "SECONDS")]
    processor_limit: Option<f64>,
}

impl DiagnoseArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        let inputs = std::iter::once(&self.model).chain(&self.recordings).chain(&self.held_out);
        keep_apart(
            inputs.map(PathBuf::as_path),
            [&self.json, &self.report, &self.extended_model, &self.refitted_model].map(Option::as_deref),
        )?;
        self.check_roles()?;
        let mut model = self.read_model()?;
        let controller = model.setup().controller.clone();
        if self.open_loop {
            model.setup_mut().controller = None;
        }
        let mut read = |paths: &[PathBuf]| -> Result<Vec<Recording>, CliError> {
            paths.iter().map(|path| self.reading.read(path, streams)).collect()
        };
        let (recordings, held_out) = (read(&self.recordings)?, read(&self.held_out)?);
        let mut options = Options::default();
        options.most_amplitude = self.most_amplitude;
        options.limits = Some(self.limits.unwrap_or_default().of_an_excitation(self.travel));
        options.time_limit_s = self.time_limit;
        options.processor_limit_s = self.processor_limit;
        let mut teller = Teller::new();
        let mut found = diagnose(&model, &recordings, &held_out, &options, &mut |progress| {
            teller.tell(streams, progress);
        })?;
        if let Some(runs) = self.controls {
            let mut teller = Teller::new();
            let tell = &mut |progress: &Progress| teller.tell(streams, progress);
            found.controls = Some(controls(&model, &recordings, &held_out, &options, &found, runs, tell)?);
        }
        if !json_on_stdout(self.json.as_deref()) {
            print_summary(streams, &found)?;
        }
        self.write(&found, controller.as_ref(), streams)
    }

    /// Writes the files that were asked for; a model with the controller that it came with.
    fn write(
        &self,
        found: &Diagnosis,
        controller: Option<&Controller>,
        streams: &mut Streams<'_>,
    ) -> Result<(), CliError> {
        let written = |found: &Model| {
            let mut model = found.clone();
            model.setup_mut().controller = controller.cloned();
            model.to_toml()
        };
        if let Some(file) = &self.json {
            streams.write_json(file, found)?;
        }
        if let Some(file) = &self.report {
            streams.write_text(file, &diagnose_page(found))?;
        }
        if let Some(file) = &self.refitted_model {
            streams.write_text(file, &written(&found.refitted_model)?)?;
        }
        match (&self.extended_model, &found.extended_model) {
            (Some(file), Some(extended)) => streams.write_text(file, &written(extended)?)?,
            (Some(file), None) if found.verdict == Verdict::Adequate => {
                streams.write_text(file, &written(&found.refitted_model)?)?;
                streams.say(&format!(
                    "nothing had to be added: {file} holds the given model with its parameters refitted"
                ));
            }
            (Some(file), None) => {
                streams.say(&format!("nothing was named, so {file} was not written"));
            }
            _ => {}
        }
        Ok(())
    }
}

impl DiagnoseArgs {
    /// The model; a recording in its place is named as one.
    fn read_model(&self) -> Result<Model, CliError> {
        let is_named_as_one = self.model.extension().is_some_and(|extension| extension == "toml");
        Model::read(&self.model).map_err(|error| match is_named_as_one {
            true => error.into(),
            false => CliError::Usage(format!(
                "{} is taken for the model, which comes before the recordings, and is none: {error}",
                self.model.display()
            )),
        })
    }

    /// A recording that was trained on cannot judge.
    fn check_roles(&self) -> Result<(), CliError> {
        let identity = |path: &PathBuf| path.canonicalize().unwrap_or_else(|_| path.clone());
        let trained: Vec<PathBuf> = self.recordings.iter().map(identity).collect();
        match self.held_out.iter().find(|path| trained.contains(&identity(path))) {
            None => Ok(()),
            Some(path) => Err(CliError::Usage(format!(
                "{} is both trained on and held out; a recording that was trained on says nothing about what the model has \
                 not seen: leave it out of one list",
                path.display()
            ))),
        }
    }
}

/// Says how far the work is, and how long it will still take once that can be told.
struct Teller {
    started: Instant,
    last: String,
}

impl Teller {
    fn new() -> Self {
        Self { started: Instant::now(), last: String::new() }
    }

    fn tell(&mut self, streams: &mut Streams<'_>, progress: &Progress) {
        let past_s = self.started.elapsed().as_secs_f64();
        // Before a fifth is done the rest is a guess.
        let left = if progress.done >= 0.2 && progress.done < 1.0 {
            format!(" (about {:.0} s left)", past_s * (1.0 - progress.done) / progress.done)
        } else {
            String::new()
        };
        let line = format!("{:3.0} %  {}{left}", 100.0 * progress.done, progress.step);
        if line != self.last {
            streams.say(&line);
            self.last = line;
        }
    }
}

fn print_summary(streams: &mut Streams<'_>, found: &Diagnosis) -> Result<(), CliError> {
    let out = &mut streams.out;
    writeln!(out, "{}", found.sentence)?;
    for effect in &found.effects {
        writeln!(out, "  {} at {}: {}", effect.id, effect.location, effect.sentence)?;
    }
    if let Some(mismatch) = &found.mismatch {
        writeln!(out, "Of what the refitted model leaves over:")?;
        for sentence in &mismatch.sentences {
            writeln!(out, "  {sentence}")?;
        }
    }
    for ParameterChange { path, from, to, stderr } in &found.parameter_changes {
        writeln!(out, "  {path}: {to:.5e} ± {stderr:.1e} instead of {from:.5e}")?;
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
    for tie in &found.ties {
        writeln!(out, "{}", tie.sentence)?;
    }
    if let (Some(next), Some(reason)) = (&found.next_experiment, &found.next_experiment_reason) {
        writeln!(out, "next run: {next}\n  {reason}")?;
    }
    if let Some(controls) = &found.controls {
        writeln!(out, "{}", controls.sentence())?;
    }
    for cap in &found.caps {
        writeln!(out, "note: {cap}")?;
    }
    Ok(())
}
