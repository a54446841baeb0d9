//! Why there is no live page.

use thiserror::Error;

/// A server that could not be started.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LiveError {
    /// The address is taken or not permitted.
    #[error(
        "127.0.0.1:{port}: cannot be listened on: {source}; choose another with --listen, or 0 for any that is free"
    )]
    Listen {
        /// The port that was asked for.
        port: u16,
        /// What the system said.
        source: std::io::Error,
    },
    /// The threads that serve pages could not be started.
    #[error(
        "the threads that serve the page could not be started: {source}; close other programs and try again"
    )]
    Threads {
        /// What the system said.
        source: std::io::Error,
    },
    /// The system gives no random numbers, so that no token can be made.
    #[error(
        "the system gives no random numbers ({reason}), and without them the page would not be safe; check /dev/urandom"
    )]
    Random {
        /// What the system said.
        reason: String,
    },
}
