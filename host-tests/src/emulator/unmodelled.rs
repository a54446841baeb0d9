//! What the image reads from and writes to peripherals that the emulator does not model, as the emulator
//! tells it.
//!
//! It tells without being stopped, so unlike watchpoints this changes no timing: virtual time, the order of
//! things and what the image reads (zero) are the same whether anybody listens or not. Whoever listens slowly
//! slows the emulator down, and loses nothing.

use std::fs::File;
use std::io::{BufRead, BufReader, PipeReader, Write};

use super::thumb::Direction;

/// Where the peripherals begin whose accesses are told, by the emulator's names for them (RM0090, memory
/// map).
const DEVICES: [(&str, u32); 5] = [
    ("DAC", 0x4000_7400),
    ("timer[1]", 0x4001_0000),
    ("timer[9]", 0x4001_4000),
    ("GPIOA", 0x4002_0000),
    ("GPIOB", 0x4002_0400),
];

/// One access of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Access {
    /// The register.
    pub address: u32,
    /// Read or written.
    pub direction: Direction,
    /// What was written; zero where it was read.
    pub value: u32,
}

impl Access {
    /// Reads a line of the emulator's log: `NAME: unimplemented device write (size 4, offset 0x18, value
    /// 0x00010000)`, or `read` without a value. `None` for other lines and other peripherals.
    pub fn parse(line: &str) -> Option<Self> {
        let (name, rest) = line.split_once(": unimplemented device ")?;
        let base = DEVICES.iter().find(|(known, _)| *known == name)?.1;
        let direction = if rest.starts_with("write") { Direction::Store } else { Direction::Load };
        let number = |key: &str| {
            let (_, text) = rest.split_once(key)?;
            let end = text.find(|c: char| !c.is_ascii_hexdigit()).unwrap_or(text.len());
            u32::from_str_radix(text.get(..end)?, 16).ok()
        };
        let value = match direction {
            Direction::Store => number("value 0x")?,
            Direction::Load => 0,
        };
        Some(Self { address: base + number("offset 0x")?, direction, value })
    }
}

/// Who is told. Called from a thread of its own, in the order of the accesses.
pub type Listener = Box<dyn FnMut(Access) + Send>;

/// Tells `listener` until the emulator ends; what else the emulator says goes on to `messages`.
pub(super) fn listen(log: PipeReader, mut messages: File, mut listener: Listener) {
    std::thread::spawn(move || {
        let mut log = BufReader::new(log);
        let mut line = String::new();
        while log.read_line(&mut line).is_ok_and(|read| read > 0) {
            match Access::parse(&line) {
                Some(access) => listener(access),
                None if line.contains(": unimplemented device ") => {}
                // For messages of errors, which do without where it cannot be written.
                None => drop(messages.write_all(line.as_bytes())),
            }
            line.clear();
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accesses_are_read_with_their_address_and_other_lines_are_none() {
        let write =
            Access::parse("GPIOB: unimplemented device write (size 4, offset 0x018, value 0x04000001)\n");
        let expected = Access { address: 0x4002_0418, direction: Direction::Store, value: 0x0400_0001 };
        assert_eq!(write, Some(expected));
        let read = Access::parse("timer[9]: unimplemented device read  (size 4, offset 0x024)\n");
        let expected = Access { address: 0x4001_4024, direction: Direction::Load, value: 0 };
        assert_eq!(read, Some(expected));
        for other in [
            "CAN1: unimplemented device write (size 4, offset 0x018, value 0x04000001)",
            "GPIOB: unimplemented device write (size 4, offset 0x018",
            "qemu-system-arm: no such file",
            "",
        ] {
            assert_eq!(Access::parse(other), None, "{other}");
        }
    }
}
