//! The shortest duration of a move, to the tick.

use stillbeam_firmware::units::TickRate;

use super::played::PlayedMove;
use super::programme::{Corners, Ended, Grid, ringing, solve};
use super::request::MoveRequest;
use crate::error::ShapeError;
use crate::optimal::boundary::{self, FINER};
use crate::optimal::pole::Pole;

/// Programmes of one duration until no place between the constraints rises above them.
const ROUNDS: usize = 12;

pub(super) struct Search<'r> {
    request: &'r MoveRequest,
    rate: TickRate,
    /// What held the last answer down.
    poles: Vec<Pole>,
}

impl<'r> Search<'r> {
    pub(super) fn new(request: &'r MoveRequest, rate: TickRate) -> Self {
        Self { request, rate, poles: Vec::new() }
    }

    /// Bisection over the ticks. A move of n ticks that starts a tick late is one of n + 1 ticks and leaves
    /// the same, so longer is never worse, but for the corners, which move with the duration: what that
    /// changes is below the cost of the pieces.
    pub(super) fn run(mut self) -> Result<PlayedMove, ShapeError> {
        let ticks = |seconds: f64| (seconds * self.rate.hz()).ceil() as u32;
        let longest = ticks(MoveRequest::LONGEST_S);
        let (mut low, mut high) = (0, ticks(self.no_less_than_s()).clamp(2, longest));
        let mut best = loop {
            if let Some(corners) = self.within_tolerance(high)? {
                break corners;
            }
            if high == longest {
                return Err(ShapeError::LongMove { longest_s: MoveRequest::LONGEST_S });
            }
            low = high;
            high = high.saturating_mul(3).div_euclid(2).min(longest);
        };
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            match self.within_tolerance(middle)? {
                Some(corners) => (high, best) = (middle, corners),
                None => low = middle,
            }
        }
        PlayedMove::new(self.request, self.rate, &best)
    }

    /// The quickest that velocity alone allows.
    fn no_less_than_s(&self) -> f64 {
        self.request.distance_m / self.request.bounds.velocity_m_s
    }

    /// A move of this many ticks that leaves no more than the tolerance.
    fn within_tolerance(&mut self, ticks: u32) -> Result<Option<Corners>, ShapeError> {
        let duration_s = self.rate.seconds(ticks);
        let most = self.request.aimed_at();
        let modes = &self.request.modes;
        let mut poles: Vec<Pole> = modes.iter().flat_map(|mode| boundary::grid(mode, duration_s)).collect();
        poles.extend(&self.poles);
        for _ in 0..ROUNDS {
            let grid = Grid::new(ticks, duration_s);
            let Ended::Best(corners) = solve(self.request, grid, &poles)? else { return Ok(None) };
            let residual = |pole: &Pole| ringing(&corners, pole);
            let held = poles.iter().map(residual).fold(0.0, f64::max);
            if held > most {
                return Ok(None);
            }
            let peaks: Vec<_> =
                modes.iter().flat_map(|mode| boundary::peaks(mode, duration_s, FINER, &residual)).collect();
            let worst = peaks.iter().map(|peak| peak.residual).fold(0.0, f64::max);
            if worst <= most {
                return Ok(Some(corners));
            }
            self.poles = peaks.iter().filter(|peak| peak.residual > held).map(|peak| peak.pole).collect();
            poles.extend(&self.poles);
        }
        Ok(None)
    }
}
