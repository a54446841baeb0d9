//! Where a mode may be: a box of frequency and damping.

use serde::{Deserialize, Serialize};

use crate::error::ShapeError;

/// A mode and the box of frequency and damping ratio that it may be anywhere in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModeBox {
    nominal: [f64; 2],
    frequency_hz: [f64; 2],
    damping_ratio: [f64; 2],
}

impl ModeBox {
    /// A box with its ends, lowest first: undamped natural frequency in Hz, above 0, and damping ratio, at
    /// least 0 and below 1. The nominal mode is within it.
    ///
    /// # Errors
    /// [`ShapeError::ModeBox`] says which end is not usable.
    pub fn new(
        nominal_hz: f64,
        nominal_damping_ratio: f64,
        frequency_hz: [f64; 2],
        damping_ratio: [f64; 2],
    ) -> Result<Self, ShapeError> {
        let refused = |what| ShapeError::ModeBox { frequency_hz: nominal_hz, what };
        let within = |value: f64, [low, high]: [f64; 2]| low <= value && value <= high;
        if !(frequency_hz[0] > 0.0 && frequency_hz[1].is_finite()) {
            return Err(refused("its frequencies must be finite and above 0 Hz"));
        }
        if !(damping_ratio[0] >= 0.0 && damping_ratio[1] < 1.0) {
            return Err(refused("its damping ratios must be at least 0 and below 1"));
        }
        if !within(nominal_hz, frequency_hz) || !within(nominal_damping_ratio, damping_ratio) {
            return Err(refused("the mode itself is not within it; give each range as lowest, highest"));
        }
        Ok(Self { frequency_hz, damping_ratio, nominal: [nominal_hz, nominal_damping_ratio] })
    }

    /// A box of ±`frequency_fraction` and ±`damping_fraction` of the mode's own values, each at least 0 and
    /// below 1.
    ///
    /// # Errors
    /// [`ShapeError::Box`] for a fraction outside that range, [`ShapeError::ModeBox`] for a mode that is
    /// none.
    pub fn around(
        frequency_hz: f64,
        damping_ratio: f64,
        frequency_fraction: f64,
        damping_fraction: f64,
    ) -> Result<Self, ShapeError> {
        for fraction in [frequency_fraction, damping_fraction] {
            if !(0.0..1.0).contains(&fraction) {
                return Err(ShapeError::Box { fraction });
            }
        }
        let spread = |value: f64, fraction: f64| [value * (1.0 - fraction), value * (1.0 + fraction)];
        let frequencies_hz = spread(frequency_hz, frequency_fraction);
        Self::new(frequency_hz, damping_ratio, frequencies_hz, spread(damping_ratio, damping_fraction))
    }

    /// The smallest box that holds this one and ±`frequency_fraction` and ±`damping_fraction` of the nominal
    /// mode's own values. A statistical error says how well one recording was fitted, and not how far
    /// payload, temperature and position move a machine; this is the floor for the latter.
    ///
    /// # Errors
    /// As [`ModeBox::around`].
    pub fn at_least(&self, frequency_fraction: f64, damping_fraction: f64) -> Result<Self, ShapeError> {
        let [hz, zeta] = self.nominal;
        let floor = Self::around(hz, zeta, frequency_fraction, damping_fraction)?;
        let hull = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Self::new(
            hz,
            zeta,
            hull(self.frequency_hz, floor.frequency_hz),
            hull(self.damping_ratio, floor.damping_ratio),
        )
    }

    /// The same box shrunk or widened about the nominal mode by a factor.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let about = |[low, high]: [f64; 2], centre: f64| {
            [centre + factor * (low - centre), centre + factor * (high - centre)]
        };
        let [nominal_hz, nominal_damping_ratio] = self.nominal;
        Self {
            frequency_hz: about(self.frequency_hz, nominal_hz),
            damping_ratio: about(self.damping_ratio, nominal_damping_ratio),
            nominal: self.nominal,
        }
    }

    /// The box that holds the nominal mode alone.
    #[must_use]
    pub fn nominal(&self) -> Self {
        self.scaled(0.0)
    }

    /// Undamped natural frequency of the nominal mode, Hz.
    pub fn nominal_hz(&self) -> f64 {
        self.nominal[0]
    }

    /// Damping ratio of the nominal mode.
    pub fn nominal_damping_ratio(&self) -> f64 {
        self.nominal[1]
    }

    /// Lowest and highest undamped natural frequency, Hz.
    pub fn frequency_hz(&self) -> [f64; 2] {
        self.frequency_hz
    }

    /// Lowest and highest damping ratio.
    pub fn damping_ratio(&self) -> [f64; 2] {
        self.damping_ratio
    }

    /// Whether the box is a single mode.
    pub fn is_point(&self) -> bool {
        self.frequency_hz[0] == self.frequency_hz[1] && self.damping_ratio[0] == self.damping_ratio[1]
    }
}
