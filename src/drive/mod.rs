//! Whether the drive may run: the state machine between a person's `enable` and the pins that a motor hangs on.
//!
//! - [`machine`]: the states, what happens to them, and what they put out. Pure: an event in, the next machine out.
//! - [`inputs`]: what the general inputs mean.
//! - [`lacking`]: what enabling needs and is not there.
//! - [`setup`]: what the settings make of it.
//! - [`signals`]: what others are told of it.
//!
//! States have CiA 402's meaning: `disabled` is its *switch on disabled*, `enabled` its *operation enabled*, `stopping` its *quick
//! stop active* or *fault reaction active*. Stops have the categories of IEC 60204-1, 9.2.2.

pub mod inputs;
pub mod lacking;
pub mod machine;
pub mod setup;
pub mod signals;

pub use inputs::{ActiveLevel, InputRole, InputRoles, Unusual};
pub use lacking::Lacking;
pub use machine::{Drive, Event, Outputs, State, Stop, Times};
pub use setup::DriveSetup;
pub use signals::Signals;
