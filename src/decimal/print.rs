//! Printing.

use core::cmp::Ordering;
use core::fmt::{self, Write};

use heapless::Vec;

use super::big::Big;
use super::{LEAST_EXPONENT, STORED_BITS};

/// The most digits after the point that can be asked for.
pub const MAX_PRECISION: usize = 40;
/// The most digits of a number below 2¹⁰²⁴ in units of 10⁻⁴⁰.
const MAX_DIGITS: usize = 352;

/// Prints as `core` prints the number: with the fewest digits that read back as the same number, or with as
/// many after the point as the format asks for, at most [`MAX_PRECISION`], rounded to even where it is half
/// way. Never with an exponent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decimal(pub f64);

impl fmt::Display for Decimal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_nan() {
            return f.write_str("NaN");
        }
        if self.0.is_sign_negative() {
            f.write_str("-")?;
        }
        if self.0.is_infinite() {
            return f.write_str("inf");
        }
        let (significand, exponent) = parts(self.0);
        match f.precision() {
            Some(precision) => fixed(significand, exponent, precision.min(MAX_PRECISION), f),
            None if significand == 0 => f.write_str("0"),
            None => shortest(significand, exponent, f),
        }
    }
}

/// Significand and exponent of the magnitude of a finite number.
fn parts(number: f64) -> (u64, i32) {
    let bits = number.abs().to_bits();
    let (stored, fraction) = ((bits >> STORED_BITS) as i32, bits & ((1 << STORED_BITS) - 1));
    match stored {
        0 => (fraction, LEAST_EXPONENT),
        _ => (fraction | 1 << STORED_BITS, stored - 1 + LEAST_EXPONENT),
    }
}

/// In units of 10^-`precision`, rounded.
fn fixed(significand: u64, exponent: i32, precision: usize, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let mut units = Big::new(significand);
    for _ in 0..precision {
        units.multiply_add(10, 0);
    }
    if exponent >= 0 {
        units.shift(exponent.unsigned_abs());
    } else {
        units.shift_down_rounding(exponent.unsigned_abs());
    }
    let mut digits = Vec::<u8, MAX_DIGITS>::new();
    while !units.is_zero() || digits.len() <= precision {
        // There is room for all.
        if digits.push(units.divide(10) as u8).is_err() {
            break;
        }
    }
    digits.reverse();
    let point = (digits.len() - precision) as i32;
    write(&digits, point, f)
}

/// The shortest digits that lie nearer to the number than to its neighbours, and the nearest of these (G. L.
/// Steele Jr., J. L. White, "How to print floating-point numbers accurately", 1990).
fn shortest(significand: u64, exponent: i32, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    // Below a power of two the neighbour is half as far.
    let uneven = significand == 1 << STORED_BITS && exponent > LEAST_EXPONENT;
    let fine = if uneven { 2 } else { 1 };
    let mut rest = Big::new(significand << fine);
    let (mut below, mut above) = (Big::new(1), Big::new(1 << (fine - 1)));
    let mut one = Big::new(1);
    let exponent = exponent - fine;
    if exponent >= 0 {
        for big in [&mut rest, &mut below, &mut above] {
            big.shift(exponent.unsigned_abs());
        }
    } else {
        one.shift(exponent.unsigned_abs());
    }
    // Half way counts where reading rounds to this number, the even one.
    let limit = if significand.is_multiple_of(2) { Ordering::Greater } else { Ordering::Equal };
    let reaches_one = |rest: &Big, above: &Big, one: &Big, factor| {
        let mut upper = rest.clone();
        upper.add(above);
        upper.multiply_add(factor, 0);
        one.compare(&upper) < limit
    };
    let tenfold = |rest: &mut Big, below: &mut Big, above: &mut Big| {
        for big in [rest, below, above] {
            big.multiply_add(10, 0);
        }
    };
    // The digits are those of 0.ddd·10^point.
    let mut point = 0;
    while reaches_one(&rest, &above, &one, 1) {
        one.multiply_add(10, 0);
        point += 1;
    }
    while !reaches_one(&rest, &above, &one, 10) {
        tenfold(&mut rest, &mut below, &mut above);
        point -= 1;
    }
    let mut digits = Vec::<u8, 17>::new();
    loop {
        tenfold(&mut rest, &mut below, &mut above);
        let mut digit = 0;
        while one.compare(&rest) != Ordering::Greater {
            rest.subtract(&one);
            digit += 1;
        }
        let down = rest.compare(&below) < limit;
        let up = reaches_one(&rest, &above, &one, 1);
        let mut twice = rest.clone();
        twice.shift(1);
        // Where the digit above is as short, the nearer one; it is never ten, or a digit less would have
        // done.
        let digit = digit + u8::from(up && (!down || twice.compare(&one) != Ordering::Less));
        // Seventeen are always enough.
        if digits.push(digit).is_err() || down || up {
            break;
        }
    }
    write(&digits, point, f)
}

/// Writes 0.ddd·10^`point`.
fn write(digits: &[u8], point: i32, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let mut places = 0..point.max(digits.len() as i32);
    if point <= 0 {
        f.write_str("0.")?;
        places.start = point;
    }
    for place in places {
        if place == point && point > 0 {
            f.write_str(".")?;
        }
        let digit = usize::try_from(place).ok().and_then(|place| digits.get(place));
        f.write_char(char::from(b'0' + digit.unwrap_or(&0)))?;
    }
    Ok(())
}
