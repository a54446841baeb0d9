//! What would make an infeasible request feasible: a looser tolerance, a smaller box, a longer shaper.

use super::fixed_duration::{Memory, Problem};
use super::request::{OptimalRequest, ROUNDING};
use super::search::Found;
use crate::error::ShapeError;

/// Steps of the search for the size of the box: it is known to 1/2⁵ of itself.
const BOX_STEPS: u32 = 5;
/// How much longer than possible shapers may be when the duration is looked for that is needed, and how many
/// periods of the slowest mode if that is more.
const LONGER: (u32, f64) = (3, 4.0);
/// Ticks per period of the fastest mode that are fine enough for advice.
const TICKS_PER_PERIOD: f64 = 12.0;
/// Steps into which the longest possible duration is divided for advice.
const STEPS: u32 = 60;

impl OptimalRequest {
    /// The error for a request that the longest shaper misses by leaving `least`.
    pub(super) fn infeasible(&self, problem: &Problem, longest: u32, least: f64) -> ShapeError {
        let seconds = |ticks: u32| f64::from(ticks) * problem.tick_s;
        ShapeError::Infeasible {
            tolerance: self.tolerance,
            longest_s: seconds(longest),
            least: least.max(ROUNDING),
            box_factor: self.feasible_box(problem, longest),
            duration_s: self.feasible_duration(problem, longest).map(seconds),
        }
    }

    /// The largest part of the boxes' size for which the longest shaper is enough.
    fn feasible_box(&self, problem: &Problem, longest: u32) -> Option<f64> {
        if self.modes.iter().all(super::uncertainty::ModeBox::is_point) {
            return None;
        }
        let aimed_at = self.aimed_at();
        let feasible = |factor: f64| {
            let modes = self.modes.iter().map(|mode| mode.scaled(factor)).collect();
            let smaller = Problem { modes, ..problem.clone() };
            smaller
                .least_residual(longest, Some(aimed_at), &mut Memory::default())
                .is_ok_and(|verdict| verdict.worst <= aimed_at)
        };
        if !feasible(0.0) {
            return None;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..BOX_STEPS {
            let middle = 0.5 * (low + high);
            if feasible(middle) { low = middle } else { high = middle }
        }
        (low > 0.0).then_some(low)
    }

    /// The duration in ticks that the tolerance needs, whatever the memory; `None` when it is far longer.
    fn feasible_duration(&self, problem: &Problem, longest: u32) -> Option<u32> {
        let fastest_hz = self.modes.iter().map(|mode| mode.frequency_hz()[1]).fold(0.0, f64::max);
        let coarser = ((1.0 / (TICKS_PER_PERIOD * fastest_hz * problem.tick_s)) as u32).max(1);
        let coarse = Problem { tick_s: problem.tick_s * f64::from(coarser), ..problem.clone() };
        let possible = longest / coarser + 1;
        let slowest_hz = self.modes.iter().map(|mode| mode.frequency_hz()[0]).fold(f64::INFINITY, f64::min);
        let most = possible.saturating_mul(LONGER.0).max((LONGER.1 / (slowest_hz * coarse.tick_s)) as u32);
        match coarse.shortest(self.aimed_at(), most, (possible / STEPS).max(1)) {
            Ok(Found::Shortest(shortest)) => Some(shortest.end_tick.saturating_mul(coarser)),
            _ => None,
        }
    }
}
