//! What the tick tells of another controller's pulses.

use core::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, Ordering};

/// The newest values, as [`super::Status`] has them. Written while the source is not the board's own moves.
#[derive(Debug, Default)]
pub struct SourceStatus {
    counted: AtomicI32,
    saturated_ticks: AtomicU32,
    behind_nm: AtomicI32,
    following: AtomicBool,
}

impl SourceStatus {
    /// Nothing counted.
    pub const fn new() -> Self {
        Self {
            counted: AtomicI32::new(0),
            saturated_ticks: AtomicU32::new(0),
            behind_nm: AtomicI32::new(0),
            following: AtomicBool::new(false),
        }
    }

    /// Counts since the source was set, whether the drive was on or off; wraps.
    pub fn counted(&self) -> i32 {
        self.counted.load(Ordering::Relaxed)
    }

    /// Ticks since then in which the setpoint could not be the shaped command; wraps.
    pub fn saturated_ticks(&self) -> u32 {
        self.saturated_ticks.load(Ordering::Relaxed)
    }

    /// The shaped command less the setpoint, in nanometres: what is still to be caught up with.
    pub fn behind_nm(&self) -> i32 {
        self.behind_nm.load(Ordering::Relaxed)
    }

    /// Whether the pulses are the command now: the drive is enabled, and nothing has stopped it since.
    pub fn is_following(&self) -> bool {
        self.following.load(Ordering::Relaxed)
    }

    pub(crate) fn publish(&self, counted: i32, saturated_ticks: u32, behind_nm: i32, following: bool) {
        self.counted.store(counted, Ordering::Relaxed);
        self.saturated_ticks.store(saturated_ticks, Ordering::Relaxed);
        self.behind_nm.store(behind_nm, Ordering::Relaxed);
        self.following.store(following, Ordering::Relaxed);
    }
}
