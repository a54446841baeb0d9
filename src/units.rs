//! Quantities that cross module borders, with their unit in the type.

/// A position in nanometres. The range, about ±2.1 m, holds every travel the firmware accepts
/// (see [`MAX_TRAVEL_MM`]) with room for the sum of two positions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Nanometres(pub i32);

/// The largest distance from zero that a position may have, in millimetres. A relative position
/// (the difference of two) then still fits in an `i32`.
pub const MAX_TRAVEL_MM: f64 = 1000.0;

const NANOMETRES_PER_MM: f64 = 1.0e6;

impl Nanometres {
    /// The nearest position to `millimetres`; `None` outside ±[`MAX_TRAVEL_MM`] or when not finite.
    pub fn from_mm(millimetres: f64) -> Option<Self> {
        // A comparison that is false for NaN refuses it too.
        if libm::fabs(millimetres) <= MAX_TRAVEL_MM {
            Some(Self(libm::round(millimetres * NANOMETRES_PER_MM) as i32))
        } else {
            None
        }
    }

    /// This position in millimetres, exact to `f64` rounding.
    pub fn to_mm(self) -> f64 {
        f64::from(self.0) / NANOMETRES_PER_MM
    }
}

/// The rate of the control interrupt, in ticks per second.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TickRate {
    hz: f64,
}

impl TickRate {
    /// The slowest and fastest accepted rates, in hertz.
    pub const RANGE_HZ: (f64, f64) = (200.0, 20_000.0);

    /// 4 kHz: the Nyquist rate is far above any mode worth shaping, and a tick has 42 000 cycles.
    pub const DEFAULT: Self = Self { hz: 4000.0 };

    /// A rate in hertz; `None` outside [`Self::RANGE_HZ`].
    pub fn from_hz(hz: f64) -> Option<Self> {
        (hz >= Self::RANGE_HZ.0 && hz <= Self::RANGE_HZ.1).then_some(Self { hz })
    }

    /// How many periods of a timer clock make one tick at the attainable rate nearest to this one.
    pub fn clocks_per_tick(self, timer_clock_hz: u32) -> u32 {
        libm::round(f64::from(timer_clock_hz) / self.hz).max(1.0) as u32
    }

    /// The rate nearest to this one that divides a timer clock by a whole number; tables are designed for it.
    pub fn attainable(self, timer_clock_hz: u32) -> Self {
        let clocks = f64::from(self.clocks_per_tick(timer_clock_hz));
        Self::from_hz(f64::from(timer_clock_hz) / clocks).unwrap_or(self)
    }

    /// Ticks per second.
    pub fn hz(self) -> f64 {
        self.hz
    }

    /// Seconds per tick.
    pub fn period_s(self) -> f64 {
        1.0 / self.hz
    }

    /// A number of ticks in seconds.
    pub fn seconds(self, ticks: u32) -> f64 {
        f64::from(ticks) / self.hz
    }
}
