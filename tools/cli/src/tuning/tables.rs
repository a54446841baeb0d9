//! The modes and the shapers side by side, for people.

use super::box_origin::BoxOrigin;
use super::outcome::Tuning;
use crate::error::CliError;
use crate::streams::Streams;

/// Prints the modes with their boxes, and all shapers with what they leave.
///
/// # Errors
/// [`CliError::Output`].
pub fn print_tables(tuning: &Tuning, streams: &mut Streams<'_>) -> Result<(), CliError> {
    let out = &mut streams.out;
    writeln!(
        out,
        "{:>4}{:>16}{:>15}{:>26}  as wide as",
        "mode", "frequency (Hz)", "damping ratio", "its box (Hz)"
    )?;
    for mode in &tuning.modes.modes {
        let [low, high] = mode.area.frequency_hz();
        let origin = BoxOrigin::of(mode, tuning.request.floor, tuning.movement(mode.number));
        writeln!(
            out,
            "{:>4}{:>16.5}{:>15.6}{:>26}  {}",
            mode.number,
            mode.area.nominal_hz(),
            mode.area.nominal_damping_ratio(),
            format!("{low:.5} to {high:.5}"),
            origin.words(tuning.request.floor)
        )?;
    }
    let recommendation = &tuning.recommendation;
    writeln!(
        out,
        "\nWhat they leave of the vibration, with the modes as measured (nominal) and anywhere in their boxes (worst):"
    )?;
    writeln!(
        out,
        "{:<10}{:>14}{:>12}{:>14}  worst of each mode (%)",
        "shaper", "duration (s)", "delay (s)", "nominal (%)"
    )?;
    for candidate in recommendation.candidates() {
        let worst: Vec<String> =
            candidate.worst_over_box().iter().map(|worst| format!("{:.3}", 100.0 * worst)).collect();
        let mark = if candidate == recommendation.best() {
            "  <- take this one"
        } else if candidate.holds(recommendation.tolerance()) {
            ""
        } else {
            "  too much"
        };
        writeln!(
            out,
            "{:<10}{:>14.4}{:>12.4}{:>14.3}  {}{mark}",
            candidate.name,
            candidate.table.duration_s(),
            candidate.table.delay_s(),
            100.0 * candidate.nominal(),
            worst.join("  ")
        )?;
    }
    Ok(())
}
