//! The receiving side of a serial port that keeps one byte (RM0090, 30): what comes while it is full is lost,
//! and the port says so.

use std::collections::VecDeque;

/// Offsets of its registers.
pub mod register {
    /// Status.
    pub const SR: u32 = 0x00;
    /// Data.
    pub const DR: u32 = 0x04;
}

/// Status: bytes were lost, a byte is there, the last one has left, there is room for one.
const OVERRUN: u32 = 1 << 3;
const RECEIVED: u32 = 1 << 5;
const SENT: u32 = 1 << 6;
const ROOM: u32 = 1 << 7;

/// The port and the line to it. Times are clocks of the board's timers.
#[derive(Debug, Clone)]
pub struct SerialLine {
    clocks_per_byte: u64,
    /// When it was looked at last.
    now: Option<u64>,
    /// What is on its way, and when its first byte arrives.
    coming: VecDeque<u8>,
    arrives_at: u64,
    data: u8,
    status: u32,
    lost: u32,
    sent: Vec<u8>,
}

impl SerialLine {
    /// A line on which a byte takes so long.
    pub fn new(clocks_per_byte: u64) -> Self {
        Self {
            clocks_per_byte,
            now: None,
            coming: VecDeque::new(),
            arrives_at: 0,
            data: 0,
            status: SENT | ROOM,
            lost: 0,
            sent: Vec::new(),
        }
    }

    /// Somebody sends bytes to the port.
    pub fn send(&mut self, bytes: &[u8]) {
        if self.coming.is_empty() {
            self.arrives_at = self.now.unwrap_or(0) + self.clocks_per_byte;
        }
        self.coming.extend(bytes);
    }

    /// It is so late.
    pub fn advance(&mut self, clocks: u64) {
        if self.now.replace(clocks).is_none() {
            // What was sent before is on its way from now on.
            self.arrives_at += clocks;
        }
        while self.arrives_at <= clocks
            && let Some(byte) = self.coming.pop_front()
        {
            self.arrives_at += self.clocks_per_byte;
            if self.status & RECEIVED == 0 {
                self.data = byte;
                self.status |= RECEIVED;
            } else {
                self.status |= OVERRUN;
                self.lost += 1;
            }
        }
    }

    /// Whether the port's interrupt is to run.
    pub fn interrupts(&self) -> bool {
        self.status & (RECEIVED | OVERRUN) != 0
    }

    /// How many bytes were lost.
    pub fn lost(&self) -> u32 {
        self.lost
    }

    /// At most so many bytes of what the firmware has sent and nobody has taken.
    pub fn take_sent(&mut self, most: usize) -> Vec<u8> {
        let count = most.min(self.sent.len());
        self.sent.drain(..count).collect()
    }

    /// The firmware reads a register. The status has been read before the data, or errors would stay.
    pub fn read(&mut self, offset: u32) -> u32 {
        match offset {
            register::SR => self.status,
            register::DR => {
                self.status &= !(RECEIVED | OVERRUN);
                u32::from(self.data)
            }
            _ => 0,
        }
    }

    /// The firmware writes a register; what it sends is gone at once.
    pub fn write(&mut self, offset: u32, value: u32) {
        if offset == register::DR {
            self.sent.push(value as u8);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_that_are_taken_in_time_are_all_there() {
        let mut line = SerialLine::new(10);
        line.send(b"ab");
        line.advance(0);
        assert!(!line.interrupts());
        for (clocks, byte) in [(10, b'a'), (20, b'b')] {
            line.advance(clocks);
            assert!(line.interrupts());
            assert_eq!(line.read(register::SR) & (RECEIVED | OVERRUN), RECEIVED);
            assert_eq!(line.read(register::DR), u32::from(byte));
        }
        line.advance(1000);
        assert_eq!((line.interrupts(), line.lost()), (false, 0));
    }

    #[test]
    fn who_comes_late_finds_the_first_byte_and_that_others_are_lost() {
        let mut line = SerialLine::new(10);
        line.advance(0);
        line.send(b"abcd");
        line.advance(35);
        assert_eq!(line.read(register::SR) & (RECEIVED | OVERRUN), RECEIVED | OVERRUN);
        assert_eq!((line.read(register::DR), line.lost()), (u32::from(b'a'), 2));
        line.advance(40);
        assert_eq!(line.read(register::SR) & (RECEIVED | OVERRUN), RECEIVED);
        assert_eq!(line.read(register::DR), u32::from(b'd'));
    }
}
