//! Accelerometer logs of 3D printers' firmware in: Klipper (and Kalico, Shake&Tune) and RepRapFirmware.

use crate::content::Content;
use crate::error::Problem;
use crate::format::Format;
use crate::options::{ColumnChoice, ReadOptions, TimeBase};
use crate::table::{self, Table, assemble};

/// Axes of an accelerometer.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Reads Klipper's raw accelerometer log: its own names, and a clock that counts from the printer's start.
pub(crate) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, Problem> {
    if matches!(options.time, Some(TimeBase::Source { .. })) {
        return Err(Problem::OwnTime { format: Format::Klipper });
    }
    let (mut table, _) = table::read(bytes, options)?;
    table.from_zero = true;
    let options =
        with_axes(&table, options, |axis| (format!("accel_{axis}"), format!("acceleration_{axis}_mm_s2")));
    assemble(table, &options)
}

/// Reads RepRapFirmware's accelerometer log (M956): samples in g, and the rate behind them.
pub(crate) fn parse_reprap(bytes: &[u8], options: &ReadOptions) -> Result<Content, Problem> {
    if matches!(options.time, Some(TimeBase::Source { .. })) {
        return Err(Problem::OwnTime { format: Format::RepRap });
    }
    let (mut table, trailer) = table::read(bytes, options)?;
    let last = trailer.iter().find(|line| line.starts_with("Rate"));
    let numbers: Vec<f64> = last
        .map(|line| line.split([' ', ',']).filter_map(|word| word.trim().parse().ok()).collect())
        .unwrap_or_default();
    if last.is_some() {
        table.remarks.retain(|remark| !remark.contains("after the table"));
    }
    let rate_hz = numbers.first().copied().filter(|rate_hz| *rate_hz > 0.0 && rate_hz.is_finite());
    table.interval_s = rate_hz.map(f64::recip);
    if table.interval_s.is_none() && options.time.is_none() {
        return Err(Problem::NoRate);
    }
    if let Some(rate_hz) = rate_hz {
        table.remarks.push(format!("sampled at {rate_hz} Hz, by its last line"));
    }
    if let Some(overflows) = numbers.get(1).filter(|count| **count > 0.0) {
        table.remarks.push(format!(
            "the accelerometer's buffer overflowed {overflows} times: samples are missing somewhere"
        ));
    }
    let options = with_axes(&table, options, |axis| (axis.to_uppercase(), format!("acceleration_{axis}_g")));
    assemble(table, &options)
}

/// The options, with the axes that the file has where no columns were asked for.
fn with_axes(table: &Table, options: &ReadOptions, names: impl Fn(&str) -> (String, String)) -> ReadOptions {
    let mut options = options.clone();
    if options.columns.is_empty() {
        let choices = AXES.iter().map(|axis| {
            let (source, name) = names(axis);
            ColumnChoice { name, source, scale: 1.0 }
        });
        options.columns = choices
            .filter(|choice| table.headings.iter().any(|heading| heading.is_called(&choice.source)))
            .collect();
    }
    options
}

/// Which of the two it is, by the line of names: it stands first or behind comments.
pub(crate) fn detect(text: &str) -> Option<Format> {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    for line in lines.take(60) {
        let plain: String =
            line.chars().filter(|c| *c != ' ' && *c != '"').collect::<String>().to_lowercase();
        if plain.starts_with("#time,accel_") {
            return Some(Format::Klipper);
        }
        if ["sample,x", "sample,y", "sample,z"].iter().any(|start| plain.starts_with(start)) {
            return Some(Format::RepRap);
        }
        if !line.starts_with('#') {
            return None;
        }
    }
    None
}
