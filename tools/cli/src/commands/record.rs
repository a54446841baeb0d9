//! `stillbeam record`: a motion on the board, as a recording.

use std::path::Path;

use clap::Args;
use stillbeam_firmware::motion::spec::USAGES;
use stillbeam_plant::SETPOINT;
use stillbeam_recording::{Recording, write_csv};

use crate::board::{BoardTarget, StreamedMotion};
use crate::error::CliError;
use crate::streams::Streams;

/// Column of the encoder, where the board has one.
const ENCODER: &str = "encoder_m";

/// Column of the command before shaping.
const COMMAND: &str = "command_m";

/// Run a motion on a board and write what it streams as a recording.
///
/// The columns are time_s (zero when the command starts to change), command_m (before shaping) and setpoint_m
/// (after), and encoder_m where the board has an encoder. To identify the machine, add what a sensor saw as a further column on the same clock, with empty cells
/// where there is no frame; an offset of the sensor's clock shows as the same delay in every mode.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam record --port /dev/ttyACM0 --out sweep.csv sweep exponential 0.1 8 80 1.0
  stillbeam record --port core --out move.csv --after 5 move 50")]
pub struct RecordArgs {
    /// The serial port, core or qemu
    #[arg(long, value_name = "PATH")]
    port: String,
    /// The recording to write
    #[arg(long, value_name = "REC.csv")]
    out: String,
    /// Ticks per sample; by default as many as make about 1000 samples a second
    #[arg(long, value_name = "N")]
    decimation: Option<u32>,
    /// Seconds to go on after the setpoint has come to rest, to see the machine ring
    #[arg(long, value_name = "SECONDS", default_value_t = 2.0, allow_negative_numbers = true)]
    after: f64,
    /// The motion, as on the console: `move POSITION_MM`, `sweep ...`, `multisine ...`, `pulse ...`, `decay ...`
    #[arg(required = true, value_name = "MOTION", allow_negative_numbers = true)]
    motion: Vec<String>,
}

/// Samples per second where --decimation does not say: what the serial line carries with ease.
const SAMPLES_PER_S: f64 = 1000.0;

impl RecordArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        let motion = self.motion.join(" ");
        let kind = motion.split_whitespace().next().unwrap_or_default();
        let is_motion = USAGES.iter().any(|usage| usage.split(' ').next() == Some(kind));
        if !is_motion || motion.contains(char::is_control) {
            return Err(CliError::Usage(format!(
                "{motion:?} is no motion; there are: {}",
                USAGES.join(" · ")
            )));
        }
        if !(self.after.is_finite() && (0.0..=3600.0).contains(&self.after)) {
            return Err(CliError::Usage(format!("--after {}: give 0 to 3600 seconds", self.after)));
        }
        if self.decimation == Some(0) {
            return Err(CliError::Usage("--decimation 0: give at least 1".to_owned()));
        }
        let mut session = BoardTarget::parse(&self.port).connect(&mut |line| streams.say(line))?;
        let tick_hz = session.tick_hz()?;
        let decimation = self.decimation.unwrap_or((tick_hz / SAMPLES_PER_S).round().max(1.0) as u32);
        let mut next_tenth = 1.0;
        let streamed = session.run_motion(&motion, decimation, self.after, &mut |done| {
            if 10.0 * done >= next_tenth {
                streams.say(&format!("[{:3.0} %] {motion}", 100.0 * done));
                next_tenth = (10.0 * done).floor() + 1.0;
            }
        })?;
        write_csv(Path::new(&self.out), &recording(&self.out, &streamed))?;
        streams.say(&format!("wrote {}", self.out));
        Ok(())
    }
}

/// The streamed samples from the last before the command changes, which is at time zero.
fn recording(name: &str, streamed: &StreamedMotion) -> Recording {
    let setpoints_m = streamed.setpoints_m();
    let time_s = (0..setpoints_m.len()).map(|index| index as f64 / streamed.rate_hz()).collect();
    let recording = Recording::new(name, time_s)
        .with_column(COMMAND, streamed.commands_m())
        .with_column(SETPOINT, setpoints_m);
    match streamed.encoder_m() {
        Some(encoder_m) => recording.with_column(ENCODER, encoder_m),
        None => recording,
    }
}
