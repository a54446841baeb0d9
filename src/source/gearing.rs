//! Electronic gearing without a remainder that gets lost.

use crate::motion::upper_product;

/// So many nanometres for so many counts: a ratio of two whole numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gearing {
    /// Whole nanometres of one count, rounded down.
    whole_nm: i32,
    /// What is left of them, in parts of `counts`.
    part: u32,
    counts: u32,
    /// ⌊(2⁶⁴ − 1) / `counts`⌋.
    inverse: u64,
}

impl Gearing {
    /// The largest of either number.
    pub const MOST: i32 = 1_000_000_000;
    /// The most that one count may be: a millimetre.
    pub const MOST_NM_PER_COUNT: u32 = 1_000_000;

    /// `nanometres` for `counts`; negative for the other direction. `None` where a number is zero or too
    /// large, or one count would be more than [`Self::MOST_NM_PER_COUNT`].
    pub fn new(nanometres: i32, counts: u32) -> Option<Self> {
        let most = Self::MOST.unsigned_abs();
        let size = nanometres.unsigned_abs();
        let numbers = size != 0 && counts != 0 && size <= most && counts <= most;
        if !numbers || u64::from(size) > u64::from(counts) * u64::from(Self::MOST_NM_PER_COUNT) {
            return None;
        }
        let divisor = counts.cast_signed();
        Some(Self {
            whole_nm: nanometres.div_euclid(divisor),
            part: nanometres.rem_euclid(divisor).unsigned_abs(),
            counts,
            inverse: u64::MAX / u64::from(counts),
        })
    }

    /// The most that the command moves with one count, in nanometres.
    pub fn most_nm_per_count(&self) -> u32 {
        let up = i64::from(self.whole_nm) + i64::from(self.part != 0);
        // Within a millimetre by `new`.
        self.whole_nm.unsigned_abs().max(up.unsigned_abs() as u32)
    }
}

/// Counts on their way through a gearing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Geared {
    gearing: Gearing,
    /// What all counts so far have left over, in parts of `counts`: 0 or more, and less than that.
    rest: u32,
}

/// Added to all counts of a tick, so that what is divided is never negative; more than a 16-bit counter
/// moves.
const BIAS: i64 = 1 << 16;

impl Geared {
    /// With nothing left over.
    pub fn new(gearing: Gearing) -> Self {
        Self { gearing, rest: 0 }
    }

    /// The nanometres of these counts, less than 2¹⁶ either way. After any number of calls the sum of what
    /// they returned is ⌊counts · nanometres / counts of the gearing⌋ of the sum of the counts.
    #[inline]
    pub fn advance(&mut self, counts: i32) -> i64 {
        let Gearing { whole_nm, part, counts: divisor, inverse } = self.gearing;
        let whole = i64::from(counts) * i64::from(whole_nm);
        if part == 0 {
            return whole;
        }
        let divisor = u64::from(divisor);
        let biased =
            i64::from(self.rest) + i64::from(counts) * i64::from(part) + BIAS * divisor.cast_signed();
        let biased = biased.cast_unsigned();
        // Below 2⁴⁸, so the inverse is off by less than one here, downwards.
        let mut quotient = upper_product(biased, inverse);
        let mut rest = biased - quotient * divisor;
        if rest >= divisor {
            quotient += 1;
            rest -= divisor;
        }
        self.rest = rest as u32;
        whole + (quotient.cast_signed() - BIAS)
    }
}
