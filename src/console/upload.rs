//! A table on its way to the board: frames in order, each with its CRC, taken only when whole.

use core::fmt;

use heapless::Vec;

use crate::shaper::uploaded::crc32;
use crate::shaper::wire::MAX_TABLE_BYTES;
use crate::shaper::{TapsError, UploadedTable};
use crate::units::TickRate;

/// The most bytes of a frame.
pub const MAX_FRAME_BYTES: usize = 56;

/// What has come so far of an announced table.
#[derive(Debug)]
pub(super) struct Upload {
    tick_rate: TickRate,
    length: usize,
    crc32: u32,
    bytes: Vec<u8, MAX_TABLE_BYTES>,
    /// Frames taken, and the CRC of the last, by which it is known when it comes again.
    frames: u32,
    last_crc32: u32,
}

/// Why an upload goes no further. What came before stays, and the frame may be sent again, unless told otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum UploadError {
    /// No table can have this length in bytes.
    Length {
        /// The announced length.
        length: usize,
    },
    /// The table is for another tick rate.
    Rate {
        /// The table's, hertz.
        rate_hz: f64,
        /// The board's, hertz.
        tick_rate: TickRate,
    },
    /// `table begin` was not sent, or not taken.
    NotBegun,
    /// A frame is missing.
    Sequence {
        /// The number of the next frame.
        expected: u32,
        /// The number that came.
        found: u32,
    },
    /// The frame has another length than it says.
    FrameLength {
        /// Bytes announced.
        announced: usize,
        /// Bytes found.
        found: usize,
    },
    /// The frame was damaged.
    FrameDamaged,
    /// More bytes than the table has.
    TooMuch {
        /// The announced length of the table.
        length: usize,
    },
    /// Bytes are missing.
    Incomplete {
        /// Bytes that came.
        received: usize,
        /// Bytes of the table.
        length: usize,
    },
    /// Every frame was right, the whole is not: the upload is dropped.
    TableDamaged {
        /// The CRC that was announced.
        announced: u32,
        /// The CRC of what came.
        computed: u32,
    },
    /// The table came as it was sent and is none: the upload is dropped.
    Taps(TapsError),
    /// `shaper.source` is `uploaded`, and nothing was.
    NoTable,
}

impl UploadError {
    /// The CODE of the refusal.
    pub(super) fn code(self) -> &'static str {
        match self {
            Self::FrameDamaged | Self::TableDamaged { .. } => "crc",
            Self::NotBegun
            | Self::Sequence { .. }
            | Self::FrameLength { .. }
            | Self::TooMuch { .. }
            | Self::Incomplete { .. } => "frame",
            Self::Length { .. } | Self::Rate { .. } | Self::Taps(_) | Self::NoTable => "range",
        }
    }
}

impl fmt::Display for UploadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { length } => {
                write!(f, "a table of {length} bytes; give a multiple of 4 from 12 to {MAX_TABLE_BYTES}")
            }
            Self::Rate { rate_hz, tick_rate } => write!(
                f,
                "made for {rate_hz} Hz, the board ticks at {} Hz; design it for that rate, 'set tick.rate_hz', or 'set shaper.source designed'",
                tick_rate.hz()
            ),
            Self::NotBegun => f.write_str("no upload under way; 'table begin' starts one"),
            Self::Sequence { expected, found } => write!(f, "frame {expected} is next, not {found}"),
            Self::FrameLength { announced, found } => {
                write!(f, "the frame has {found} bytes, not {announced}; at most {MAX_FRAME_BYTES}")
            }
            Self::FrameDamaged => f.write_str("the frame's CRC does not match; send it again"),
            Self::TooMuch { length } => write!(f, "more than the {length} bytes announced"),
            Self::Incomplete { received, length } => write!(f, "{received} of {length} bytes have come"),
            Self::TableDamaged { announced, computed } => {
                write!(f, "the table's CRC is 0x{computed:08x}, 0x{announced:08x} was announced; start again")
            }
            Self::Taps(error) => error.fmt(f),
            Self::NoTable => f.write_str("no table was uploaded; 'set shaper.source designed'"),
        }
    }
}

impl Upload {
    /// Expects a table of so many bytes.
    pub(super) fn begin(tick_rate: TickRate, length: usize, crc32: u32) -> Result<Self, UploadError> {
        if !(12..=MAX_TABLE_BYTES).contains(&length) || !length.is_multiple_of(4) {
            return Err(UploadError::Length { length });
        }
        Ok(Self { tick_rate, length, crc32, bytes: Vec::new(), frames: 0, last_crc32: 0 })
    }

    /// Takes the next frame, or the last one again, whose acknowledgement may have been lost.
    pub(super) fn take(
        &mut self,
        sequence: u32,
        announced: usize,
        frame: &[u8],
        frame_crc32: u32,
    ) -> Result<(), UploadError> {
        if frame.len() != announced || frame.is_empty() {
            return Err(UploadError::FrameLength { announced, found: frame.len() });
        }
        if crc32(frame) != frame_crc32 {
            return Err(UploadError::FrameDamaged);
        }
        if sequence.checked_add(1) == Some(self.frames) && frame_crc32 == self.last_crc32 {
            return Ok(());
        }
        if sequence != self.frames {
            return Err(UploadError::Sequence { expected: self.frames, found: sequence });
        }
        if frame.len() > self.length - self.bytes.len() || self.bytes.extend_from_slice(frame).is_err() {
            return Err(UploadError::TooMuch { length: self.length });
        }
        self.frames += 1;
        self.last_crc32 = frame_crc32;
        Ok(())
    }

    /// Bytes that have come.
    pub(super) fn received(&self) -> usize {
        self.bytes.len()
    }

    /// Bytes of the table.
    pub(super) fn length(&self) -> usize {
        self.length
    }

    /// The table, if it is whole and valid.
    pub(super) fn finish(&self) -> Result<UploadedTable, UploadError> {
        let (received, length) = (self.bytes.len(), self.length);
        if received != length {
            return Err(UploadError::Incomplete { received, length });
        }
        let computed = crc32(&self.bytes);
        if computed != self.crc32 {
            return Err(UploadError::TableDamaged { announced: self.crc32, computed });
        }
        UploadedTable::new(self.tick_rate, &self.bytes).map_err(UploadError::Taps)
    }
}
