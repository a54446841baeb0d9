//! What `stillbeam shape` is asked for: where modes may be, and what the machine stands.

mod machine;
mod uncertainty;

pub use machine::{MachineLimits, MoveCheck};
pub use uncertainty::{Uncertainty, mode_boxes};
