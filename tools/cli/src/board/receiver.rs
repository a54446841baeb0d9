//! What comes over the line, sorted: lines of text, frames of samples, and what is neither.
//!
//! A zero byte never occurs in text nor in a frame and begins and ends every frame. A frame's first byte is
//! [`FIRST_BYTE`], which text never has either. So after any loss at most the line and the frame that it hit
//! are wrong.

use std::collections::VecDeque;

use stillbeam_firmware::telemetry::Sample;
use stillbeam_firmware::telemetry::frame::{FIRST_BYTE, MAX_ENCODED, decode};

/// Something that came.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Received {
    /// A line that is not empty, without its end. Bytes that are not text became replacement characters.
    Line(String),
    /// The board says unasked that a fault has come up: its words.
    Fault(String),
    /// The samples of a frame whose CRC is right.
    Samples(Vec<Sample>),
    /// What was a frame before the line damaged it.
    Damaged,
}

/// Sorts bytes as they come.
#[derive(Debug, Default)]
pub struct Receiver {
    /// Since the last zero or line break.
    segment: Vec<u8>,
    /// Of a line that a frame has interrupted.
    line: Vec<u8>,
    ready: VecDeque<Received>,
}

impl Receiver {
    /// Takes bytes in pieces of any length.
    pub fn push(&mut self, bytes: &[u8]) {
        for byte in bytes {
            match byte {
                0 => self.end_frame(),
                b'\n' if !self.in_frame() => self.end_line(),
                _ => self.extend(*byte),
            }
        }
    }

    /// The next thing that is whole.
    pub fn take(&mut self) -> Option<Received> {
        self.ready.pop_front()
    }

    /// Forgets what is not whole yet.
    pub fn clear(&mut self) {
        self.segment.clear();
        self.line.clear();
    }

    fn in_frame(&self) -> bool {
        self.segment.first() == Some(&FIRST_BYTE)
    }

    fn extend(&mut self, byte: u8) {
        self.segment.push(byte);
        if self.in_frame() && self.segment.len() > MAX_ENCODED {
            // The zero at its end was lost.
            self.segment.clear();
            self.ready.push_back(Received::Damaged);
        }
    }

    fn end_frame(&mut self) {
        let segment = std::mem::take(&mut self.segment);
        if segment.is_empty() {
            return;
        }
        match decode(&segment) {
            Ok(samples) => self.ready.push_back(Received::Samples(samples.to_vec())),
            Err(_) if segment.iter().all(|byte| matches!(byte, b'\r' | b' '..=b'~')) => {
                self.line.extend(segment)
            }
            Err(_) => self.ready.push_back(Received::Damaged),
        }
    }

    fn end_line(&mut self) {
        self.line.append(&mut self.segment);
        let line = std::mem::take(&mut self.line);
        let line = String::from_utf8_lossy(&line).trim_end_matches('\r').to_owned();
        // A prompt may stand before it, and its checksum is worth no repetition.
        if let Some(fault) = line.trim_start_matches("> ").strip_prefix("! fault ") {
            let fault = fault.split_once(" *").map_or(fault, |(words, _)| words);
            self.ready.push_back(Received::Fault(fault.to_owned()));
        } else if !line.is_empty() {
            self.ready.push_back(Received::Line(line));
        }
    }
}
