//! Sine sweeps of the position, for identification.
//!
//! The phase is a 64-bit fraction of a turn and advances every tick by the instantaneous frequency, which
//! itself advances by a constant (linear sweep, eq. 33) or by a constant fraction of itself (exponential sweep,
//! eq. 34). The frequency thus *is* the derivative of the phase; the usual mistake, sin(2π f(t) t), sweeps at the
//! wrong rate. The amplitude rises and falls over half a raised cosine at both ends, so that the sweep starts and
//! ends at rest, where it started.

use micromath::F32Ext;

use super::sine::sine;
use super::{MotionError, MoveLimits};
use crate::units::{Nanometres, TickRate};

/// How the frequency goes from the first to the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SweepKind {
    /// By equal steps: eq. (33).
    Linear,
    /// By equal ratios: eq. (34).
    Exponential,
}

/// What to sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SweepSpec {
    /// How the frequency changes.
    pub kind: SweepKind,
    /// First frequency in hertz. A sweep down starts above the last.
    pub from_hz: f64,
    /// Last frequency in hertz.
    pub to_hz: f64,
    /// How long it takes, in seconds.
    pub duration_s: f64,
    /// Amplitude of the position in millimetres.
    pub amplitude_mm: f64,
}

impl SweepSpec {
    /// The longest sweep in seconds.
    pub const MAX_DURATION_S: f64 = 3600.0;

    /// How long the amplitude rises at the start and falls at the end, in seconds: one tenth of the
    /// sweep, at most half a second.
    pub fn taper_s(&self) -> f64 {
        (self.duration_s * 0.1).min(0.5)
    }

    fn check(&self, centre: Nanometres, limits: &MoveLimits, rate: TickRate) -> Result<(), MotionError> {
        let parameter = |name, value: f64, range: (f64, f64)| {
            if value >= range.0 && value <= range.1 {
                Ok(())
            } else {
                Err(MotionError::Parameter { name, value, range })
            }
        };
        let frequencies_hz = (0.01, rate.hz() / 8.0);
        parameter("FROM_HZ", self.from_hz, frequencies_hz)?;
        parameter("TO_HZ", self.to_hz, frequencies_hz)?;
        parameter("SECONDS", self.duration_s, (0.1, Self::MAX_DURATION_S))?;
        parameter("AMPLITUDE_MM", self.amplitude_mm, (1.0e-5, 100.0))?;
        limits.check_position(centre.to_mm() - self.amplitude_mm)?;
        limits.check_position(centre.to_mm() + self.amplitude_mm)?;
        let omega = core::f64::consts::TAU * self.from_hz.max(self.to_hz);
        let needed_mm_s = self.amplitude_mm * omega;
        if needed_mm_s > limits.velocity_mm_s {
            return Err(MotionError::Velocity { needed_mm_s, limit_mm_s: limits.velocity_mm_s });
        }
        let needed_mm_s2 = needed_mm_s * omega;
        if needed_mm_s2 > limits.acceleration_mm_s2 {
            let limit_mm_s2 = limits.acceleration_mm_s2;
            return Err(MotionError::Acceleration { needed_mm_s2, limit_mm_s2 });
        }
        Ok(())
    }
}

/// How the phase step changes from tick to tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Advance {
    /// Adds this, in 2⁻⁶⁴ turns per tick².
    By(i64),
    /// Adds this fraction of itself, in 2⁻⁶⁴.
    Up(u64),
    /// Takes away this fraction of itself, in 2⁻⁶⁴.
    Down(u64),
}

/// A sweep in progress.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepPlan {
    centre: Nanometres,
    amplitude_nm: f32,
    ticks_left: u32,
    elapsed: u32,
    taper_ticks: u32,
    /// π / taper in rad per tick.
    taper_rad: f32,
    /// In 2⁻⁶⁴ turns.
    phase: u64,
    /// In 2⁻⁶⁴ turns per tick.
    phase_step: u64,
    advance: Advance,
}

impl SweepPlan {
    /// Plans a sweep around `centre`.
    ///
    /// # Errors
    /// [`MotionError`] names the parameter outside its range, or the travel, velocity or acceleration
    /// limit that the sweep would break.
    pub fn new(
        spec: &SweepSpec,
        centre: Nanometres,
        limits: &MoveLimits,
        rate: TickRate,
    ) -> Result<Self, MotionError> {
        spec.check(centre, limits, rate)?;
        let ticks = libm::round(spec.duration_s * rate.hz());
        let step_of = |hz: f64| libm::scalbn(hz * rate.period_s(), 64);
        let advance = match spec.kind {
            SweepKind::Linear => Advance::By(((step_of(spec.to_hz) - step_of(spec.from_hz)) / ticks) as i64),
            SweepKind::Exponential => {
                let ratio = libm::expm1(libm::log(spec.to_hz / spec.from_hz) / ticks);
                let fraction = libm::scalbn(libm::fabs(ratio), 64) as u64;
                if ratio < 0.0 { Advance::Down(fraction) } else { Advance::Up(fraction) }
            }
        };
        let taper_ticks = libm::round(spec.taper_s() * rate.hz()).max(1.0);
        Ok(Self {
            centre,
            amplitude_nm: (spec.amplitude_mm * 1.0e6) as f32,
            ticks_left: ticks as u32,
            elapsed: 0,
            taper_ticks: taper_ticks as u32,
            taper_rad: (core::f64::consts::PI / taper_ticks) as f32,
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
    pub fn step(&mut self) -> Option<Nanometres> {
        self.ticks_left = self.ticks_left.checked_sub(1)?;
        self.elapsed += 1;
        self.phase = self.phase.wrapping_add(self.phase_step);
        self.phase_step = match self.advance {
            Advance::By(step) => self.phase_step.wrapping_add_signed(step),
            Advance::Up(fraction) => self.phase_step.wrapping_add(upper_product(self.phase_step, fraction)),
            Advance::Down(fraction) => self.phase_step.wrapping_sub(upper_product(self.phase_step, fraction)),
        };
        let from_end = self.elapsed.min(self.ticks_left);
        let offset_nm = self.amplitude_nm * self.taper(from_end) * sine((self.phase >> 32) as u32);
        // Rounded half away from zero; the cast truncates and saturates.
        let rounded_nm = (offset_nm + 0.5_f32.copysign(offset_nm)) as i32;
        Some(Nanometres(self.centre.0.wrapping_add(rounded_nm)))
    }

    /// The raised cosine (1 − cos(π n / N)) / 2 by micromath: its error of 10⁻³ bends the taper by as much,
    /// which nothing depends on, and it is exact at both ends.
    #[inline]
    fn taper(&self, ticks_from_end: u32) -> f32 {
        if ticks_from_end >= self.taper_ticks {
            return 1.0;
        }
        0.5 - 0.5 * F32Ext::cos(ticks_from_end as f32 * self.taper_rad)
    }
}

/// ⌊a b / 2⁶⁴⌋.
#[inline]
fn upper_product(a: u64, b: u64) -> u64 {
    ((u128::from(a) * u128::from(b)) >> 64) as u64
}
