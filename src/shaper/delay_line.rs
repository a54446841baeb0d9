//! One stage at work: past samples in a ring, taps read in groups of neighbours.
//!
//! The taps of a designed stage come in runs of neighbouring ticks (one for every impulse), so they are stored as groups of
//! [`WIDTH`] weights with one delay, missing taps having the weight zero. A group reads its samples as one slice: past
//! its end the ring repeats its first samples, so that no group is cut in two. That makes one wrap and one bounds check
//! per group rather than per tap.
//!
//! ```text
//! words: | group | group | ... | ring: samples, in order of time, wrapping | its first WIDTH - 1 again |
//! group: | delay of the oldest | weight of the oldest | ... | weight of the youngest |
//! ```

use super::cascade::WEIGHT_BITS;
use super::stage::{StageTaps, Tap, WEIGHT_ONE};

/// Taps of a group.
const WIDTH: usize = 4;
/// Words of a group.
const GROUP: usize = WIDTH + 1;
/// Samples that the ring has twice.
const REPEATED: usize = WIDTH - 1;

/// Where one stage's words are, and how far its ring has come.
#[derive(Debug)]
pub(super) struct DelayLine {
    group_words: usize,
    words: usize,
    /// Samples in the ring, without those it repeats.
    samples: usize,
    /// Where in the ring the newest sample is.
    newest: usize,
    /// The weight of the newest sample, which no group has.
    weight_now: i32,
}

impl DelayLine {
    /// The line of a stage, its ring at the beginning.
    pub(super) fn of(stage: StageTaps<'_>) -> Self {
        let group_words = GROUP * groups(stage).count();
        let samples = (stage.duration_ticks() as usize).saturating_add(1).max(WIDTH);
        let words = group_words.saturating_add(samples).saturating_add(REPEATED);
        let now = stage.taps().first().filter(|tap| tap.delay_ticks == 0);
        Self { group_words, words, samples, newest: 0, weight_now: now.map_or(0, |tap| tap.weight) }
    }

    /// How many words of memory it takes.
    pub(super) fn words(&self) -> usize {
        self.words
    }

    /// Puts the stage's groups where [`Self::step`] expects them.
    pub(super) fn write_groups(&self, stage: StageTaps<'_>, words: &mut [i32]) {
        let (places, _) = words.as_chunks_mut::<GROUP>();
        places.iter_mut().zip(groups(stage)).for_each(|(place, group)| *place = group);
    }

    /// Takes a sample and returns the weighted sum, in nanometres.
    #[inline]
    pub(super) fn step(&mut self, words: &mut [i32], input_nm: i32) -> i64 {
        let half = i64::from(WEIGHT_ONE / 2);
        let mut sum = half + i64::from(input_nm) * i64::from(self.weight_now);
        if let Some((groups, ring)) = words.split_at_mut_checked(self.group_words) {
            self.remember(ring, input_nm);
            for [delay, oldest, older, younger, youngest] in groups.as_chunks::<GROUP>().0 {
                let delay = *delay as usize;
                let wraps = if delay > self.newest { self.samples } else { 0 };
                let place = (self.newest + wraps).wrapping_sub(delay);
                if let Some([a, b, c, d]) = ring.get(place..).and_then(<[i32]>::first_chunk::<WIDTH>) {
                    sum += i64::from(*a) * i64::from(*oldest);
                    sum += i64::from(*b) * i64::from(*older);
                    sum += i64::from(*c) * i64::from(*younger);
                    sum += i64::from(*d) * i64::from(*youngest);
                }
            }
        }
        sum >> WEIGHT_BITS
    }

    #[inline]
    fn remember(&mut self, ring: &mut [i32], sample_nm: i32) {
        self.newest += 1;
        if self.newest >= self.samples {
            self.newest = 0;
        }
        if let Some(place) = ring.get_mut(self.newest) {
            *place = sample_nm;
        }
        if self.newest < REPEATED
            && let Some(place) = ring.get_mut(self.newest + self.samples)
        {
            *place = sample_nm;
        }
    }
}

/// The taps but the one without delay, in groups. Each begins with the oldest tap that the group before left over, so
/// it never looks further back than the stage does; what it reads beyond the newest sample has no weight.
fn groups<'t>(stage: StageTaps<'t>) -> impl Iterator<Item = [i32; GROUP]> + use<'t> {
    let mut rest = stage.taps();
    if let [Tap { delay_ticks: 0, .. }, after @ ..] = rest {
        rest = after;
    }
    core::iter::from_fn(move || {
        let oldest = rest.last()?.delay_ticks;
        // Delays are below the length of a memory wherever a line runs.
        let mut group = [oldest.cast_signed(), 0, 0, 0, 0];
        while let Some((tap, before)) = rest.split_last()
            && let Some(weight) = group.get_mut(1 + (oldest - tap.delay_ticks) as usize)
        {
            *weight = tap.weight;
            rest = before;
        }
        Some(group)
    })
}
