//! What the `stillbeam` command does, as a library.
pub mod base_move;
pub mod board;
pub mod demo;
pub mod error;
pub mod report;
pub mod streams;
pub mod workspace;
