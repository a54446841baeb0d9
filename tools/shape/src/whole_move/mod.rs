//! The shortest command for a whole move: a shaper and a move planned as one.
//!
//! | sentence | file |
//! |---|---|
//! | a distance, limits, modes in boxes and a tolerance | `request` |
//! | the acceleration at the corners of a grid that leaves least, within the limits: one conic programme | `programme` |
//! | the shortest duration by bisection | `search` |
//! | its jerks in the integers of the board | `rounded`, `board_plan`, `plan_file` |
//! | the command at every tick, in nanometres, and what it leaves | `played` |
//!
//! Corners are at whole ticks and the programme is about the sums that the board makes, so nothing is
//! interpolated. docs/derivations/shortest.md has the formulas.

mod board_plan;
mod plan_file;
mod played;
mod programme;
mod request;
mod rounded;
mod search;

pub use board_plan::BoardPlan;
pub use plan_file::PlanEntry;
pub use played::{PlayedMove, command_residual};
pub use request::{MoveBounds, MoveRequest};
