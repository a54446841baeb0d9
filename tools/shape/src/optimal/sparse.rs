//! Fewer taps, and the integers that run.
//!
//! The best weights of the shortest duration are few already wherever the tolerance binds. Where it leaves
//! room (an exact zero does, between two ticks) the solver spreads them; taps are then dropped, the lightest
//! first, as long as the others can be weighted anew within the tolerance.

use stillbeam_firmware::shaper::Tap;
use stillbeam_firmware::shaper::stage::WEIGHT_ONE;

use super::fixed_duration::{Memory, Problem, RealTaps};
use super::pole::Pole;
use crate::error::ShapeError;

/// A weight that the solver means to be zero.
const NO_WEIGHT: f64 = 1e-7;

impl Problem {
    /// The same shaper with as few taps as dropping them one after the other gives; at most `tolerance` is
    /// left.
    ///
    /// # Errors
    /// [`ShapeError::Solver`].
    pub(super) fn thinned(
        &self,
        taps: RealTaps,
        end_tick: u32,
        tolerance: f64,
    ) -> Result<RealTaps, ShapeError> {
        let mut poles = self.first_poles(end_tick, &Memory::default());
        let mut kept = taps;
        // All that have no weight at once, then halves of the lighter ones, then single taps.
        let weighty = kept.iter().filter(|(_, weight)| weight.abs() > NO_WEIGHT).count();
        let mut dropped = kept.len() - weighty;
        loop {
            let dropping = dropped.clamp(1, kept.len().saturating_sub(1).max(1));
            match self.without_lightest(&kept, dropping, (end_tick, tolerance), &mut poles)? {
                Some(fewer) => {
                    kept = fewer;
                    dropped = kept.len() / 2;
                }
                None if dropping > 1 => dropped = dropping / 2,
                None => break,
            }
        }
        self.without_singles(kept, (end_tick, tolerance), &mut poles)
    }

    /// Tries every tap once, the lightest first.
    fn without_singles(
        &self,
        mut kept: RealTaps,
        (end_tick, tolerance): (u32, f64),
        poles: &mut Vec<Pole>,
    ) -> Result<RealTaps, ShapeError> {
        let mut tried = 0;
        while tried < kept.len() && kept.len() > 1 {
            let order = lightest_first(&kept);
            let Some(&candidate) = order.get(tried) else { break };
            let ticks: Vec<u32> =
                kept.iter().map(|(tick, _)| *tick).filter(|tick| *tick != candidate).collect();
            let (fewer, worst) = self.reweighted(&ticks, end_tick, tolerance, poles)?;
            if worst <= tolerance {
                (kept, tried) = (fewer, 0);
            } else {
                tried += 1;
            }
        }
        Ok(kept)
    }

    fn without_lightest(
        &self,
        taps: &RealTaps,
        count: usize,
        (end_tick, tolerance): (u32, f64),
        poles: &mut Vec<Pole>,
    ) -> Result<Option<RealTaps>, ShapeError> {
        let Some(heavier) = lightest_first(taps).get(count..).map(<[u32]>::to_vec) else { return Ok(None) };
        if heavier.is_empty() {
            return Ok(None);
        }
        let mut ticks = heavier;
        ticks.sort_unstable();
        let (fewer, worst) = self.reweighted(&ticks, end_tick, tolerance, poles)?;
        Ok((worst <= tolerance).then_some(fewer))
    }
}

fn lightest_first(taps: &RealTaps) -> Vec<u32> {
    let mut order = taps.clone();
    order.sort_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()));
    order.into_iter().map(|(tick, _)| tick).collect()
}

/// The weights as the board's integers: rounded, those of zero left out, the first tap without delay, the sum
/// exactly [`WEIGHT_ONE`]. What rounding took or gave goes to the heaviest tap, where it matters least.
pub(super) fn integer_taps(taps: &[(u32, f64)]) -> Vec<Tap> {
    let one = f64::from(WEIGHT_ONE);
    let mut rounded: Vec<Tap> = taps
        .iter()
        .map(|(tick, weight)| Tap { delay_ticks: *tick, weight: (weight * one).round() as i32 })
        .filter(|tap| tap.weight != 0)
        .collect();
    let first = rounded.first().map_or(0, |tap| tap.delay_ticks);
    rounded.iter_mut().for_each(|tap| tap.delay_ticks -= first);
    let sum: i64 = rounded.iter().map(|tap| i64::from(tap.weight)).sum();
    let missing = i64::from(WEIGHT_ONE) - sum;
    if let Some(heaviest) = rounded.iter_mut().max_by_key(|tap| tap.weight) {
        // Half a unit for each tap at most.
        heaviest.weight += missing as i32;
    }
    rounded
}
