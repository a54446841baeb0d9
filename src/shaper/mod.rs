//! The input shaper: closed forms, the exact cascade on the tick grid, and the live handover.
//!
//! Terms. A *mode* is one resonance of the machine, given by its undamped natural frequency and its
//! damping ratio. A *shaper* is a short sequence of impulses that a command is convolved with. A
//! *stage* is the shaper of one mode as a finite impulse response on the tick grid; the *cascade*
//! runs the stages of all modes one after the other.

pub mod blocks;
pub mod cascade;
pub mod design;
pub mod handover;
pub mod mode;
pub mod pattern;
pub mod residual;
pub mod stage;
pub mod table;
mod tick_grid;
pub mod transition;
pub mod uploaded;
pub mod wire;

pub use cascade::Cascade;
pub use design::Impulse;
pub use handover::Shaping;
pub use mode::{KnownTypes, Mode, ModeError, ShaperType};
pub use stage::{Stage, StageTaps, Tap};
pub use table::{ShaperTable, TapsError};
pub use transition::{Fade, Transition};
pub use uploaded::UploadedTable;

/// The most modes that one table shapes.
pub const MAX_MODES: usize = 4;
