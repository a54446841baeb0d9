//! The running shaper: one ring of past samples per stage, stages one after the other.
//!
//! Samples are `i32` nanometres, weights Q30, sums `i64`. Absolute weights sum to at most 4·2³⁰ and samples are within
//! 2·10⁹ nm of the origin, so a sum stays below 2⁶³ however many taps there are. Because a stage's weights sum to one
//! exactly, a constant input comes out unchanged, to the nanometre; anything else is rounded to the nearest nanometre
//! once per stage.

use heapless::Vec;

use super::MAX_MODES;
use super::delay_line::DelayLine;
use super::stage::{StageTaps, WEIGHT_ONE};
use super::table::ShaperTable;

pub(super) const WEIGHT_BITS: u32 = WEIGHT_ONE.trailing_zeros();

/// A table together with the memory it runs in.
#[derive(Debug)]
pub struct Cascade<'m> {
    lines: Vec<DelayLine, MAX_MODES>,
    /// The words of every line, one after the other.
    memory: &'m mut [i32],
    duration_ticks: u32,
}

/// The memory that was to hold the histories is too small.
#[derive(Debug)]
pub struct HistoryTooShort<'m> {
    /// Words the table needs.
    pub needed: usize,
    /// The memory, given back.
    pub history: &'m mut [i32],
}

/// How many words of memory a stage takes.
pub(super) fn words_of(stage: StageTaps<'_>) -> usize {
    DelayLine::of(stage).words()
}

impl<'m> Cascade<'m> {
    /// Makes `table` ready to run in `history`, all past samples being zero. Takes time in proportion to
    /// the history: it is not for the interrupt.
    ///
    /// # Errors
    /// [`HistoryTooShort`] returns the memory when [`ShaperTable::history_samples`] do not fit into it.
    pub fn new(table: &ShaperTable, history: &'m mut [i32]) -> Result<Self, HistoryTooShort<'m>> {
        let needed = table.history_samples();
        if needed > history.len() {
            return Err(HistoryTooShort { needed, history });
        }
        history.fill(0);
        let mut rest = &mut *history;
        let mut lines = Vec::new();
        for stage in table.stages() {
            let line = DelayLine::of(stage);
            if let Some(own) = rest.split_off_mut(..line.words()) {
                line.write_groups(stage, own);
            }
            // A table has no more stages than there is room for.
            let _fits = lines.push(line);
        }
        Ok(Self { lines, memory: history, duration_ticks: table.duration_ticks() })
    }

    /// The cascade that changes nothing, holding on to `history`.
    pub fn identity(history: &'m mut [i32]) -> Self {
        Self { lines: Vec::new(), memory: history, duration_ticks: 0 }
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
    #[inline]
    pub fn step(&mut self, input_nm: i32) -> i32 {
        let mut sample_nm = i64::from(input_nm);
        let mut rest = &mut *self.memory;
        for line in &mut self.lines {
            let Some((own, after)) = rest.split_at_mut_checked(line.words()) else { break };
            // Between stages a sample is a weighted mean of i32 samples with non-negative weights.
            sample_nm = line.step(own, sample_nm as i32);
            rest = after;
        }
        sample_nm.clamp(i32::MIN.into(), i32::MAX.into()) as i32
    }
}
