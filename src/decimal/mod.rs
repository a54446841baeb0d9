//! Numbers as people read and write them: exactly what `core` prints and reads, in a tenth of its code.
//!
//! `core` is fast: it has tables of powers of five and of ten, two methods for each way of printing, and all
//! that again for `f32`, 30 KB on the board. A console has time. Here whole numbers of any length do
//! everything ([`big`]), at about as many microseconds as the serial port needs for the digits.
//! `golden_decimal` compares every bit and every character with `core`.

mod big;
mod parse;
mod print;

pub use parse::{MAX_DIGITS, parse};
pub use print::{Decimal, MAX_PRECISION};

/// Bits of the significand that are stored.
const STORED_BITS: u32 = 52;
/// The exponent of the last place of numbers with the stored exponent 1, and of those below them, which have
/// 0.
const LEAST_EXPONENT: i32 = -1074;
