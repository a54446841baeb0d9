//! Trapezoid and S-curve: a velocity that is the convolution of boxes, counted in integers.
//!
//! Let A ≤ B ≤ C ticks be the lengths of three boxes of ones and v(n) their convolution, T(n) = v(1) + … +
//! v(n). Then T ends at A B C, and the move over the distance D is
//!
//! > x(n) = x₀ + D T(n) / (A B C),  n = 1 … A + B + C − 1.
//!
//! Its differences are the boxes': velocity at most D/C per tick, acceleration D/(B C), jerk D/(A B C) where
//! C ≥ A + B. With A = 1 it is a trapezoid. The quickest move within limits of velocity, acceleration and
//! jerk has seven segments of constant jerk, and each of its degenerate forms is such a convolution too: B =
//! A without a segment of constant acceleration, C = A + B without one of constant velocity
//! (docs/derivations/motions.md).
//!
//! T is counted exactly, so nothing drifts however long the move takes. It is counted in units that make A B
//! C fill 64 bits, so one multiplication by a factor computed with the plan gives the position.

use super::fine::{FinePosition, upper_product};
use crate::elementary::cube_root;

/// Limits per tick, in nanometres.
#[derive(Clone, Copy, Debug)]
pub(super) struct PerTick {
    pub(super) velocity: f64,
    pub(super) acceleration: f64,
    pub(super) jerk: f64,
}

/// The lengths of the boxes in ticks, shortest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Boxes {
    jerk: u32,
    acceleration: u32,
    velocity: u32,
}

impl Boxes {
    /// The longest move in ticks of each kind. They keep the product of the lengths below 2⁶³.
    const MAX_TICKS: (f64, f64) = (16.0e6, 5.0e6);

    /// The shortest boxes of a trapezoid over `distance_nm` > 0.
    ///
    /// # Errors
    /// The number of ticks when it is too large.
    pub(super) fn trapezoid(distance_nm: f64, limits: PerTick) -> Result<Self, f64> {
        let product = distance_nm / limits.acceleration;
        let fall = libm::ceil(distance_nm / limits.velocity).max(1.0);
        let rise = libm::ceil(product / fall).max(1.0);
        let (rise, fall) = if rise <= fall {
            (rise, fall)
        } else {
            let both = libm::ceil(libm::sqrt(product));
            (both, both)
        };
        Self::counted(1.0, rise, fall, Self::MAX_TICKS.0)
    }

    /// The shortest boxes of an S-curve over `distance_nm` > 0, up to rounding each to whole ticks.
    ///
    /// # Errors
    /// The number of ticks when it is too large.
    pub(super) fn s_curve(distance_nm: f64, limits: PerTick) -> Result<Self, f64> {
        let PerTick { velocity, acceleration, jerk } = limits;
        let (short, middle) = real_lengths(distance_nm, limits);
        let short = libm::ceil(short).max(1.0);
        let middle = libm::ceil(middle).max(short);
        let long = (short + middle)
            .max(libm::ceil(distance_nm / velocity))
            .max(libm::ceil(distance_nm / (acceleration * middle)))
            .max(libm::ceil(distance_nm / (jerk * short * middle)));
        Self::counted(short, middle, long, Self::MAX_TICKS.1)
    }

    fn counted(short: f64, middle: f64, long: f64, most: f64) -> Result<Self, f64> {
        let ticks = short + middle + long - 1.0;
        if !ticks.is_finite() || ticks > most {
            return Err(ticks);
        }
        Ok(Self { jerk: short as u32, acceleration: middle as u32, velocity: long as u32 })
    }

    /// From the start to the tick that reaches the target.
    pub(super) fn duration_ticks(self) -> u32 {
        self.jerk + self.acceleration + self.velocity - 1
    }
}

/// The two shorter boxes of the quickest S-curve, in ticks and fractions.
fn real_lengths(distance: f64, limits: PerTick) -> (f64, f64) {
    let PerTick { velocity, acceleration, jerk } = limits;
    // As if the limit of velocity were reached; without constant acceleration where that limit is not.
    let mut short = acceleration / jerk;
    let mut middle = velocity / acceleration;
    if middle < short {
        short = libm::sqrt(velocity / jerk);
        middle = short;
    }
    if distance / velocity >= short + middle {
        return (short, middle);
    }
    // It is not: the longest box is as long as both others. D = a m (s + m), or D = 2 j s³.
    short = acceleration / jerk;
    middle = 0.5 * (libm::sqrt(short * short + 4.0 * distance / acceleration) - short);
    if middle < short {
        short = cube_root(0.5 * distance / jerk);
        middle = short;
    }
    (short, middle)
}

/// A convolution of boxes on its way.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BoxCourse {
    boxes: Boxes,
    /// One, in units of 2^-shift that make the product of the lengths fill 64 bits.
    unit: u64,
    /// D in fine units, times 2⁶⁴ over the product of the lengths in those units.
    factor: u64,
    acceleration: u64,
    velocity: u64,
    travelled: u64,
}

impl BoxCourse {
    /// A course over a distance of `distance_nm`, not negative.
    pub(super) fn new(boxes: Boxes, distance_nm: u32) -> Self {
        let product = u64::from(boxes.jerk) * u64::from(boxes.acceleration) * u64::from(boxes.velocity);
        let shift = product.leading_zeros();
        // Off by 2⁻⁵² of itself, at most 2⁻²¹ nm at the end of two metres.
        let factor = libm::scalbn(
            f64::from(distance_nm) / product as f64,
            64 - shift as i32 + FinePosition::FRACTION_BITS as i32,
        );
        Self { boxes, unit: 1 << shift, factor: factor as u64, acceleration: 0, velocity: 0, travelled: 0 }
    }

    /// What has been travelled after `tick` ticks, which counts from one and is before the last.
    #[inline]
    pub(super) fn step(&mut self, tick: u32) -> FinePosition {
        let Boxes { jerk, acceleration, velocity } = self.boxes;
        let tick = tick - 1;
        // Whether the jerk that starts there acts now. Before it starts the difference wraps to something
        // large.
        let acts = |start: u32| tick.wrapping_sub(start) < jerk;
        let rises = u64::from(acts(0)) + u64::from(acts(acceleration + velocity));
        let falls = u64::from(acts(acceleration)) + u64::from(acts(velocity));
        let change = rises.wrapping_sub(falls).wrapping_mul(self.unit);
        self.acceleration = self.acceleration.wrapping_add(change);
        self.velocity = self.velocity.wrapping_add(self.acceleration);
        self.travelled = self.travelled.wrapping_add(self.velocity);
        FinePosition(upper_product(self.travelled, self.factor) as i64)
    }
}
