//! Sine sweeps of the position, for identification.
//!
//! The phase is a 64-bit fraction of a turn and advances every tick by the instantaneous frequency, which
//! itself advances by a constant (linear sweep, eq. 33) or by a constant fraction of itself (exponential
//! sweep, eq. 34). The frequency thus *is* the derivative of the phase; the usual mistake, sin(2π f(t) t),
//! sweeps at the wrong rate. The amplitude rises and falls smoothly at both ends, so that the sweep starts
//! and ends at rest, where it started.
//!
//! A constant acceleration needs a position amplitude with 1/f². From tick to tick it changes by
//! (f(n)/f(n+1))², a factor that is constant in an exponential sweep; in a linear one the interrupt needs
//! 1/f, for which micromath gives a first guess (off by up to 12.5 %) and three of Newton's steps the rest,
//! off by 2·10⁻⁷: no division. The error goes into the *change* of the amplitude only.

use micromath::F32Ext;

use super::fine::{FinePosition, fine_units, upper_product};
use super::sine::sine;
use super::sweep_spec::{CheckedSweep, SweepKind, SweepSpec};
use super::taper::Taper;
use super::{MotionContext, MotionError};
use crate::units::Nanometres;

/// How a quantity changes from tick to tick.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Advance {
    /// Adds this.
    By(i64),
    /// Adds this fraction of itself, in 2⁻⁶⁴.
    Up(u64),
    /// Takes away this fraction of itself, in 2⁻⁶⁴.
    Down(u64),
}

/// How the amplitude follows the frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
enum AmplitudeLaw {
    /// Not at all, or by a constant fraction.
    Steady(Advance),
    /// As 1/f², while the frequency, in 2⁻³² turns per tick, changes by this per tick.
    InverseSquare {
        /// The change, with its sign.
        change: f32,
        /// 2 to the power of the next.
        scale: f32,
        /// The fraction's fractional bits, so many that its largest value uses its 32 bits.
        bits: u32,
    },
}

/// A sweep in progress.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepPlan {
    centre: Nanometres,
    ticks_left: u32,
    elapsed: u32,
    taper: Taper,
    /// So that the largest one fills 62 bits.
    amplitude: u64,
    law: AmplitudeLaw,
    /// What the upper half of the amplitude times a sine in Q30 has to lose to be in fine units.
    shift: u32,
    /// In 2⁻⁶⁴ turns.
    phase: u64,
    /// In 2⁻⁶⁴ turns per tick.
    phase_step: u64,
    advance: Advance,
}

impl SweepPlan {
    /// Plans a sweep around where the command is.
    ///
    /// # Errors
    /// [`MotionError`] names the parameter outside its range, or the limit of travel, velocity, acceleration
    /// or jerk that the sweep would break.
    pub fn new(spec: &SweepSpec, context: &MotionContext) -> Result<Self, MotionError> {
        let CheckedSweep { ticks, taper, first_mm, largest_mm, falls_with_square } = spec.check(context)?;
        let step_of = |hz: f64| libm::scalbn(hz * context.rate.period_s(), 64);
        let count = f64::from(ticks);
        let growth = libm::log(spec.to_hz / spec.from_hz) / count;
        let change = (step_of(spec.to_hz) - step_of(spec.from_hz)) / count;
        let (advance, law) = match (spec.kind, falls_with_square) {
            (SweepKind::Linear, false) => (Advance::By(change as i64), AmplitudeLaw::Steady(Advance::By(0))),
            (SweepKind::Linear, true) => {
                let lowest = step_of(spec.from_hz.min(spec.to_hz));
                (Advance::By(change as i64), AmplitudeLaw::inverse_square(change, lowest))
            }
            (SweepKind::Exponential, false) => {
                (Advance::by_ratio(growth), AmplitudeLaw::Steady(Advance::By(0)))
            }
            (SweepKind::Exponential, true) => {
                (Advance::by_ratio(growth), AmplitudeLaw::Steady(Advance::by_ratio(-2.0 * growth)))
            }
        };
        // At most 62: the largest amplitude is above a nanometre.
        let spare = fine_units(largest_mm).leading_zeros().saturating_sub(2);
        Ok(Self {
            centre: context.start,
            ticks_left: ticks,
            elapsed: 0,
            taper,
            amplitude: libm::scalbn(first_mm * 1.0e6, FinePosition::FRACTION_BITS as i32 + spare as i32)
                as u64,
            law,
            shift: (spare + 30).saturating_sub(32),
            phase: 0,
            phase_step: step_of(spec.from_hz) as u64,
            advance,
        })
    }

    /// How many ticks the sweep takes from its start.
    pub fn duration_ticks(&self) -> u32 {
        self.elapsed + self.ticks_left
    }

    /// The position of the next tick; `None` after the last one, which is the centre again.
    #[inline]
    pub fn step(&mut self) -> Option<FinePosition> {
        self.ticks_left = self.ticks_left.checked_sub(1)?;
        self.elapsed += 1;
        let centre = FinePosition::from(self.centre);
        if self.ticks_left == 0 {
            return Some(centre);
        }
        self.phase = self.phase.wrapping_add(self.phase_step);
        self.phase_step = self.advance.apply(self.phase_step);
        self.amplitude = match self.law {
            AmplitudeLaw::Steady(advance) => advance.apply(self.amplitude),
            AmplitudeLaw::InverseSquare { change, scale, bits } => {
                let fraction = square_ratio(self.phase_step, change, scale, bits);
                let part = upper_product(self.amplitude, fraction);
                if change > 0.0 { self.amplitude - part } else { self.amplitude + part }
            }
        };
        let faded = self.taper.fade(self.amplitude, self.elapsed.min(self.ticks_left));
        let upper_half = (faded >> 32) as u32;
        let offset = (i64::from(upper_half) * i64::from(sine((self.phase >> 32) as u32))) >> self.shift;
        Some(centre + FinePosition(offset))
    }
}

impl Advance {
    /// By the exponential of this, per tick.
    fn by_ratio(growth: f64) -> Self {
        let ratio = libm::expm1(growth);
        let fraction = libm::scalbn(libm::fabs(ratio), 64) as u64;
        if ratio < 0.0 { Self::Down(fraction) } else { Self::Up(fraction) }
    }

    #[inline]
    fn apply(self, value: u64) -> u64 {
        match self {
            Self::By(step) => value.wrapping_add_signed(step),
            Self::Up(fraction) => value.wrapping_add(upper_product(value, fraction)),
            Self::Down(fraction) => value.wrapping_sub(upper_product(value, fraction)),
        }
    }
}

impl AmplitudeLaw {
    /// For a frequency that changes by `change` per tick and is never below `lowest`, both in 2⁻⁶⁴ turns per
    /// tick.
    fn inverse_square(change: f64, lowest: f64) -> Self {
        // The fraction is at most this, and a little for the change of the last tick.
        let largest = 2.5 * libm::fabs(change) / lowest;
        let bits = 32 - libm::ilogb(largest.max(f64::MIN_POSITIVE)).clamp(-31, 30) - 1;
        Self::InverseSquare {
            change: libm::scalbn(change, -32) as f32,
            scale: libm::scalbn(1.0, bits) as f32,
            bits: bits as u32,
        }
    }
}

/// |1 − (f(n)/f(n+1))²| = |d (2 − d)| with d = (f(n+1) − f(n))/f(n+1), Q64, from f(n+1) in 2⁻⁶⁴ turns per tick.
#[inline]
fn square_ratio(frequency: u64, change: f32, scale: f32, bits: u32) -> u64 {
    let high = (frequency >> 32) as u32 as f32;
    let low = frequency as u32 as f32;
    let frequency = high + low * (1.0 / 4_294_967_296.0);
    let mut inverse = F32Ext::inv(frequency);
    for _ in 0..3 {
        inverse *= 2.0 - frequency * inverse;
    }
    let d = change * inverse;
    let fraction = (d * (2.0 - d)).abs() * scale;
    u64::from(fraction as u32) << (64 - bits)
}
