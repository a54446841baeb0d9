//! What the chores need beyond the host's toolchain, installed where that is possible.

mod apt;
mod apt_sources;
mod cross;
mod emulator;
mod python;
mod version;

pub use cross::compiler;
pub use emulator::emulator;
pub use python::{pip, python};

use crate::failure::Failure;

/// Prepares for all chores.
pub fn everything() -> Result<(), Failure> {
    compiler()?;
    emulator()?;
    python().map(|_| ())
}
