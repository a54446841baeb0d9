//! The blocks that a running cascade is stored in ([`super::cascade`]): taps that are looked at together.

use super::stage::{StageTaps, Tap};

/// Taps of a group.
pub(super) const WIDTH: usize = 4;
/// Words of a block.
pub(super) const BLOCK: usize = WIDTH + 1;
/// Samples that the ring has twice.
pub(super) const REPEATED: usize = WIDTH;
/// Added to a delay: here begins a stage.
pub(super) const STAGE: i32 = i32::MIN;
/// In place of a delay: two taps with delays of their own.
pub(super) const PAIR: i32 = i32::MIN / 2;

/// Taps that are looked at together.
pub enum Taps {
    /// Up to [`WIDTH`] on neighbouring ticks. It never looks further back than its oldest tap; what it reads
    /// beyond its youngest has no weight.
    Group {
        /// Delay of the oldest tap in ticks.
        oldest_delay: i32,
        /// Weights, the oldest tap's first.
        weights: [i32; WIDTH],
    },
    /// Two with no others on neighbouring ticks, the youngest first.
    Pair([Tap; 2]),
}

impl Taps {
    /// The block, for a stage whose newest sample has this delay.
    pub(super) fn words(&self, stage_delay: i32) -> [i32; BLOCK] {
        match self {
            Self::Group { oldest_delay, weights: [oldest, older, younger, youngest] } => {
                [*oldest, *older, *younger, *youngest, stage_delay + oldest_delay + 1]
            }
            Self::Pair([first, second]) => {
                let delay = |tap: &Tap| stage_delay + tap.delay_ticks.cast_signed();
                [first.weight, delay(first), second.weight, delay(second), PAIR]
            }
        }
    }
}

/// The taps but the one without delay, with increasing delays, which are below the length of a memory
/// wherever a cascade runs.
pub fn blocks_of<'t>(stage: StageTaps<'t>) -> impl Iterator<Item = Taps> + use<'t> {
    let mut rest = stage.taps();
    if let [Tap { delay_ticks: 0, .. }, after @ ..] = rest {
        rest = after;
    }
    core::iter::from_fn(move || {
        let count = neighbours(rest);
        let taps = rest.split_off(..count)?;
        if let ([first], [second, ..]) = (taps, rest)
            && neighbours(rest) == 1
        {
            rest.split_off_first();
            return Some(Taps::Pair([*first, *second]));
        }
        let oldest = taps.last()?.delay_ticks;
        let mut weights = [0; WIDTH];
        for tap in taps {
            if let Some(weight) = weights.get_mut((oldest - tap.delay_ticks) as usize) {
                *weight = tap.weight;
            }
        }
        Some(Taps::Group { oldest_delay: oldest.cast_signed(), weights })
    })
}

/// How many of these taps are on [`WIDTH`] neighbouring ticks, from the first on.
fn neighbours(taps: &[Tap]) -> usize {
    let Some(first) = taps.first() else { return 0 };
    taps.iter().take_while(|tap| tap.delay_ticks - first.delay_ticks < WIDTH as u32).count()
}
