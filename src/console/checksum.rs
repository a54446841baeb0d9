//! Lines and replies with a CRC-32: `LINE *XXXXXXXX`, eight hexadecimal digits over what stands before ` *`.
//!
//! A reply's CRC is on its last line and covers the whole reply, line breaks (CR LF) between its lines
//! included.

use core::fmt::{self, Write};

use crc::{CRC_32_ISO_HDLC, Crc, Digest, NoTable};

use crate::shaper::uploaded::crc32;

static CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Characters of ` *XXXXXXXX`.
pub const CHECKSUM_CHARACTERS: usize = 10;

/// What a line says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Checked<'l> {
    /// It has no checksum.
    Plain(&'l str),
    /// It is the line that was sent.
    Good(&'l str),
    /// It is not the line that was sent.
    Damaged,
}

impl<'l> Checked<'l> {
    /// Takes the checksum off a line.
    pub fn of(line: &'l str) -> Self {
        let Some((text, digits)) = line.rsplit_once(" *") else { return Self::Plain(line) };
        // `from_str_radix` would take a sign.
        if digits.len() + 2 != CHECKSUM_CHARACTERS || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
            return Self::Plain(line);
        }
        match u32::from_str_radix(digits, 16) {
            Ok(written) if written == crc32(text.as_bytes()) => Self::Good(text),
            _ => Self::Damaged,
        }
    }
}

/// Passes a reply on and ends its last line with the reply's CRC.
pub(super) struct ReplyWithChecksum<'o> {
    out: &'o mut dyn Write,
    digest: Digest<'static, u32, NoTable>,
    /// A line break that is sent when something follows it.
    line_break: bool,
}

impl<'o> ReplyWithChecksum<'o> {
    pub(super) fn new(out: &'o mut dyn Write) -> Self {
        Self { out, digest: CRC.digest(), line_break: false }
    }

    /// Sends the CRC and the last line break. A reply without any line has neither.
    pub(super) fn finish(self) {
        if self.line_break {
            let _best_effort = write!(self.out, " *{:08x}\r\n", self.digest.finalize());
        }
    }
}

impl Write for ReplyWithChecksum<'_> {
    fn write_str(&mut self, part: &str) -> fmt::Result {
        if part.is_empty() {
            return Ok(());
        }
        if core::mem::take(&mut self.line_break) {
            self.digest.update(b"\r\n");
            self.out.write_str("\r\n")?;
        }
        let text = part.strip_suffix("\r\n").unwrap_or(part);
        self.line_break = text.len() != part.len();
        self.digest.update(text.as_bytes());
        self.out.write_str(text)
    }
}
