//! The sine of a 32-bit phase, for the interrupt.
//!
//! libm's `sinf` computes in `f64`, which the Cortex-M4F does in software; micromath's sine is off by up to
//! 10⁻³, which would put a third harmonic of −60 dB into every sweep. This polynomial is off by less than
//! 3 × 10⁻⁷ and takes six multiplications.

/// sin(2π · `phase` / 2³²). The same bits on every machine: IEEE single operations in a fixed order.
#[inline]
pub fn sine(phase: u32) -> f32 {
    // Half a turn is folded over: sin(π − x) = sin x. Then −2³⁰ ..= 2³⁰ is a quarter turn each way.
    let turn = phase as i32;
    let folded = if (-QUARTER..=QUARTER).contains(&turn) { turn } else { HALF.wrapping_sub(turn) };
    let x = folded as f32 * (1.0 / QUARTER as f32);
    let square = x * x;
    // Taylor coefficients of sin(πx/2): (π/2)^k / k! with alternating signs.
    let mut sum = -3.598_843e-6;
    sum = sum * square + 1.604_411_8e-4;
    sum = sum * square - 4.681_754e-3;
    sum = sum * square + 7.969_262_6e-2;
    sum = sum * square - 6.459_641e-1;
    sum = sum * square + 1.570_796_4;
    sum * x
}

/// A quarter turn.
const QUARTER: i32 = 1 << 30;
/// Half a turn, which as a signed phase is also minus half a turn.
const HALF: i32 = i32::MIN;
