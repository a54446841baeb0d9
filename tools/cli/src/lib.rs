//! What the `stillbeam` command does, as a library.
pub mod board;
pub mod workspace;
