//! A board behind a serial port. Works on USB adapters and on pseudo-terminals alike.

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use serialport::{ClearBuffer, DataBits, FlowControl, Parity, SerialPort, StopBits};

use super::{BoardError, ByteLink};

/// The rate of the board's port in bits per second, 8N1. A pseudo-terminal ignores it.
pub const BAUD: u32 = 921_600;

/// How long one write may take.
const WRITE_PATIENCE: Duration = Duration::from_secs(2);

/// An open serial port.
pub struct SerialBoard {
    port: Box<dyn SerialPort>,
    name: String,
    opened: Instant,
}

impl SerialBoard {
    /// Opens a port at [`BAUD`], 8 data bits, no parity, one stop bit, no flow control.
    ///
    /// # Errors
    /// [`BoardError::Open`].
    pub fn open(path: &str) -> Result<Self, BoardError> {
        let port = serialport::new(path, BAUD)
            .data_bits(DataBits::Eight)
            .parity(Parity::None)
            .stop_bits(StopBits::One)
            .flow_control(FlowControl::None)
            .timeout(WRITE_PATIENCE)
            .open()
            .map_err(|error| BoardError::Open { port: path.to_owned(), reason: error.to_string() })?;
        // What was printed before belongs to nobody; a port that cannot clear is no worse for it.
        let _best_effort = port.clear(ClearBuffer::Input);
        Ok(Self { port, name: path.to_owned(), opened: Instant::now() })
    }

    /// A second handle to the same port, for a thread that only reads.
    ///
    /// # Errors
    /// [`BoardError::Open`] when the system gives no second handle.
    pub fn try_clone(&self) -> Result<Self, BoardError> {
        let port = self
            .port
            .try_clone()
            .map_err(|error| BoardError::Open { port: self.name.clone(), reason: error.to_string() })?;
        Ok(Self { port, name: self.name.clone(), opened: self.opened })
    }
}

impl ByteLink for SerialBoard {
    fn name(&self) -> &str {
        &self.name
    }

    fn write_all(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.port.set_timeout(WRITE_PATIENCE)?;
        self.port.write_all(bytes)?;
        self.port.flush()
    }

    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> std::io::Result<usize> {
        // The port takes whole milliseconds; zero would not wait at all.
        self.port.set_timeout(patience.max(Duration::from_millis(1)))?;
        match self.port.read(buffer) {
            Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => Ok(count),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => Ok(0),
            Err(error) => Err(error),
        }
    }

    fn clock(&self) -> Duration {
        self.opened.elapsed()
    }

    fn pause(&mut self, duration: Duration) {
        std::thread::sleep(duration);
    }
}
