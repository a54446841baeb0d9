//! The shapes a move can have.

use core::fmt;

/// How a move gets from rest to rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Profile {
    /// Constant acceleration, constant velocity, constant deceleration: the quickest within velocity and
    /// acceleration.
    #[default]
    Trapezoid = 0,
    /// Seven segments of constant jerk: the quickest within velocity, acceleration and jerk.
    SCurve = 1,
    /// The polynomial of fifth degree, which has the least integral of jerk squared for its duration.
    MinimumJerk = 2,
}

impl Profile {
    /// Every profile.
    pub const ALL: [Self; 3] = [Self::Trapezoid, Self::SCurve, Self::MinimumJerk];

    /// Their words on the console, in the same order.
    pub const NAMES: [&'static str; 3] = ["trapezoid", "s_curve", "minimum_jerk"];

    /// Its word on the console.
    pub fn name(self) -> &'static str {
        let [trapezoid, s_curve, minimum_jerk] = Self::NAMES;
        match self {
            Self::Trapezoid => trapezoid,
            Self::SCurve => s_curve,
            Self::MinimumJerk => minimum_jerk,
        }
    }

    /// Whether moves and stops keep to the limit of jerk.
    pub fn limits_jerk(self) -> bool {
        self != Self::Trapezoid
    }
}

impl fmt::Display for Profile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
