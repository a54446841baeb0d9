//! `stillbeam simulate`: a model under a command or a recording.

use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args};
use serde::Serialize;
use stillbeam_firmware::shaper::ShaperTable;
use stillbeam_plant::Model;
use stillbeam_recording::{ReadOptions, Recording, read_recording, write_csv};
use stillbeam_shape::ShaperDesign;

use crate::command_signal::MotionCommand;
use crate::error::CliError;
use crate::outputs::keep_apart;
use crate::simulation::{Simulated, SimulatedMove, Simulation};
use crate::streams::{Streams, json_on_stdout};

/// Simulate a model under a move or a recorded input, shaped or not.
///
/// The motion is the firmware's own: its profile within its default limits, its shaper in its integers.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("driven by").required(true).args(["command", "input"])))]
#[command(after_help = "\
Example:
  stillbeam simulate models/paper_beam.toml --command 'move 50mm' --shaper table.json --out move.csv
  stillbeam simulate models/paper_beam.toml --command 'sweep linear 0.5 8 0.1Hz/s 200mm/s2' --out sweep.csv
  stillbeam simulate models/paper_beam.toml --input sweep.csv --out simulated.csv")]
pub struct SimulateArgs {
    /// The model file
    #[arg(value_name = "MODEL.toml")]
    model: PathBuf,
    /// What the base is told to do, from zero: 'move 50' (mm) or 'move 0.05m', or a sweep, multisine, pulse
    /// or decay as on the firmware's console, in mm
    #[arg(long, value_name = "COMMAND")]
    command: Option<String>,
    /// A recording that has the model's input column; between even samples the input is a cubic, as
    /// `identify` and `diagnose` read it, unless the model says `hold`
    #[arg(long, value_name = "REC.csv")]
    input: Option<PathBuf>,
    /// Shape the command, or the recorded input, with a table that `shape --json` wrote
    #[arg(long, value_name = "FILE")]
    shaper: Option<PathBuf>,
    /// Ticks per second of a command; by default the shaper's, or 4000. Between the ticks of an excitation
    /// the base follows a cubic, as `identify` and `diagnose` read it
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Use the recorded input as it is, even if the model has a controller and the recording its reference
    #[arg(long)]
    open_loop: bool,
    /// Let the model's sensors add the noise that the model states (`noise_rms` of a `[[sensor]]`)
    #[arg(long)]
    noise: bool,
    /// With --noise: another number is another draw of it
    #[arg(long, value_name = "NUMBER", default_value_t = 0, requires = "noise")]
    seed: u64,
    /// Write what was simulated to this recording
    #[arg(long, value_name = "REC.csv")]
    out: Option<String>,
    /// Write the numbers as JSON to this file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<String>,
}

/// What is printed about a move.
#[derive(Serialize)]
struct MoveNumbers {
    schema_version: u32,
    rate_hz: f64,
    settling_time_s: Option<f64>,
    overshoot_pct: f64,
    residual_peak_m: f64,
    percentage_vibration_pct: f64,
    mode_vibration_pct: Vec<f64>,
}

/// What is printed about one simulated output.
#[derive(Serialize)]
struct OutputNumbers {
    column: String,
    lowest: f64,
    highest: f64,
    rms: f64,
    /// Against the recording's column of the same name, if it has one: rms difference, and that over the
    /// recorded column's standard deviation.
    rms_error: Option<f64>,
    nrmse: Option<f64>,
}

#[derive(Serialize)]
struct RecordingNumbers {
    schema_version: u32,
    outputs: Vec<OutputNumbers>,
}

impl SimulateArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        let inputs = [Some(&self.model), self.input.as_ref(), self.shaper.as_ref()];
        keep_apart(
            inputs.into_iter().flatten().map(PathBuf::as_path),
            [self.out.as_deref(), self.json.as_deref()],
        )?;
        let model = Model::read(&self.model)?;
        if self.noise && !model.setup().sensors.iter().any(|sensor| sensor.noise_rms > 0.0) {
            return Err(CliError::Usage(format!(
                "--noise: no sensor of {} states a noise; add `noise_rms` to a [[sensor]], or leave --noise out",
                self.model.display()
            )));
        }
        let table = self.table()?;
        let simulation = Simulation {
            name: &self.model.display().to_string(),
            model: &model,
            table: table.as_ref(),
            open_loop: self.open_loop,
            noise_seed: self.noise.then_some(self.seed),
        };
        match (&self.command, &self.input) {
            (Some(command), _) => self.run_command(&simulation, command, streams),
            (None, Some(input)) => self.run_recording(&simulation, input, streams),
            (None, None) => Err(CliError::Usage(
                "nothing to simulate; give --command 'move 50mm' or --input RECORDING".to_owned(),
            )),
        }
    }

    fn table(&self) -> Result<Option<ShaperTable>, CliError> {
        let Some(path) = &self.shaper else { return Ok(None) };
        let design = ShaperDesign::read(path)?;
        let table = design.table().map_err(|problem| CliError::File {
            file: path.display().to_string(),
            problem: problem.to_string(),
        })?;
        Ok(Some(table))
    }

    fn run_command(
        &self,
        simulation: &Simulation<'_>,
        command: &str,
        streams: &mut Streams<'_>,
    ) -> Result<(), CliError> {
        let command: MotionCommand = command.parse()?;
        if let Some(doubt) = &command.doubt {
            streams.say(&format!("--command: {doubt}"));
        }
        match simulation.of_command(&command, simulation.rate_hz(self.rate)?)? {
            Simulated::Move(made) => self.report_move(&made, streams),
            Simulated::Excitation(result) => self.report_outputs(simulation.model, &result, None, streams),
        }
    }

    fn report_move(&self, made: &SimulatedMove, streams: &mut Streams<'_>) -> Result<(), CliError> {
        let numbers = MoveNumbers::of(made);
        if let Some(path) = &self.out {
            write(Path::new(path), &made.recording(), streams)?;
        }
        if !json_on_stdout(self.json.as_deref()) {
            let settling =
                numbers.settling_time_s.map_or("never".to_owned(), |seconds| format!("{seconds:.3} s"));
            writeln!(streams.out, "settling time (2 % band)   {settling}")?;
            writeln!(streams.out, "overshoot                  {:.3} %", numbers.overshoot_pct)?;
            writeln!(streams.out, "residual peak of the tip   {:.6} m", numbers.residual_peak_m)?;
            writeln!(streams.out, "percentage vibration       {:.4} %", numbers.percentage_vibration_pct)?;
            for (number, vibration) in (1..).zip(&numbers.mode_vibration_pct) {
                writeln!(streams.out, "  of mode {number}                {vibration:.4} %")?;
            }
        }
        self.json.as_ref().map_or(Ok(()), |file| streams.write_json(file, &numbers))
    }

    fn run_recording(
        &self,
        simulation: &Simulation<'_>,
        path: &Path,
        streams: &mut Streams<'_>,
    ) -> Result<(), CliError> {
        if let Some(rate_hz) = self.rate {
            return Err(CliError::Usage(format!(
                "--rate {rate_hz} goes with --command; a recording brings its own times"
            )));
        }
        let recording = read_recording(path, &ReadOptions::default())?.recording;
        let result = simulation.of_recording(&recording)?;
        // Behind a shaper the times are the shaper's, and so is the experiment.
        let beside = simulation.table.is_none().then_some(&recording);
        self.report_outputs(simulation.model, &result, beside, streams)
    }

    /// Writes what was asked for and prints what each output did, beside what was recorded of it.
    fn report_outputs(
        &self,
        model: &Model,
        result: &Recording,
        recorded: Option<&Recording>,
        streams: &mut Streams<'_>,
    ) -> Result<(), CliError> {
        if let Some(path) = &self.out {
            write(Path::new(path), result, streams)?;
        }
        let outputs = model.output_columns().into_iter().filter_map(|column| {
            let simulated = result.column(&column).ok()?;
            let recorded = recorded.and_then(|recording| recording.column(&column).ok());
            Some(OutputNumbers::new(column, simulated, recorded))
        });
        let numbers = RecordingNumbers { schema_version: 1, outputs: outputs.collect() };
        if !json_on_stdout(self.json.as_deref()) {
            for output in &numbers.outputs {
                let OutputNumbers { column, lowest, highest, rms, .. } = output;
                writeln!(streams.out, "{column}: from {lowest:.6e} to {highest:.6e}, rms {rms:.6e}")?;
                if let (Some(error), Some(nrmse)) = (output.rms_error, output.nrmse) {
                    writeln!(
                        streams.out,
                        "  off the recorded one by an rms of {error:.3e}, {:.2} % of its spread",
                        100.0 * nrmse
                    )?;
                }
            }
        }
        self.json.as_ref().map_or(Ok(()), |file| streams.write_json(file, &numbers))
    }
}

impl MoveNumbers {
    fn of(made: &SimulatedMove) -> Self {
        let shaped = &made.shaped;
        Self {
            schema_version: 1,
            rate_hz: shaped.rate_hz,
            settling_time_s: shaped.metrics.settling_time_s,
            overshoot_pct: shaped.metrics.overshoot_pct,
            residual_peak_m: shaped.residual.tip_peak_m,
            percentage_vibration_pct: made.vibration.tip_pct,
            mode_vibration_pct: made.vibration.modes_pct.clone(),
        }
    }
}

impl OutputNumbers {
    fn new(column: String, simulated: &[f64], recorded: Option<&[f64]>) -> Self {
        let rms = |values: &mut dyn Iterator<Item = f64>| {
            let (sum, count) =
                values.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
            if count > 0.0 { Some(f64::sqrt(sum / count)) } else { None }
        };
        // An empty cell of a recording is not a number: a missed frame, or a sensor slower than the rows.
        let pairs = || {
            let rows = recorded.into_iter().flatten().zip(simulated);
            rows.filter(|(recorded, simulated)| !recorded.is_nan() && !simulated.is_nan())
        };
        let count = pairs().count().max(1) as f64;
        let mean = pairs().map(|(recorded, _)| recorded).sum::<f64>() / count;
        let rms_error = rms(&mut pairs().map(|(recorded, simulated)| simulated - recorded));
        let spread = rms(&mut pairs().map(|(recorded, _)| recorded - mean));
        Self {
            column,
            lowest: simulated.iter().copied().fold(f64::INFINITY, f64::min),
            highest: simulated.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            rms: rms(&mut simulated.iter().copied().filter(|value| !value.is_nan())).unwrap_or(0.0),
            rms_error,
            nrmse: rms_error
                .zip(spread)
                .map(|(error, spread)| error / spread)
                .filter(|nrmse| nrmse.is_finite()),
        }
    }
}

fn write(path: &Path, recording: &Recording, streams: &mut Streams<'_>) -> Result<(), CliError> {
    write_csv(path, recording)?;
    streams.say(&format!("wrote {}", path.display()));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_cells_do_not_count() {
        let simulated = [3.0, f64::NAN, -3.0, 5.0];
        let numbers = OutputNumbers::new("tip".into(), &simulated[..3], None);
        assert_eq!((numbers.lowest, numbers.highest, numbers.rms), (-3.0, 3.0, 3.0));
        let numbers = OutputNumbers::new("tip".into(), &simulated, Some(&[2.0, 7.0, -4.0, f64::NAN]));
        assert_eq!(numbers.rms_error, Some(1.0));
    }
}
