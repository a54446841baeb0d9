//! Client of the GDB remote serial protocol, as far as driving a start-up needs it.
//!
//! Packets are `$payload#checksum`; each side acknowledges with `+` or asks again with `-`.
//! Reference: "Debugging with GDB", appendix "GDB Remote Serial Protocol".

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use thiserror::Error;

/// How long the stub may take to answer a command that does not run the CPU.
const ANSWER_LIMIT: Duration = Duration::from_secs(5);
/// Attempts at a packet before the link counts as broken.
const ATTEMPTS: usize = 3;

/// What can go wrong on the link to the stub.
#[derive(Debug, Error)]
pub enum RspError {
    /// The socket failed.
    #[error("the debug link failed: {0}")]
    Io(#[from] std::io::Error),
    /// The stub closed the link, as it does when the emulator ends.
    #[error("the emulator closed the debug link")]
    Closed,
    /// No (complete) packet arrived in time.
    #[error("the debug stub did not answer within {limit:?}")]
    Timeout {
        /// The time that was allowed.
        limit: Duration,
    },
    /// A packet was damaged again and again.
    #[error("the debug link damaged a packet {ATTEMPTS} times; last seen: {packet:?}")]
    Damaged {
        /// The packet as it arrived or was sent.
        packet: String,
    },
    /// The CPU was stepped for long without getting where it was expected.
    #[error("no return from the interrupt after {instructions} instructions")]
    Endless {
        /// How many it executed.
        instructions: u32,
    },
    /// The stub answered with an error or with something that is not an answer to the command.
    #[error("the debug stub answered {answer:?} to {command:?}")]
    Refused {
        /// The command.
        command: String,
        /// The answer.
        answer: String,
    },
}

/// Why the CPU stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stop {
    /// Signal number; 5 is a trap (breakpoint, watchpoint), 2 follows [`RspClient::interrupt`].
    pub signal: u8,
    /// Base of the watched range where a watchpoint stopped the CPU.
    pub watchpoint: Option<u32>,
}

/// A client over any byte stream whose reads time out now and then (say every 100 ms), so that
/// limits can be kept.
#[derive(Debug)]
pub struct RspClient<S> {
    stream: S,
    received: Vec<u8>,
}

impl<S: Read + Write> RspClient<S> {
    /// A client on a connected stream.
    pub fn new(stream: S) -> Self {
        Self { stream, received: Vec::new() }
    }

    /// Value of core register `number` (13 = sp, 15 = pc, 25 = program status).
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or the stub has no such register.
    pub fn register(&mut self, number: u8) -> Result<u32, RspError> {
        self.word(&format!("p{number:x}"))
    }

    /// Sets core register `number`.
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or the stub refuses.
    pub fn set_register(&mut self, number: u8, value: u32) -> Result<(), RspError> {
        self.expect_ok(&format!("P{number:x}={}", word_hex(value)))
    }

    /// `length` bytes of memory at `address`.
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or the memory cannot be read.
    pub fn memory(&mut self, address: u32, length: usize) -> Result<Vec<u8>, RspError> {
        let command = format!("m{address:x},{length:x}");
        let answer = self.command(&command)?;
        match parse_hex(&answer) {
            Some(bytes) if bytes.len() == length => Ok(bytes),
            _ => Err(refused(&command, &answer)),
        }
    }

    /// The word at `address`, which may be a peripheral's register.
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or there is nothing to read.
    pub fn read_word(&mut self, address: u32) -> Result<u32, RspError> {
        self.word(&format!("m{address:x},4"))
    }

    /// Writes a word to `address`, which may be a peripheral's register.
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or the stub refuses.
    pub fn write_word(&mut self, address: u32, value: u32) -> Result<(), RspError> {
        self.expect_ok(&format!("M{address:x},4:{}", word_hex(value)))
    }

    /// Writes bytes to memory at `address`; about a thousand fit into a packet.
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or the stub refuses.
    pub fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<(), RspError> {
        let content: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        self.expect_ok(&format!("M{address:x},{:x}:{content}", bytes.len()))
    }

    /// Writes bytes, however many, to memory from `address` on.
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or the stub refuses.
    pub fn write_block(&mut self, address: u32, bytes: &[u8]) -> Result<(), RspError> {
        const PACKET_BYTES: usize = 1024;
        (address..)
            .step_by(PACKET_BYTES)
            .zip(bytes.chunks(PACKET_BYTES))
            .try_for_each(|(address, chunk)| self.write_memory(address, chunk))
    }

    /// Stops the CPU before every read and write of a range.
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or the stub refuses.
    pub fn watch(&mut self, base: u32, length: u32) -> Result<(), RspError> {
        self.expect_ok(&format!("Z4,{base:x},{length:x}"))
    }

    /// Undoes [`Self::watch`].
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or the stub refuses.
    pub fn unwatch(&mut self, base: u32, length: u32) -> Result<(), RspError> {
        self.expect_ok(&format!("z4,{base:x},{length:x}"))
    }

    /// Stops the CPU before every write to a range.
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or the stub refuses.
    pub fn watch_writes(&mut self, base: u32, length: u32) -> Result<(), RspError> {
        self.expect_ok(&format!("Z2,{base:x},{length:x}"))
    }

    /// Undoes [`Self::watch_writes`].
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or the stub refuses.
    pub fn unwatch_writes(&mut self, base: u32, length: u32) -> Result<(), RspError> {
        self.expect_ok(&format!("z2,{base:x},{length:x}"))
    }

    /// Stops the CPU before the Thumb instruction at `address` (even).
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or the stub refuses.
    pub fn break_at(&mut self, address: u32) -> Result<(), RspError> {
        self.expect_ok(&format!("Z1,{address:x},2"))
    }

    /// Undoes [`Self::break_at`].
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or the stub refuses.
    pub fn unbreak(&mut self, address: u32) -> Result<(), RspError> {
        self.expect_ok(&format!("z1,{address:x},2"))
    }

    /// Runs the CPU until it stops.
    ///
    /// # Errors
    ///
    /// [`RspError::Timeout`] where it does not stop within `limit` (it then still runs:
    /// [`Self::interrupt`]), otherwise what the link says.
    pub fn resume(&mut self, limit: Duration) -> Result<Stop, RspError> {
        self.run("c", limit)
    }

    /// Executes one instruction; interrupts wait.
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or the CPU does not stop within `limit`.
    pub fn step(&mut self, limit: Duration) -> Result<Stop, RspError> {
        self.run("s", limit)
    }

    /// Stops a running CPU.
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails.
    pub fn interrupt(&mut self) -> Result<Stop, RspError> {
        self.stream.write_all(&[0x03])?;
        let answer = self.receive(ANSWER_LIMIT)?;
        parse_stop(&answer).ok_or_else(|| refused("interrupt", &answer))
    }

    /// Lets the CPU run and leaves.
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails or the stub refuses.
    pub fn detach(mut self) -> Result<(), RspError> {
        self.expect_ok("D")
    }

    fn run(&mut self, command: &str, limit: Duration) -> Result<Stop, RspError> {
        self.send(command)?;
        let answer = self.receive(limit)?;
        parse_stop(&answer).ok_or_else(|| refused(command, &answer))
    }

    fn word(&mut self, command: &str) -> Result<u32, RspError> {
        let answer = self.command(command)?;
        // Words travel in the target's order, which is little-endian.
        match parse_hex(&answer).as_deref() {
            Some(&[a, b, c, d]) => Ok(u32::from_le_bytes([a, b, c, d])),
            _ => Err(refused(command, &answer)),
        }
    }

    fn expect_ok(&mut self, command: &str) -> Result<(), RspError> {
        let answer = self.command(command)?;
        if answer == "OK" { Ok(()) } else { Err(refused(command, &answer)) }
    }

    fn command(&mut self, payload: &str) -> Result<String, RspError> {
        self.send(payload)?;
        self.receive(ANSWER_LIMIT)
    }

    /// Sends a packet and waits for its acknowledgement.
    fn send(&mut self, payload: &str) -> Result<(), RspError> {
        let packet = frame(payload);
        for _ in 0..ATTEMPTS {
            self.stream.write_all(packet.as_bytes())?;
            let deadline = Instant::now() + ANSWER_LIMIT;
            loop {
                match self.next_byte(deadline, ANSWER_LIMIT)? {
                    b'+' => return Ok(()),
                    b'-' => break,
                    _ => {}
                }
            }
        }
        Err(RspError::Damaged { packet })
    }

    /// Waits for a whole packet, acknowledges it and returns its payload.
    fn receive(&mut self, limit: Duration) -> Result<String, RspError> {
        let deadline = Instant::now() + limit;
        let mut last = String::new();
        for _ in 0..ATTEMPTS {
            while self.next_byte(deadline, limit)? != b'$' {}
            let mut raw = Vec::new();
            loop {
                match self.next_byte(deadline, limit)? {
                    b'#' => break,
                    byte => raw.push(byte),
                }
            }
            let digits = [self.next_byte(deadline, limit)?, self.next_byte(deadline, limit)?];
            let claimed =
                std::str::from_utf8(&digits).ok().and_then(|text| u8::from_str_radix(text, 16).ok());
            if claimed == Some(checksum(&raw)) {
                self.stream.write_all(b"+")?;
                return Ok(unescape(&raw));
            }
            self.stream.write_all(b"-")?;
            last = String::from_utf8_lossy(&raw).into_owned();
        }
        Err(RspError::Damaged { packet: last })
    }

    /// The next byte of the stream; `limit` only serves the error.
    fn next_byte(&mut self, deadline: Instant, limit: Duration) -> Result<u8, RspError> {
        while self.received.is_empty() {
            let mut chunk = [0; 512];
            match self.stream.read(&mut chunk) {
                Ok(0) => return Err(RspError::Closed),
                // Last byte first, so that taking one is a pop.
                Ok(count) => self.received.extend(chunk.iter().take(count).rev().copied()),
                Err(error) => match error.kind() {
                    ErrorKind::Interrupted => {}
                    ErrorKind::WouldBlock | ErrorKind::TimedOut => {}
                    ErrorKind::ConnectionReset | ErrorKind::BrokenPipe => {
                        return Err(RspError::Closed);
                    }
                    _ => return Err(RspError::Io(error)),
                },
            }
            if self.received.is_empty() && Instant::now() >= deadline {
                return Err(RspError::Timeout { limit });
            }
        }
        // Not empty: the loop above ended.
        self.received.pop().ok_or(RspError::Closed)
    }
}

fn refused(command: &str, answer: &str) -> RspError {
    RspError::Refused { command: command.to_owned(), answer: answer.to_owned() }
}

/// Sum of the bytes modulo 256.
fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}

fn frame(payload: &str) -> String {
    format!("${payload}#{:02x}", checksum(payload.as_bytes()))
}

/// Undoes the escape `}` (next byte XOR 0x20) and the run length `*` (repeat the byte before).
fn unescape(raw: &[u8]) -> String {
    let mut plain: Vec<u8> = Vec::with_capacity(raw.len());
    let mut bytes = raw.iter().copied();
    while let Some(byte) = bytes.next() {
        match byte {
            b'}' => plain.extend(bytes.next().map(|escaped| escaped ^ 0x20)),
            b'*' => {
                let times = usize::from(bytes.next().unwrap_or(29).saturating_sub(29));
                if let Some(&repeated) = plain.last() {
                    plain.extend(std::iter::repeat_n(repeated, times));
                }
            }
            _ => plain.push(byte),
        }
    }
    String::from_utf8_lossy(&plain).into_owned()
}

fn word_hex(value: u32) -> String {
    format!("{:08x}", value.swap_bytes())
}

fn parse_hex(text: &str) -> Option<Vec<u8>> {
    if !text.is_ascii() || !text.len().is_multiple_of(2) {
        return None;
    }
    (0..text.len()).step_by(2).map(|at| u8::from_str_radix(text.get(at..at + 2)?, 16).ok()).collect()
}

/// `T05thread:01;awatch:40023800;` or `S05`.
fn parse_stop(answer: &str) -> Option<Stop> {
    let details = answer.strip_prefix(['T', 'S'])?;
    let signal = u8::from_str_radix(details.get(..2)?, 16).ok()?;
    let watchpoint = details
        .get(2..)?
        .split(';')
        .filter_map(|pair| pair.split_once(':'))
        .find(|(key, _)| matches!(*key, "watch" | "rwatch" | "awatch"))
        .and_then(|(_, address)| u32::from_str_radix(address, 16).ok());
    Some(Stop { signal, watchpoint })
}

#[cfg(test)]
#[path = "rsp_tests.rs"]
mod tests;
