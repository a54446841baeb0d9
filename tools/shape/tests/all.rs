//! What shapers promise, one file per subject. One program, which is linked once.

mod axis_shaper;
mod comparison;
mod json_tables;
mod optimal;
mod refusals;
mod whole_move;
