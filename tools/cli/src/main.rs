//! The stillbeam command.
fn main() {}
