//! The sine of a 32-bit phase in integers, for the interrupt.
//!
//! libm's `sinf` computes in `f64`, which the Cortex-M4F does in software; micromath's sine is off by up to
//! 10⁻³, which would put a third harmonic of −60 dB into every sweep. This polynomial is off by less than 5 ×
//! 10⁻⁹ and is smooth to that level too, so differences of sweeps are accelerations, not rounding.

/// One, in the result of [`sine`].
pub const ONE: i32 = 1 << BITS;

const BITS: u32 = 30;
/// A quarter turn.
const QUARTER: i32 = 1 << 30;
/// Half a turn, which as a signed phase is also minus half a turn.
const HALF: i32 = i32::MIN;

/// Taylor coefficients of sin(πx/2) for x¹³ down to x⁵: (π/2)^k / k! with alternating signs, each two bits
/// coarser than the one before, from Q42 on. What follows x¹³ is below 7 × 10⁻¹⁰.
const SMALL: [i32; 5] = [250_344, -3_956_970, 44_101_737, -321_727_694, 1_369_108_894];
/// That of x³, Q31.
const CUBIC: i32 = -1_387_197_337;
/// That of x, Q29.
const LINEAR: i32 = 843_314_857;

/// sin(2π · `phase` / 2³²) in Q30. The same bits on every machine.
#[inline]
pub fn sine(phase: u32) -> i32 {
    // Half a turn is folded over: sin(π − x) = sin x. Then −2³⁰ ..= 2³⁰ is a quarter turn each way.
    let turn = phase as i32;
    let x = if (-QUARTER..=QUARTER).contains(&turn) { turn } else { HALF.wrapping_sub(turn) };
    let magnitude = u64::from(x.unsigned_abs() << 1);
    // Q31 squared, less 32: Q30. Each product with it is two bits coarser than its other factor.
    let square = ((magnitude * magnitude) >> 32) as i32;
    let small = SMALL.into_iter().fold(0, |sum, coefficient| upper(sum, square) + coefficient);
    let sum = upper((upper(small, square) >> 1) + CUBIC, square) + LINEAR;
    // Q29 times Q30.
    ((i64::from(sum) * i64::from(x)) >> 29) as i32
}

/// The upper half of a product: one instruction.
#[inline]
fn upper(a: i32, b: i32) -> i32 {
    ((i64::from(a) * i64::from(b)) >> 32) as i32
}
