//! How recordings are read: options that several commands share.

use std::path::Path;

use clap::{Args, ValueEnum};
use stillbeam_recording::{
    ColumnChoice, Format, Measurement, ReadOptions, Recording, Separator, TimeBase, read_measurement,
    read_recording,
};

use crate::error::CliError;
use crate::project::file::RecordingsTable;
use crate::streams::Streams;

/// What a recording's file may leave open.
#[derive(Debug, Clone, Default, Args)]
pub struct ReadArgs {
    /// Format of the recordings: csv, klipper, reprap, lvm, uff58, uff58b, mat, octave, npy, wav, json; by
    /// default what their content shows
    #[arg(long, value_name = "FORMAT")]
    format: Option<Format>,
    /// Column or variable that holds the time, and how many seconds its unit is, such as millis*0.001
    #[arg(long, value_name = "SOURCE[*SCALE]", conflicts_with = "sample_rate")]
    time: Option<TimeBase>,
    /// Samples per second, of files that hold no time or wrong stamps
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    sample_rate: Option<f64>,
    /// A column to take, what to call it and its scale, such as tip_deflection_m=y*0.001; may be repeated
    #[arg(long = "column", value_name = "NAME_UNIT=SOURCE[*SCALE]")]
    columns: Vec<ColumnChoice>,
    /// Lines to leave out before a table of text
    #[arg(long, value_name = "N")]
    skip_lines: Option<u32>,
    /// What separates the cells of a table of text: comma, semicolon, tab, blanks, | or :; by default what
    /// its content shows
    #[arg(long, value_name = "SEPARATOR")]
    separator: Option<Separator>,
    /// Decimal sign of a table of text; by default what its content shows
    #[arg(long, value_name = "SIGN")]
    decimal: Option<Decimal>,
}

/// A decimal sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Decimal {
    #[value(alias = ".")]
    Point,
    #[value(alias = ",")]
    Comma,
}

impl ReadArgs {
    /// Reads a recording in any format, and says what was left out of it.
    ///
    /// # Errors
    /// [`CliError::Usage`] for a rate that is none, [`CliError::Recording`] for the file, also where it holds
    /// no signals over time.
    pub fn read(&self, path: &Path, streams: &mut Streams<'_>) -> Result<Recording, CliError> {
        let imported = read_recording(path, &self.options()?)?;
        tell(path, imported.format, &imported.remarks, streams);
        Ok(imported.recording)
    }

    /// Reads whatever a file holds, signals over time or functions of frequency, and says what was left out.
    ///
    /// # Errors
    /// As [`Self::read`], but for functions of frequency.
    pub fn measurement(&self, path: &Path, streams: &mut Streams<'_>) -> Result<Measurement, CliError> {
        let measurement = read_measurement(path, &self.options()?)?;
        match &measurement {
            Measurement::Recording(imported) => tell(path, imported.format, &imported.remarks, streams),
            Measurement::Spectra(spectra) => {
                tell(path, spectra.format, &spectra.remarks, streams);
                streams.say(&format!("{}: {}", path.display(), spectra.words()));
            }
        }
        Ok(measurement)
    }

    /// The same, but these columns.
    pub fn with_columns(self, columns: Vec<ColumnChoice>) -> Self {
        Self { columns, ..self }
    }

    /// The same in the file of a project.
    pub fn entries(&self) -> RecordingsTable {
        let scaled = |source: &str, scale: f64| match scale {
            1.0 => source.to_owned(),
            _ => format!("{source}*{scale}"),
        };
        let column =
            |choice: &ColumnChoice| format!("{}={}", choice.name, scaled(&choice.source, choice.scale));
        let time = self.time.as_ref().and_then(|time| match time {
            TimeBase::Source { source, scale } => Some(match scale {
                Some(scale) => format!("{source}*{scale}"),
                None => source.clone(),
            }),
            TimeBase::IntervalS(_) => None,
        });
        let separator = self.separator.map(|separator| match separator {
            Separator::Blanks => "blanks".to_owned(),
            Separator::Byte(b'\t') => "tab".to_owned(),
            Separator::Byte(byte) => char::from(byte).to_string(),
        });
        RecordingsTable {
            columns: self.columns.iter().map(column).collect(),
            time,
            sample_rate_hz: self.sample_rate,
            format: self.format.map(|format| format.to_string()),
            skip_lines: self.skip_lines,
            separator,
            decimal: self.decimal.and_then(|sign| Some(sign.to_possible_value()?.get_name().to_owned())),
            ..RecordingsTable::default()
        }
    }

    fn options(&self) -> Result<ReadOptions, CliError> {
        let interval = self.sample_rate.map(|rate_hz| match rate_hz {
            rate_hz if rate_hz > 0.0 && rate_hz.is_finite() => Ok(TimeBase::IntervalS(1.0 / rate_hz)),
            _ => Err(CliError::Usage(format!("--sample-rate {rate_hz} is no rate; give a number above 0"))),
        });
        Ok(ReadOptions {
            format: self.format,
            time: interval.transpose()?.or_else(|| self.time.clone()),
            columns: self.columns.clone(),
            skip_lines: self.skip_lines,
            separator: self.separator,
            decimal_comma: self.decimal.map(|sign| sign == Decimal::Comma),
        })
    }
}

fn tell(path: &Path, format: Format, remarks: &[String], streams: &mut Streams<'_>) {
    let name = path.display();
    if format != Format::Csv {
        streams.say(&format!("{name}: read as {format}"));
    }
    for remark in remarks {
        streams.say(&format!("{name}: {remark}"));
    }
}
