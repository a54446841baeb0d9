//! Whether the drive may run: the state machine between a person's `enable` and the pins that a motor hangs
//! on.
//!
//! - [`machine`]: the states, what happens to them, and what they put out. Pure: an event in, the next
//!   machine out.
//! - [`inputs`]: what the general inputs mean.
//! - [`lacking`]: what enabling needs and is not there.
//! - [`lines`]: the pins' levels, and what others are told.
//! - [`setup`]: what the settings make of it.
//!
//! States have CiA 402's meaning: `disabled` is its *switch on disabled*, `enabled` its *operation enabled*,
//! `stopping` its *quick stop active* or *fault reaction active*. Stops have the categories of IEC 60204-1,
//! 9.2.2.

pub mod inputs;
pub mod lacking;
pub mod lines;
pub mod machine;
pub mod setup;

pub use inputs::{ActiveLevel, InputRole, InputRoles, Unusual};
pub use lacking::Lacking;
pub use lines::Lines;
pub use machine::{Drive, Event, Outputs, State, Stop, Times};
pub use setup::DriveSetup;
