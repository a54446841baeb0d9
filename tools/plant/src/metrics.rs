//! How good a move was: settling time and overshoot, the first two columns of the paper's Table 2.

use crate::error::PlantError;

/// A move, and what counts as having arrived.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Move {
    /// When the command starts, seconds on the recording's clock.
    pub start_s: f64,
    /// Where the tip rests before, metres.
    pub from_m: f64,
    /// Where it is to rest after, metres.
    pub to_m: f64,
    /// Half-width of the band around the target, as a fraction of the move's length; above 0.
    pub band: f64,
}

impl Move {
    /// The usual band: 2 % of the move either side.
    pub const DEFAULT_BAND: f64 = 0.02;

    /// A move with the default band.
    pub fn new(start_s: f64, from_m: f64, to_m: f64) -> Self {
        Self { start_s, from_m, to_m, band: Self::DEFAULT_BAND }
    }
}

/// What [`measure_move`] found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MoveMetrics {
    /// Seconds from the command's start to the first sample from which on the tip stays within the band
    /// around the target to the end of the record; `None` when the last sample is still outside. Resolved to
    /// a sample, not interpolated.
    pub settling_time_s: Option<f64>,
    /// Furthest that the tip's absolute position goes beyond the target, in the direction of the move, in
    /// percent of the move's length; 0 when it never does.
    pub overshoot_pct: f64,
}

/// Measures a move from the tip's *absolute* position (base plus deflection).
///
/// Samples before the start and empty ones (NaN) are left out; a record that ends before the vibration has
/// decayed makes a settling time too short, so record on.
///
/// # Errors
/// [`PlantError::Measure`] when the slices differ in length, the move has no length, the band is not positive
/// or no sample is left.
pub fn measure_move(
    time_s: &[f64],
    tip_position_m: &[f64],
    command: &Move,
) -> Result<MoveMetrics, PlantError> {
    let refuse = |what, remedy| Err(PlantError::Measure { what, remedy });
    if time_s.len() != tip_position_m.len() {
        return refuse("times and positions differ in number", "give one position per time");
    }
    let length_m = command.to_m - command.from_m;
    if !(length_m.is_finite() && length_m != 0.0) {
        return refuse("the move has no length", "give a start and a target that differ");
    }
    if !(command.band.is_finite() && command.band > 0.0) {
        return refuse("the settling band is not positive", "give a fraction of the move such as 0.02");
    }
    // Error along the move, as a fraction of it: positive beyond the target.
    let errors: Vec<(f64, f64)> = time_s
        .iter()
        .zip(tip_position_m)
        .filter(|(time_s, tip_m)| **time_s >= command.start_s && !tip_m.is_nan())
        .map(|(time_s, tip_m)| (*time_s, (tip_m - command.to_m) / length_m))
        .collect();
    if errors.is_empty() {
        return refuse(
            "there is no sample after the start of the command",
            "check the start time and the tip's column",
        );
    }
    let outside = errors.iter().rposition(|(_, error)| error.abs() > command.band);
    let settled = errors.get(outside.map_or(0, |last| last + 1));
    let beyond = errors.iter().fold(0.0, |peak: f64, (_, error)| peak.max(*error));
    Ok(MoveMetrics {
        settling_time_s: settled.map(|(time_s, _)| time_s - command.start_s),
        overshoot_pct: 100.0 * beyond,
    })
}
