//! The sine of a 32-bit phase in integers, for the interrupt.
//!
//! libm's `sinf` computes in `f64`, which the Cortex-M4F does in software; micromath's sine is off by up to 10⁻³, which would put a
//! third harmonic of −60 dB into every sweep. This polynomial is off by less than 5 × 10⁻⁹ and is smooth to that
//! level too, so differences of sweeps are accelerations, not rounding.

/// One, in the result of [`sine`].
pub const ONE: i32 = 1 << BITS;

const BITS: u32 = 30;
/// A quarter turn.
const QUARTER: i32 = 1 << 30;
/// Half a turn, which as a signed phase is also minus half a turn.
const HALF: i32 = i32::MIN;

/// Taylor coefficients of sin(πx/2) for x¹³ down to x: (π/2)^k / k! with alternating signs, Q30. What follows is below 7 × 10⁻¹⁰.
const COEFFICIENTS: [i32; 7] = [61, -3_864, 172_272, -5_026_995, 85_569_306, -693_598_668, 1_686_629_713];

/// sin(2π · `phase` / 2³²) in Q30. The same bits on every machine.
#[inline]
pub fn sine(phase: u32) -> i32 {
    // Half a turn is folded over: sin(π − x) = sin x. Then −2³⁰ ..= 2³⁰ is a quarter turn each way.
    let turn = phase as i32;
    let x = if (-QUARTER..=QUARTER).contains(&turn) { turn } else { HALF.wrapping_sub(turn) };
    let square = product(x, x);
    let sum = COEFFICIENTS.into_iter().fold(0, |sum, coefficient| product(sum, square) + coefficient);
    product(sum, x)
}

/// The product of two Q30 numbers, rounded.
#[inline]
fn product(a: i32, b: i32) -> i32 {
    ((i64::from(a) * i64::from(b) + (1 << (BITS - 1))) >> BITS) as i32
}
