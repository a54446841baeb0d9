//! Data sets 58 and 58b out.

use std::io::Write;

use super::error::UffProblem;
use super::fortran::{densest, exponential, real};
use super::units;
use crate::error::{Problem, RecordingError};
use crate::recording::{Column, Recording};

/// Intervals within this share of the mean one count as even: rounding of stamps, not jitter.
const EVEN: f64 = 1e-6;
/// Uneven stamps may move by this share of the mean interval when they are written with the format's digits.
const MOVED: f64 = 0.01;

/// Writes one data set 58 per column, values with 13 digits; the column's name stands in the first line.
///
/// # Errors
/// What [`Recording::check`] finds; missing values, which the format does not have; stamps that its digits
/// cannot tell apart; [`Problem::Io`].
pub fn to_uff58(sink: impl Write, recording: &Recording) -> Result<(), RecordingError> {
    write_all(sink, recording, false)
}

/// The same with binary values (58b, IEEE 754, little-endian), which read back as the same bits.
///
/// # Errors
/// As [`to_uff58`].
pub fn to_uff58b(sink: impl Write, recording: &Recording) -> Result<(), RecordingError> {
    write_all(sink, recording, true)
}

fn write_all(mut sink: impl Write, recording: &Recording, binary: bool) -> Result<(), RecordingError> {
    recording.check()?;
    let refused = |problem: UffProblem| recording.error(problem.into());
    for column in &recording.columns {
        let missing = column.samples.iter().filter(|sample| sample.is_nan()).count();
        if missing > 0 {
            return Err(refused(UffProblem::MissingValues { column: column.name.clone(), missing }));
        }
    }
    let times = Times::of(recording, binary).map_err(refused)?;
    let failed = |error| recording.error(Problem::Io(error));
    for (number, column) in (1..).zip(&recording.columns) {
        write_function(&mut sink, number, column, &times, binary).map_err(failed)?;
    }
    sink.flush().map_err(failed)
}

/// The abscissa as the format has it.
enum Times<'r> {
    Even { start_s: f64, step_s: f64 },
    Uneven(&'r [f64]),
}

impl<'r> Times<'r> {
    fn of(recording: &'r Recording, binary: bool) -> Result<Self, UffProblem> {
        let start_s = recording.time_s.first().copied().unwrap_or(0.0);
        let step_s = recording.mean_interval_s();
        let on_grid = |(k, t): (usize, &f64)| {
            (t - start_s - k as f64 * step_s).abs() <= EVEN * step_s + 4.0 * f64::EPSILON * t.abs()
        };
        // Both numbers of an even abscissa have few digits: they must bring the last stamp where it belongs.
        let read = |value: f64| real(&densest(value, 13)).unwrap_or(value);
        let last = recording.len().saturating_sub(1) as f64;
        let moved = (read(start_s) + last * read(step_s) - start_s - last * step_s).abs();
        if recording.time_s.iter().enumerate().all(on_grid) && moved <= MOVED * step_s {
            return Ok(Self::Even { start_s, step_s });
        }
        let lost = |t: &&f64| !binary && (read(**t) - **t).abs() > MOVED * step_s;
        match recording.time_s.iter().find(lost) {
            Some(time_s) => Err(UffProblem::TimeDigits { time_s: *time_s }),
            None => Ok(Self::Uneven(&recording.time_s)),
        }
    }
}

fn write_function(
    sink: &mut impl Write,
    number: u32,
    column: &Column,
    times: &Times<'_>,
    binary: bool,
) -> std::io::Result<()> {
    let count = column.samples.len();
    let (even, start_s, step_s) = match times {
        Times::Even { start_s, step_s } => (1, *start_s, *step_s),
        Times::Uneven(stamps) => (0, stamps.first().copied().unwrap_or(0.0), 0.0),
    };
    writeln!(sink, "{:>6}", -1)?;
    if binary {
        let bytes = count * if even == 1 { 8 } else { 16 };
        writeln!(sink, "{:>6}b{:>6}{:>6}{:>12}{bytes:>12}{:>6}{:>6}{:>12}{:>12}", 58, 1, 2, 11, 0, 0, 0, 0)?;
    } else {
        writeln!(sink, "{:>6}", 58)?;
    }
    let unit = column.unit();
    writeln!(sink, "{:<80}", column.name)?;
    for _ in 2..=5 {
        writeln!(sink, "{:<80}", "NONE")?;
    }
    // Time response, its number, version, load case; response at node `number`, no direction; no reference.
    writeln!(
        sink,
        "{:>5}{number:>10}{:>5}{:>10} {:<10}{number:>10}{:>4} {:<10}{:>10}{:>4}",
        1, 0, 0, "NONE", 0, "NONE", 0, 0
    )?;
    writeln!(
        sink,
        "{:>10}{count:>10}{even:>10}{}{}{}",
        4,
        densest(start_s, 13),
        densest(step_s, 13),
        exponential(0.0, 13, 5)
    )?;
    write_axis(sink, units::TIME, "Time", "s")?;
    write_axis(sink, units::data_type(unit), units::quantity(units::data_type(unit)), &units::label(unit))?;
    for _ in 10..=11 {
        write_axis(sink, 0, "NONE", "NONE")?;
    }
    match (binary, times) {
        (true, Times::Even { .. }) => write_bytes(sink, &column.samples)?,
        (true, Times::Uneven(stamps)) => {
            for (time_s, sample) in stamps.iter().zip(&column.samples) {
                write_bytes(sink, &[*time_s, *sample])?;
            }
        }
        (false, Times::Even { .. }) => {
            for line in column.samples.chunks(4) {
                let fields: Vec<String> = line.iter().map(|value| exponential(*value, 20, 12)).collect();
                writeln!(sink, "{}", fields.concat())?;
            }
        }
        (false, Times::Uneven(stamps)) => {
            for (time_s, sample) in stamps.iter().zip(&column.samples) {
                writeln!(sink, "{}{}", densest(*time_s, 13), exponential(*sample, 20, 12))?;
            }
        }
    }
    if binary {
        writeln!(sink)?;
    }
    writeln!(sink, "{:>6}", -1)
}

/// Records 8 to 11: what an axis is.
fn write_axis(sink: &mut impl Write, data_type: i64, label: &str, unit: &str) -> std::io::Result<()> {
    writeln!(sink, "{data_type:>10}{:>5}{:>5}{:>5} {label:<20.20} {unit:<20.20}", 0, 0, 0)
}

fn write_bytes(sink: &mut impl Write, values: &[f64]) -> std::io::Result<()> {
    for value in values {
        sink.write_all(&value.to_le_bytes())?;
    }
    Ok(())
}
