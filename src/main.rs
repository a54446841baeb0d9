//! Firmware image.
fn main() {}
