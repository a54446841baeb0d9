//! A move with a trapezoidal velocity, exact at its end.
//!
//! A trapezoid of velocity is the convolution of two boxes of A ≤ B ticks. With v(n) = min(n, A, A + B − n)
//! and T(n) = v(1) + … + v(n), the move from x₀ over the distance D is
//!
//! > x(n) = x₀ + D T(n) / (A B),  n = 0 … A + B,
//!
//! because T(A + B) = A B. T is counted in integers, so there is no drift; the division is a multiplication
//! by a reciprocal that was computed with the plan. The peak velocity is D/B per tick and the acceleration
//! D/(A B) per tick²; a move too short to reach the velocity limit gets A = B, a triangle.

use super::MotionError;
use crate::units::{Nanometres, TickRate};

/// What a move may ask of the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MoveLimits {
    /// Largest velocity in mm/s, above zero.
    pub velocity_mm_s: f64,
    /// Largest acceleration in mm/s², above zero.
    pub acceleration_mm_s2: f64,
    /// First and last permitted position in mm.
    pub travel_mm: (f64, f64),
}

impl MoveLimits {
    /// Refuses a position outside the travel.
    ///
    /// # Errors
    /// [`MotionError::Travel`] with the position and the range.
    pub fn check_position(&self, position_mm: f64) -> Result<Nanometres, MotionError> {
        let refused = MotionError::Travel { position_mm, range_mm: self.travel_mm };
        if !(self.travel_mm.0..=self.travel_mm.1).contains(&position_mm) {
            return Err(refused);
        }
        Nanometres::from_mm(position_mm).ok_or(refused)
    }
}

/// A move in progress.
#[derive(Clone, Debug, PartialEq)]
pub struct MovePlan {
    from: Nanometres,
    to: Nanometres,
    /// A: how long the velocity rises, in ticks.
    rise_ticks: u32,
    /// B: after how many ticks it starts to fall.
    fall_tick: u32,
    /// ⌊2⁶⁴ / (A B)⌋.
    reciprocal: u64,
    tick: u32,
    /// v(n).
    velocity: u32,
    /// T(n).
    travelled: u64,
}

impl MovePlan {
    /// The longest move in ticks. It keeps A B below 2⁴⁸, so that the reciprocal has 16 bits or more to spare.
    const MAX_TICKS: f64 = 16.0e6;

    /// Plans the quickest trapezoid from `from` to `to_mm` within `limits`. A move of no distance takes no tick.
    ///
    /// # Errors
    /// [`MotionError`] when the target is outside the travel or the move would take over 16 million ticks.
    pub fn new(
        from: Nanometres,
        to_mm: f64,
        limits: &MoveLimits,
        tick_rate: TickRate,
    ) -> Result<Self, MotionError> {
        let to = limits.check_position(to_mm)?;
        let distance_mm = libm::fabs(to.to_mm() - from.to_mm());
        let velocity = limits.velocity_mm_s * tick_rate.period_s();
        let acceleration = limits.acceleration_mm_s2 * tick_rate.period_s() * tick_rate.period_s();
        let product = distance_mm / acceleration;
        let fall = libm::ceil(distance_mm / velocity).max(1.0);
        let rise = libm::ceil(product / fall);
        let (rise, fall) = if rise <= fall {
            (rise.max(1.0), fall)
        } else {
            let both = libm::ceil(libm::sqrt(product));
            (both, both)
        };
        let ticks = rise + fall;
        if !ticks.is_finite() || ticks > Self::MAX_TICKS {
            return Err(MotionError::TooLong { seconds: ticks * tick_rate.period_s() });
        }
        let (rise_ticks, fall_tick) = (rise as u32, fall as u32);
        let area = u64::from(rise_ticks) * u64::from(fall_tick);
        let reciprocal = u64::MAX / area;
        let tick = if from == to { rise_ticks + fall_tick } else { 0 };
        Ok(Self { from, to, rise_ticks, fall_tick, reciprocal, tick, velocity: 0, travelled: 0 })
    }

    /// How many ticks the move takes from its start to the tick that reaches the target.
    pub fn duration_ticks(&self) -> u32 {
        if self.from == self.to { 0 } else { self.rise_ticks + self.fall_tick }
    }

    /// Where the move ends.
    pub fn target(&self) -> Nanometres {
        self.to
    }

    /// The position of the next tick; `None` once the target has been reached.
    #[inline]
    pub fn step(&mut self) -> Option<Nanometres> {
        let end = self.rise_ticks + self.fall_tick;
        if self.tick >= end {
            return None;
        }
        self.tick += 1;
        if self.tick == end {
            return Some(self.to);
        }
        if self.tick <= self.rise_ticks {
            self.velocity += 1;
        }
        if self.tick > self.fall_tick {
            self.velocity -= 1;
        }
        self.travelled += u64::from(self.velocity);
        // T < A B here, so the product stays below 2⁶⁴; its upper half is T / (A B) in Q32.
        let fraction = (self.travelled * self.reciprocal) >> 32;
        let distance_nm = i64::from(self.to.0) - i64::from(self.from.0);
        let offset_nm = (distance_nm * fraction as i64 + (1 << 31)) >> 32;
        Some(Nanometres(self.from.0 + offset_nm as i32))
    }
}
