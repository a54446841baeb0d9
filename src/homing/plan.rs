//! What homing looks for, and how fast; computed outside the interrupt.

use super::EXTRA_BITS;
use crate::motion::{FinePosition, MoveLimits};
use crate::units::{Nanometres, TickRate};

/// What says that the axis is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sense {
    /// The limit switch of the end that is approached.
    Limit,
    /// The home switch.
    Home,
    /// The machine is held by something and falls behind its setpoint by so many nanometres.
    Stop {
        /// How far.
        error_nm: i32,
    },
}

/// Ready for one tick rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HomingPlan {
    /// To the upper end.
    upward: bool,
    sense: Sense,
    /// Velocities, and the largest change of them, per tick with [`EXTRA_BITS`].
    pub(super) approach: i64,
    pub(super) creep: i64,
    pub(super) change: i64,
    /// Distances.
    pub(super) backoff: i64,
    pub(super) search: i64,
    /// What a contact says for so long is true.
    pub(super) bounce_ticks: u32,
    position: Nanometres,
}

/// What a person chooses of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HomingSpec {
    /// To the upper end.
    pub upward: bool,
    /// What says that the axis is there.
    pub sense: Sense,
    /// Speed until then, in mm/s.
    pub approach_mm_s: f64,
    /// Speed at which the edge is crossed, in mm/s.
    pub creep_mm_s: f64,
    /// How far the axis goes from the edge, in mm.
    pub backoff_mm: f64,
    /// The position of the edge.
    pub position: Nanometres,
}

impl HomingPlan {
    /// The longest that a contact bounces, in seconds.
    pub const BOUNCE_S: f64 = 0.005;
    /// The way to the edge is at most the travel and so much of it.
    const SEARCH: f64 = 1.05;

    /// Within these limits; the way to the edge is at most as long as the travel, or a twentieth more.
    pub fn new(spec: &HomingSpec, limits: &MoveLimits, rate: TickRate) -> Self {
        let units = |nm: f64| libm::scalbn(nm, FinePosition::FRACTION_BITS as i32) as i64;
        let per_tick = |mm_s: f64| units(mm_s * 1.0e6 * rate.period_s()) << EXTRA_BITS;
        let change = limits.acceleration_mm_s2 * 1.0e6 * rate.period_s() * rate.period_s();
        let (first_mm, last_mm) = limits.travel_mm;
        Self {
            upward: spec.upward,
            sense: spec.sense,
            approach: per_tick(spec.approach_mm_s),
            // Never slower than what a tick can tell.
            creep: per_tick(spec.creep_mm_s.min(spec.approach_mm_s)).max(1 << EXTRA_BITS),
            change: (units(change) << EXTRA_BITS).max(1 << EXTRA_BITS),
            backoff: units(spec.backoff_mm * 1.0e6),
            search: units((Self::SEARCH * (last_mm - first_mm) + spec.backoff_mm) * 1.0e6),
            bounce_ticks: (libm::ceil(Self::BOUNCE_S * rate.hz()) as u32).max(1),
            position: spec.position,
        }
    }

    /// What says that the axis is there.
    pub fn sense(&self) -> Sense {
        self.sense
    }

    /// The end that is approached: -1 the lower, 1 the upper one.
    pub fn end(&self) -> i32 {
        if self.upward { 1 } else { -1 }
    }

    /// The position of the edge once it is found.
    pub fn position(&self) -> Nanometres {
        self.position
    }

    pub(super) fn toward(&self) -> i64 {
        self.end().into()
    }

    pub(super) fn touches(&self) -> bool {
        matches!(self.sense, Sense::Stop { .. })
    }
}
