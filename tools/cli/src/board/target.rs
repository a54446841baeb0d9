//! Which board: the words of `--board`.

use super::emulated::EmulatedBoard;
use super::in_process::InProcessBoard;
use super::serial::SerialBoard;
use super::{BoardError, ByteLink, Session};

/// Where the firmware runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BoardTarget {
    /// The portable core, in this process.
    Core,
    /// The release image, on an emulated board.
    Qemu,
    /// Whatever is behind this serial port.
    Port(String),
}

impl BoardTarget {
    /// Reads `core`, `qemu` or the path of a port.
    pub fn parse(text: &str) -> Self {
        match text {
            "core" => Self::Core,
            "qemu" => Self::Qemu,
            port => Self::Port(port.to_owned()),
        }
    }

    /// The word, as it was read.
    pub fn name(&self) -> &str {
        match self {
            Self::Core => "core",
            Self::Qemu => "qemu",
            Self::Port(port) => port,
        }
    }

    /// What exactly is real about it, for whoever reads results.
    pub fn description(&self) -> String {
        match self {
            Self::Core => "the firmware's portable core, run in this process".to_owned(),
            Self::Qemu => "the unmodified firmware image, run on an emulated STM32F405".to_owned(),
            Self::Port(port) => format!("the board behind the serial port {port}"),
        }
    }

    /// Connects and shakes hands. `say` is told what takes long.
    ///
    /// # Errors
    /// [`BoardError`].
    pub fn connect(&self, say: &mut dyn FnMut(&str)) -> Result<Session, BoardError> {
        Session::start(self.open(say)?)
    }

    /// The line to the board, before any handshake. `say` is told what takes long.
    ///
    /// # Errors
    /// [`BoardError`].
    pub fn open(&self, say: &mut dyn FnMut(&str)) -> Result<Box<dyn ByteLink>, BoardError> {
        Ok(match self {
            Self::Core => Box::new(InProcessBoard::new()),
            Self::Qemu => Box::new(EmulatedBoard::start(say)?),
            Self::Port(port) => Box::new(SerialBoard::open(port)?),
        })
    }
}
