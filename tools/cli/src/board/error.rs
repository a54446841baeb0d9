//! What can go wrong between the host and a board.

use std::time::Duration;

use thiserror::Error;

/// A board that could not be reached, or that did not do what it was asked.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BoardError {
    /// The port could not be opened.
    #[error(
        "{port}: cannot be opened: {reason}; check the path, the cable, and that no other program has it open"
    )]
    Open {
        /// The port.
        port: String,
        /// What the system said.
        reason: String,
    },
    /// Nobody answered the handshake.
    #[error(
        "{board}: no stillbeam console answered within {:.0} s; check that the firmware runs and the port is the right one",
        waited.as_secs_f64()
    )]
    NoConsole {
        /// The board.
        board: String,
        /// How long was waited.
        waited: Duration,
    },
    /// The console refused a command: `err CODE NAME: reason`.
    #[error("{board} refused `{command}`: {name}: {reason} ({code})")]
    Refused {
        /// The board.
        board: String,
        /// The command.
        command: String,
        /// The kind of refusal: `range`, `syntax`, `busy`, ...
        code: String,
        /// The setting or command that was at fault.
        name: String,
        /// Why.
        reason: String,
    },
    /// A reply or a motion did not end in time.
    #[error("{board}: no end of {what} after {:.1} s; the link may be broken or the firmware stuck", waited.as_secs_f64())]
    Timeout {
        /// The board.
        board: String,
        /// What did not end.
        what: String,
        /// How long was waited, on the link's clock.
        waited: Duration,
    },
    /// The line damages what is sent over it.
    #[error(
        "{board}: `{command}` or its reply was damaged by the line, in the last of {attempts} attempts or where another could do it twice; look at `status`, and check cable, baud rate and ground"
    )]
    Damaged {
        /// The board.
        board: String,
        /// The command.
        command: String,
        /// How often it may have been sent.
        attempts: u32,
    },
    /// The line failed.
    #[error("{board}: the line failed: {source}; check the cable and start again")]
    Io {
        /// The board.
        board: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The reply was not what the protocol says.
    #[error(
        "{board}: `{command}` was answered `{found}`, {expected} was expected; firmware and host may differ in version"
    )]
    Protocol {
        /// The board.
        board: String,
        /// The command.
        command: String,
        /// What came.
        found: String,
        /// What should have come.
        expected: &'static str,
    },
    /// The board has another table or plan than the one that was sent.
    #[error("{board}: the table or plan sent has crc32 {sent}, the board reports {found}; send it again")]
    Table {
        /// The board.
        board: String,
        /// The CRC of what was sent.
        sent: String,
        /// What the board says.
        found: String,
    },
    /// A fault stopped the machine in the middle of a motion.
    #[error(
        "{board}: `{motion}` was ended by a fault: {fault}; `events` and `status` on the console say more, `clear` goes on"
    )]
    Fault {
        /// The board.
        board: String,
        /// The motion.
        motion: String,
        /// What the board said of it.
        fault: String,
    },
    /// A person asked for a stop.
    #[error("{board}: stopped by Ctrl-C; the machine comes to rest within its limits")]
    Interrupted {
        /// The board.
        board: String,
    },
    /// Telemetry is missing.
    #[error(
        "{board}: {lost} streamed sample(s) were lost near tick {tick}; stream fewer (a larger decimation), or use a faster port"
    )]
    SamplesLost {
        /// The board.
        board: String,
        /// How many.
        lost: u32,
        /// The tick of the first sample after the gap.
        tick: u32,
    },
    /// Something that the emulated board needs is not there or failed.
    #[error("the emulated board could not be started: {reason}; {remedy}")]
    Emulator {
        /// What happened.
        reason: String,
        /// What to do.
        remedy: &'static str,
    },
}
