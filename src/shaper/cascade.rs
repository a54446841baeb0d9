//! The running shaper: one ring of past samples per stage, stages one after the other.
//!
//! Samples are `i32` nanometres, weights Q30, sums `i64`. Weights are not negative and sum to 2³⁰, so a sum
//! stays within 2⁶¹ however many taps there are. Because a stage's weights sum to one exactly, a constant input comes out unchanged, to
//! the nanometre; anything else is rounded to the nearest nanometre once per stage.

use heapless::Vec;

use super::MAX_MODES;
use super::stage::{MAX_TAPS, Tap, WEIGHT_ONE};
use super::table::{ShaperTable, history_of};

const WEIGHT_BITS: u32 = WEIGHT_ONE.trailing_zeros();

/// A table together with the memory it runs in.
#[derive(Debug)]
pub struct Cascade<'m> {
    lines: Vec<DelayLine, MAX_MODES>,
    history: &'m mut [i32],
    duration_ticks: u32,
}

/// The ring and the taps of one stage. The ring is a range of the cascade's history.
#[derive(Debug)]
struct DelayLine {
    taps: Vec<Tap, MAX_TAPS>,
    start: usize,
    samples: usize,
    /// Where in the ring the newest sample is.
    newest: usize,
}

/// The memory that was to hold the histories is too small.
#[derive(Debug)]
pub struct HistoryTooShort<'m> {
    /// Samples the table needs.
    pub needed: usize,
    /// The memory, given back.
    pub history: &'m mut [i32],
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
        let mut start = 0;
        let lines = table
            .stages()
            .iter()
            .map(|stage| {
                let samples = history_of(stage);
                let line =
                    DelayLine { taps: stage.taps().iter().copied().collect(), start, samples, newest: 0 };
                start += samples;
                line
            })
            .collect();
        Ok(Self { lines, history, duration_ticks: table.duration_ticks() })
    }

    /// The cascade that changes nothing, holding on to `history`.
    pub fn identity(history: &'m mut [i32]) -> Self {
        Self { lines: Vec::new(), history, duration_ticks: 0 }
    }

    /// The memory, for the next table.
    pub fn into_history(self) -> &'m mut [i32] {
        self.history
    }

    /// How many ticks after its last change the input still moves the output.
    pub fn duration_ticks(&self) -> u32 {
        self.duration_ticks
    }

    /// Shapes one sample, in nanometres.
    #[inline]
    pub fn step(&mut self, input_nm: i32) -> i32 {
        let mut sample_nm = input_nm;
        for line in &mut self.lines {
            if let Some(ring) = self.history.get_mut(line.start..line.start + line.samples) {
                sample_nm = line.step(ring, sample_nm);
            }
        }
        sample_nm
    }
}

impl DelayLine {
    #[inline]
    fn step(&mut self, ring: &mut [i32], input_nm: i32) -> i32 {
        self.newest += 1;
        if self.newest >= ring.len() {
            self.newest = 0;
        }
        if let Some(slot) = ring.get_mut(self.newest) {
            *slot = input_nm;
        }
        let half = i64::from(WEIGHT_ONE / 2);
        let sum = self.taps.iter().fold(half, |sum, tap| {
            let delay = tap.delay_ticks as usize;
            let place =
                if delay <= self.newest { self.newest - delay } else { self.newest + self.samples - delay };
            let sample_nm = ring.get(place).copied().unwrap_or(input_nm);
            sum + i64::from(sample_nm) * i64::from(tap.weight)
        });
        // A weighted mean of i32 samples with non-negative weights fits in an i32.
        (sum >> WEIGHT_BITS) as i32
    }
}
