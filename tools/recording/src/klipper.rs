//! Klipper's raw accelerometer log in.

use crate::csv_columns::chosen_cells;
use crate::csv_reader::{Parsed, parse_table};
use crate::error::Problem;
use crate::format::Format;
use crate::options::{ColumnChoice, ReadOptions, TimeBase};

/// Reads Klipper's raw accelerometer log: its own names, and a clock that counts from the printer's start.
pub(crate) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Parsed, Problem> {
    if options.time.is_some() {
        return Err(Problem::OwnTime { format: Format::Klipper });
    }
    let all = ["x", "y", "z"].map(|axis| ColumnChoice {
        name: format!("acceleration_{axis}_mm_s2"),
        source: format!("accel_{axis}"),
        scale: 1.0,
    });
    let columns = if options.columns.is_empty() { all.to_vec() } else { options.columns.clone() };
    let time = Some(TimeBase::Source("#time".to_owned()));
    let options = ReadOptions { format: None, time, columns };
    let (mut time_s, columns, mut remarks) = parse_table(bytes, |names| chosen_cells(&names, &options))?;
    if let Some(first_s) = time_s.first().copied().filter(|first_s| *first_s != 0.0) {
        for stamp_s in &mut time_s {
            *stamp_s -= first_s;
        }
        remarks.push(format!("the printer's clock stood at {first_s} s, which became 0"));
    }
    Ok((time_s, columns, remarks))
}
