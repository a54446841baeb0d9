//! The mean of the last ticks, which makes a slope of the stairs that counts are.

use crate::motion::FinePosition;

/// A running mean over a power of two of ticks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Average {
    recent_nm: [i32; Self::MOST_TICKS],
    /// Of those that count.
    sum_nm: i64,
    /// The oldest of them.
    oldest: usize,
    bits: u32,
}

impl Average {
    /// The logarithm of the most ticks.
    pub const MOST_BITS: u32 = 6;
    /// The most ticks.
    pub const MOST_TICKS: usize = 1 << Self::MOST_BITS;

    /// Over 2^`bits` ticks, [`Self::MOST_BITS`] at most, in all of which it was at this position.
    pub fn new(bits: u32, position_nm: i32) -> Self {
        let bits = bits.min(Self::MOST_BITS);
        Self {
            recent_nm: [position_nm; Self::MOST_TICKS],
            sum_nm: i64::from(position_nm) << bits,
            oldest: 0,
            bits,
        }
    }

    /// As if it had been at this position in all ticks, in place: the stack has better things to hold.
    pub fn begin_at(&mut self, position_nm: i32) {
        self.recent_nm.fill(position_nm);
        self.sum_nm = i64::from(position_nm) << self.bits;
    }

    /// The mean with the position of this tick; exact.
    #[inline]
    pub fn step(&mut self, position_nm: i32) -> FinePosition {
        let ticks = 1_usize << self.bits;
        if let Some(oldest_nm) = self.recent_nm.get_mut(self.oldest) {
            self.sum_nm += i64::from(position_nm) - i64::from(core::mem::replace(oldest_nm, position_nm));
        }
        self.oldest = (self.oldest + 1) & (ticks - 1);
        FinePosition(self.sum_nm << (FinePosition::FRACTION_BITS - self.bits))
    }
}
