//! `stillbeam record`: a motion on the board, as a recording.

use std::path::Path;

use clap::Args;
use stillbeam_firmware::motion::spec::USAGES;
use stillbeam_firmware::telemetry::Sample;
use stillbeam_firmware::units::Nanometres;
use stillbeam_plant::SETPOINT;
use stillbeam_recording::{Recording, write_csv};

use crate::board::{BoardTarget, StreamedMotion};
use crate::error::CliError;
use crate::streams::Streams;

/// Column of the command before shaping.
const COMMAND: &str = "command_m";

/// Column of the encoder, where there is one.
const ENCODER: &str = "encoder_m";

/// Run a motion on a board and write what it streams as a recording.
///
/// The columns are time_s (zero when the command starts to change), command_m (before shaping), setpoint_m
/// (after) and, with an encoder, encoder_m. The side file (.toml) says how many samples were lost, and where. To identify the machine, add what a sensor saw as a further column on the same clock, with empty cells
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
        let streamed = session.record_motion(&motion, decimation, self.after, &mut |done| {
            if 10.0 * done >= next_tenth {
                streams.say(&format!("[{:3.0} %] {motion}", 100.0 * done));
                next_tenth = (10.0 * done).floor() + 1.0;
            }
        })?;
        let recording = recording(&self.out, &motion, &streamed);
        write_csv(Path::new(&self.out), &recording)?;
        streams.say(&format!("wrote {}", self.out));
        for fault in &streamed.faults {
            streams.say(&format!(
                "a fault ended the motion: {fault}; 'stillbeam console' and 'events' say more, 'clear' goes on"
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

fn lost_samples(streamed: &StreamedMotion) -> u64 {
    streamed.gaps.iter().map(|gap| u64::from(gap.lost)).sum()
}

/// The streamed samples from the last before the command changes, which is at time zero. A row without a sample is empty.
fn recording(name: &str, motion: &str, streamed: &StreamedMotion) -> Recording {
    let samples: Vec<&Sample> = streamed.samples.iter().skip(streamed.start).collect();
    let first = samples.first().map_or(0, |sample| sample.sequence);
    let row = |sample: &Sample| sample.sequence.wrapping_sub(first) as usize;
    let rows = samples.last().map_or(0, |sample| row(sample) + 1);
    let column = |value: &dyn Fn(&Sample) -> Option<f64>| {
        let mut cells = vec![f64::NAN; rows];
        for sample in &samples {
            if let (Some(cell), Some(value)) = (cells.get_mut(row(sample)), value(sample)) {
                *cell = value;
            }
        }
        cells
    };
    let metres = |position: Nanometres| f64::from(position.0) * 1e-9;
    let time_s = (0..rows).map(|index| index as f64 / streamed.rate_hz()).collect();
    let mut recording = Recording::new(name, time_s)
        .with_column(COMMAND, column(&|sample| Some(metres(sample.command))))
        .with_column(SETPOINT, column(&|sample| Some(metres(sample.setpoint))));
    if samples.iter().any(|sample| sample.encoder.is_some()) {
        recording = recording.with_column(ENCODER, column(&|sample| sample.encoder.map(metres)));
    }
    recording.notes = notes(motion, streamed, samples.first().map_or(0, |sample| sample.tick));
    recording
}

/// What the side file says of the stream.
fn notes(motion: &str, streamed: &StreamedMotion, first_tick: u32) -> toml::Table {
    let mut stream = toml::Table::new();
    stream.insert("motion".to_owned(), motion.into());
    stream.insert("tick_hz".to_owned(), streamed.tick_hz.into());
    stream.insert("ticks_per_sample".to_owned(), i64::from(streamed.decimation).into());
    // Counts of samples are far below 2⁶³.
    stream.insert("lost_samples".to_owned(), (lost_samples(streamed) as i64).into());
    stream.insert("damaged_frames".to_owned(), (streamed.damaged_frames as i64).into());
    let gaps: Vec<toml::Value> = streamed
        .gaps
        .iter()
        .map(|gap| {
            let ticks = gap.tick.wrapping_sub(first_tick).cast_signed();
            let gap_table = [
                ("lost_samples".to_owned(), i64::from(gap.lost).into()),
                ("until_s".to_owned(), (f64::from(ticks) / streamed.tick_hz).into()),
            ];
            toml::Value::Table(gap_table.into_iter().collect())
        })
        .collect();
    if !gaps.is_empty() {
        stream.insert("gaps".to_owned(), gaps.into());
    }
    if !streamed.faults.is_empty() {
        stream.insert("faults".to_owned(), streamed.faults.clone().into());
    }
    let flagged = streamed.samples.iter().fold(0, |flags, sample| flags | sample.flags.0);
    stream.insert("flags_seen".to_owned(), i64::from(flagged).into());
    [("stream".to_owned(), toml::Value::Table(stream))].into_iter().collect()
}
