//! A streamed motion as a recording: the columns of what the board sends, and what the side file says of the
//! stream.

use stillbeam_firmware::telemetry::{Flags, Sample};
use stillbeam_firmware::units::Nanometres;
use stillbeam_plant::SETPOINT;
use stillbeam_recording::Recording;

use crate::board::StreamedMotion;

/// Column of the command before shaping.
pub const COMMAND: &str = "command_m";

/// Column of the encoder, where there is one.
pub const ENCODER: &str = "encoder_m";

/// Columns of the general inputs 1, 2 and 3: 1 where the input is high, else 0.
pub const INPUTS: [&str; 3] = ["input_1_level", "input_2_level", "input_3_level"];

/// Column of what the board was doing: the number of [`stillbeam_firmware::telemetry::Activity`].
pub const STATE: &str = "state_number";

/// Whether the column of this name says what the board was told and did, so that it is never the response of
/// a machine.
pub fn is_of_the_board(column: &str) -> bool {
    column == STATE || INPUTS.contains(&column)
}

/// Samples per second where nobody says how many: what the serial line carries with ease.
const SAMPLES_PER_S: f64 = 1000.0;

/// Ticks per sample where nobody says how many.
pub fn usual_decimation(tick_hz: f64) -> u32 {
    (tick_hz / SAMPLES_PER_S).round().max(1.0) as u32
}

/// How many samples are missing.
pub fn lost_samples(streamed: &StreamedMotion) -> u64 {
    streamed.gaps.iter().map(|gap| u64::from(gap.lost)).sum()
}

/// The streamed samples from the last before the command changes, which is at time zero. A row without a
/// sample is empty. `name` is what messages call the recording, `motion` what the board was asked for.
pub fn recording(name: &str, motion: &str, streamed: &StreamedMotion) -> Recording {
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
    for (name, input) in INPUTS.into_iter().zip(Flags::INPUTS) {
        let level = |sample: &Sample| Some(f64::from(u8::from(sample.flags.contains(input))));
        recording = recording.with_column(name, column(&level));
    }
    recording = recording.with_column(STATE, column(&|sample| Some(f64::from(sample.activity as u8))));
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
