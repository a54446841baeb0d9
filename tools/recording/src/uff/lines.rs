//! The lines of a universal file, and the bytes between them.

use std::borrow::Cow;

/// Reads forward, counting lines. Binary values may lie between lines.
#[derive(Clone)]
pub(super) struct Lines<'b> {
    bytes: &'b [u8],
    at: usize,
    /// Line that was read last, from 1.
    pub(super) line: u64,
}

impl<'b> Lines<'b> {
    pub(super) fn new(bytes: &'b [u8]) -> Self {
        Self { bytes, at: 0, line: 0 }
    }

    /// Whether all of the file has been read.
    pub(super) fn at_end(&self) -> bool {
        self.at >= self.bytes.len()
    }

    /// Whether the line that was read last is the last of the file and has no end.
    pub(super) fn ended_open(&self) -> bool {
        self.at > self.bytes.len()
    }

    /// The next line without its end. The format is older than UTF-8: a line that is none is Latin-1.
    pub(super) fn next(&mut self) -> Option<Cow<'b, str>> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
        let line = rest.get(..length).unwrap_or(rest);
        self.at += length + 1;
        self.line += 1;
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        Some(match std::str::from_utf8(line) {
            Ok(text) => Cow::Borrowed(text),
            Err(_) => Cow::Owned(line.iter().map(|byte| char::from(*byte)).collect()),
        })
    }

    /// Whether a line `-1` follows after `skipped` bytes.
    pub(super) fn delimiter_follows(&self, skipped: usize) -> bool {
        let rest = self.at.checked_add(skipped).and_then(|at| self.bytes.get(at..)).unwrap_or(&[]);
        let rest = rest.strip_prefix(b"\r").unwrap_or(rest);
        let rest = rest.strip_prefix(b"\n").unwrap_or(rest);
        let length = rest.iter().take(80).position(|byte| *byte == b'\n').unwrap_or(rest.len().min(80));
        rest.get(..length).is_some_and(|line| line.trim_ascii() == b"-1")
    }

    /// Whether a line `-1` is left.
    pub(super) fn any_delimiter(mut self) -> bool {
        while let Some(line) = self.next() {
            if is_delimiter(&line) {
                return true;
            }
        }
        false
    }

    /// All bytes that are left.
    pub(super) fn rest(&mut self) -> &'b [u8] {
        let rest = self.bytes.get(self.at..).unwrap_or(&[]);
        self.at = self.bytes.len();
        rest
    }

    /// The next `count` bytes, whatever they are; `None` when there are fewer.
    pub(super) fn take(&mut self, count: usize) -> Option<&'b [u8]> {
        let end = self.at.checked_add(count)?;
        let taken = self.bytes.get(self.at..end)?;
        self.at = end;
        Some(taken)
    }
}

/// Whether a line is the `-1` that begins and ends a data set.
pub(super) fn is_delimiter(line: &str) -> bool {
    line.trim() == "-1"
}
