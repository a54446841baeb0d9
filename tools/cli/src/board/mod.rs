//! Boards: anything that speaks the console protocol over bytes.
//!
//! | kind | file |
//! |---|---|
//! | a serial port: USB adapter, USB device, pseudo-terminal | [`serial`] |
//! | the firmware's core in this process, on its own clock | [`in_process`] |
//! | the same on the clock of the wall | [`paced`] |
//! | the firmware image on an emulated board | [`emulated`] |
//!
//! On top of any of them, [`session`] sends commands and sorts replies from telemetry, [`motion`] runs a
//! motion and collects every setpoint of it, and `upload` sends a table.

pub mod emulated;
pub mod enabling;
pub mod error;
pub mod in_process;
mod interrupt;
pub mod motion;
pub mod paced;
mod ram_flash;
pub mod receiver;
pub mod serial;
pub mod session;
pub mod target;
mod upload;

use std::time::Duration;

pub use enabling::{Consent, Enabled};
pub use error::BoardError;
pub use interrupt::StopLine;
pub use motion::{Gap, StreamedMotion};
pub use session::{Reply, Session};
pub use target::BoardTarget;

/// A line of bytes to something that speaks the console protocol, with its own idea of time.
pub trait ByteLink {
    /// What messages call the board.
    fn name(&self) -> &str;

    /// Sends all of `bytes`.
    ///
    /// # Errors
    /// Whatever the line reports.
    fn write_all(&mut self, bytes: &[u8]) -> std::io::Result<()>;

    /// Waits for bytes, at most `patience` on the link's clock, and returns how many were put into `buffer`;
    /// 0 when none came.
    ///
    /// # Errors
    /// Whatever the line reports; a line that was closed is an error, not 0.
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> std::io::Result<usize>;

    /// Time on the link's clock since it was opened: real for a board, simulated for the core in this
    /// process.
    fn clock(&self) -> Duration;

    /// Lets time pass on the link's clock.
    fn pause(&mut self, duration: Duration);
}
