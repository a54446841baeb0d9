//! The running shaper: all past samples in one ring, taps read in groups of neighbours.
//!
//! Samples are `i32` nanometres, weights Q30, sums `i64`. Absolute weights sum to at most 4·2³⁰ and samples are within
//! 2·10⁹ nm of the origin, so a sum stays below 2⁶³ however many taps there are. Because a stage's weights sum to one
//! exactly, a constant input comes out unchanged, to the nanometre; anything else is rounded to the nearest nanometre
//! once per stage.
//!
//! **One ring.** Seen from the newest sample backwards, the ring holds the past of the first stage, then that of the second,
//! and so on. Every tick moves the whole ring by one, so that the place for a stage's newest sample is the one that the
//! oldest of the stage before has just left. One index serves all stages.
//!
//! **Groups.** The taps of a designed stage come in runs of neighbouring ticks, one run for every impulse. They are stored
//! as groups of [`WIDTH`] weights with one delay, missing taps having the weight zero. Past its end the ring repeats its
//! first samples, so that no group is cut in two: one wrap and one bounds check per group rather than per tap.
//!
//! ```text
//! words: | group | group | ... | ring: samples in order of time, wrapping | its first WIDTH - 1 again |
//! group: | delay of the oldest | weight of the oldest | ... | weight of the youngest |
//! ```

use heapless::Vec;

use super::MAX_MODES;
use super::stage::{StageTaps, Tap, WEIGHT_ONE};
use super::table::ShaperTable;

const WEIGHT_BITS: u32 = WEIGHT_ONE.trailing_zeros();

/// Taps of a group.
const WIDTH: usize = 4;
/// Words of a group.
const GROUP: usize = WIDTH + 1;
/// Samples that the ring has twice.
const REPEATED: usize = WIDTH - 1;

/// A table together with the memory it runs in.
///
/// Places in the memory have 16 bits, from which the compiler sees that sums of them do not overflow: it then checks
/// one bound where it would check three.
#[derive(Debug)]
pub struct Cascade<'m> {
    stages: Vec<RunningStage, MAX_MODES>,
    memory: &'m mut [i32],
    group_words: u16,
    /// Samples in the ring, without those it repeats.
    samples: u16,
    /// Where in the ring the newest sample of the first stage is.
    newest: u16,
    duration_ticks: u32,
}

/// Where a stage is in the ring and among the groups.
#[derive(Debug)]
struct RunningStage {
    /// How much older than the newest sample of the first stage its own seems, in the ring.
    delay: u16,
    group_words: u16,
    /// The weight of its newest sample, which no group has.
    weight_now: i32,
}

/// The memory that was to hold the histories is too small.
#[derive(Debug)]
pub struct HistoryTooShort<'m> {
    /// Words the table needs.
    pub needed: usize,
    /// The memory, given back.
    pub history: &'m mut [i32],
}

impl<'m> Cascade<'m> {
    /// How many words of memory a table takes.
    pub(super) fn words(table: &ShaperTable) -> usize {
        let groups: usize = table.stages().map(|stage| groups(stage).count()).sum();
        ring_samples(table).saturating_add(GROUP * groups + REPEATED)
    }

    /// Makes `table` ready to run in `history`, all past samples being zero. Takes time in proportion to
    /// the history: it is not for the interrupt.
    ///
    /// # Errors
    /// [`HistoryTooShort`] returns the memory when [`ShaperTable::history_samples`] do not fit into it; of a memory
    /// only the first 65 535 words are used.
    pub fn new(table: &ShaperTable, history: &'m mut [i32]) -> Result<Self, HistoryTooShort<'m>> {
        let needed = table.history_samples();
        if needed > history.len() || needed > usize::from(u16::MAX) {
            return Err(HistoryTooShort { needed, history });
        }
        history.fill(0);
        let mut places = history.as_chunks_mut::<GROUP>().0.iter_mut();
        let (mut stages, mut delay, mut group_words) = (Vec::new(), 0, 0);
        // From here on every number is at most `needed`.
        for stage in table.stages() {
            let mut own_words = 0;
            for ([oldest, weights @ ..], place) in groups(stage).zip(&mut places) {
                let [first, second, third, fourth] = weights;
                *place = [oldest + i32::from(delay), first, second, third, fourth];
                own_words += GROUP as u16;
            }
            let now = stage.taps().first().filter(|tap| tap.delay_ticks == 0);
            let weight_now = now.map_or(0, |tap| tap.weight);
            // A table has no more stages than there is room for.
            let _fits = stages.push(RunningStage { delay, group_words: own_words, weight_now });
            delay += own_samples(stage) as u16;
            group_words += own_words;
        }
        let (samples, duration_ticks) = (ring_samples(table) as u16, table.duration_ticks());
        Ok(Self { stages, memory: history, group_words, samples, newest: 0, duration_ticks })
    }

    /// The cascade that changes nothing, holding on to `history`.
    pub fn identity(history: &'m mut [i32]) -> Self {
        Self { stages: Vec::new(), memory: history, group_words: 0, samples: 0, newest: 0, duration_ticks: 0 }
    }

    /// The memory, for the next table.
    pub fn into_history(self) -> &'m mut [i32] {
        self.memory
    }

    /// How many ticks after its last change the input still moves the output.
    pub fn duration_ticks(&self) -> u32 {
        self.duration_ticks
    }

    /// Shapes one sample, in nanometres. What leaves the range of an `i32`, which only negative weights can, ends there.
    #[inline(always)]
    pub fn step(&mut self, input_nm: i32) -> i32 {
        let samples = usize::from(self.samples);
        let Some((groups, ring)) = self.memory.split_at_mut_checked(usize::from(self.group_words)) else {
            return input_nm;
        };
        let Some(ring) = ring.get_mut(..samples + REPEATED) else { return input_nm };
        let mut groups = &*groups;
        let mut newest = usize::from(self.newest) + 1;
        if newest >= samples {
            newest = 0;
        }
        // The ring is shorter than 2¹⁶.
        self.newest = newest as u16;
        let mut sample_nm = i64::from(input_nm);
        for stage in &self.stages {
            // Between stages a sample is a weighted mean of i32 samples with non-negative weights.
            let input_nm = sample_nm as i32;
            let delay = usize::from(stage.delay);
            if !remember(ring, newest.wrapping_sub(delay), samples, input_nm) {
                newest = next_lap(newest, samples);
                if !remember(ring, newest.wrapping_sub(delay), samples, input_nm) {
                    break;
                }
            }
            let mut sum = i64::from(WEIGHT_ONE / 2) + i64::from(input_nm) * i64::from(stage.weight_now);
            let Some((mut own, after)) = groups.split_at_checked(usize::from(stage.group_words)) else {
                break;
            };
            groups = after;
            while let Some(([delay, oldest, older, younger, youngest], rest)) =
                own.split_first_chunk::<GROUP>()
            {
                own = rest;
                let delay = *delay as usize;
                let samples_nm = match window(ring, newest.wrapping_sub(delay), samples) {
                    Some(window) => window,
                    None => {
                        newest = next_lap(newest, samples);
                        match window(ring, newest.wrapping_sub(delay), samples) {
                            Some(window) => window,
                            None => break,
                        }
                    }
                };
                let [a, b, c, d] = samples_nm;
                sum += i64::from(*a) * i64::from(*oldest);
                sum += i64::from(*b) * i64::from(*older);
                sum += i64::from(*c) * i64::from(*younger);
                sum += i64::from(*d) * i64::from(*youngest);
            }
            sample_nm = sum >> WEIGHT_BITS;
        }
        if let Ok(sample_nm) = i32::try_from(sample_nm) { sample_nm } else { nearest_i32(sample_nm) }
    }
}

/// Writes a sample, and its repetition past the end; whether the place is within the ring.
#[inline(always)]
fn remember(ring: &mut [i32], place: usize, samples: usize, sample_nm: i32) -> bool {
    if place >= samples {
        return false;
    }
    if let Some(slot) = ring.get_mut(place) {
        *slot = sample_nm;
    }
    if place < REPEATED {
        repeat(ring, place + samples, sample_nm);
    }
    true
}

/// The samples of a group that begins at this place, if that is within the ring.
#[inline(always)]
fn window(ring: &[i32], place: usize, samples: usize) -> Option<&[i32; WIDTH]> {
    if place < samples { ring.get(place..place + WIDTH)?.first_chunk() } else { None }
}

// The following happen at most once per tick or hardly ever; apart from the loop they take no registers from it.

#[cold]
#[inline(never)]
fn repeat(ring: &mut [i32], place: usize, sample_nm: i32) {
    if let Some(slot) = ring.get_mut(place) {
        *slot = sample_nm;
    }
}

/// Delays increase along the groups, so when one reaches back past the ring's start, all after it do.
#[cold]
#[inline(never)]
fn next_lap(newest: usize, samples: usize) -> usize {
    newest.wrapping_add(samples)
}

#[cold]
#[inline(never)]
fn nearest_i32(value: i64) -> i32 {
    if value < 0 { i32::MIN } else { i32::MAX }
}

/// The past of a stage and its newest sample.
fn own_samples(stage: StageTaps<'_>) -> usize {
    (stage.duration_ticks() as usize).saturating_add(1)
}

/// Samples in a table's ring; those of a group are all different.
fn ring_samples(table: &ShaperTable) -> usize {
    table.stages().map(own_samples).fold(0, usize::saturating_add).max(WIDTH)
}

/// The taps but the one without delay, in groups with increasing delays. A group never looks further back than its
/// oldest tap; what it reads beyond its youngest has no weight.
fn groups<'t>(stage: StageTaps<'t>) -> impl Iterator<Item = [i32; GROUP]> + use<'t> {
    let mut rest = stage.taps();
    if let [Tap { delay_ticks: 0, .. }, after @ ..] = rest {
        rest = after;
    }
    core::iter::from_fn(move || {
        let youngest = rest.first()?.delay_ticks;
        let count = rest.iter().take_while(|tap| tap.delay_ticks - youngest < WIDTH as u32).count();
        let taps = rest.split_off(..count)?;
        let oldest = taps.last()?.delay_ticks;
        // Delays are below the length of a memory wherever a cascade runs.
        let mut group = [oldest.cast_signed(), 0, 0, 0, 0];
        for tap in taps {
            if let Some(weight) = group.get_mut(1 + (oldest - tap.delay_ticks) as usize) {
                *weight = tap.weight;
            }
        }
        Some(group)
    })
}
