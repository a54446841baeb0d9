//! `stillbeam merge`: two recordings of one experiment on one clock.

use std::path::{Path, PathBuf};

use clap::Args;
use stillbeam_identify::{
    ClockError, ClockFit, Derivative, Signal, clock_by_edges, clock_by_motion, rising_edges_s,
};
use stillbeam_recording::{Column, ReadOptions, Recording, read_recording, write_recording};

use crate::error::CliError;
use crate::merging::{Sides, merged};
use crate::outputs::keep_apart;
use crate::streams::Streams;

/// Put two recordings of one experiment, such as a camera's and a board's, on one clock and into one file.
///
/// The clocks are compared by a trigger that both recorded, or by a motion that both saw. Offset and drift
/// are printed with their standard errors. Nothing that was measured is resampled: the file has the rows of
/// both, and cells stay empty where a recording has no sample; only the recording that samples faster is
/// also read off, between its samples, at the times of the slower one. The second recording's clock is
/// kept.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam merge camera.csv board.csv --trigger input_1_level --out joined.csv
  stillbeam merge camera.csv board.csv --same base_m=setpoint_m --out joined.csv")]
pub struct MergeArgs {
    /// The first recording; `stillbeam convert` makes one of any other format or with other names
    #[arg(value_name = "CAMERA.csv")]
    first: PathBuf,
    /// The second recording, whose clock is kept
    #[arg(value_name = "BOARD.csv")]
    second: PathBuf,
    /// The second recording's column with an edge for every sample of the first one, or for its first
    /// sample only; or a column with the same edges in each: led_level=input_1_level
    #[arg(long, value_name = "[COLUMN=]COLUMN", conflicts_with = "same")]
    trigger: Option<String>,
    /// A motion that both saw: the column in the first recording and in the second; by default the columns
    /// of one name. A speed or an acceleration may stand beside a position that samples faster
    #[arg(long, value_name = "COLUMN=COLUMN")]
    same: Option<String>,
    /// The file to write
    #[arg(long, value_name = "OUT.csv")]
    out: String,
}

impl MergeArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        keep_apart([self.first.as_path(), self.second.as_path()], [Some(self.out.as_str())])?;
        let read = |path: &Path| read_recording(path, &ReadOptions::default());
        let (first, second) = (read(&self.first)?.recording, read(&self.second)?.recording);
        let first_is_slow = interval_s(&first) >= interval_s(&second);
        let clock = match &self.trigger {
            Some(trigger) => self.by_trigger(trigger, &first, &second, first_is_slow)?,
            None => self.by_motion(&first, &second, first_is_slow)?,
        };
        let sides = Sides { first: &first, second: &second, first_is_slow };
        tell(&clock, sides, streams);
        let out = merged(sides, &clock);
        write_recording(Path::new(&self.out), &out, None)?;
        streams.say(&format!(
            "wrote {}: {}, {} rows; {} is read off between its samples at the times of {}",
            self.out,
            out.column_names().join(", "),
            out.len(),
            sides.fast().name,
            sides.slow().name
        ));
        Ok(())
    }

    fn by_trigger(
        &self,
        trigger: &str,
        first: &Recording,
        second: &Recording,
        first_is_slow: bool,
    ) -> Result<ClockFit, CliError> {
        let refused = |error: ClockError| CliError::Usage(format!("--trigger {trigger}: {error}"));
        let edges = |recording: &Recording, column: &str| -> Result<Vec<f64>, CliError> {
            Ok(rising_edges_s(&recording.time_s, recording.column(column)?))
        };
        let (firsts, seconds) = match trigger.split_once('=') {
            Some((own, other)) => (edges(first, own)?, edges(second, other)?),
            None => (first.time_s.clone(), edges(second, trigger)?),
        };
        // One edge is that of the first sample.
        let one_each = [firsts.len(), seconds.len()] == [1, 1];
        if first_is_slow || seconds.len() == 1 && !one_each {
            let mut clock = clock_by_edges(&firsts, &seconds, interval_s(second)).map_err(refused)?;
            if !first_is_slow {
                clock = clock.reversed(first.time_s[0]);
            }
            return Ok(clock);
        }
        clock_by_edges(&seconds, &firsts, interval_s(second).max(interval_s(first))).map_err(refused)
    }

    fn by_motion(
        &self,
        first: &Recording,
        second: &Recording,
        first_is_slow: bool,
    ) -> Result<ClockFit, CliError> {
        let (own, other) = self.same_motion(first, second)?;
        let pairs = [(first, own.as_str()), (second, other.as_str())];
        let [slow, fast] = if first_is_slow { pairs } else { [pairs[1], pairs[0]] };
        let derivative = derivative(slow.1, fast.1)?;
        let present = |(recording, column): (&Recording, &str)| -> Result<(Vec<f64>, Vec<f64>), CliError> {
            let samples = recording.column(column)?;
            let rows = recording.time_s.iter().copied().zip(samples.iter().copied());
            Ok(rows.filter(|(_, value)| value.is_finite()).unzip())
        };
        let (slow, fast) = (present(slow)?, present(fast)?);
        let signal = |(time_s, values)| Signal { time_s, values };
        clock_by_motion(signal((&slow.0, &slow.1)), signal((&fast.0, &fast.1)), derivative)
            .map_err(|error| CliError::Usage(format!("{own} and {other}: {error}")))
    }

    /// The columns that saw the same motion.
    fn same_motion(&self, first: &Recording, second: &Recording) -> Result<(String, String), CliError> {
        if let Some(same) = &self.same {
            let pair = same.split_once('=').ok_or_else(|| {
                CliError::Usage(format!(
                    "--same {same}: write the column of each recording: base_m=setpoint_m"
                ))
            })?;
            return Ok((pair.0.to_owned(), pair.1.to_owned()));
        }
        let in_second = |column: &&Column| second.columns.iter().any(|other| other.name == column.name);
        match first.columns.iter().find(in_second) {
            Some(column) => Ok((column.name.clone(), column.name.clone())),
            None => Err(CliError::Usage(format!(
                "{} has {} and {} has {}: no column of one name; say what both saw with --same COLUMN=COLUMN, or name a trigger with --trigger COLUMN",
                first.name,
                first.column_names().join(", "),
                second.name,
                second.column_names().join(", ")
            ))),
        }
    }
}

fn interval_s(recording: &Recording) -> f64 {
    recording.duration_s() / (recording.len().max(2) - 1) as f64
}

/// What the slower sampled column is of the faster one, by their units.
fn derivative(slow: &str, fast: &str) -> Result<Derivative, CliError> {
    let order = |name: &str| {
        let unit = Column { name: name.to_owned(), samples: Vec::new() }.unit().to_owned();
        match unit.as_str() {
            "g" => 2,
            unit if unit.ends_with("_s2") => 2,
            unit if unit.ends_with("_s") => 1,
            _ => 0,
        }
    };
    match order(slow) - order(fast) {
        0 => Ok(Derivative::Same),
        1 => Ok(Derivative::Rate),
        2 => Ok(Derivative::SecondRate),
        _ => Err(CliError::Usage(format!(
            "{slow} and {fast}: a position that samples slower than a speed or an acceleration cannot be compared with it; name two columns of one quantity, or a trigger"
        ))),
    }
}

fn tell(clock: &ClockFit, sides: Sides<'_>, streams: &mut Streams<'_>) {
    let (slow, fast) = (&sides.slow().name, &sides.fast().name);
    let offset = clock.offset_s;
    streams.say(&format!(
        "offset: the clock of {fast} shows {:.6} ± {:.6} s more than that of {slow} at its first sample",
        offset.value, offset.stderr
    ));
    match clock.drift {
        Some(drift) => streams.say(&format!(
            "drift: the clock of {fast} gains {:.3} ± {:.3} parts per million on it ({} compared, {:.1} % the same)",
            1e6 * drift.value,
            1e6 * drift.stderr,
            clock.pairs,
            100.0 * clock.explained
        )),
        None => streams.say("drift: not known from one edge, taken as none; quartz clocks drift by up to 100 parts per million, 6 ms in a minute"),
    }
}
