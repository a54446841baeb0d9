//! A table or a plan on its way to the board: frames in order, each with its CRC, taken only when whole.

use core::fmt;

use crate::decimal::Decimal;
use crate::motion::pieces::{MAX_PIECES, MAX_PLAN_BYTES, PIECE_BYTES};
use crate::motion::{PieceMemory, PlanError};
use crate::shaper::TapsError;
use crate::shaper::uploaded::crc32;
use crate::shaper::wire::MAX_TABLE_BYTES;
use crate::units::TickRate;

/// The most bytes of a frame.
pub const MAX_FRAME_BYTES: usize = 56;

/// What is uploaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UploadKind {
    /// A shaper.
    Table,
    /// A command.
    Plan,
}

impl UploadKind {
    /// The word of its commands.
    pub fn word(self) -> &'static str {
        match self {
            Self::Table => "table",
            Self::Plan => "plan",
        }
    }

    pub(super) fn usage(self) -> &'static str {
        match self {
            Self::Table => {
                "table begin BYTES CRC32 RATE_HZ | frame NUMBER BYTES HEX CRC32 | commit | abort | show"
            }
            Self::Plan => {
                "plan begin BYTES CRC32 RATE_HZ | frame NUMBER BYTES HEX CRC32 | commit | abort | show"
            }
        }
    }

    pub(super) fn begin_usage(self) -> &'static str {
        match self {
            Self::Table => "table begin BYTES CRC32 RATE_HZ",
            Self::Plan => "plan begin BYTES CRC32 RATE_HZ",
        }
    }

    /// The bytes that it may have, and of what they are a multiple.
    fn lengths(self) -> (usize, usize, usize) {
        match self {
            Self::Table => (12, MAX_TABLE_BYTES, 4),
            Self::Plan => (PIECE_BYTES, MAX_PLAN_BYTES, PIECE_BYTES),
        }
    }
}

/// How much has come so far of what was announced.
#[derive(Debug)]
pub(super) struct Upload {
    kind: UploadKind,
    tick_rate: TickRate,
    length: usize,
    crc32: u32,
    /// Frames taken, and the CRC of the last, by which it is known when it comes again.
    frames: u32,
    last_crc32: u32,
}

/// Why an upload goes no further. What came before stays, and the frame may be sent again, unless told
/// otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum UploadError {
    /// None can have this length in bytes.
    Length {
        /// What.
        kind: UploadKind,
        /// The announced length.
        length: usize,
    },
    /// It is for another tick rate.
    Rate {
        /// What.
        kind: UploadKind,
        /// Its own, hertz.
        rate_hz: f64,
        /// The board's, hertz.
        tick_rate: TickRate,
    },
    /// `begin` was not sent, or not taken.
    NotBegun {
        /// What.
        kind: UploadKind,
    },
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
    /// More bytes than were announced.
    TooMuch {
        /// How many were announced.
        length: usize,
    },
    /// Bytes are missing.
    Incomplete {
        /// Bytes that came.
        received: usize,
        /// Bytes announced.
        length: usize,
    },
    /// Every frame was right, the whole is not: the upload is dropped.
    WholeDamaged {
        /// What.
        kind: UploadKind,
        /// The CRC that was announced.
        announced: u32,
        /// The CRC of what came.
        computed: u32,
    },
    /// The table came as it was sent and is none: the upload is dropped.
    Taps(TapsError),
    /// The plan came as it was sent and cannot be played: the upload is dropped.
    Plan(PlanError),
    /// `shaper.source` is `uploaded`, and nothing was.
    NoTable,
}

impl UploadError {
    /// The CODE of the refusal.
    pub(super) fn code(self) -> &'static str {
        match self {
            Self::FrameDamaged | Self::WholeDamaged { .. } => "crc",
            Self::NotBegun { .. }
            | Self::Sequence { .. }
            | Self::FrameLength { .. }
            | Self::TooMuch { .. }
            | Self::Incomplete { .. } => "frame",
            // There is room for no more of them.
            Self::Length { kind: UploadKind::Plan, length } if length > MAX_PLAN_BYTES => "memory",
            Self::Length { .. } | Self::Rate { .. } | Self::Taps(_) | Self::Plan(_) | Self::NoTable => {
                "range"
            }
        }
    }
}

impl fmt::Display for UploadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { kind: UploadKind::Plan, length } if *length > MAX_PLAN_BYTES => write!(
                f,
                "{} pieces of {PIECE_BYTES} bytes, there is room for {MAX_PIECES}; plan with fewer, or a shorter move",
                length.div_ceil(PIECE_BYTES)
            ),
            Self::Length { kind, length } => {
                let (least, most, unit) = kind.lengths();
                write!(
                    f,
                    "a {} of {length} bytes; give a multiple of {unit} from {least} to {most}",
                    kind.word()
                )
            }
            Self::Rate { kind: UploadKind::Plan, rate_hz, tick_rate } => write!(
                f,
                "made for {} Hz, the board ticks at {} Hz; plan it for that rate, or 'set tick.rate_hz'",
                Decimal(*rate_hz),
                Decimal(tick_rate.hz())
            ),
            Self::Rate { rate_hz, tick_rate, .. } => write!(
                f,
                "made for {} Hz, the board ticks at {} Hz; design it for that rate, 'set tick.rate_hz', or 'set shaper.source designed'",
                Decimal(*rate_hz),
                Decimal(tick_rate.hz())
            ),
            Self::NotBegun { kind } => {
                write!(f, "no upload under way; '{} begin' starts one", kind.word())
            }
            Self::Sequence { expected, found } => write!(f, "frame {expected} is next, not {found}"),
            Self::FrameLength { announced, found } => {
                write!(f, "the frame has {found} bytes, not {announced}; at most {MAX_FRAME_BYTES}")
            }
            Self::FrameDamaged => f.write_str("the frame's CRC does not match; send it again"),
            Self::TooMuch { length } => write!(f, "more than the {length} bytes announced"),
            Self::Incomplete { received, length } => write!(f, "{received} of {length} bytes have come"),
            Self::WholeDamaged { kind, announced, computed } => write!(
                f,
                "the {}'s CRC is 0x{computed:08x}, 0x{announced:08x} was announced; start again",
                kind.word()
            ),
            Self::Taps(error) => error.fmt(f),
            Self::Plan(error) => error.fmt(f),
            Self::NoTable => f.write_str("no table was uploaded; 'set shaper.source designed'"),
        }
    }
}

impl Upload {
    /// Expects so many bytes.
    pub(super) fn begin(
        kind: UploadKind,
        tick_rate: TickRate,
        length: usize,
        crc32: u32,
    ) -> Result<Self, UploadError> {
        let (least, most, unit) = kind.lengths();
        if !(least..=most).contains(&length) || !length.is_multiple_of(unit) {
            return Err(UploadError::Length { kind, length });
        }
        Ok(Self { kind, tick_rate, length, crc32, frames: 0, last_crc32: 0 })
    }

    /// Takes the next frame, or the last one again, whose acknowledgement may have been lost.
    pub(super) fn take(
        &mut self,
        sequence: u32,
        announced: usize,
        frame: &[u8],
        frame_crc32: u32,
        bytes: &mut PieceMemory,
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
        if frame.len() > self.length - bytes.len() || bytes.extend_from_slice(frame).is_err() {
            return Err(UploadError::TooMuch { length: self.length });
        }
        self.frames += 1;
        self.last_crc32 = frame_crc32;
        Ok(())
    }

    /// What is uploaded.
    pub(super) fn kind(&self) -> UploadKind {
        self.kind
    }

    /// Bytes announced.
    pub(super) fn length(&self) -> usize {
        self.length
    }

    /// The tick rate that it is for.
    pub(super) fn tick_rate(&self) -> TickRate {
        self.tick_rate
    }

    /// Whether these bytes are what was announced.
    pub(super) fn check(&self, bytes: &[u8]) -> Result<(), UploadError> {
        let (received, length) = (bytes.len(), self.length);
        if received != length {
            return Err(UploadError::Incomplete { received, length });
        }
        let computed = crc32(bytes);
        if computed != self.crc32 {
            return Err(UploadError::WholeDamaged { kind: self.kind, announced: self.crc32, computed });
        }
        Ok(())
    }
}
