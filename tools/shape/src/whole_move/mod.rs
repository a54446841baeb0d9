//! The shortest command for a whole move: a shaper and a move planned as one.
//!
//! | sentence | file |
//! |---|---|
//! | a distance, limits, modes in boxes and a tolerance | `request` |
//! | the acceleration at the corners of a grid that leaves least, within the limits: one conic programme | `programme` |
//! | the shortest duration by bisection | `search` |
//! | the command at every tick, in nanometres, and what it leaves | `played` |
//!
//! The acceleration is a straight line between corners, so the jerk is constant between them and the position a cubic:
//! positions at ticks are exact, not interpolated. docs/derivations.md has the formulas.

mod played;
mod programme;
mod request;
mod search;

pub use played::{PlayedMove, command_residual};
pub use request::{MoveBounds, MoveRequest};
