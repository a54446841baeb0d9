//! The board's serial port as a pseudo-terminal that is always open somewhere.
//!
//! QEMU throws output away while nobody has the terminal open, and looks only about once per
//! second whether somebody has come back. The driver therefore opens it once, before the CPU
//! starts, and never reads: the kernel keeps what the image prints until a client comes.

use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

use rustix::fs::{Mode, OFlags};

/// An open pseudo-terminal.
#[derive(Debug)]
pub(super) struct HeldSerial {
    path: PathBuf,
    _terminal: OwnedFd,
}

impl HeldSerial {
    /// Opens the terminal behind `link`.
    pub(super) fn open(link: &Path) -> std::io::Result<Self> {
        let path = std::fs::canonicalize(link)?;
        // NOCTTY: a signal typed on the board's console must not reach this process.
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC | OFlags::NONBLOCK;
        let terminal = rustix::fs::open(&path, flags, Mode::empty())?;
        Ok(Self { path, _terminal: terminal })
    }

    /// The terminal's own path.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}
