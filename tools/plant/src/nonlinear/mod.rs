//! A model with left-out physics, a controller or sensors, run over a recording.
//!
//! ```text
//! recorded input, or controller ─▶ drive laws ─▶ (servo) ─▶ motion laws ─▶ state space + force laws ─▶ sensors
//! ```
//!
//! Between time stamps the plant takes sub-steps of at most [`longest_step_s`]. Over a sub-step the linear
//! part is exact for straight-line inputs and constant forces; the forces are of second order in the sub-step
//! ([`crate::catalogue`]). Several forces in one sub-step are found together by sweeps over the laws until
//! none moves any more. Fits take longer steps of fourth order where all forces are smooth ([`smooth`]).
//! Everything is deterministic.

mod assembly;
mod control;
mod engine;
mod guide;
mod lean;
mod sensing;
mod smooth;
mod steps;

pub(crate) use assembly::{Machine, Run, elements, passed, signals};
pub use guide::{Guide, Tie};
pub(crate) use lean::Look;
pub(crate) use sensing::{Dense, Sensing};

use crate::state_space::StateSpace;

/// Radians that the plant's fastest motion turns in the longest sub-step: with a tenth, the mean force of a
/// smooth law is right to better than 1e-3 of itself in that motion, and to 1e-5 in one ten times slower.
const RADIANS_PER_STEP: f64 = 0.1;

/// The longest sub-step in seconds, for a plant, unless a caller asks for another.
pub(crate) fn longest_step_s(space: &StateSpace) -> f64 {
    let by_speed_s = RADIANS_PER_STEP / space.fastest_rad_s().max(1e-9);
    by_speed_s.clamp(1e-4, 2e-3)
}

/// Into how many steps a stretch of time is cut: none longer than `longest_step_s`, and all halved so often.
fn pieces(stretch_s: f64, longest_step_s: f64, halvings: u32) -> f64 {
    let needed = (stretch_s / longest_step_s * (1.0 - 1e-9)).ceil().max(1.0);
    needed * f64::from(halvings).exp2()
}
