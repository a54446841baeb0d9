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

    /// The next line without its end; bytes that are no UTF-8 are shown as replacement characters.
    pub(super) fn next(&mut self) -> Option<Cow<'b, str>> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
        let line = rest.get(..length).unwrap_or(rest);
        self.at += length + 1;
        self.line += 1;
        Some(String::from_utf8_lossy(line.strip_suffix(b"\r").unwrap_or(line)))
    }

    /// Whether a line `-1` follows after `skipped` bytes.
    pub(super) fn delimiter_follows(&self, skipped: usize) -> bool {
        let rest = self.at.checked_add(skipped).and_then(|at| self.bytes.get(at..)).unwrap_or(&[]);
        let rest = rest.strip_prefix(b"\r").unwrap_or(rest);
        let rest = rest.strip_prefix(b"\n").unwrap_or(rest);
        let length = rest.iter().take(80).position(|byte| *byte == b'\n').unwrap_or(rest.len().min(80));
        rest.get(..length).is_some_and(|line| line.trim_ascii() == b"-1")
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
