//! What `stillbeam shape` and `stillbeam plan` are asked for: which modes and where they may be, what the
//! machine stands, and what there is to compare with.

mod candidates;
mod comparison;
mod machine;
mod selection;
mod tolerance;
mod uncertainty;

pub use candidates::{Candidate, candidates};
pub use comparison::{ComparedMove, compare_moves};
pub use machine::{MachineLimits, MoveCheck, Travel};
pub use selection::{ModeSelection, Task, board_rate_hz};
pub use tolerance::Tolerance;
pub use uncertainty::{BoxFloor, Spread, Uncertainty, describe_measured, measured_box, mode_boxes};
