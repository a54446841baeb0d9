//! `stillbeam record`: a motion on the board, as a recording.

use std::path::Path;

use clap::Args;
use stillbeam_firmware::motion::spec::USAGES;
use stillbeam_recording::write_csv;

use crate::board::{BoardTarget, Consent};
use crate::board_recording::{lost_samples, recording, usual_decimation};
use crate::error::CliError;
use crate::streams::Streams;

/// Run a motion on a board and write what it streams as a recording.
///
/// The columns are time_s (zero when the command starts to change), command_m (before shaping), setpoint_m
/// (after), with an encoder encoder_m, input_1_level to input_3_level (the general inputs, 0 or 1) and
/// state_number (0 rest, 1 moving, 2 sweeping, 3 stopping, 4 settling, 5 fault, 6 multisine, 7 pulsing, 8
/// decaying, 9 playing). The side file (.toml) says how many samples were lost, and where. To identify the
/// machine, add what a sensor saw as a further column on the same clock, with empty cells where there is no
/// frame; an offset of the sensor's clock shows as the same delay in every mode.
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
    /// Go on without asking whether the machine may move
    #[arg(long)]
    yes: bool,
    /// The motion, as on the console: `move POSITION_MM`, `sweep ...`, `multisine ...`, `pulse ...`, `decay
    /// ...`
    #[arg(required = true, value_name = "MOTION", allow_negative_numbers = true)]
    motion: Vec<String>,
}

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
        let board = BoardTarget::parse(&self.port);
        let mut session = board.connect(&mut |line| streams.say(line))?;
        let enabled = board.enable(&mut session, &motion, Consent::from_yes(self.yes), streams)?;
        let tick_hz = session.tick_hz()?;
        let decimation = self.decimation.unwrap_or_else(|| usual_decimation(tick_hz));
        let mut next_tenth = 1.0;
        let streamed = session.record_motion(&motion, decimation, self.after, &mut |done| {
            if 10.0 * done >= next_tenth {
                streams.say(&format!("[{:3.0} %] {motion}", 100.0 * done));
                next_tenth = (10.0 * done).floor() + 1.0;
            }
        });
        // Whatever came of it.
        enabled.leave(&mut session)?;
        let streamed = streamed?;
        let recording = recording(&self.out, &motion, &streamed);
        write_csv(Path::new(&self.out), &recording)?;
        streams.say(&format!("wrote {}", self.out));
        for fault in &streamed.faults {
            streams.say(&format!(
                "a fault ended the motion: {fault}; 'stillbeam console' and 'events' say more, 'clear' and 'enable' go on"
            ));
        }
        if !streamed.gaps.is_empty() {
            let lost = lost_samples(&streamed);
            streams.say(&format!(
                "{lost} sample(s) were lost and their cells are empty; the side file says where. Stream fewer with --decimation"
            ));
        }
        Ok(())
    }
}
