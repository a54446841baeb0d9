//! A command that was designed elsewhere, as pieces of constant jerk, summed up in integers.
//!
//! With the jerk j of the piece, tick by tick: a += j, v += a, x += v. All are in units of 2⁻³⁸ nm per tick³,
//! tick² and tick, and nothing is rounded: x keeps what is finer than a [`FinePosition`]. So host and board
//! have the same positions to the last bit, and what rounding the jerks did is known to whoever chose them
//! (docs/derivations/motions.md, "Uploaded commands").

use heapless::Vec;

use super::fine::FinePosition;

/// Fractional bits of jerk, acceleration and velocity in nanometres per tick³, tick² and tick.
pub const FRACTION_BITS: u32 = 38;
/// What velocities have more of them than positions.
const FINER_BITS: u32 = FRACTION_BITS - FinePosition::FRACTION_BITS;

/// Bytes of a piece.
pub const PIECE_BYTES: usize = 12;
/// The most pieces of a command.
pub const MAX_PIECES: usize = 512;
/// The most bytes of a command.
pub const MAX_PLAN_BYTES: usize = MAX_PIECES * PIECE_BYTES;
/// The most ticks of a command, 33 s at 4 kHz: what the board can go through before it accepts it, without
/// keeping the console waiting.
pub const MAX_PLAN_TICKS: u32 = 1 << 17;

/// The bytes of a command.
pub type PieceMemory = Vec<u8, MAX_PLAN_BYTES>;

/// Some ticks of constant jerk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    /// How many, 1 or more.
    pub ticks: u32,
    /// The jerk in nanometres per tick³, [`FRACTION_BITS`] of them fractional.
    pub jerk: i64,
}

impl Piece {
    /// As it is uploaded: little endian, the ticks in four bytes and the jerk in eight.
    pub fn to_bytes(self) -> [u8; PIECE_BYTES] {
        let ([a, b, c, d], [e, f, g, h, i, j, k, l]) = (self.ticks.to_le_bytes(), self.jerk.to_le_bytes());
        [a, b, c, d, e, f, g, h, i, j, k, l]
    }

    /// The first piece of these bytes, and what follows it; `None` where there is no whole one.
    #[inline]
    pub fn read(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let (ticks, rest) = bytes.split_first_chunk()?;
        let (jerk, rest) = rest.split_first_chunk()?;
        Some((Self { ticks: u32::from_le_bytes(*ticks), jerk: i64::from_le_bytes(*jerk) }, rest))
    }
}

/// The sums on their way, from rest at zero.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PieceCourse {
    /// Where the next piece begins.
    next: usize,
    ticks_left: u32,
    jerk: i64,
    acceleration: i64,
    velocity: i64,
    position: i64,
    /// What of the position is finer than its unit.
    finer: i64,
}

impl PieceCourse {
    /// The position of the next tick of the command with these bytes; `None` after the last.
    #[inline]
    pub fn step(&mut self, bytes: &[u8]) -> Option<FinePosition> {
        if self.ticks_left == 0 {
            let (piece, _) = Piece::read(bytes.get(self.next..)?)?;
            (self.ticks_left, self.jerk) = (piece.ticks, piece.jerk);
            self.next += PIECE_BYTES;
        }
        // A piece of no ticks, which no checked command has, ends it.
        self.ticks_left = self.ticks_left.checked_sub(1)?;
        self.acceleration += self.jerk;
        self.velocity += self.acceleration;
        let moved = self.finer + self.velocity;
        self.finer = moved & ((1 << FINER_BITS) - 1);
        self.position += moved >> FINER_BITS;
        Some(FinePosition(self.position))
    }

    /// Jerk, acceleration and velocity of the last tick, in units of 2⁻³⁸ nm per tick³, tick² and tick.
    pub fn derivatives(&self) -> [i64; 3] {
        [self.jerk, self.acceleration, self.velocity]
    }
}
