//! How recordings are read: options that several commands share.

use std::path::Path;

use clap::Args;
use stillbeam_recording::{ColumnChoice, Format, ReadOptions, Recording, TimeBase, read_recording};

use crate::error::CliError;
use crate::streams::Streams;

/// What a recording's file may leave open.
#[derive(Debug, Clone, Default, Args)]
pub struct ReadArgs {
    /// Format of the recordings: csv, klipper, uff58, uff58b, mat, wav; by default what their content shows
    #[arg(long, value_name = "FORMAT")]
    format: Option<Format>,
    /// Column or variable that holds the time in seconds, where it is not called time_s
    #[arg(long, value_name = "SOURCE", conflicts_with = "sample_rate")]
    time: Option<String>,
    /// Samples per second, of files that hold no time
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    sample_rate: Option<f64>,
    /// A column to take, what to call it and its scale, such as tip_deflection_m=y*0.001; may be repeated
    #[arg(long = "column", value_name = "NAME_UNIT=SOURCE[*SCALE]")]
    columns: Vec<ColumnChoice>,
}

impl ReadArgs {
    /// Reads a recording in any format, and says what was left out of it.
    ///
    /// # Errors
    /// [`CliError::Usage`] for a rate that is none, [`CliError::Recording`] for the file.
    pub fn read(&self, path: &Path, streams: &mut Streams<'_>) -> Result<Recording, CliError> {
        let interval = self.sample_rate.map(|rate_hz| match rate_hz {
            rate_hz if rate_hz > 0.0 && rate_hz.is_finite() => Ok(TimeBase::IntervalS(1.0 / rate_hz)),
            _ => Err(CliError::Usage(format!("--sample-rate {rate_hz} is no rate; give a number above 0"))),
        });
        let options = ReadOptions {
            format: self.format,
            time: interval.transpose()?.or_else(|| self.time.clone().map(TimeBase::Source)),
            columns: self.columns.clone(),
        };
        let imported = read_recording(path, &options)?;
        let name = path.display();
        if imported.format != Format::Csv {
            streams.say(&format!("{name}: read as {}", imported.format));
        }
        for remark in &imported.remarks {
            streams.say(&format!("{name}: {remark}"));
        }
        Ok(imported.recording)
    }
}
