//! Scoring: what the tool answered against the truth that was sealed before.

pub mod answer;
pub mod judge;
pub mod page;
pub mod tables;
