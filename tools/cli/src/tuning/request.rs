//! What a user asks `tune` for.

use crate::shaping::Spread;

/// What a user asks for.
#[derive(Clone, Debug)]
pub struct TuningRequest {
    /// Numbers of the modes to shape for, counted from 1; all where there are none.
    pub chosen: Vec<usize>,
    /// The least that the modes are taken to move by.
    pub floor: Spread,
    /// The most that may be left of any mode, a fraction.
    pub tolerance: f64,
    /// Ticks per second of the board.
    pub rate_hz: f64,
}
