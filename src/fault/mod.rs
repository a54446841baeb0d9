//! What can go wrong while the machine is trusted to the firmware, and what is done about it.
//!
//! - [`event`]: everything that is worth a line in `events`, with its tick, and a counter each.
//! - [`latch`]: faults that stop the machine until a person says `clear`.
//! - [`guard`]: the last look at a setpoint before it goes out.
//!
//! A fault never panics and never waits: the setpoint stays where it was, the motion is dropped, the drive is disabled if
//! the fault's [`Reaction`] says so. The command is put where the setpoint is, so that the shaper settles there behind the
//! scenes; once it has, `clear` goes on from rest without a jump.

pub mod event;
pub mod guard;
pub mod latch;
mod log;

pub use event::{Counters, Event, EventRecord, MAX_EVENTS};
pub use guard::TravelGuard;
pub use latch::{Fault, Latch, Reaction, Reactions};
pub use log::EventLog;
