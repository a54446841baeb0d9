//! Reading.

use core::cmp::Ordering;

use super::big::Big;
use super::{LEAST_EXPONENT, STORED_BITS};

/// The most digits that are read, leading zeros not counted.
pub const MAX_DIGITS: u32 = 200;

/// Bits of a quotient, of which rounding leaves 53.
const QUOTIENT_BITS: u32 = 64;

/// Reads what `str::parse` reads of an `f64`, and as that rounds it: to the nearest, to even where it is half
/// way; too large is infinite. `None` for anything else, and for more than [`MAX_DIGITS`] digits.
pub fn parse(text: &str) -> Option<f64> {
    let magnitude = text.strip_prefix(['+', '-']).unwrap_or(text);
    let value = match magnitude {
        word if ["inf", "infinity"].iter().any(|name| word.eq_ignore_ascii_case(name)) => f64::INFINITY,
        word if word.eq_ignore_ascii_case("nan") => f64::NAN,
        digits => number(digits.as_bytes())?,
    };
    Some(if text.starts_with('-') { -value } else { value })
}

/// Digits, perhaps with a point among them and an exponent after them.
fn number(text: &[u8]) -> Option<f64> {
    let mut digits = Big::new(0);
    let (mut count, mut exponent, mut any, mut point) = (0, 0, false, false);
    let mut rest = text.iter();
    while let Some(character) = rest.next() {
        match character {
            b'0'..=b'9' => {
                digits.multiply_add(10, u32::from(character - b'0'));
                any = true;
                exponent -= i32::from(point);
                count += u32::from(!digits.is_zero());
                if count > MAX_DIGITS {
                    return None;
                }
            }
            b'.' if !point => point = true,
            b'e' | b'E' if any => {
                exponent = exponent.saturating_add(signed(rest.as_slice())?);
                break;
            }
            _ => return None,
        }
    }
    any.then(|| nearest(digits, count as i32, exponent))
}

/// An exponent; one that is far too large may be any such.
fn signed(text: &[u8]) -> Option<i32> {
    let (sign, digits) = match text {
        [b'-', digits @ ..] => (-1, digits),
        [b'+', digits @ ..] | digits => (1, digits),
    };
    let value = digits.iter().try_fold(0_i32, |value, digit| {
        let digit = char::from(*digit).to_digit(10)?;
        Some(value.saturating_mul(10).saturating_add(digit as i32))
    })?;
    (!digits.is_empty()).then_some(sign * value)
}

/// The `f64` next to the digits, of which there are `count`, times a power of ten.
fn nearest(mut digits: Big, count: i32, exponent: i32) -> f64 {
    // Above 10³⁰⁹ and below 10⁻³²⁴; what comes after works with whole numbers below 2¹³³⁵.
    let magnitude = exponent.saturating_add(count);
    if digits.is_zero() || magnitude < -324 {
        return 0.0;
    }
    if magnitude > 310 {
        return f64::INFINITY;
    }
    let mut divisor = Big::new(1);
    let fives = if exponent < 0 { &mut divisor } else { &mut digits };
    fives.multiply_by_five_to(exponent.unsigned_abs());
    // Both get the same length; then the quotient is from a half to two.
    let longer = digits.bits() as i32 - divisor.bits() as i32;
    if longer < 0 { &mut digits } else { &mut divisor }.shift(longer.unsigned_abs());
    let mut scale = exponent + longer;
    if digits.compare(&divisor) == Ordering::Less {
        digits.shift(1);
        scale -= 1;
    }
    let mut quotient = 0_u64;
    for _ in 0..QUOTIENT_BITS {
        quotient <<= 1;
        if digits.compare(&divisor) != Ordering::Less {
            digits.subtract(&divisor);
            quotient |= 1;
        }
        digits.shift(1);
    }
    assemble(quotient, scale + 1 - QUOTIENT_BITS as i32, !digits.is_zero())
}

/// quotient·2^scale, a little more if there is a `rest`, rounded. The quotient's first bit is one.
fn assemble(quotient: u64, scale: i32, rest: bool) -> f64 {
    // Bits to drop: what 53 leave, or more where the last place has the least exponent.
    let normal = QUOTIENT_BITS as i32 - 1 - STORED_BITS as i32;
    let dropped = normal.max(LEAST_EXPONENT - scale);
    if dropped > QUOTIENT_BITS as i32 {
        return 0.0;
    }
    let kept = quotient.checked_shr(dropped.unsigned_abs()).unwrap_or_default();
    let half = 1 << (dropped - 1);
    let below = quotient & (half | (half - 1));
    let up = match below.cmp(&half) {
        Ordering::Less => false,
        Ordering::Equal => rest || !kept.is_multiple_of(2),
        Ordering::Greater => true,
    };
    // What rounding carries over, and the first bit itself, count up the stored exponent.
    let exponent = scale + dropped - LEAST_EXPONENT;
    if exponent > 2045 {
        return f64::INFINITY;
    }
    f64::from_bits(((exponent.unsigned_abs() as u64) << STORED_BITS) + kept + u64::from(up))
}
