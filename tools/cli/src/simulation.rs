//! What a model does under a command or a recorded input, shaped or not.
//!
//! The motion is the firmware's own: its profile within its default limits, its shaper in its integers.

use stillbeam_firmware::shaper::ShaperTable;
use stillbeam_identify::InputInterpolation;
use stillbeam_identify::interpolation::PiecewiseCubic;
use stillbeam_plant::{
    BASE_POSITION, Feedback, Model, PercentageVibration, SETPOINT, SimulateOptions, TIP_DEFLECTION,
    TIP_POSITION, simulate_with,
};
use stillbeam_recording::Recording;

use crate::base_move::BaseMove;
use crate::command_signal::{MotionCommand, shape_recorded, shaped_setpoints_m};
use crate::error::CliError;

/// Straight lines between two samples of an input: they are off a sine of four samples per period by less
/// than 1e-4 of it, and of twenty by 2e-6.
const PARTS: f64 = 64.0;
/// Fewer where all of them would be more than this, ...
const MOST_LINES: f64 = 4e6;
/// ... but as many as make this rate, hertz.
const FINE_HZ: f64 = 4000.0;
/// Distances from even stamps, as a share of the interval, that are rounding.
const EVEN: f64 = 5e-3;

/// Seconds of a simulated move that are written to a recording, or the whole of a command that takes longer:
/// a decay lasts as long as it was asked for.
const WRITTEN_S: f64 = 10.0;

/// Ticks per second without a rate and without a shaper.
const DEFAULT_RATE_HZ: f64 = 4000.0;

/// How long the machine is simulated after a motion that comes back, seconds.
const AFTER_S: f64 = 2.0;

/// A model, and what stands between it and what drives it.
#[derive(Debug, Clone, Copy)]
pub struct Simulation<'a> {
    /// What messages call the model: its file.
    pub name: &'a str,
    /// The model.
    pub model: &'a Model,
    /// The shaper that commands and recorded inputs go through.
    pub table: Option<&'a ShaperTable>,
    /// The recorded input drives the model as it is, even if the model has a controller and the recording its
    /// reference.
    pub open_loop: bool,
    /// The draw of the noise that the model's sensors add; `None` for no noise.
    pub noise_seed: Option<u64>,
}

/// A move to another place, and the same without the shaper.
#[derive(Debug, Clone)]
pub struct SimulatedMove {
    /// The move.
    pub shaped: BaseMove,
    /// The vibration that it leaves, in percent of what the unshaped move leaves.
    pub vibration: PercentageVibration,
    /// How many setpoints the command had.
    commanded: usize,
}

/// What was simulated.
#[derive(Debug, Clone)]
pub enum Simulated {
    /// Of a command that ends elsewhere.
    Move(Box<SimulatedMove>),
    /// Of a command that comes back: the model's outputs.
    Excitation(Recording),
}

impl Simulation<'_> {
    /// The rate of a command: the one asked for, the shaper's, or 4000 Hz.
    ///
    /// # Errors
    /// [`CliError::Usage`] where the shaper is for another rate.
    pub fn rate_hz(&self, asked_hz: Option<f64>) -> Result<f64, CliError> {
        let table_hz = self.table.map(|table| table.tick_rate().hz());
        match (asked_hz, table_hz) {
            (Some(rate_hz), Some(table_hz)) if rate_hz != table_hz => Err(CliError::Usage(format!(
                "--rate {rate_hz} Hz, but the shaper is for {table_hz} Hz; leave --rate out, or design a table for it"
            ))),
            (rate_hz, table_hz) => Ok(rate_hz.or(table_hz).unwrap_or(DEFAULT_RATE_HZ)),
        }
    }

    /// Under a command.
    ///
    /// # Errors
    /// [`CliError`] for a rate or a motion that the firmware does not accept, a model that is not driven by
    /// motion, and an output that cannot be simulated.
    pub fn of_command(&self, command: &MotionCommand, rate_hz: f64) -> Result<Simulated, CliError> {
        let setpoints_m = shaped_setpoints_m(command, rate_hz, self.table)?;
        if setpoints_m.first() == setpoints_m.last() {
            return self.of_excitation(rate_hz, setpoints_m).map(Simulated::Excitation);
        }
        let simulated = |setpoints_m: &[f64]| {
            BaseMove::simulate(self.model, rate_hz, setpoints_m).map_err(CliError::plant(self.name))
        };
        let shaped = simulated(&setpoints_m)?;
        let unshaped = simulated(&shaped_setpoints_m(command, rate_hz, None)?)?;
        let vibration = shaped.percentage_vibration(&unshaped);
        let commanded = setpoints_m.len();
        Ok(Simulated::Move(Box::new(SimulatedMove { shaped, vibration, commanded })))
    }

    /// A motion that comes back has no settling time; what it does to each output is what there is.
    fn of_excitation(&self, rate_hz: f64, mut setpoints_m: Vec<f64>) -> Result<Recording, CliError> {
        let Some(input) = self.model.input().filter(|input| input.is_motion()) else {
            return Err(CliError::Usage(format!(
                "{}: a command is a motion, and the model's input is none; set input.column to setpoint_m or base_position_m",
                self.name
            )));
        };
        let held = setpoints_m.last().copied().unwrap_or(0.0);
        setpoints_m.resize(setpoints_m.len() + (AFTER_S * rate_hz) as usize, held);
        let time_s = (0..setpoints_m.len()).map(|index| index as f64 / rate_hz).collect();
        let driven = Recording::new("simulated excitation", time_s).with_column(&input.column, setpoints_m);
        self.between_its_samples(&driven)
    }

    /// Under the input that a recording has, at the recording's times; behind a shaper, at the shaper's.
    ///
    /// # Errors
    /// [`CliError`] for an input that is missing or has gaps, and a shaper before an input that is no motion.
    pub fn of_recording(&self, recording: &Recording) -> Result<Recording, CliError> {
        let Some(table) = self.table else { return self.between_its_samples(recording) };
        let controller = self.model.setup().controller.as_ref().filter(|_| !self.open_loop);
        // With a controller it is the reference that moves.
        let moved = match (controller, self.model.input()) {
            (Some(controller), _) => &controller.reference_column,
            (None, Some(input)) if self.model.input_is_motion() => &input.column,
            _ => {
                return Err(CliError::Usage(format!(
                    "{}: a shaper shapes motion, and the model's input is none; set input.column to setpoint_m or base_position_m",
                    self.name
                )));
            }
        };
        self.driven_by(&shape_recorded(recording, moved, table)?, None)
    }

    fn between_its_samples(&self, recording: &Recording) -> Result<Recording, CliError> {
        match self.between_samples(recording)? {
            Some((fine, rate_hz)) => self.driven_by(&fine, Some(rate_hz)),
            None => self.driven_by(recording, None),
        }
    }

    /// An even recording's input on a grid so fine that the straight lines of the simulation follow its
    /// cubic, and the rate of the recording, hertz. `None` where its own samples are to be used: a model that
    /// says what its input does between them (`hold`), uneven stamps, a loop, samples that are missing (which
    /// the simulation refuses with their place).
    fn between_samples(&self, recording: &Recording) -> Result<Option<(Recording, f64)>, CliError> {
        let in_loop = self.model.setup().controller.as_ref().is_some_and(|controller| {
            !self.open_loop && recording.column(&controller.reference_column).is_ok()
        });
        let (Some(input), false) = (self.model.input(), in_loop) else { return Ok(None) };
        if input.hold.is_some() && !self.model.input_is_motion() {
            return Ok(None);
        }
        let samples = recording.column(&input.column)?;
        let (Some(first_s), Some(last_s)) = (recording.time_s.first(), recording.time_s.last()) else {
            return Ok(None);
        };
        let rate_hz = (recording.len() as f64 - 1.0) / (last_s - first_s);
        let least = (FINE_HZ / rate_hz).ceil().min(PARTS);
        let parts = (MOST_LINES / recording.len() as f64).floor().clamp(least, PARTS);
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

    fn driven_by(&self, driven: &Recording, output_rate_hz: Option<f64>) -> Result<Recording, CliError> {
        let options = SimulateOptions {
            feedback: if self.open_loop { Feedback::Open } else { Feedback::IfPossible },
            sensor_noise: self.noise_seed.is_some(),
            noise_seed: self.noise_seed.unwrap_or_default(),
            output_rate_hz,
            ..SimulateOptions::default()
        };
        simulate_with(self.model, driven, &options).map_err(CliError::plant(self.name))
    }
}

impl SimulatedMove {
    /// Setpoint, base and tip, until the command has ended and the tip has rung for a while.
    pub fn recording(&self) -> Recording {
        let shaped = &self.shaped;
        let base_m = shaped.tip_position_m.iter().zip(&shaped.tip_deflection_m);
        let base_m = base_m.map(|(tip, deflection)| tip - deflection);
        let written = ((WRITTEN_S * shaped.rate_hz) as usize).max(self.commanded);
        let written = written.min(shaped.setpoint_m.len());
        let first = |values: &[f64]| values.iter().take(written).copied().collect();
        let time_s = (0..written).map(|index| index as f64 / shaped.rate_hz).collect();
        Recording::new("simulated move", time_s)
            .with_column(SETPOINT, first(&shaped.setpoint_m))
            .with_column(BASE_POSITION, base_m.take(written).collect())
            .with_column(TIP_DEFLECTION, first(&shaped.tip_deflection_m))
            .with_column(TIP_POSITION, first(&shaped.tip_position_m))
    }
}
