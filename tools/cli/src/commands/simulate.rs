//! `stillbeam simulate`: a model under a command or a recording.

use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args};
use serde::Serialize;
use stillbeam_firmware::shaper::ShaperTable;
use stillbeam_identify::InputInterpolation;
use stillbeam_identify::interpolation::PiecewiseCubic;
use stillbeam_plant::{
    BASE_POSITION, Feedback, Model, SETPOINT, SimulateOptions, TIP_DEFLECTION, TIP_POSITION, simulate_with,
};
use stillbeam_recording::{ReadOptions, Recording, read_recording, write_csv};
use stillbeam_shape::ShaperDesign;

use crate::base_move::BaseMove;
use crate::command_signal::{MotionCommand, shape_recorded, shaped_setpoints_m};
use crate::error::CliError;
use crate::outputs::keep_apart;
use crate::streams::{Streams, json_on_stdout};

/// Between the samples of an input at a lower rate than this there are straight lines of this rate, hertz,
/// ...
const FINE_HZ: f64 = 4000.0;
/// ... or this many to an interval: then they are off a sine of four samples per period by less than 1e-4 of
/// it.
const MOST_PARTS: f64 = 64.0;
/// Distances from even stamps, as a share of the interval, that are rounding.
const EVEN: f64 = 5e-3;

/// Seconds of a simulated move that are written to a recording, or the whole of a command that takes longer:
/// a decay lasts as long as it was asked for.
const WRITTEN_S: f64 = 10.0;

/// Ticks per second without --rate and without a shaper.
const DEFAULT_RATE_HZ: f64 = 4000.0;

/// How long the machine is simulated after a motion that comes back, seconds.
const AFTER_S: f64 = 2.0;

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
        match (&self.command, &self.input) {
            (Some(command), _) => self.run_command(&model, command, table.as_ref(), streams),
            (None, Some(input)) => self.run_recording(&model, input, table.as_ref(), streams),
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
        model: &Model,
        command: &str,
        table: Option<&ShaperTable>,
        streams: &mut Streams<'_>,
    ) -> Result<(), CliError> {
        let command: MotionCommand = command.parse()?;
        if let Some(doubt) = &command.doubt {
            streams.say(&format!("--command: {doubt}"));
        }
        let table_hz = table.map(|table| table.tick_rate().hz());
        let rate_hz = match (self.rate, table_hz) {
            (Some(rate_hz), Some(table_hz)) if rate_hz != table_hz => {
                return Err(CliError::Usage(format!(
                    "--rate {rate_hz} Hz, but the shaper is for {table_hz} Hz; leave --rate out, or design a table for it"
                )));
            }
            (rate_hz, table_hz) => rate_hz.or(table_hz).unwrap_or(DEFAULT_RATE_HZ),
        };
        let context = self.model.display().to_string();
        let setpoints_m = shaped_setpoints_m(&command, rate_hz, table)?;
        if setpoints_m.first() == setpoints_m.last() {
            return self.run_excitation(model, rate_hz, setpoints_m, streams);
        }
        let simulated = |table| {
            let setpoints_m = shaped_setpoints_m(&command, rate_hz, table)?;
            BaseMove::simulate(model, rate_hz, &setpoints_m).map_err(CliError::plant(context.clone()))
        };
        let shaped = simulated(table)?;
        let unshaped = simulated(None)?;
        let vibration = shaped.percentage_vibration(&unshaped);
        let numbers = MoveNumbers {
            schema_version: 1,
            rate_hz,
            settling_time_s: shaped.metrics.settling_time_s,
            overshoot_pct: shaped.metrics.overshoot_pct,
            residual_peak_m: shaped.residual.tip_peak_m,
            percentage_vibration_pct: vibration.tip_pct,
            mode_vibration_pct: vibration.modes_pct,
        };
        if let Some(path) = &self.out {
            write(Path::new(path), &move_recording(&shaped, setpoints_m.len()), streams)?;
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

    /// A motion that comes back has no settling time; what it does to each output is printed instead.
    fn run_excitation(
        &self,
        model: &Model,
        rate_hz: f64,
        mut setpoints_m: Vec<f64>,
        streams: &mut Streams<'_>,
    ) -> Result<(), CliError> {
        let Some(input) = model.input().filter(|input| input.is_motion()) else {
            return Err(CliError::Usage(format!(
                "{}: a command is a motion, and the model's input is none; set input.column to setpoint_m or base_position_m",
                self.model.display()
            )));
        };
        let held = setpoints_m.last().copied().unwrap_or(0.0);
        setpoints_m.resize(setpoints_m.len() + (AFTER_S * rate_hz) as usize, held);
        let time_s = (0..setpoints_m.len()).map(|index| index as f64 / rate_hz).collect();
        let driven = Recording::new("simulated excitation", time_s).with_column(&input.column, setpoints_m);
        match self.between_samples(model, &driven)? {
            Some((fine, rate_hz)) => self.report(model, &fine, Some(rate_hz), None, streams),
            None => self.report(model, &driven, None, None, streams),
        }
    }

    fn run_recording(
        &self,
        model: &Model,
        path: &Path,
        table: Option<&ShaperTable>,
        streams: &mut Streams<'_>,
    ) -> Result<(), CliError> {
        if let Some(rate_hz) = self.rate {
            return Err(CliError::Usage(format!(
                "--rate {rate_hz} goes with --command; a recording brings its own times"
            )));
        }
        let recording = read_recording(path, &ReadOptions::default())?.recording;
        let driven = match (table, model.input()) {
            // With a controller it is the reference that moves.
            (Some(table), _) if model.setup().controller.is_some() && !self.open_loop => {
                let reference = model.setup().controller.as_ref().map(|it| it.reference_column.as_str());
                shape_recorded(&recording, reference.unwrap_or_default(), table)?
            }
            (Some(table), Some(input)) if model.input_is_motion() => {
                shape_recorded(&recording, &input.column, table)?
            }
            (Some(_), _) => {
                return Err(CliError::Usage(format!(
                    "{}: a shaper shapes motion, and the model's input is none; set input.column to setpoint_m or base_position_m",
                    self.model.display()
                )));
            }
            (None, _) => recording.clone(),
        };
        // After shaping, the times are the shaper's, and so is the experiment.
        if table.is_some() {
            return self.report(model, &driven, None, None, streams);
        }
        match self.between_samples(model, &recording)? {
            Some((fine, rate_hz)) => self.report(model, &fine, Some(rate_hz), Some(&recording), streams),
            None => self.report(model, &recording, None, Some(&recording), streams),
        }
    }

    /// An even recording's input on a grid so fine that the straight lines of the simulation follow its
    /// cubic, and the rate of the recording, hertz. `None` where its own samples are to be used: a model that
    /// says what its input does between them (`hold`), uneven stamps, a loop, samples that are missing (which
    /// the simulation refuses with their place).
    fn between_samples(
        &self,
        model: &Model,
        recording: &Recording,
    ) -> Result<Option<(Recording, f64)>, CliError> {
        let in_loop = model.setup().controller.as_ref().is_some_and(|controller| {
            !self.open_loop && recording.column(&controller.reference_column).is_ok()
        });
        let (Some(input), false) = (model.input(), in_loop) else { return Ok(None) };
        if input.hold.is_some() && !model.input_is_motion() {
            return Ok(None);
        }
        let samples = recording.column(&input.column)?;
        let (Some(first_s), Some(last_s)) = (recording.time_s.first(), recording.time_s.last()) else {
            return Ok(None);
        };
        let rate_hz = (recording.len() as f64 - 1.0) / (last_s - first_s);
        let parts = (FINE_HZ / rate_hz).ceil().min(MOST_PARTS);
        let usable = recording.is_uniform(EVEN) && samples.iter().all(|sample| sample.is_finite());
        if !usable || parts.is_nan() || parts < 2.0 {
            return Ok(None);
        }
        let fine = (recording.len() - 1) * parts as usize;
        let time_s: Vec<f64> = (0..=fine).map(|k| first_s + k as f64 / (parts * rate_hz)).collect();
        let cubic = PiecewiseCubic::new(&recording.time_s, samples, InputInterpolation::Cubic);
        let values = cubic.sample(time_s.iter().copied()).into_iter().map(|[value, ..]| value).collect();
        let fine = Recording::new(recording.name.clone(), time_s).with_column(input.column.clone(), values);
        Ok(Some((fine, rate_hz)))
    }

    /// Simulates, writes what was asked for, at the input's times or at a rate, and prints what each output
    /// did, beside what was recorded of it.
    fn report(
        &self,
        model: &Model,
        driven: &Recording,
        output_rate_hz: Option<f64>,
        recorded: Option<&Recording>,
        streams: &mut Streams<'_>,
    ) -> Result<(), CliError> {
        let options = SimulateOptions {
            feedback: if self.open_loop { Feedback::Open } else { Feedback::IfPossible },
            sensor_noise: self.noise,
            noise_seed: self.seed,
            output_rate_hz,
            ..SimulateOptions::default()
        };
        let result = simulate_with(model, driven, &options)
            .map_err(CliError::plant(self.model.display().to_string()))?;
        if let Some(path) = &self.out {
            write(Path::new(path), &result, streams)?;
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

fn move_recording(shaped: &BaseMove, commanded: usize) -> Recording {
    let base_m =
        shaped.tip_position_m.iter().zip(&shaped.tip_deflection_m).map(|(tip, deflection)| tip - deflection);
    let written = ((WRITTEN_S * shaped.rate_hz) as usize).max(commanded).min(shaped.setpoint_m.len());
    let first = |values: &[f64]| values.iter().take(written).copied().collect();
    let time_s = (0..written).map(|index| index as f64 / shaped.rate_hz).collect();
    Recording::new("simulated move", time_s)
        .with_column(SETPOINT, first(&shaped.setpoint_m))
        .with_column(BASE_POSITION, base_m.take(written).collect())
        .with_column(TIP_DEFLECTION, first(&shaped.tip_deflection_m))
        .with_column(TIP_POSITION, first(&shaped.tip_position_m))
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
