//! What stops a chore.

use std::path::PathBuf;

use thiserror::Error;

/// A chore that could not be done.
#[derive(Debug, Error)]
pub enum Failure {
    /// The command line makes no sense.
    #[error("{0}")]
    Usage(String),
    /// A program could not be started.
    #[error("cannot run {program}: {source}")]
    Start {
        /// The program.
        program: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// A program ended with an error.
    #[error("`{command}` failed ({how})")]
    Command {
        /// The command line.
        command: String,
        /// Its exit status, or the limit that it exceeded.
        how: String,
    },
    /// Something that a chore needs is missing and could not be installed.
    #[error("{what} is missing: {why}; {remedy}")]
    Missing {
        /// What is missing.
        what: &'static str,
        /// Why it could not be installed here.
        why: String,
        /// What the reader can do.
        remedy: &'static str,
    },
    /// A file could not be read or written.
    #[error("{path:?}: {reason}")]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// An interrupt of the highest priority can do what it must not.
    #[error("an interrupt of the highest priority breaks its rules\n{report}")]
    Interrupt {
        /// What was found, and where.
        report: String,
    },
    /// A goal that was reached is no longer.
    #[error("{what}: {now}, the goal is {goal}")]
    Goal {
        /// What was measured.
        what: &'static str,
        /// The most that it may be.
        goal: u32,
        /// As measured.
        now: u32,
    },
    /// The image takes clearly more than it did when its numbers were recorded.
    #[error(
        "{what} went from {recorded} to {now}, more than {limit_pct} % up; `cargo xtask bench-firmware` records it anew if it has to be"
    )]
    Regression {
        /// What was measured.
        what: String,
        /// As recorded.
        recorded: u64,
        /// As measured.
        now: u64,
        /// How much more is accepted, in per cent.
        limit_pct: u64,
    },
}
