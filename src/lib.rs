//! The portable core of the stillbeam firmware: input shaping for a machine with lightly damped modes.
//!
//! Everything with logic in it lives here, without `std`, without allocation, without `unsafe`, and
//! runs the same on the board, in the emulator and under the host's tests. From the bottom up:
//!
//! - [`units`]: positions and rates with their unit in the type.
//! - [`shaper`]: from a mode's frequency and damping ratio to integer taps, and the cascade that runs them.
//! - [`motion`]: moves, sweeps and the controlled stop as functions of the tick.
//! - [`source`]: another controller's pulses as the command instead, and what holds the setpoint within its
//!   limits then.
//! - [`servo`], [`telemetry`]: the two ways out.
//! - [`drive`]: whether the drive may run, from a person's `enable` to the end of a stop.
//! - [`fault`]: what can go wrong and what is done about it.
//! - [`restart`]: why the firmware starts, and what a crash has left.
//! - [`brown_out`]: below which supply the chip keeps itself in reset.
//! - [`self_test`]: what a board finds when it tests itself.
//! - [`watchdog`]: when it may be fed, and how long it waits.
//! - [`control`]: the tick, all that the interrupt does.
//! - [`settings`]: what a person can set, with meaning, unit, range and default.
//! - [`console`]: bytes in, replies out; stages settings and turns commands into requests to the tick.
//! - [`machine`]: the memory and the queues that tie console and tick together.

#![no_std]
#![deny(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

pub mod brown_out;
pub mod console;
pub mod control;
pub mod decimal;
pub mod drive;
pub mod elementary;
pub mod fault;
pub mod homing;
pub mod machine;
pub mod motion;
pub mod real_time;
pub mod restart;
pub mod self_test;
pub mod servo;
pub mod settings;
pub mod shaper;
pub mod source;
pub mod telemetry;
pub mod units;
pub mod watchdog;

#[cfg(target_os = "none")]
pub mod board;
