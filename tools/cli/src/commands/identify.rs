//! `stillbeam identify`: modes from recordings.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use stillbeam_identify::{
    ForcedOptions, FreeDecayOptions, IdentifiedMode, IdentifiedModes, InputKind, OutputOnlyOptions,
    OutputQuantity, RecordKind, SWEEP_COLUMN, SpectralOptions, SweepPlan, identify_forced,
    identify_forced_together, identify_free_decay, identify_output_only, identify_spectra, possible_inputs,
    recognise, usual_max_delay_s,
};
use stillbeam_plant::{BASE_POSITION, SETPOINT};
use stillbeam_recording::{ImportedSpectra, Measurement, Recording};

use crate::error::CliError;
use crate::identification::axis_shapers::{AXIS_COLUMNS, AxisArgs, AxisShapers};
use crate::identification::columns::{holds_base_motion, output_column};
use crate::identification::combined::combine;
use crate::identification::modal_file::{ModalFile, modal_file};
use crate::identification::sweep::with_sweeps;
use crate::outputs::keep_apart;
use crate::reading::ReadArgs;
use crate::report::identify_page::identify_page;
use crate::streams::{Streams, json_on_stdout};

/// Natural frequencies and damping ratios, with standard errors, from recordings.
///
/// With --input the record is a forced one (a sweep, say) and the input may be a base position (unit m), a
/// base acceleration (m_s2) or a force (N). Without it the record says itself what it is: a free decay is
/// fitted, of several knocks one decay, of a random record (ambient noise, traffic, wind) the outputs alone
/// are read, and a sweep, a multisine or a tone is refused with what it needs. Several forced recordings are
/// also fitted together: same modes, each with its own initial state and offset.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam identify sweep.csv --input setpoint_m --modes 2 --json modes.json --report modes.html
  stillbeam identify ringdown.csv --modes 3
  stillbeam identify raw_data_x.csv raw_data_y.csv --sweep 5,133.33,1Hz/s --axes
  stillbeam identify frf.uff")]
pub struct IdentifyArgs {
    /// Recordings of the same structure
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// The column that drives the structure; without it, the record itself says what it is
    #[arg(long, value_name = "COLUMN")]
    input: Option<String>,
    /// The column that responds; by default the tip's, else the strongest. Without an input several,
    /// with commas between, which give shapes
    #[arg(long, value_name = "COLUMN")]
    output: Option<String>,
    /// The sweep that the recordings answer, where its signal was not recorded: its start is found in the
    /// response. Frequencies in Hz; the rate in Hz/s (2.5Hz/s) or oct/min, or its length in seconds (36s)
    #[arg(long, value_name = "FROM,TO,RATE_OR_SECONDS[,exponential]", conflicts_with = "input")]
    sweep: Option<SweepPlan>,
    #[command(flatten)]
    axes: AxisArgs,
    #[command(flatten)]
    reading: ReadArgs,
    /// What the input is, where its unit does not say
    #[arg(long, value_name = "KIND")]
    input_kind: Option<InputMeaning>,
    /// What the output is, where its unit does not say
    #[arg(long, value_name = "QUANTITY")]
    output_quantity: Option<OutputMeaning>,
    /// Take the input as given even where the base's position was recorded
    #[arg(long)]
    keep_input: bool,
    /// The longest delay of the output behind the input that may be found, s; kept only where the record
    /// calls for one. By default 0.05, and of a record shorter than 2.5 s a fiftieth of it
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    max_delay: Option<f64>,
    /// Where the free decay begins, s; by default at the largest deflection
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    start: Option<f64>,
    /// Where the free decay ends, s; by default where it has long sunk into the noise
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    end: Option<f64>,
    /// How many modes; by default all that stand out. Of a free decay the lowest, of a forced record those
    /// that explain most of it
    #[arg(long, value_name = "N")]
    modes: Option<usize>,
    /// Write JSON to this file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<String>,
    /// Write a report with plots to this file
    #[arg(long, value_name = "FILE.html")]
    report: Option<String>,
    /// Write a modal model for `simulate` to this file, from all recordings together where they are forced,
    /// else from the first one
    #[arg(long, value_name = "FILE.toml")]
    model_out: Option<String>,
}

impl IdentifyArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        keep_apart(
            self.recordings.iter().map(PathBuf::as_path),
            [self.json.as_deref(), self.report.as_deref(), self.model_out.as_deref()],
        )?;
        let (mut recordings, mut spectra) = (Vec::new(), Vec::new());
        for path in &self.recordings {
            match self.reading.measurement(path, streams)? {
                Measurement::Recording(imported) => recordings.push(imported.recording),
                Measurement::Spectra(file) => spectra.push(file),
            }
        }
        if !spectra.is_empty() {
            return self.identify_spectra(&spectra, recordings.len(), streams);
        }
        if let Some(plan) = &self.sweep {
            let quantity = self.output_quantity.map(OutputQuantity::from);
            recordings = with_sweeps(&recordings, plan, (self.output.as_deref(), quantity), streams)?;
        }
        let input = self.input(&recordings, streams)?;
        let results: Vec<IdentifiedModes> = recordings
            .iter()
            .map(|recording| self.identify(recording, input.as_deref(), streams))
            .collect::<Result<_, _>>()?;
        let together = match (&input, recordings.len()) {
            (Some(input), 2..) if !self.axes.axes => {
                let all: Vec<&Recording> = recordings.iter().collect();
                Some(identify_forced_together(&all, &self.forced_options(input, &recordings[0])?)?)
            }
            _ => None,
        };
        self.tell(&results, together.as_ref(), streams)
    }

    /// Modes from functions of frequency.
    fn identify_spectra(
        &self,
        files: &[ImportedSpectra],
        recordings: usize,
        streams: &mut Streams<'_>,
    ) -> Result<(), CliError> {
        if recordings > 0 || self.input.is_some() || self.sweep.is_some() {
            return Err(CliError::Usage(format!(
                "{}: it holds {}, which has no input and is not fitted together with signals over time; leave out --input and --sweep and the other recordings",
                files[0].name,
                files[0].words()
            )));
        }
        let outputs = self.output.iter().flat_map(|names| names.split(','));
        let options = SpectralOptions {
            outputs: outputs.map(|name| name.trim().to_owned()).collect(),
            modes: self.modes,
            band_hz: None,
        };
        let results: Vec<IdentifiedModes> =
            files.iter().map(|file| identify_spectra(file, &options)).collect::<Result<_, _>>()?;
        self.tell(&results, None, streams)
    }

    /// Modes and warnings for people, and the files that were asked for.
    fn tell(
        &self,
        results: &[IdentifiedModes],
        together: Option<&IdentifiedModes>,
        streams: &mut Streams<'_>,
    ) -> Result<(), CliError> {
        let combined = combine(results, together);
        for warning in &combined.warnings {
            streams.say(&format!("warning: {}", warning.message));
        }
        streams.say(&combined.linearity.statement);
        let axes: Vec<AxisShapers> = match self.axes.axes {
            true => results.iter().map(|axis| self.axes.recommend(axis)).collect::<Result<_, _>>()?,
            false => Vec::new(),
        };
        if !json_on_stdout(self.json.as_deref()) {
            for result in results {
                print_modes(streams, &result.recording, &result.modes)?;
                print_fit(streams, result)?;
                print_real_pole(streams, result)?;
            }
            if results.len() > 1 && !self.axes.axes {
                print_modes(streams, "all recordings together", &combined.modes)?;
                together.map_or(Ok(()), |together| print_real_pole(streams, together))?;
            }
            for axis in &axes {
                writeln!(streams.out, "\n{axis}")?;
            }
            if !axes.is_empty() {
                streams.say(AXIS_COLUMNS);
            }
        }
        if let Some(file) = &self.json {
            match results {
                [only] => streams.write_json(file, only)?,
                _ => streams.write_json(file, &combined)?,
            }
        }
        if let Some(file) = &self.report {
            let pages: Vec<&IdentifiedModes> = together.into_iter().chain(results).collect();
            streams.write_text(file, &identify_page(&pages, &axes))?;
        }
        match (&self.model_out, together.or(results.first())) {
            (Some(file), Some(best)) => {
                let ModalFile { text, remarks } = modal_file(best)?;
                for remark in remarks {
                    streams.say(&remark);
                }
                streams.write_text(file, &text)
            }
            _ => Ok(()),
        }
    }

    /// The input column: the one asked for, or the base's position where every recording holds that and it
    /// lies between the one asked for and the response.
    fn input(&self, recordings: &[Recording], streams: &mut Streams<'_>) -> Result<Option<String>, CliError> {
        if self.sweep.is_some() {
            return Ok(Some(SWEEP_COLUMN.to_owned()));
        }
        let Some(asked) = &self.input else { return Ok(None) };
        let measured = |recording: &Recording| {
            let present = |samples: &[f64]| samples.iter().filter(|y| y.is_finite()).count();
            recording.column(BASE_POSITION).is_ok_and(|samples| 2 * present(samples) > samples.len())
        };
        let upstream = asked == SETPOINT || asked == "command_m";
        let responds = self.output.as_deref() == Some(BASE_POSITION);
        if self.keep_input || responds || !upstream || !recordings.iter().all(measured) {
            return Ok(Some(asked.clone()));
        }
        for recording in recordings {
            recording.column(asked)?;
        }
        streams.say(&format!(
            "{BASE_POSITION} was recorded and is taken as the input: what the drive makes of {asked} is then no matter (--keep-input takes {asked})"
        ));
        Ok(Some(BASE_POSITION.to_owned()))
    }

    fn forced_options(&self, input: &str, recording: &Recording) -> Result<ForcedOptions, CliError> {
        let output = output_column(recording, Some(input), self.output.as_deref())?.name;
        Ok(ForcedOptions {
            modes: self.modes,
            input_kind: self.input_kind.map(InputKind::from),
            output_quantity: self.output_quantity.map(OutputQuantity::from),
            max_delay_s: self.max_delay.unwrap_or_else(|| usual_max_delay_s(recording)),
            ..ForcedOptions::new(input, output)
        })
    }

    /// The outputs that were asked for behind the first one.
    fn further_outputs(&self, recording: &Recording) -> Result<Vec<String>, CliError> {
        let asked = self.output.iter().flat_map(|asked| asked.split(',')).skip(1);
        let further: Vec<String> = asked.map(|name| name.trim().to_owned()).collect();
        for output in &further {
            recording.column(output)?;
        }
        Ok(further)
    }

    /// All outputs that were asked for, the first of them for the amplitudes.
    fn output_only_options(
        &self,
        recording: &Recording,
        first: String,
    ) -> Result<OutputOnlyOptions, CliError> {
        let outputs = match &self.output {
            Some(asked) => asked.split(',').map(|name| name.trim().to_owned()).collect(),
            None => vec![first],
        };
        for output in &outputs {
            recording.column(output)?;
        }
        Ok(OutputOnlyOptions { outputs, modes: self.modes })
    }

    fn identify(
        &self,
        recording: &Recording,
        input: Option<&str>,
        streams: &mut Streams<'_>,
    ) -> Result<IdentifiedModes, CliError> {
        let asked = self.output.as_deref().map(|asked| asked.split(',').next().unwrap_or(asked));
        let choice = output_column(recording, input, asked)?;
        let output = choice.name.clone();
        let chosen = if self.output.is_none() { choice.chosen() } else { String::new() };
        let recognised = match input {
            Some(_) => None,
            None => Some(recognise(recording, &output)?),
        };
        let kind = match (&recognised, input) {
            (Some(recognised), _) => recognised.kind.words().to_owned(),
            (None, input) => format!("input {}", input.unwrap_or_default()),
        };
        streams.say(&format!("{}: {kind}, output {output}{chosen}", recording.name));
        if let Some(said) = input.and_then(|input| holds_base_motion(recording, input, &output)) {
            streams.say(&said);
        }
        let identified = match input {
            Some(input) => identify_forced(recording, &self.forced_options(input, recording)?)?,
            None if recognised.is_some_and(|one| one.kind == RecordKind::Random) && self.start.is_none() => {
                streams.say(
                    "It is random, so that outputs alone are read: modes from their covariances, which nothing but the structure shapes if the excitation has no lines of its own.",
                );
                // A record of what drives it is worth more than any assumption about it.
                for driven in possible_inputs(recording, &output) {
                    streams.say(&format!(
                        "If {driven} is what drives it, `--input {driven}` gives far more certain modes."
                    ));
                }
                identify_output_only(recording, &self.output_only_options(recording, output)?)?
            }
            None => identify_free_decay(
                recording,
                &FreeDecayOptions {
                    modes: self.modes,
                    start_s: self.start,
                    end_s: self.end,
                    also: self.further_outputs(recording)?,
                    ..FreeDecayOptions::new(output)
                },
            )?,
        };
        for other in choice.unexplained(recording, &identified) {
            streams.say(&other);
        }
        Ok(identified)
    }
}

/// What an input column is, where its unit does not say.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum InputMeaning {
    Force,
    BasePosition,
    BaseAcceleration,
}

impl From<InputMeaning> for InputKind {
    fn from(meaning: InputMeaning) -> Self {
        match meaning {
            InputMeaning::Force => Self::Force,
            InputMeaning::BasePosition => Self::BasePosition,
            InputMeaning::BaseAcceleration => Self::BaseAcceleration,
        }
    }
}

/// What an output column is, where its unit does not say.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum OutputMeaning {
    Position,
    Velocity,
    Acceleration,
}

impl From<OutputMeaning> for OutputQuantity {
    fn from(meaning: OutputMeaning) -> Self {
        match meaning {
            OutputMeaning::Position => Self::Position,
            OutputMeaning::Velocity => Self::Velocity,
            OutputMeaning::Acceleration => Self::Acceleration,
        }
    }
}

fn print_real_pole(streams: &mut Streams<'_>, result: &IdentifiedModes) -> Result<(), CliError> {
    if let Some(real) = &result.real_pole {
        writeln!(streams.out, "{}", real.words())?;
    }
    Ok(())
}

/// How much of its output the fit explains.
fn print_fit(streams: &mut Streams<'_>, result: &IdentifiedModes) -> Result<(), CliError> {
    if let Some(record) = result.records.first() {
        writeln!(streams.out, "the fit explains {:.1} % of {}", record.fit_percent, result.output)?;
    }
    Ok(())
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
