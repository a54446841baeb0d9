//! What to sweep, and whether the machine may.

use super::taper::{Taper, TaperSlopes};
use super::{MotionContext, MotionError, within};

/// How the frequency goes from the first to the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SweepKind {
    /// By equal steps: eq. (33).
    Linear,
    /// By equal ratios: eq. (34).
    Exponential,
}

/// How long a sweep takes, or how fast it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SweepPace {
    /// Takes so many seconds.
    Seconds(f64),
    /// Changes the frequency by so many hertz per second, up or down; eq. (33).
    HertzPerSecond(f64),
    /// Changes the frequency by so many octaves per minute, up or down; eq. (34).
    OctavesPerMinute(f64),
}

/// What stays constant while the frequency changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Amplitude {
    /// The amplitude of the position, in mm.
    Position(f64),
    /// The amplitude of the acceleration, in mm/s²: the position's is this over (2πf)².
    Acceleration(f64),
    /// The amplitude of the force that accelerates the moving mass, in newtons.
    Force(f64),
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
    /// How long it takes.
    pub pace: SweepPace,
    /// How far it moves.
    pub amplitude: Amplitude,
}

/// A spec resolved into position and time, within all limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CheckedSweep {
    pub(super) ticks: u32,
    pub(super) taper: Taper,
    /// Amplitude of the position at the first frequency, mm.
    pub(super) first_mm: f64,
    /// The largest amplitude of the position, mm.
    pub(super) largest_mm: f64,
    /// Whether the amplitude goes with 1/f².
    pub(super) falls_with_square: bool,
}

impl SweepSpec {
    /// Smallest and largest amplitude of the position, mm.
    pub const AMPLITUDE_RANGE_MM: (f64, f64) = (1.0e-5, 100.0);

    /// The shortest and the longest sweep in seconds.
    pub const DURATION_RANGE_S: (f64, f64) = (0.1, 3600.0);

    /// The longest fade at either end, in seconds.
    pub const TAPER_S: f64 = 0.5;

    /// How much farther than its amplitude a sweep may go when it is stopped half-way: 3.6 % where the limit
    /// of jerk binds (docs/derivations/motions.md), and a little for the fade.
    pub const STOP_REACH: f64 = 1.05;

    /// How long the sweep takes, in seconds.
    ///
    /// # Errors
    /// [`MotionError::Parameter`] names a rate that is not above zero, or leads to a duration outside
    /// [`Self::DURATION_RANGE_S`].
    pub fn duration_s(&self) -> Result<f64, MotionError> {
        let span = match (self.pace, self.kind) {
            (SweepPace::Seconds(seconds), _) => return within("SECONDS", seconds, Self::DURATION_RANGE_S),
            (SweepPace::HertzPerSecond(rate), SweepKind::Linear) => {
                libm::fabs(self.to_hz - self.from_hz) / within("HZ_PER_S", rate, (1.0e-6, 1.0e5))?
            }
            (SweepPace::OctavesPerMinute(rate), SweepKind::Exponential) => {
                let octaves = libm::fabs(libm::log(self.to_hz / self.from_hz)) / core::f64::consts::LN_2;
                60.0 * octaves / within("OCTAVES_PER_MIN", rate, (1.0e-6, 1.0e5))?
            }
            (SweepPace::HertzPerSecond(_), SweepKind::Exponential) => {
                return Err(MotionError::PaceOfOtherKind { kind: "exponential", unit: "oct/min" });
            }
            (SweepPace::OctavesPerMinute(_), SweepKind::Linear) => {
                return Err(MotionError::PaceOfOtherKind { kind: "linear", unit: "Hz/s" });
            }
        };
        within("SECONDS (by the rate)", span, Self::DURATION_RANGE_S)
    }

    /// How long the amplitude rises at the start and falls at the end of a sweep of this duration, in
    /// seconds: one tenth of it, at most half a second.
    pub fn taper_s(duration_s: f64) -> f64 {
        (duration_s * 0.1).min(Self::TAPER_S)
    }

    /// The instantaneous frequency at a time, in hertz.
    pub fn frequency_hz(&self, time_s: f64, duration_s: f64) -> f64 {
        let part = time_s / duration_s;
        match self.kind {
            SweepKind::Linear => self.from_hz + (self.to_hz - self.from_hz) * part,
            SweepKind::Exponential => self.from_hz * libm::exp(part * libm::log(self.to_hz / self.from_hz)),
        }
    }

    pub(super) fn check(&self, context: &MotionContext) -> Result<CheckedSweep, MotionError> {
        let MotionContext { limits, rate, .. } = context;
        let frequencies_hz = (0.01, rate.hz() / 8.0);
        within("FROM_HZ", self.from_hz, frequencies_hz)?;
        within("TO_HZ", self.to_hz, frequencies_hz)?;
        let duration_s = self.duration_s()?;
        let omega = |hz: f64| core::f64::consts::TAU * hz;
        let acceleration_mm_s2 = match self.amplitude {
            Amplitude::Position(mm) => within("AMPLITUDE_MM", mm, Self::AMPLITUDE_RANGE_MM).map(|_| None)?,
            Amplitude::Acceleration(mm_s2) => Some(within("AMPLITUDE_MM_S2", mm_s2, (1.0e-3, 1.0e6))?),
            Amplitude::Force(newton) => {
                Some(context.acceleration_mm_s2(within("AMPLITUDE_N", newton, (1.0e-6, 1.0e6))?)?)
            }
        };
        let amplitude_mm = |hz: f64| match (acceleration_mm_s2, self.amplitude) {
            (Some(mm_s2), _) => mm_s2 / (omega(hz) * omega(hz)),
            (None, Amplitude::Position(mm) | Amplitude::Acceleration(mm) | Amplitude::Force(mm)) => mm,
        };
        let largest_mm = amplitude_mm(self.from_hz.min(self.to_hz));
        within("amplitude at the lowest frequency, in mm,", largest_mm, Self::AMPLITUDE_RANGE_MM)?;
        let reach_mm = Self::STOP_REACH * largest_mm;
        let centre_mm = context.start.to_mm();
        limits.check_span(centre_mm - reach_mm, centre_mm + reach_mm)?;

        let ticks = libm::round(duration_s * rate.hz());
        if acceleration_mm_s2.is_some() {
            // The amplitude follows the frequency tick by tick, in small steps.
            let growth = self.growth(self.from_hz.min(self.to_hz), duration_s);
            within("change of frequency per tick, relative,", growth * rate.period_s(), (0.0, 0.02))?;
        }
        let taper = Taper::new(Self::taper_s(duration_s), *rate);
        let slopes = taper.slopes(*rate);
        let taper_s = rate.seconds(taper.ticks());
        let mut peaks = [0.0_f64; 3];
        // Between the corners every bound is a sum of positive powers of the frequency, so it is largest at
        // one of them.
        for (time_s, slopes) in [
            (0.0, slopes),
            (taper_s, slopes),
            (taper_s, TaperSlopes::NONE),
            (duration_s - taper_s, TaperSlopes::NONE),
            (duration_s - taper_s, slopes),
            (duration_s, slopes),
        ] {
            let hz = self.frequency_hz(time_s, duration_s);
            let local = Local {
                amplitude_mm: amplitude_mm(hz),
                omega: omega(hz),
                growth: self.growth(hz, duration_s),
                falls_with_square: acceleration_mm_s2.is_some(),
            };
            for (peak, here) in peaks.iter_mut().zip(local.derivatives(slopes)) {
                *peak = peak.max(here);
            }
        }
        let [velocity, acceleration, jerk] = peaks;
        limits.check_velocity(velocity)?;
        limits.check_acceleration(acceleration)?;
        limits.check_jerk(jerk)?;
        Ok(CheckedSweep {
            ticks: ticks as u32,
            taper,
            first_mm: amplitude_mm(self.from_hz),
            largest_mm,
            falls_with_square: acceleration_mm_s2.is_some(),
        })
    }

    /// |ω'/ω| at this frequency, per second.
    fn growth(&self, hz: f64, duration_s: f64) -> f64 {
        match self.kind {
            SweepKind::Linear => libm::fabs(self.to_hz - self.from_hz) / (hz * duration_s),
            SweepKind::Exponential => libm::fabs(libm::log(self.to_hz / self.from_hz)) / duration_s,
        }
    }
}

/// The sweep around one moment.
struct Local {
    amplitude_mm: f64,
    omega: f64,
    growth: f64,
    falls_with_square: bool,
}

impl Local {
    /// Bounds of velocity, acceleration and jerk in mm/s, mm/s², mm/s³ of E sin φ with φ' = ω: the product
    /// rule, sine and cosine apart. The envelope E is the taper times the amplitude.
    fn derivatives(&self, taper: TaperSlopes) -> [f64; 3] {
        let Self { amplitude_mm, omega, growth, falls_with_square } = *self;
        // Of an amplitude with 1/ω², relative to itself; ω''/ω is at most the square of ω'/ω.
        let [a1, a2, a3] = if falls_with_square {
            [2.0 * growth, 8.0 * growth * growth, 24.0 * growth * growth * growth]
        } else {
            [0.0; 3]
        };
        let e1 = taper.first + a1;
        let e2 = taper.second + 2.0 * taper.first * a1 + a2;
        let e3 = taper.third + 3.0 * taper.second * a1 + 3.0 * taper.first * a2 + a3;
        let square = omega * omega;
        let chirp = growth * omega;
        let velocity = hypotenuse(e1, omega);
        let acceleration = hypotenuse(e2 + square, 2.0 * e1 * omega + chirp);
        let jerk = hypotenuse(
            e3 + 3.0 * e1 * square + 3.0 * omega * chirp,
            3.0 * e2 * omega + 3.0 * e1 * chirp + growth * chirp + square * omega,
        );
        [velocity, acceleration, jerk].map(|derivative| amplitude_mm * derivative)
    }
}

/// Of numbers far from the ends of the range.
fn hypotenuse(a: f64, b: f64) -> f64 {
    libm::sqrt(a * a + b * b)
}
