//! The last look at a setpoint before it goes out.

use crate::units::Nanometres;

/// The travel, checked on what the shaper made of the command.
///
/// A setpoint beyond it may come back but not go further out: travel that was narrowed around a machine at
/// rest outside of it leaves a way back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TravelGuard {
    low: Nanometres,
    high: Nanometres,
    slack: Nanometres,
}

impl TravelGuard {
    /// Guards the positions from `low` to `high`, both permitted, and as far beyond them as stops need.
    pub fn new(low: Nanometres, high: Nanometres, slack: Nanometres) -> Self {
        let (lowest, highest) = (low.0.saturating_sub(slack.0), high.0.saturating_add(slack.0));
        Self { low: Nanometres(lowest), high: Nanometres(highest), slack }
    }

    /// As lenient a guard of the positions as far as `reach` around `centre`.
    #[must_use]
    pub fn around(self, centre: Nanometres, reach: Nanometres) -> Self {
        let (low, high) = (centre.0.saturating_sub(reach.0), centre.0.saturating_add(reach.0));
        Self::new(Nanometres(low), Nanometres(high), self.slack)
    }

    /// The same travel with at least the slack of `earlier`, which a motion under way may still need.
    pub fn as_lenient_as(self, earlier: Self) -> Self {
        let more = Nanometres(earlier.slack.0.saturating_sub(self.slack.0).max(0));
        Self { slack: Nanometres(self.slack.0.max(earlier.slack.0)), ..Self::new(self.low, self.high, more) }
    }

    /// Whether going from `before` to `next` leaves the travel or goes further out.
    #[inline]
    pub fn forbids(&self, before: Nanometres, next: Nanometres) -> bool {
        (next > self.high && next > before) || (next < self.low && next < before)
    }
}
