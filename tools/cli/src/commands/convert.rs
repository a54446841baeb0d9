//! `stillbeam convert`: a recording from one format into another.

use std::path::PathBuf;

use clap::Args;
use stillbeam_recording::{Format, to_format, write_recording};

use crate::error::CliError;
use crate::outputs::keep_apart;
use crate::reading::ReadArgs;
use crate::streams::Streams;

/// Read a recording in any format and write it as CSV, universal file or JSON.
///
/// Read: CSV, universal files (data sets 58 and 58b), MATLAB files (-v6, -v7), WAV, Klipper's raw
/// accelerometer logs, told apart by their content.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam convert run.mat run.csv --time t --column tip_deflection_m=y*0.001
  stillbeam convert hammer.wav hammer.csv --column acceleration_m_s2=1*50
  stillbeam convert sweep.csv sweep.uff --to uff58b")]
pub struct ConvertArgs {
    /// The recording to read
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The file to write; its extension (.csv, .uff, .json) is the format unless --to says otherwise. `-` is
    /// standard output
    #[arg(value_name = "OUT")]
    output: String,
    #[command(flatten)]
    reading: ReadArgs,
    /// Format to write: csv, uff58, uff58b or json; to standard output csv by default
    #[arg(long, value_name = "FORMAT")]
    to: Option<Format>,
}

impl ConvertArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        keep_apart([self.input.as_path()], [Some(self.output.as_str())])?;
        let recording = self.reading.read(&self.input, streams)?;
        if self.output == "-" {
            to_format(&mut *streams.out, &recording, self.to.unwrap_or(Format::Csv))?;
            return Ok(streams.out.flush()?);
        }
        let path = PathBuf::from(&self.output);
        let format = write_recording(&path, &recording, self.to)?;
        streams.say(&format!(
            "wrote {}: {} as {format}, {} samples over {:.3} s",
            self.output,
            recording.column_names().join(", "),
            recording.len(),
            recording.duration_s()
        ));
        Ok(())
    }
}
