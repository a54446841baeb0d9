//! How a moving machine changes from one table to the next without moving faster than its command.
//!
//! The command's motion is given to the new table little by little, over F ticks, and the new table looks D
//! ticks further back than it would at rest. What the setpoint moves in a tick is then a weighted mean of
//! what the command moves, weights of the two tables together never being more than one: where the new table
//! delays less than the old one, the difference is not made up while the command moves.
//! docs/derivations/handover.md proves it from the two orders that [`suffices`] checks stage by stage, and
//! they carry over to the sums of the stages' delays, that is to whole shapers.

use super::stage::{StageTaps, Tap, WEIGHT_ONE};
use super::table::ShaperTable;

/// The tap of a stage that changes nothing.
const NOTHING: [Tap; 1] = [Tap { delay_ticks: 0, weight: WEIGHT_ONE }];

/// The whole command in units of [`Fade`].
const WHOLE: u32 = 1 << 31;

/// How fast the command's motion goes over from the old table to the new one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fade {
    /// What the old table's share loses per tick.
    fall: u32,
}

impl Fade {
    /// Over at least so many ticks.
    pub fn over(ticks: u32) -> Self {
        Self { fall: WHOLE / ticks.max(1) }
    }

    pub(super) fn start(self) -> Share {
        Share { left: WHOLE, fall: self.fall.max(1) }
    }
}

/// What the old table still gets of the command's motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share {
    left: u32,
    fall: u32,
}

impl Share {
    /// The old table's part of what the command moves in the next tick; it has the sign of the whole, or is
    /// zero.
    #[inline]
    pub(super) fn of(&mut self, moved_nm: i32) -> i32 {
        self.left = self.left.saturating_sub(self.fall);
        ((i64::from(moved_nm) * i64::from(self.left)) >> WHOLE.trailing_zeros()) as i32
    }
}

/// What it takes to change from the live table to another while the command moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transition {
    /// How much further back the new table looks until the machine is at rest, D.
    pub lag_ticks: u32,
    /// How the command's motion goes over.
    pub fade: Fade,
}

impl Transition {
    /// At rest there is nothing to go over.
    pub const AT_REST: Self = Self { lag_ticks: 0, fade: Fade { fall: WHOLE } };

    /// From `live`, which itself looks `live_lag_ticks` further back than it would at rest, to `next`, in
    /// `least_ticks` or more. Takes some milliseconds on the board: it is not for the interrupt.
    pub fn between(live: &ShaperTable, live_lag_ticks: u32, next: &ShaperTable, least_ticks: u32) -> Self {
        let (mut olds, mut news) = (live.stages(), next.stages());
        let mut lag_ticks = i64::from(live_lag_ticks);
        loop {
            let (old, new) = (olds.next(), news.next());
            if old.is_none() && new.is_none() {
                break;
            }
            lag_ticks += stage_lag(taps(old), taps(new));
        }
        // Stages are shorter than 2³² ticks, and there are few.
        let lag_ticks = u32::try_from(lag_ticks.max(0)).unwrap_or(u32::MAX);
        let longer = live
            .duration_ticks()
            .saturating_add(live_lag_ticks)
            .max(next.duration_ticks().saturating_add(lag_ticks));
        Self { lag_ticks, fade: Fade::over(longer.max(least_ticks)) }
    }
}

fn taps(stage: Option<StageTaps<'_>>) -> &[Tap] {
    stage.map_or(&NOTHING, StageTaps::taps)
}

/// The least lag that suffices for a stage, found by bisection; negative where the new stage delays more
/// anyway.
fn stage_lag(old: &[Tap], new: &[Tap]) -> i64 {
    let last = |taps: &[Tap]| taps.last().map_or(0, |tap| i64::from(tap.delay_ticks));
    // With the first the new stage would be over before it began; with the second it begins when the old one
    // is over.
    let (mut too_short, mut enough) = (-1 - last(new), last(old));
    while enough - too_short > 1 {
        let middle = (enough + too_short) >> 1;
        *(if suffices(old, new, middle) { &mut enough } else { &mut too_short }) = middle;
    }
    enough
}

/// Whether the delay Y of the new stage, `lag` included, is later than the delay X of the old one in the
/// increasing concave and in the increasing convex order: E(t − Y)⁺ ≤ E(t − X)⁺ and E(Y − t)⁺ ≥ E(X − t)⁺ for
/// all t. Delays are random here in that a tap's weight, without its sign and in units of the stage's sum of
/// them, is its probability. Both differences are piecewise linear in t and smallest at the ticks that are
/// looked at, or far out, where they are the difference of the means.
fn suffices(old: &[Tap], new: &[Tap], lag: i64) -> bool {
    let delays = |taps: &[Tap]| mean_excess(taps, 0, |delay, zero| delay - zero);
    if delays(new) + lag * i64::from(WEIGHT_ONE) < delays(old) {
        return false;
    }
    let before = |delay, t| i64::max(t - delay, 0);
    let after = |delay, t| i64::max(delay - t, 0);
    let concave = old.iter().map(|tap| i64::from(tap.delay_ticks));
    let convex = new.iter().map(|tap| i64::from(tap.delay_ticks) + lag);
    concave.into_iter().all(|t| mean_excess(new, t - lag, before) <= mean_excess(old, t, before))
        && convex.into_iter().all(|t| mean_excess(new, t - lag, after) >= mean_excess(old, t, after))
}

/// The mean of `excess(delay, t)`, in units of a tick over [`WEIGHT_ONE`].
fn mean_excess(taps: &[Tap], t: i64, excess: impl Fn(i64, i64) -> i64) -> i64 {
    let whole: u64 = taps.iter().map(|tap| u64::from(tap.weight.unsigned_abs())).sum();
    let one = u64::from(WEIGHT_ONE.unsigned_abs());
    taps.iter()
        .map(|tap| {
            let weight = u64::from(tap.weight.unsigned_abs());
            let weight = if whole == one { weight } else { weight * one / whole.max(1) };
            weight.cast_signed() * excess(i64::from(tap.delay_ticks), t)
        })
        .sum()
}
