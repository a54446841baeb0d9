//! The core in this process on the clock of the wall, for people who watch it.

use std::io;
use std::time::{Duration, Instant};

use super::ByteLink;
use super::in_process::InProcessBoard;

/// How far the core may be behind the wall before it gives up catching up: a computer that was busy for
/// longer makes time pass late, not faster.
const LONGEST_LAG: Duration = Duration::from_millis(200);

/// How long to sleep where the core is ahead.
const NAP: Duration = Duration::from_millis(1);

/// A core whose time passes no faster than real time.
#[derive(Debug)]
pub struct PacedBoard {
    core: InProcessBoard,
    /// When the core's clock would have been zero.
    began: Instant,
}

impl PacedBoard {
    /// Slows a core down.
    pub fn new(core: InProcessBoard) -> Self {
        let began = Instant::now();
        // Only a clock that has run longer than the computer could lie before all instants.
        let began = began.checked_sub(core.clock()).unwrap_or(began);
        Self { core, began }
    }

    /// How far the core's clock is behind the wall's.
    fn lag(&mut self) -> Duration {
        let lag = self.began.elapsed().saturating_sub(self.core.clock());
        if lag > LONGEST_LAG {
            self.began += lag - LONGEST_LAG;
        }
        lag.min(LONGEST_LAG)
    }
}

impl ByteLink for PacedBoard {
    fn name(&self) -> &str {
        self.core.name()
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.core.write_all(bytes)
    }

    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        let ends = Instant::now() + patience;
        loop {
            let lag = self.lag();
            let count = if lag.is_zero() { 0 } else { self.core.read(buffer, lag)? };
            if count != 0 || Instant::now() >= ends {
                return Ok(count);
            }
            std::thread::sleep(NAP.min(patience));
        }
    }

    fn clock(&self) -> Duration {
        self.core.clock()
    }

    fn pause(&mut self, duration: Duration) {
        let ends = self.core.clock() + duration;
        while self.core.clock() < ends {
            let lag = self.lag().min(ends.saturating_sub(self.core.clock()));
            if lag.is_zero() {
                std::thread::sleep(NAP);
            } else {
                self.core.pause(lag);
            }
        }
    }
}
