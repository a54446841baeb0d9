//! The running shaper: all past samples in one ring, taps read in groups of neighbours.
//!
//! Samples are `i32` nanometres, weights Q30, sums `i64`. Absolute weights sum to at most 4·2³⁰ and samples
//! are within 2·10⁹ nm of the origin, so a sum stays below 2⁶³ however many taps there are. Because a stage's
//! weights sum to one exactly, a constant input comes out unchanged, to the nanometre; anything else is
//! rounded to the nearest nanometre once per stage.
//!
//! **One ring.** Seen from the newest sample backwards, the ring holds the past of the first stage, then that
//! of the second, and so on. Every tick moves the whole ring by one, so that the place for a stage's newest
//! sample is the one that the oldest of the stage before has just left. One index serves all stages.
//!
//! **Blocks.** The taps of a designed stage come in runs of neighbouring ticks, one run for every impulse.
//! They are stored as groups of [`WIDTH`] weights with one delay, missing taps having the weight zero. Past
//! its end the ring repeats its first samples, so that no group is cut in two: one comparison per group finds
//! the wrap and bounds the access. What begins a stage is a block of the same form whose delay is no delay,
//! so that it is found by the comparison that fails. So are two taps that have no neighbours: as groups they
//! would cost what eight taps do.
//!
//! ```text
//! words: | stage | group | group | ... | stage | pair | ... | ring: samples in order of time, wrapping | its first WIDTH again |
//! group: | weight of the oldest | ... | weight of the youngest | delay of the oldest |
//! pair:  | weight | delay | weight | delay | PAIR |
//! stage: | weight of its newest sample | 0 | 0 | 0 | delay of its newest sample + STAGE |
//! ```
//!
//! Delays are those seen from the newest sample of the first stage, so they increase from block to block, and
//! the ring is wrapped once per tick at most.

use core::hint::cold_path;

use super::blocks::{BLOCK, PAIR, REPEATED, STAGE, WIDTH, blocks_of};
use super::stage::{StageTaps, Tap, WEIGHT_ONE};
use super::table::ShaperTable;

const WEIGHT_BITS: u32 = WEIGHT_ONE.trailing_zeros();

/// A table together with the memory it runs in.
///
/// Places in the memory have 16 bits, from which the compiler sees that sums of them do not overflow: it then
/// checks one bound where it would check three.
#[derive(Debug)]
pub struct Cascade<'m> {
    memory: &'m mut [i32],
    /// Stages and groups at the start of the memory.
    blocks: u16,
    /// Samples in the ring, without those it repeats.
    samples: u16,
    /// Where in the ring the newest sample of the first stage is.
    newest: u16,
    /// Whether a block is a pair of taps.
    pairs: bool,
    duration_ticks: u32,
    /// By how much the first stage, which does nothing else, delays.
    lag_ticks: u32,
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
        words(table.stages())
    }

    /// How many words of memory a table takes that looks `lag_ticks` further back.
    pub fn words_with_lag(table: &ShaperTable, lag_ticks: u32) -> usize {
        words(with_lag(table, &lag(lag_ticks)))
    }

    /// Makes `table` ready to run in `history`, all past samples being zero. Takes time in proportion to
    /// the history: it is not for the interrupt.
    ///
    /// # Errors
    /// [`HistoryTooShort`] returns the memory when [`ShaperTable::history_samples`] do not fit into it; of a
    /// memory only the first 65 535 words are used.
    pub fn new(table: &ShaperTable, history: &'m mut [i32]) -> Result<Self, HistoryTooShort<'m>> {
        Self::with_lag(table, 0, history)
    }

    /// The same, for a table that looks `lag_ticks` further back until [`Self::end_lag`].
    ///
    /// # Errors
    /// As [`Self::new`], with [`Self::words_with_lag`].
    pub fn with_lag(
        table: &ShaperTable,
        lag_ticks: u32,
        history: &'m mut [i32],
    ) -> Result<Self, HistoryTooShort<'m>> {
        let lag = lag(lag_ticks);
        let stages = with_lag(table, &lag);
        let needed = words(stages.clone());
        if needed > history.len() || needed > usize::from(u16::MAX) {
            return Err(HistoryTooShort { needed, history });
        }
        history.fill(0);
        let mut places = history.as_chunks_mut::<BLOCK>().0.iter_mut();
        let (mut delay, mut blocks, mut pairs) = (0, 0, false);
        let mut write = |block: [i32; BLOCK]| {
            // The memory is long enough for all.
            if let Some(place) = places.next() {
                *place = block;
                blocks += 1;
                pairs |= matches!(block, [.., PAIR]);
            }
        };
        for stage in stages.clone() {
            let now = stage.taps().first().filter(|tap| tap.delay_ticks == 0);
            write([now.map_or(0, |tap| tap.weight), 0, 0, 0, delay + STAGE]);
            blocks_of(stage).for_each(|block| write(block.words(delay)));
            // All delays are below `needed`.
            delay += own_samples(stage) as i32;
        }
        let samples = ring_samples(stages) as u16;
        let duration_ticks = table.duration_ticks().saturating_add(lag_ticks);
        Ok(Self { memory: history, blocks, samples, newest: 0, pairs, duration_ticks, lag_ticks })
    }

    /// The cascade that changes nothing, holding on to `history`.
    pub fn identity(history: &'m mut [i32]) -> Self {
        Self {
            memory: history,
            blocks: 0,
            samples: 0,
            newest: 0,
            pairs: false,
            duration_ticks: 0,
            lag_ticks: 0,
        }
    }

    /// The memory, for the next table.
    pub fn into_history(self) -> &'m mut [i32] {
        self.memory
    }

    /// How many ticks after its last change the input still moves the output.
    pub fn duration_ticks(&self) -> u32 {
        self.duration_ticks
    }

    /// From now on the table looks no further back than it does at rest. Nothing moves if the input has been
    /// constant for [`Self::duration_ticks`], for then all of the ring is that constant.
    pub fn end_lag(&mut self) {
        if self.lag_ticks == 0 {
            return;
        }
        self.duration_ticks -= self.lag_ticks;
        self.lag_ticks = 0;
        // The stage's own block and its group.
        if let Some([[now, ..], [weights @ .., _], ..]) =
            self.memory.as_chunks_mut::<BLOCK>().0.first_chunk_mut::<2>()
        {
            *now = WEIGHT_ONE;
            weights.fill(0);
        }
    }

    /// Shapes one sample, in nanometres. What leaves the range of an `i32`, which only negative weights can,
    /// ends there.
    #[inline]
    pub fn step(&mut self, input_nm: i32) -> i32 {
        if self.pairs { self.step_paired(input_nm) } else { self.step_grouped(input_nm) }
    }

    // On their own they have all registers to themselves, and who has no pairs does not pay for them.

    #[inline(never)]
    fn step_grouped(&mut self, input_nm: i32) -> i32 {
        self.step_as::<false>(input_nm)
    }

    #[inline(never)]
    fn step_paired(&mut self, input_nm: i32) -> i32 {
        self.step_as::<true>(input_nm)
    }

    #[inline(always)]
    fn step_as<const PAIRS: bool>(&mut self, input_nm: i32) -> i32 {
        let samples = usize::from(self.samples);
        let Some((blocks, ring)) = self.memory.split_at_mut_checked(usize::from(self.blocks) * BLOCK) else {
            return input_nm;
        };
        // `get_mut` would make a second pointer to the same ring, and take a register for it.
        if ring.len() < samples + REPEATED {
            return input_nm;
        }
        let mut newest = usize::from(self.newest) + 1;
        if newest >= samples {
            newest = 0;
        }
        // The ring is shorter than 2¹⁶.
        self.newest = newest as u16;
        let mut running = Running { ring, samples, newest, sum: i64::from(input_nm) << WEIGHT_BITS };
        let (fours, rest) = blocks.as_chunks::<BLOCK>().0.as_chunks::<4>();
        let inside = fours.iter().all(|[first, second, third, fourth]| {
            running.take::<PAIRS>(first)
                && running.take::<PAIRS>(second)
                && running.take::<PAIRS>(third)
                && running.take::<PAIRS>(fourth)
        });
        if inside {
            // Where one does not lie within the ring, neither do those after it.
            let _ = rest.iter().all(|block| running.take::<PAIRS>(block));
        }
        let sum = running.sum;
        // Sums are below 2⁶³, so this is the sample's upper half less two bits.
        let upper = (sum >> 32) as i32;
        if (upper.wrapping_add(1 << 29)).cast_unsigned() >= 1 << 30 {
            return nearest_i32(upper);
        }
        (sum >> WEIGHT_BITS) as i32
    }
}

/// A tick under way. All of it lives in registers.
struct Running<'r> {
    ring: &'r mut [i32],
    samples: usize,
    /// Where the first stage's newest sample is, or that and `samples` once the delays have passed the ring's
    /// start.
    newest: usize,
    sum: i64,
}

impl Running<'_> {
    /// One block; whether it lay within the ring.
    #[inline(always)]
    fn take<const PAIRS: bool>(&mut self, [oldest, older, younger, youngest, delay]: &[i32; BLOCK]) -> bool {
        let place = self.newest.wrapping_sub(*delay as usize);
        let samples_nm = match window(self.ring, place, self.samples) {
            Some(window) => window,
            None if PAIRS && *delay == PAIR => {
                return self.take_lone(*oldest, *older) && self.take_lone(*younger, *youngest);
            }
            None if *delay < 0 => {
                // Between stages a sample is a weighted mean of i32 samples with non-negative weights.
                let input_nm = (self.sum >> WEIGHT_BITS) as i32;
                let place = place.wrapping_add(STAGE as usize);
                if !remember(self.ring, place, self.samples, input_nm) {
                    cold_path();
                    self.newest = self.newest.wrapping_add(self.samples);
                    if !remember(self.ring, place.wrapping_add(self.samples), self.samples, input_nm) {
                        return false;
                    }
                }
                self.sum = i64::from(WEIGHT_ONE / 2) + i64::from(input_nm) * i64::from(*oldest);
                return true;
            }
            None => {
                cold_path();
                // Delays increase, so when one reaches back past the ring's start, all after it do.
                self.newest = self.newest.wrapping_add(self.samples);
                match window(self.ring, self.newest.wrapping_sub(*delay as usize), self.samples) {
                    Some(window) => window,
                    None => return false,
                }
            }
        };
        let [_, a, b, c, d] = samples_nm;
        self.sum += i64::from(*a) * i64::from(*oldest);
        self.sum += i64::from(*b) * i64::from(*older);
        self.sum += i64::from(*c) * i64::from(*younger);
        self.sum += i64::from(*d) * i64::from(*youngest);
        true
    }

    /// One tap alone; whether it lay within the ring.
    #[inline(always)]
    fn take_lone(&mut self, weight: i32, delay: i32) -> bool {
        let place = self.newest.wrapping_sub(delay as usize);
        // The group that begins there: its bounds need no second check.
        let [sample_nm, ..] = match window(self.ring, place, self.samples) {
            Some(window) => window,
            None => {
                cold_path();
                self.newest = self.newest.wrapping_add(self.samples);
                match window(self.ring, place.wrapping_add(self.samples), self.samples) {
                    Some(window) => window,
                    None => return false,
                }
            }
        };
        self.sum += i64::from(*sample_nm) * i64::from(weight);
        true
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

/// The sample before a group, and the group's, if that is within the ring.
#[inline(always)]
fn window(ring: &[i32], place: usize, samples: usize) -> Option<&[i32; 1 + WIDTH]> {
    if place < samples { ring.get(place..place + 1 + WIDTH)?.first_chunk() } else { None }
}

// These happen at most once per tick or hardly ever; on their own they take no registers from the rest.

#[cold]
#[inline(never)]
fn repeat(ring: &mut [i32], place: usize, sample_nm: i32) {
    if let Some(slot) = ring.get_mut(place) {
        *slot = sample_nm;
    }
}

#[cold]
#[inline(never)]
fn nearest_i32(upper: i32) -> i32 {
    if upper < 0 { i32::MIN } else { i32::MAX }
}

/// The past of a stage and its newest sample.
fn own_samples(stage: StageTaps<'_>) -> usize {
    (stage.duration_ticks() as usize).saturating_add(1)
}

/// Samples in the ring of these stages; those of a group are all different.
fn ring_samples<'t>(stages: impl Iterator<Item = StageTaps<'t>>) -> usize {
    stages.map(own_samples).fold(0, usize::saturating_add).max(WIDTH)
}

/// Words of memory for these stages.
fn words<'t>(stages: impl Iterator<Item = StageTaps<'t>> + Clone) -> usize {
    let blocks: usize = stages.clone().map(|stage| 1 + blocks_of(stage).count()).sum();
    ring_samples(stages).saturating_add(BLOCK * blocks + REPEATED)
}

/// The only tap of a stage that delays.
fn lag(lag_ticks: u32) -> [Tap; 1] {
    [Tap { delay_ticks: lag_ticks, weight: WEIGHT_ONE }]
}

/// The stages of `table` behind one that delays, if it does.
fn with_lag<'t>(table: &'t ShaperTable, lag: &'t [Tap; 1]) -> impl Iterator<Item = StageTaps<'t>> + Clone {
    let stage = StageTaps::new(lag);
    Some(stage).filter(|stage| stage.duration_ticks() > 0).into_iter().chain(table.stages())
}
