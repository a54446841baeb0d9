//! Whole numbers of any length that printing and reading an `f64` takes.

use core::cmp::Ordering;

/// 1408 bits: the largest number that a significand and a power of ten of an `f64` make has 1335
/// ([`super::parse()`]).
const WORDS: usize = 44;

/// A whole number, not negative. What does not fit is cut off above; no caller gets there.
#[derive(Clone, Debug)]
pub(super) struct Big {
    /// The least significant first; those from `used` on are zero.
    words: [u32; WORDS],
    used: usize,
}

impl Big {
    pub(super) fn new(value: u64) -> Self {
        let mut big = Self { words: [0; WORDS], used: 0 };
        for (word, half) in big.words.iter_mut().zip([value as u32, (value >> 32) as u32]) {
            *word = half;
        }
        big.used = 2;
        big.trim();
        big
    }

    pub(super) fn is_zero(&self) -> bool {
        self.used == 0
    }

    /// Bits without leading zeros.
    pub(super) fn bits(&self) -> u32 {
        let last = self.digits().last().copied().unwrap_or_default();
        // Below 1408.
        32 * self.used as u32 - last.leading_zeros() * u32::from(self.used > 0)
    }

    /// The lower 64 bits.
    pub(super) fn low(&self) -> u64 {
        let [low, high, ..] = self.words;
        u64::from(high) << 32 | u64::from(low)
    }

    fn digits(&self) -> &[u32] {
        self.words.get(..self.used).unwrap_or_default()
    }

    fn trim(&mut self) {
        let zeros = self.digits().iter().rev().take_while(|word| **word == 0).count();
        self.used -= zeros;
    }

    /// Multiplies by `factor` and adds `summand`.
    pub(super) fn multiply_add(&mut self, factor: u32, summand: u32) {
        let mut carry = u64::from(summand);
        for word in self.words.iter_mut().take(self.used) {
            carry += u64::from(*word) * u64::from(factor);
            *word = carry as u32;
            carry >>= 32;
        }
        if let Some(word) = self.words.get_mut(self.used)
            && carry > 0
        {
            *word = carry as u32;
            self.used += 1;
        }
        self.trim();
    }

    /// Multiplies by the power of five; with a shift by as much, that is a power of ten.
    pub(super) fn multiply_by_five_to(&mut self, power: u32) {
        for _ in 0..power {
            self.multiply_add(5, 0);
        }
    }

    /// Shifts to the left.
    pub(super) fn shift(&mut self, bits: u32) {
        let (words, bits) = ((bits / 32) as usize, bits % 32);
        self.multiply_add(1 << bits, 0);
        let used = (self.used + words).min(WORDS);
        if let Some(all) = self.words.get_mut(..used) {
            all.rotate_right(words.min(used));
        }
        self.used = used;
        self.trim();
    }

    /// Divides by `divisor`, which is not zero, and returns the remainder.
    pub(super) fn divide(&mut self, divisor: u32) -> u32 {
        let mut rest = 0;
        for word in self.words.iter_mut().take(self.used).rev() {
            let dividend = rest << 32 | u64::from(*word);
            *word = dividend.checked_div(u64::from(divisor)).unwrap_or_default() as u32;
            rest = dividend - u64::from(*word) * u64::from(divisor);
        }
        self.trim();
        rest as u32
    }

    /// Subtracts what is not larger.
    pub(super) fn subtract(&mut self, other: &Self) {
        let mut borrow = 0;
        for (word, others) in self.words.iter_mut().zip(other.words).take(self.used) {
            let difference = i64::from(*word) - i64::from(others) + borrow;
            *word = difference as u32;
            borrow = difference >> 32;
        }
        self.trim();
    }

    pub(super) fn add(&mut self, other: &Self) {
        let mut carry = 0;
        self.used = (self.used.max(other.used) + 1).min(WORDS);
        for (word, others) in self.words.iter_mut().zip(other.words).take(self.used) {
            carry += u64::from(*word) + u64::from(others);
            *word = carry as u32;
            carry >>= 32;
        }
        self.trim();
    }

    pub(super) fn compare(&self, other: &Self) -> Ordering {
        self.used.cmp(&other.used).then_with(|| self.digits().iter().rev().cmp(other.digits().iter().rev()))
    }

    /// Shifts to the right and rounds, to even where it is half way.
    pub(super) fn shift_down_rounding(&mut self, bits: u32) {
        let Some(before) = bits.checked_sub(1) else { return };
        let mut rest = false;
        let (words, bits) = ((before / 32) as usize, before % 32);
        for place in 0..words.min(self.used) {
            rest |= self.words.get(place).is_some_and(|word| *word != 0);
        }
        let kept = self.used.saturating_sub(words);
        self.words.copy_within(words.min(self.used)..self.used, 0);
        self.words.iter_mut().skip(kept).for_each(|word| *word = 0);
        self.used = kept;
        rest |= self.divide(1 << bits) != 0;
        let half = self.divide(2) != 0;
        if half && (rest || !self.low().is_multiple_of(2)) {
            self.add(&Self::new(1));
        }
    }
}
