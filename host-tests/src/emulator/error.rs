//! What can keep the emulated board from starting.

use std::path::PathBuf;
use std::time::Duration;

use thiserror::Error;

use super::rsp::RspError;
use super::thumb::UnsupportedInstruction;
use super::version::OLDEST_MAJOR;

/// Failure to start or to drive the emulator.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EmulatorError {
    /// The emulator is not installed.
    #[error("{program:?} cannot be run: {source}; `cargo xtask setup` installs it")]
    NotFound {
        /// The program that was tried.
        program: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The emulator lacks what the firmware needs.
    #[error(
        "{program:?} is {found}, but the serial port needs {OLDEST_MAJOR}.0 or newer (older ones have no \
         transmit interrupts); `cargo xtask setup` installs it"
    )]
    TooOld {
        /// The program that was asked.
        program: PathBuf,
        /// Its version.
        found: String,
    },
    /// The image cannot be used.
    #[error("image {image:?}: {reason}")]
    Image {
        /// The image's file.
        image: PathBuf,
        /// What is wrong with it and what helps.
        reason: String,
    },
    /// A file, socket, terminal or process of the driver failed.
    #[error("{doing}: {source}")]
    System {
        /// What was being done.
        doing: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The emulator ended or never became ready.
    #[error("{what}; the emulator printed: {output:?}")]
    Process {
        /// What happened.
        what: String,
        /// All that the emulator wrote to its standard output and error.
        output: String,
    },
    /// The debug link failed.
    #[error("{source}; the emulator printed: {output:?}")]
    Link {
        /// What the link said.
        source: RspError,
        /// All that the emulator wrote to its standard output and error.
        output: String,
    },
    /// The start-up touched a covered register with an instruction that is not decoded.
    #[error("at {location} a covered register is touched in a way the driver does not serve: {source}")]
    Instruction {
        /// Program counter and, where known, the function.
        location: String,
        /// The instruction.
        source: UnsupportedInstruction,
    },
    /// The decoded address is not in the cover although its watchpoint fired.
    #[error("at {location} a watchpoint fired, but the instruction goes to {address:#010x}")]
    Stray {
        /// Program counter and, where known, the function.
        location: String,
        /// The address that follows from the instruction and the registers.
        address: u32,
    },
    /// The CPU stopped for an unexpected reason.
    #[error("the CPU stopped at {location} with signal {signal} during start-up")]
    UnexpectedStop {
        /// Program counter and, where known, the function.
        location: String,
        /// The signal number the stub reports.
        signal: u8,
    },
    /// The board has run for too long to be reset.
    #[error(
        "the board has run for more than 4.2 s of virtual time, and the emulator's timers cannot be aligned with a tick \
         that starts so late; reset it earlier, or boot another emulator"
    )]
    LateReset,
    /// The start-up did not end in time.
    #[error(
        "{waiting_for} within {limit:?}; the image is at {location} after {served} covered accesses, \
         the last one {last_access}"
    )]
    BootTimeout {
        /// What has not happened yet.
        waiting_for: &'static str,
        /// The time that was allowed.
        limit: Duration,
        /// Program counter and, where known, the function.
        location: String,
        /// Number of accesses that were served.
        served: usize,
        /// The last of them.
        last_access: String,
    },
}

impl EmulatorError {
    pub(super) fn system(doing: impl Into<String>, source: std::io::Error) -> Self {
        Self::System { doing: doing.into(), source }
    }
}
