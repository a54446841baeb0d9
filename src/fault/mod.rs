//! What can go wrong while the machine is trusted to the firmware, and what is done about it.
//!
//! - [`event`]: everything that is worth a line in `events`, with its tick, and a counter each.
//! - [`latch`]: faults that stop the machine until a person says `clear`.
//! - [`guard`]: the last look at a setpoint before it goes out.
//!
//! A fault never panics and never waits. What it does to the drive is one of the stop categories of IEC
//! 60204-1, as its [`Reaction`] says ([`crate::drive`]): the setpoint itself is braked, past the shaper, and
//! the command goes with it, so that the shaper settles there behind the scenes. Once it has, the machine
//! goes on from rest without a jump.

pub mod event;
pub mod guard;
pub mod latch;
mod log;

pub use event::{Counters, Event, EventRecord, MAX_EVENTS};
pub use guard::TravelGuard;
pub use latch::{Fault, Latch, Reaction, Reactions};
pub use log::EventLog;
