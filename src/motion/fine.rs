//! Positions finer than a nanometre, and the one multiplication that plans are stepped with.
//!
//! A plan yields positions in 2⁻²⁴ nm; only what leaves the motion is rounded to the nanometre. Differences
//! of three successive positions are then velocity and acceleration to 10⁻⁶ nm per tick and tick², good
//! enough for a controlled stop to go on from.

use core::ops::{Add, Sub};

use crate::units::Nanometres;

/// A position, or a difference of positions, in 2⁻²⁴ nm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct FinePosition(pub i64);

impl FinePosition {
    /// How many of the bits are fractions of a nanometre.
    pub const FRACTION_BITS: u32 = 24;

    /// The nearest whole nanometre.
    #[inline]
    pub fn rounded(self) -> Nanometres {
        Nanometres(((self.0 + (1 << (Self::FRACTION_BITS - 1))) >> Self::FRACTION_BITS) as i32)
    }
}

impl From<Nanometres> for FinePosition {
    #[inline]
    fn from(whole: Nanometres) -> Self {
        Self(i64::from(whole.0) << Self::FRACTION_BITS)
    }
}

impl Add for FinePosition {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl Sub for FinePosition {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

/// ⌊a b / 2⁶⁴⌋.
#[inline]
pub(crate) fn upper_product(a: u64, b: u64) -> u64 {
    ((u128::from(a) * u128::from(b)) >> 64) as u64
}

/// A length in mm as units of 2⁻²⁴ nm, rounded towards zero.
pub(super) fn fine_units(millimetres: f64) -> i64 {
    libm::scalbn(millimetres * 1.0e6, FinePosition::FRACTION_BITS as i32) as i64
}
