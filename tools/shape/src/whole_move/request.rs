//! What is asked of a move.

use stillbeam_firmware::units::TickRate;

use crate::error::ShapeError;
use crate::optimal::{ModeBox, ROUNDING};
use crate::whole_move::played::PlayedMove;
use crate::whole_move::search::Search;

/// What the machine can do, all above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MoveBounds {
    /// Largest velocity, m/s.
    pub velocity_m_s: f64,
    /// Largest acceleration, m/s².
    pub acceleration_m_s2: f64,
    /// Largest jerk, m/s³.
    pub jerk_m_s3: f64,
}

impl MoveBounds {
    /// The bounds that the solver is given: its own accuracy and the rounding of jerks take a little.
    pub(super) fn aimed_at(self) -> Self {
        const LESS: f64 = 1.0 - 1e-6;
        Self {
            velocity_m_s: LESS * self.velocity_m_s,
            acceleration_m_s2: LESS * self.acceleration_m_s2,
            jerk_m_s3: LESS * self.jerk_m_s3,
        }
    }
}

/// A request for the shortest move.
#[derive(Clone, Debug, PartialEq)]
pub struct MoveRequest {
    /// From rest to rest, metres, above 0.
    pub distance_m: f64,
    /// What the machine can do.
    pub bounds: MoveBounds,
    /// Whether the command may go backwards and past its end on the way, within the limit of velocity.
    pub reversing: bool,
    /// The modes and where they may be. None gives the quickest move within the limits.
    pub modes: Vec<ModeBox>,
    /// The largest residual vibration of any mode anywhere in its box, as a fraction of what a step of the
    /// same distance leaves.
    pub tolerance: f64,
    /// Ticks per second of the board.
    pub rate_hz: f64,
}

impl MoveRequest {
    /// Solves for it.
    ///
    /// # Errors
    /// [`ShapeError`]: a request outside the ranges above, or one that needs more than
    /// [`MoveRequest::LONGEST_S`].
    pub fn solve(&self) -> Result<PlayedMove, ShapeError> {
        let rate = self.checked_rate()?;
        Search::new(self, rate).run()
    }

    /// Moves that would take longer are refused, seconds.
    pub const LONGEST_S: f64 = 60.0;

    fn checked_rate(&self) -> Result<TickRate, ShapeError> {
        let rate_hz = self.rate_hz;
        let rate = TickRate::from_hz(rate_hz).ok_or(ShapeError::Rate { rate_hz })?;
        let MoveBounds { velocity_m_s, acceleration_m_s2, jerk_m_s3 } = self.bounds;
        for (what, value) in [
            ("distance", self.distance_m),
            ("velocity", velocity_m_s),
            ("acceleration", acceleration_m_s2),
            ("jerk", jerk_m_s3),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(ShapeError::MoveBound { what, value });
            }
        }
        if !(0.0..1.0).contains(&self.tolerance) {
            return Err(ShapeError::Tolerance { fraction: self.tolerance });
        }
        Ok(rate)
    }

    /// The tolerance that the solver is given: rounding of positions to the nanometre takes a little.
    pub(super) fn aimed_at(&self) -> f64 {
        0.999 * self.tolerance.max(ROUNDING)
    }
}
